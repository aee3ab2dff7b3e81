//! What an operator asks of the daemon itself: how much it logs, and what its audit trail has.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde_json::Value;
use tokio::task::spawn_blocking;
use tracing::info;

use super::Response;
use crate::audit::last_lines;
use crate::log::Dial;
use crate::log::module::SERVICE;
use crate::reload::{Asker, Report};
use crate::status::table;

/// Entries of the audit trail that are told at most.
const MOST_ENTRIES: usize = 1000;

/// The log and the audit trail of this daemon.
#[derive(Clone, Debug, Default)]
pub struct Operation {
    /// What the log is turned by.
    pub log: Option<Dial>,
    /// Where the audit trail is kept, if anywhere.
    pub audit: Option<PathBuf>,
    /// Who reloads the configuration, if it is in a file.
    pub reload: Option<Asker>,
}

impl Operation {
    /// Changes how much is logged, if `change` says how: `LEVEL`, or `MODULE=LEVEL`. What is logged then.
    pub(super) fn log(&self, change: Option<&str>) -> Result<Response, String> {
        let dial = self.log.as_ref().ok_or("this daemon has no log")?;
        if let Some(change) = change {
            dial.turn(change).map_err(|error| error.to_string())?;
            info!(target: SERVICE, "log: {change}");
        }
        let levels = dial.levels().map_err(|error| error.to_string())?;
        Ok(Response::Log(levels.into_iter().collect()))
    }

    /// Takes the configuration as its file now says.
    pub(super) async fn reload(&self) -> Result<Response, String> {
        let asker = self.reload.as_ref().ok_or("this daemon runs without a configuration file")?;
        asker.ask().await.map(Response::Reload)
    }

    /// The last entries of the audit trail, the oldest first.
    pub(super) async fn audit(&self, count: usize) -> Result<Response, String> {
        let directory = self
            .audit
            .clone()
            .ok_or("this daemon keeps no audit trail: it has no [storage] or [audit] path")?;
        let lines = spawn_blocking(move || last_lines(&directory, count.min(MOST_ENTRIES)));
        let lines = lines.await.map_err(|error| error.to_string())?.map_err(|error| error.to_string())?;
        // A line that is still being written is not told.
        Ok(Response::Audit(lines.iter().filter_map(|line| serde_json::from_str(line).ok()).collect()))
    }
}

/// Levels of the log as a table.
#[must_use]
pub fn levels_text(levels: &BTreeMap<String, String>) -> String {
    let rows: Vec<_> = levels.iter().map(|(module, level)| [module.clone(), level.clone()]).collect();
    table(&["MODULE", "LEVEL"], &rows)
}

/// Entries of the audit trail as a table.
#[must_use]
pub fn audit_text(entries: &[Value]) -> String {
    const HEAD: [&str; 7] = ["TIME", "BY", "DEVICE", ">AXIS", "EVENT", "WHAT", ">VALUE"];
    let row = |entry: &Value| {
        let part = |key: &str| told(&entry[key]);
        let value = if entry["lost"].is_null() { part("value") } else { format!("{} lost", part("lost")) };
        let more = entry["times"].as_u64().map(|times| format!(", {times} more")).unwrap_or_default();
        [
            part("time"),
            who(&entry["by"]),
            part("device"),
            part("axis"),
            part("event") + &more,
            what(entry),
            value,
        ]
    };
    table(&HEAD, &entries.iter().map(row).collect::<Vec<_>>())
}

/// The bus, and who is known behind it; the kind if that is all.
fn who(by: &Value) -> String {
    let user = by["uid"].as_u64().map(|uid| format!("uid {uid}"));
    let parts = [told(&by["bus"]), told(&by["client"]), user.unwrap_or_default()];
    let known: Vec<&str> = parts.iter().map(String::as_str).filter(|part| !part.is_empty()).collect();
    if known.is_empty() { told(&by["kind"]) } else { known.join(", ") }
}

/// The order and the node that it is for, the object and why it was refused, or what a reload has changed.
fn what(entry: &Value) -> String {
    let part = |key: &str| told(&entry[key]);
    if !entry["reload"].is_null() {
        let report = serde_json::from_value::<Report>(entry["reload"].clone());
        return report.map_or_else(|_| String::new(), |report| report.line());
    }
    match (&entry["node_id"], &entry["reason"]) {
        (Value::Null, Value::Null) => {
            format!("{} {} {}", part("order"), part("object"), part("name")).trim().to_owned()
        }
        (Value::Null, _) => format!("{} {}: {}", part("object"), part("name"), part("reason")),
        (node, _) if node.as_u64() == Some(0) => format!("{}, all nodes", part("order")),
        (node, _) => format!("{}, node {node}", part("order")),
    }
}

fn told(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_told_in_a_table() {
        let entries = [
            r#"{"time":"T1","event":"write","device":"x","axis":1,"by":{"kind":"canopen","bus":"can0","node_id":1},"object":"0x6040:00","name":"Controlword","value":6}"#,
            r#"{"time":"T2","event":"lost","lost":3}"#,
            r#"{"time":"T3","event":"nmt","by":{"kind":"local"},"bus":"can0","node_id":0,"order":"start"}"#,
            r#"{"time":"T4","event":"move","device":"x","axis":1,"by":{"kind":"local","uid":1000,"pid":7},"order":"9 --relative"}"#,
            r#"{"time":"T5","event":"refused","device":"x","axis":1,"by":{"kind":"modbus","client":"C"},"object":"0x6040:00","name":"Controlword","value":6,"code":"0x08000022","reason":"state","times":7,"lasted_s":1.0}"#,
        ];
        let entries: Vec<Value> = entries.iter().map(|entry| serde_json::from_str(entry).unwrap()).collect();
        assert_eq!(
            audit_text(&entries),
            "TIME  BY        DEVICE  AXIS  EVENT            WHAT                           VALUE\n\
             T1    can0      x          1  write            0x6040:00 Controlword              6\n\
             T2                            lost                                           3 lost\n\
             T3    local                   nmt              start, all nodes\n\
             T4    uid 1000  x          1  move             9 --relative\n\
             T5    C         x          1  refused, 7 more  0x6040:00 Controlword: state       6\n"
        );
    }
}
