//! What came of a reload, for people and programs.

use config::Changes;
use humantime::format_rfc3339_seconds;
use serde::{Deserialize, Serialize};

use crate::clock::Clock;

/// Errors that are told; a file may have any number.
const MAX_ERRORS: usize = 20;
/// How the line begins that says what needs a restart.
pub(super) const RESTART: &str = "needs a restart";

/// See the module's documentation. Fields are only ever added.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Report {
    /// When it was done, in UTC.
    pub time: String,
    /// Why nothing of the file was taken; empty if it was.
    pub errors: Vec<String>,
    /// Devices that have joined.
    pub added: Vec<String>,
    /// Devices that have left.
    pub removed: Vec<String>,
    /// Devices that have left and joined again as the file says now.
    pub changed: Vec<String>,
    /// Devices that went on, and are reached or commanded as the file says now.
    pub adjusted: Vec<String>,
    /// Buses that have come.
    pub buses_added: Vec<String>,
    /// Buses that have gone.
    pub buses_removed: Vec<String>,
    /// Other keys whose new values are in effect.
    pub taken: Vec<String>,
    /// Keys whose new values come with a restart.
    pub restart: Vec<String>,
}

impl Report {
    /// Of a reload that took nothing.
    pub(super) fn refused(mut errors: Vec<String>) -> Self {
        let more = errors.len().saturating_sub(MAX_ERRORS);
        errors.truncate(MAX_ERRORS);
        errors.extend((more > 0).then(|| format!("and {more} more")));
        Self { time: now(), errors, ..Self::default() }
    }

    /// Of one that takes `changes`.
    pub(super) fn of(changes: &Changes) -> Self {
        let devices = |positions: &[usize]| {
            let named = positions.iter().filter_map(|device| changes.next.devices.get(*device));
            named.map(|device| device.name.clone()).collect()
        };
        let buses = changes.buses_added.iter().filter_map(|bus| changes.next.buses.get(*bus));
        let taken = [(changes.socketcand, "socketcand"), (changes.modbus, "modbus"), (changes.log, "log")];
        Self {
            time: now(),
            errors: Vec::new(),
            added: devices(&changes.added),
            removed: changes.removed.clone(),
            changed: devices(&changes.replaced),
            adjusted: devices(&changes.adjusted),
            buses_added: buses.map(|bus| bus.name.clone()).collect(),
            buses_removed: changes.buses_removed.clone(),
            taken: taken.iter().filter(|(is, _)| *is).map(|(_, key)| (*key).to_owned()).collect(),
            restart: changes.restart.iter().map(|key| (*key).to_owned()).collect(),
        }
    }

    /// Whether nothing of the file was taken.
    #[must_use]
    pub fn is_refused(&self) -> bool {
        !self.errors.is_empty()
    }

    /// What came of it, in lines.
    pub(crate) fn lines(&self) -> Vec<String> {
        if self.is_refused() {
            let head = "refused, nothing has changed".to_owned();
            return core::iter::once(head).chain(self.errors.iter().cloned()).collect();
        }
        let told = [
            ("buses removed", &self.buses_removed),
            ("buses added", &self.buses_added),
            ("devices removed", &self.removed),
            ("devices changed", &self.changed),
            ("devices added", &self.added),
            ("devices adjusted", &self.adjusted),
            ("taken", &self.taken),
            (RESTART, &self.restart),
        ];
        let told = told.into_iter().filter(|(_, names)| !names.is_empty());
        let mut lines: Vec<String> =
            told.map(|(what, names)| format!("{what}: {}", names.join(", "))).collect();
        if lines.is_empty() {
            lines.push("nothing has changed".to_owned());
        }
        lines
    }

    /// What came of it, in one line.
    #[must_use]
    pub fn line(&self) -> String {
        self.lines().join("; ")
    }

    /// What came of it, for people.
    #[must_use]
    pub fn text(&self) -> String {
        let lines = self
            .lines()
            .into_iter()
            .flat_map(|line| line.lines().map(|line| format!("  {line}\n")).collect::<Vec<_>>());
        format!("reload at {}:\n{}", self.time, lines.collect::<String>())
    }
}

fn now() -> String {
    // A clock that nobody could read any more is not shown.
    const LATEST: core::time::Duration = core::time::Duration::from_secs(253_402_300_799);
    format_rfc3339_seconds(std::time::UNIX_EPOCH + Clock::wall().min(LATEST)).to_string()
}
