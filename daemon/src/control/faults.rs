//! Faults of the simulated plants, told and ordered.

use od::Instant;
use profiles::{Device, PlantFault, Repair};
use serde::{Deserialize, Serialize};

use super::axes::{change, list};
use crate::core::Core;
use crate::status::table;

/// What a client wants to know or to have done. Without `axis` it concerns every axis of the device.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Break something.
    Inject {
        /// Name of the device.
        device: String,
        /// Number of the axis, from 1.
        axis: Option<usize>,
        /// What breaks.
        fault: PlantFault,
    },
    /// Repair something.
    Repair {
        /// Name of the device.
        device: String,
        /// Number of the axis, from 1.
        axis: Option<usize>,
        /// What is repaired.
        repair: Repair,
    },
    /// Only tell.
    List {
        /// Name of the device; without it, every device.
        device: Option<String>,
    },
}

/// What is broken behind one axis.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisFaults {
    /// Name of the device.
    pub device: String,
    /// Number of the axis, from 1.
    pub axis: usize,
    /// The faults in words, as they are ordered.
    pub faults: Vec<String>,
}

/// What comes of an order: what is now broken behind each axis of the device, or why nothing was done.
pub type Outcome = Result<Vec<AxisFaults>, String>;

impl Order {
    /// Does it in `core`. A wrong order changes nothing.
    ///
    /// # Errors
    /// There is no such device or axis.
    pub fn carry_out(&self, now: Instant, core: &mut Core) -> Outcome {
        let device = match self {
            Self::Inject { device, axis, fault } => {
                change(core, device, *axis, |core, device, axis| core.inject(now, device, axis, *fault))?;
                Some(device)
            }
            Self::Repair { device, axis, repair } => {
                change(core, device, *axis, |core, device, axis| core.repair(now, device, axis, *repair))?;
                Some(device)
            }
            Self::List { device } => device.as_ref(),
        };
        list(core, device.map(String::as_str), told)
    }

    /// The device that it changes, and how, for the log.
    pub(crate) fn change(&self) -> Option<(&str, String)> {
        match self {
            Self::Inject { device, fault, .. } => Some((device, format!("fault {fault} injected"))),
            Self::Repair { device, repair: Repair::One(fault), .. } => {
                Some((device, format!("fault {fault} cleared")))
            }
            Self::Repair { device, repair: Repair::All, .. } => {
                Some((device, "all injected faults cleared".to_owned()))
            }
            Self::List { .. } => None,
        }
    }
}

/// The faults of every axis as a table for people.
#[must_use]
pub fn text(axes: &[AxisFaults]) -> String {
    let line = |AxisFaults { device, axis, faults }: &AxisFaults| {
        let faults = if faults.is_empty() { "-".to_owned() } else { faults.join(", ") };
        [device.clone(), axis.to_string(), faults]
    };
    let rows: Vec<_> = axes.iter().map(line).collect();
    table(&["DEVICE", ">AXIS", "FAULTS"], &rows)
}

fn told(name: &str, device: &Device, axis: usize) -> Option<AxisFaults> {
    let faults = device.plant_faults(axis).map(|fault| fault.to_string()).collect();
    Some(AxisFaults { device: name.to_owned(), axis: axis + 1, faults })
}
