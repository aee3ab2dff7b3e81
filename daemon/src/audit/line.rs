//! A line of the trail. docs/operation.md describes it; fields are only ever added.

use core::time::Duration;
use std::io;
use std::sync::Arc;

use humantime::format_rfc3339_micros;
use od::Instant;
use profiles::Profile;
use serde::Serialize;

use super::words;
use crate::core::{AuditEntry, Item, LinkId, Peer, What, Who};
use crate::reload::Report;
use crate::status::owner_name;

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
    bus: Option<&'n str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    node_id: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    order: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    object: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'n str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<i128>,
    #[serde(skip_serializing_if = "Option::is_none")]
    code: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    set_points: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    times: Option<u64>,
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
    #[serde(skip_serializing_if = "Option::is_none")]
    uid: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pid: Option<i32>,
}

impl<'n> Line<'n> {
    /// The line of an entry that happened when the wall clock showed `wall`.
    #[must_use]
    pub fn of(entry: &AuditEntry, names: &'n Names, wall: Duration) -> Self {
        let AuditEntry { what, again, .. } = entry;
        let bare = |event| Self::about(entry, event, names, wall);
        let order = |event, axis: usize, order| Self {
            axis: u8::try_from(axis + 1).ok(),
            order: Some(order).filter(|order: &String| !order.is_empty()),
            ..bare(event)
        };
        let owner_name = |owner| {
            let buses: Vec<&str> = names.buses.iter().map(String::as_str).collect();
            owner_name(owner, &buses)
        };
        let line = match *what {
            What::Write(item) => bare("write").with_item(item, names, entry),
            What::Change(item) => bare("change").with_item(item, names, entry),
            What::StreamStart(item) => bare("stream-start").with_item(item, names, entry),
            What::StreamEnd(item) => {
                let set_points = again.map(|again| again.times);
                let line = bare("stream-end").with_item(item, names, entry);
                Self { set_points, lasted_s: again.map(|again| again.lasted.as_secs_f64()), ..line }
            }
            What::Refused(item, code) => {
                let (number, reason) = (format!("0x{:08X}", code as u32), code.text());
                let line = bare("refused").with_item(item, names, entry);
                Self { code: Some(number), reason: Some(reason), ..line }
            }
            What::Network(link, network) => {
                let (event, node_id, order) = words::network(network);
                let order = Some(order);
                Self { bus: bus_name(names, link), node_id, order, ..bare(event) }
            }
            What::Claim(axis, owner) => order("claim", axis, owner_name(Some(owner))),
            What::Release(axis, owner) => order("release", axis, owner_name(owner)),
            What::Inject(axis, fault) => order("fault-inject", axis, fault.to_string()),
            What::Repair(axis, repair) => order("fault-clear", axis, words::repair(repair)),
            What::Signal(axis, signal) => order("signal-set", axis, signal.to_string()),
            What::Motion(axis, goal) => {
                let (event, words) = words::motion(goal);
                order(event, axis, words)
            }
        };
        match (line.set_points, again) {
            (None, Some(again)) => {
                Self { times: Some(again.times), lasted_s: Some(again.lasted.as_secs_f64()), ..line }
            }
            (_, _) => line,
        }
    }

    /// When, on which device and by whom.
    fn about(entry: &AuditEntry, event: &'static str, names: &'n Names, wall: Duration) -> Self {
        let device = entry.device.and_then(|device| names.devices.get(device));
        Self {
            device: device.map(|(name, _)| &**name),
            by: Some(by(entry, names)),
            ..Self::bare(event, entry.at, wall)
        }
    }

