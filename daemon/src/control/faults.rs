//! Faults of the simulated plants, told and ordered.

use core::ops::Range;

use od::Instant;
use profiles::{PlantFault, Repair};
use serde::{Deserialize, Serialize};

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
        match self {
            Self::Inject { device, axis, fault } => {
                let number = find(core, device)?;
                for axis in axes(core, number, device, *axis)? {
                    core.inject(now, number, axis, *fault).map_err(|error| error.to_string())?;
                }
                Ok(told(core, number, device))
            }
            Self::Repair { device, axis, repair } => {
                let number = find(core, device)?;
                for axis in axes(core, number, device, *axis)? {
                    core.repair(now, number, axis, *repair).map_err(|error| error.to_string())?;
                }
                Ok(told(core, number, device))
            }
            Self::List { device: Some(device) } => Ok(told(core, find(core, device)?, device)),
            Self::List { device: None } => {
                Ok(core.names().flat_map(|(number, device)| told(core, number, device)).collect())
            }
        }
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

/// The position of the device of this name.
pub(crate) fn find(core: &Core, device: &str) -> Result<usize, String> {
    core.find(device).ok_or_else(|| {
        let known: Vec<&str> = core.names().map(|(_, name)| name).collect();
        format!("no device `{device}`; there are: {}", known.join(", "))
    })
}

/// The numbers from 0 of the axes that are meant.
pub(super) fn axes(
    core: &Core,
    number: usize,
    device: &str,
    axis: Option<usize>,
) -> Result<Range<usize>, String> {
    let count = core.device(number).map_or(0, |device| device.axes().count());
    match (count, axis) {
        (0, _) => Err(format!("device `{device}` has no axis")),
        (_, None) => Ok(0..count),
        (_, Some(axis @ 1..)) if axis <= count => Ok(axis - 1..axis),
        (1, Some(axis)) => Err(format!("device `{device}` has no axis {axis}, only axis 1")),
        (_, Some(axis)) => Err(format!("device `{device}` has no axis {axis}, only 1 to {count}")),
    }
}

fn told(core: &Core, number: usize, name: &str) -> Vec<AxisFaults> {
    let Some(device) = core.device(number) else { return Vec::new() };
    let told = |axis: usize| AxisFaults {
        device: name.to_owned(),
        axis: axis + 1,
        faults: device.plant_faults(axis).map(|fault| fault.to_string()).collect(),
    };
    (0..device.axes().count()).map(told).collect()
}
