//! What happens, in the log: at most one line a second for each device or bus and kind.

use std::io;

use canopen::{BusState, Emergency, UNCONFIGURED};
use od::Instant;
use profiles::{Dialect, error_text};
use tracing::{info, warn};

use crate::core::{Core, Notice};
use crate::link::Link;
use crate::log::module::{BUS, DEVICE, STORAGE};
use crate::log::{Limiter, Subject};
use crate::storage::Failure;

/// A line that is a warning or not, with its fields.
macro_rules! say {
    ($is_bad:expr, $($line:tt)*) => {
        if $is_bad { warn!($($line)*) } else { info!($($line)*) }
    };
}

/// Knows what was said last.
#[derive(Debug)]
pub(crate) struct Reporter {
    limiter: Limiter,
    /// For each link, why its interface cannot be used.
    troubles: Vec<Option<String>>,
    /// For each link, how many frames were known to be lost.
    unsent: Vec<u64>,
}

impl Reporter {
    /// A reporter for so many links.
    pub(crate) fn new(links: usize) -> Self {
        let (troubles, unsent) = (vec![None; links], vec![0; links]);
        Self { limiter: Limiter::default(), troubles, unsent }
    }

    /// Forgets what was said of a link, which may be new, and is to be another bus.
    pub(crate) fn open_link(&mut self, link: usize) {
        if self.troubles.len() <= link {
            self.troubles.resize(link + 1, None);
            self.unsent.resize(link + 1, 0);
        }
        self.troubles.get_mut(link).into_iter().for_each(|trouble| *trouble = None);
        self.unsent.get_mut(link).into_iter().for_each(|unsent| *unsent = 0);
    }

    /// Why the interface of a link cannot be used, if that is known.
    pub(crate) fn trouble(&self, link: usize) -> Option<&str> {
        self.troubles.get(link)?.as_deref()
    }

    /// Says what has happened in the core, at most so much at once, and on the links. Whether there may be more.
    pub(crate) fn report(&mut self, now: Instant, core: &mut Core, links: &[Link], most: usize) -> bool {
        let mut count = 0;
        while count < most
            && let Some((device, notice)) = core.poll_notice()
        {
            self.notice(now, core, device, notice);
            count += 1;
        }
        for (number, (link, known)) in links.iter().zip(&mut self.unsent).enumerate() {
            let Some(interface) = link.interface.as_ref().filter(|interface| interface.fd().is_some()) else {
                continue;
            };
            let unsent = interface.waiting().dropped();
            if unsent > *known && self.limiter.admit(now, Subject::Bus(number), "unsent").is_some() {
                let bus = &*link.name;
                warn!(target: BUS, bus, "bus {bus}: {} frames could not be sent", unsent - *known);
                *known = unsent;
            }
        }
        count == most
    }

    /// Says that an interface can be used, or why not, when that has changed.
    pub(crate) fn interface(
        &mut self,
        now: Instant,
        link: usize,
        bus: &str,
        interface: &str,
        error: Option<&io::Error>,
    ) {
        let Some(trouble) = self.troubles.get_mut(link) else { return };
        let error = error.map(io::Error::to_string);
        match &error {
            None => info!(target: BUS, bus, "bus {bus}: on interface {interface}"),
            Some(error) if trouble.as_ref() == Some(error) => return,
            Some(error) => {
                if self.limiter.admit(now, Subject::Bus(link), "interface").is_none() {
                    return;
                }
                warn!(target: BUS, bus, "bus {bus}: interface {interface}: {error}; trying again");
            }
        }
        *trouble = error;
    }

    /// Says that the state of the CAN controller of a link is now this one.
    pub(crate) fn bus_state(&mut self, now: Instant, link: usize, bus: &str, state: BusState) {
        let (text, is_bad) = (state.name(), state != BusState::Active);
        let Some(suppressed) = self.limiter.admit(now, Subject::Bus(link), text) else { return };
        let more = left_out(suppressed);
        say!(is_bad, target: BUS, bus, "bus {bus}: {text}{more}");
    }