    fn with_item(self, item: Item, names: &'n Names, entry: &AuditEntry) -> Self {
        let profile = entry.device.and_then(|device| names.devices.get(device)).map(|(_, profile)| profile);
        let schema = profile.map(|profile| &profile.application);
        let object = schema.and_then(|schema| schema.entry(schema.slot(item.address)?));
        let by = self.by.map(|by| By { node_id: item.node_id, ..by });
        Self {
            axis: object.and_then(|object| object.command).map(|axis| axis + 1),
            by,
            object: Some(item.address.to_string()),
            name: object.map(|object| &*object.name),
            value: item.value,
            ..self
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
            bus: None,
            node_id: None,
            order: None,
            object: None,
            name: None,
            value: None,
            code: None,
            reason: None,
            set_points: None,
            times: None,
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
    let by = match entry.who {
        Who::CanOpen(link) => By { kind: "canopen", bus: bus_name(names, link), ..By::default() },
        Who::Modbus(peer) => By { kind: "modbus", client: Some(peer.to_string()), ..By::default() },
        Who::ModbusGone => By { kind: "modbus", ..By::default() },
        Who::Local => By { kind: "local", ..By::default() },
    };
    match entry.peer {
        Some(Peer::Process { uid, pid }) => By { uid: Some(uid), pid, ..by },
        Some(Peer::Address(address)) => By { client: Some(address.to_string()), ..by },
        None => by,
    }
}

fn bus_name(names: &Names, LinkId(link): LinkId) -> Option<&str> {
    names.buses.get(usize::from(link)).map(String::as_str)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Again;
    use crate::motion::Goal;
    use canopen::{NetworkOrder, NmtCommand};
    use od::{AbortCode, Address, Bus, Owner};
    use profiles::Repair;

    fn names() -> Names {
        let profile = Arc::new(Profile::embedded("cia402-servo", None).unwrap().unwrap());
        Names { devices: vec![("x".to_owned(), profile)], buses: vec!["can0".to_owned()] }
    }

    fn text(who: Who, what: What, again: Option<Again>) -> String {
        let at = Instant::ZERO + Duration::from_micros(1_500_000);
        let peer = None;
        let entry = AuditEntry { at, device: Some(0), who, peer, what, again };
        Line::of(&entry, &names(), Duration::from_micros(1_700_000_000_000_001)).text().unwrap()
    }

    fn item(node_id: Option<u8>) -> Item {
        Item { node_id, address: Address::new(0x607A, 0), value: Some(-5) }
    }

    const CLIENT: &str = "10.0.0.5:40112";

    #[test]
    fn an_entry_is_one_line_of_json() {
        assert_eq!(
            text(Who::CanOpen(LinkId(0)), What::Write(item(Some(7))), None),
            r#"{"time":"2023-11-14T22:13:20.000001Z","uptime_s":1.5,"event":"write","device":"x","axis":1,"by":{"kind":"canopen","bus":"can0","node_id":7},"object":"0x607A:00","name":"Target position","value":-5}"#
        );
        let again = Again { times: 60, lasted: Duration::from_millis(59) };
        let text = text(Who::Modbus(CLIENT.parse().unwrap()), What::StreamEnd(item(None)), Some(again));
        assert!(text.contains(r#""by":{"kind":"modbus","client":"10.0.0.5:40112"}"#), "{text}");
        assert!(text.ends_with(r#""value":-5,"set_points":60,"lasted_s":0.059}"#), "{text}");
        let lost = Line::lost(3, Instant::ZERO, Duration::MAX).text().unwrap();
        assert_eq!(lost, r#"{"time":"9999-12-31T23:59:59.000000Z","uptime_s":0.0,"event":"lost","lost":3}"#);
    }

    #[test]
    fn a_refused_command_is_told_with_its_abort_code_and_how_often_it_came() {
        let refused = What::Refused(item(None), AbortCode::DeviceState);
        let again = Again { times: 9, lasted: Duration::from_millis(500) };
        let text = text(Who::Modbus(CLIENT.parse().unwrap()), refused, Some(again));
        let expected = r#""event":"refused","device":"x","axis":1,"by":{"kind":"modbus","client":"10.0.0.5:40112"},"object":"0x607A:00","name":"Target position","value":-5,"code":"0x08000022","reason":"data cannot be transferred or stored because of the present device state","times":9,"lasted_s":0.5}"#;
        assert!(text.ends_with(expected), "{text}");
    }

    #[test]
    fn who_is_behind_a_connection_is_told_as_far_as_it_is_known() {
        let peer = Some(Peer::Process { uid: 1000, pid: Some(4242) });
        let what = What::Motion(0, Goal::Stop);
        let entry =
            AuditEntry { at: Instant::ZERO, device: Some(0), who: Who::Local, peer, what, again: None };
        let text = Line::of(&entry, &names(), Duration::ZERO).text().unwrap();
        assert!(text.ends_with(r#""axis":1,"by":{"kind":"local","uid":1000,"pid":4242}}"#), "{text}");
        let who = Who::CanOpen(LinkId(0));
        let client = AuditEntry { who, peer: Some(Peer::Address(CLIENT.parse().unwrap())), ..entry };
        let text = Line::of(&client, &names(), Duration::ZERO).text().unwrap();
        let by = r#""by":{"kind":"canopen","bus":"can0","client":"10.0.0.5:40112"}}"#;
        assert!(text.ends_with(by), "{text}");
    }

    #[test]
    fn orders_are_told_in_the_words_of_axisctl() {
        let supply_dip = "supply-dip:40".parse().unwrap();
        let move_to = Goal::Move { position: 9, is_relative: true, velocity: Some(5), acceleration: None };
        let jog = Goal::Jog { velocity: -5, acceleration: None, time: Some(Duration::from_millis(500)) };
        let nmt = NetworkOrder::Nmt { command: NmtCommand::Start, node_id: 0 };
        let by_modbus = Owner { bus: Bus::Modbus, link: None };
        let orders = [
            (
                What::Network(LinkId(0), nmt),
                r#""event":"nmt","device":"x","by":{"kind":"local"},"bus":"can0","node_id":0,"order":"start"}"#,
            ),
            (
                What::Network(LinkId(0), NetworkOrder::LssNodeId(5)),
                r#""event":"lss","device":"x","by":{"kind":"local"},"bus":"can0","order":"node-id 5"}"#,
            ),
            (
                What::Claim(0, by_modbus),
                r#""event":"claim","device":"x","axis":1,"by":{"kind":"local"},"order":"modbus"}"#,
            ),
            (
                What::Release(0, None),
                r#""event":"release","device":"x","axis":1,"by":{"kind":"local"},"order":"any"}"#,
            ),
            (
                What::Inject(0, supply_dip),
                r#""event":"fault-inject","device":"x","axis":1,"by":{"kind":"local"},"order":"supply-dip:40"}"#,
            ),
            (
                What::Repair(0, Repair::All),
                r#""event":"fault-clear","device":"x","axis":1,"by":{"kind":"local"},"order":"all"}"#,
            ),
            (
                What::Motion(0, move_to),
                r#""event":"move","device":"x","axis":1,"by":{"kind":"local"},"order":"9 --relative --velocity 5"}"#,
            ),
            (
                What::Motion(0, jog),
                r#""event":"jog","device":"x","axis":1,"by":{"kind":"local"},"order":"-5 --time 0.5"}"#,
            ),
            (
                What::Motion(0, Goal::Home { method: Some(33) }),
                r#""event":"home","device":"x","axis":1,"by":{"kind":"local"},"order":"--method 33"}"#,
            ),
            (What::Motion(0, Goal::Stop), r#""event":"stop","device":"x","axis":1,"by":{"kind":"local"}}"#),
        ];
        for (what, expected) in orders {
            let text = text(Who::Local, what, None);
            assert!(text.ends_with(expected), "{text}");
        }
    }
}
