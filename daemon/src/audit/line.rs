//! A line of the trail. docs/operation.md describes it; fields are only ever added.

use core::time::Duration;
use std::io;
use std::sync::Arc;

use humantime::format_rfc3339_micros;
use od::Instant;
use profiles::Profile;
use serde::Serialize;

use crate::core::{AuditEntry, LinkId, What, Who};
use crate::reload::Report;

/// What devices and buses are called.
#[derive(Clone, Debug, Default)]
pub struct Names {
    /// Each device by its position, and what its objects are called.
    pub devices: Vec<(String, Arc<Profile>)>,
    /// Each bus by its position.
    pub buses: Vec<String>,
}

impl Names {
    /// Makes this the name of the device at a position, and what its objects are called.
    pub(super) fn set_device(&mut self, device: usize, name: &str, profile: &Arc<Profile>) {
        let known = || (name.to_owned(), Arc::clone(profile));
        // Whatever is between two positions joins before anybody asks for it.
        if self.devices.len() <= device {
            self.devices.resize_with(device + 1, known);
        }
        self.devices.get_mut(device).into_iter().for_each(|place| *place = known());
    }

    /// Makes this the name of the bus of a link.
    pub(super) fn set_bus(&mut self, link: usize, name: String) {
        if self.buses.len() <= link {
            self.buses.resize(link + 1, String::new());
        }
        if let Some(known) = self.buses.get_mut(link) {
            *known = name;
        }
    }
}

/// One entry.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line<'n> {
    /// When, by the wall clock, in UTC.
    time: String,
    /// When, since the daemon was started, in s.
    uptime_s: f64,
    event: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    device: Option<&'n str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    axis: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    by: Option<By<'n>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    object: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'n str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<i128>,
    #[serde(skip_serializing_if = "Option::is_none")]
    set_points: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lasted_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lost: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reload: Option<&'n Report>,
}

/// Who did it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
struct By<'n> {
    /// `canopen`, `modbus` or `local`.
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    bus: Option<&'n str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    node_id: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    client: Option<String>,
}

impl<'n> Line<'n> {
    /// The line of an entry that happened when the wall clock showed `wall`.
    #[must_use]
    pub fn of(entry: &AuditEntry, names: &'n Names, wall: Duration) -> Self {
        let (event, set_points, lasted) = match entry.what {
            What::Write => ("write", None, None),
            What::Change => ("change", None, None),
            What::StreamStart => ("stream-start", None, None),
            What::StreamEnd { set_points, lasted } => ("stream-end", Some(set_points), Some(lasted)),
        };
        let (device, profile) =
            names.devices.get(entry.device).map(|(name, profile)| (&**name, profile)).unzip();
        let schema = profile.map(|profile| &profile.application);
        let object = schema.and_then(|schema| schema.entry(schema.slot(entry.address)?));
        Self {
            device,
            axis: object.and_then(|object| object.command).map(|axis| axis + 1),
            by: Some(by(entry, names)),
            object: Some(entry.address.to_string()),
            name: object.map(|object| &*object.name),
            value: Some(entry.value),
            set_points,
            lasted_s: lasted.map(|lasted| lasted.as_secs_f64()),
            ..Self::bare(event, entry.at, wall)
        }
    }

    /// The line that says that so many entries were lost.
    #[must_use]
    pub fn lost(entries: u64, now: Instant, wall: Duration) -> Self {
        Self { lost: Some(entries), ..Self::bare("lost", now, wall) }
    }

    /// The line that says what came of a reload of the configuration.
    #[must_use]
    pub fn reload(at: Instant, wall: Duration, report: &'n Report) -> Self {
        Self { reload: Some(report), ..Self::bare("reload", at, wall) }
    }

    fn bare(event: &'static str, at: Instant, wall: Duration) -> Self {
        // A clock that nobody could read any more is not shown.
        const LATEST: Duration = Duration::from_secs(253_402_300_799);
        let time = std::time::UNIX_EPOCH + wall.min(LATEST);
        Self {
            time: format_rfc3339_micros(time).to_string(),
            uptime_s: at.saturating_since(Instant::ZERO).as_secs_f64(),
            event,
            device: None,
            axis: None,
            by: None,
            object: None,
            name: None,
            value: None,
            set_points: None,
            lasted_s: None,
            lost: None,
            reload: None,
        }
    }

    /// It as JSON.
    ///
    /// # Errors
    /// None that is expected: it is plain data.
    pub fn text(&self) -> io::Result<String> {
        serde_json::to_string(self).map_err(io::Error::from)
    }
}

fn by<'n>(entry: &AuditEntry, names: &'n Names) -> By<'n> {
    match entry.who {
        Who::CanOpen(LinkId(link)) => By {
            kind: "canopen",
            bus: names.buses.get(usize::from(link)).map(String::as_str),
            node_id: entry.node_id,
            client: None,
        },
        Who::Modbus(peer) => By { kind: "modbus", client: Some(peer.to_string()), ..By::default() },
        Who::ModbusGone => By { kind: "modbus", ..By::default() },
        Who::Local => By { kind: "local", ..By::default() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use od::Address;

    fn names() -> Names {
        let profile = Arc::new(Profile::embedded("cia402-servo", None).unwrap().unwrap());
        Names { devices: vec![("x".to_owned(), profile)], buses: vec!["can0".to_owned()] }
    }

    fn line(who: Who, node_id: Option<u8>, what: What) -> String {
        let at = Instant::ZERO + Duration::from_micros(1_500_000);
        let address = Address::new(0x607A, 0);
        let entry = AuditEntry { at, device: 0, who, node_id, address, value: -5, what };
        Line::of(&entry, &names(), Duration::from_micros(1_700_000_000_000_001)).text().unwrap()
    }

    #[test]
    fn an_entry_is_one_line_of_json() {
        assert_eq!(
            line(Who::CanOpen(LinkId(0)), Some(7), What::Write),
            r#"{"time":"2023-11-14T22:13:20.000001Z","uptime_s":1.5,"event":"write","device":"x","axis":1,"by":{"kind":"canopen","bus":"can0","node_id":7},"object":"0x607A:00","name":"Target position","value":-5}"#
        );
        let end = What::StreamEnd { set_points: 60, lasted: Duration::from_millis(59) };
        let text = line(Who::Modbus("10.0.0.5:40112".parse().unwrap()), None, end);
        assert!(text.contains(r#""by":{"kind":"modbus","client":"10.0.0.5:40112"}"#), "{text}");
        assert!(text.ends_with(r#""value":-5,"set_points":60,"lasted_s":0.059}"#), "{text}");
        let lost = Line::lost(3, Instant::ZERO, Duration::MAX).text().unwrap();
        assert_eq!(lost, r#"{"time":"9999-12-31T23:59:59.000000Z","uptime_s":0.0,"event":"lost","lost":3}"#);
    }
}