    /// Says that the parameters of a device are stored, or why not.
    pub(crate) fn stored(&mut self, now: Instant, core: &Core, device: usize, failure: Option<&Failure>) {
        let kind = if failure.is_some() { "not stored" } else { "stored" };
        if self.limiter.admit(now, Subject::Device(device), kind).is_none() {
            return;
        }
        let (device, _) = known(core, device);
        match failure {
            None => info!(target: STORAGE, device, "{device}: parameters stored"),
            Some(failure) => warn!(target: STORAGE, device, "{device}: parameters not stored: {failure}"),
        }
    }

    /// Says what somebody has done to a device, by its name.
    pub(crate) fn ordered(&mut self, now: Instant, core: &Core, device: &str, change: &str) {
        let Some(number) = core.find(device) else { return };
        if let Some(suppressed) = self.limiter.admit(now, Subject::Device(number), "ordered") {
            info!(target: DEVICE, device, "{device}: {change}{}", left_out(suppressed));
        }
    }

    fn notice(&mut self, now: Instant, core: &Core, device: usize, notice: Notice) {
        let (kind, is_bad) = match notice {
            Notice::Fault(_) => ("fault", true),
            Notice::FaultOver(_) => ("fault over", false),
            Notice::Reset => ("reset", false),
            Notice::NodeId(_) => ("node-id", false),
            Notice::Nmt(_) => ("nmt", false),
            Notice::ConnectionLost(_) => ("connection", true),
            Notice::Emergency { emergency, .. } => ("emergency", emergency.code != 0),
            Notice::DroppedSteps(_) => ("dropped", true),
            Notice::ModbusLost => ("modbus", true),
            Notice::PowerCut => ("power cut", true),
        };
        let Some(suppressed) = self.limiter.admit(now, Subject::Device(device), kind) else { return };
        let (device, dialect) = known(core, device);
        let text = match notice {
            Notice::Fault(code) => format!("fault 0x{code:04X} ({})", error_text(code, dialect)),
            Notice::FaultOver(code) => format!("fault 0x{code:04X} is over"),
            Notice::Reset => "reset over the bus".to_owned(),
            Notice::NodeId(UNCONFIGURED) => "has no Node-ID any more, by LSS".to_owned(),
            Notice::NodeId(node_id) => format!("is node {node_id} now, by LSS"),
            Notice::Nmt(state) => state.name().to_owned(),
            Notice::ConnectionLost(cause) => format!("connection lost: {cause}"),
            Notice::Emergency { producer, emergency: Emergency { code, .. } } => {
                // Whatever the other node is: it is the standard that both share.
                format!("node {producer} tells 0x{code:04X} ({})", error_text(code, Dialect::Cia402))
            }
            Notice::DroppedSteps(steps) => format!("served too late, {steps} raster steps dropped"),
            Notice::ModbusLost => "connection lost: no Modbus client asks any more".to_owned(),
            Notice::PowerCut => "does not come to rest in time: its power is cut, it coasts".to_owned(),
        };
        let more = left_out(suppressed);
        let (node, code) = node_and_code(notice);
        say!(is_bad, target: DEVICE, device, node, code, "{device}: {text}{more}");
    }
}

/// The name of a device, and how it speaks of its faults.
fn known(core: &Core, device: usize) -> (&str, Dialect) {
    let dialect = core.profile(device).map_or_else(Dialect::default, |profile| profile.dialect);
    (core.name(device).map_or("?", |name| name), dialect)
}

/// The Node-ID that a notice is about, if it is about one, and the error code that it tells.
fn node_and_code(notice: Notice) -> (Option<u8>, Option<u16>) {
    match notice {
        Notice::Fault(code) | Notice::FaultOver(code) => (None, Some(code)),
        Notice::NodeId(node_id) => (Some(node_id), None),
        Notice::Emergency { producer, emergency } => (Some(producer), Some(emergency.code)),
        Notice::Reset
        | Notice::Nmt(_)
        | Notice::ConnectionLost(_)
        | Notice::DroppedSteps(_)
        | Notice::ModbusLost
        | Notice::PowerCut => (None, None),
    }
}

fn left_out(lines: u32) -> String {
    if lines > 0 { format!(" ({lines} lines like this left out)") } else { String::new() }
}
