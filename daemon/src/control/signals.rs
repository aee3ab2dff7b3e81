//! Signals that come to axes from outside of their machines, told and set.

use od::Instant;
use profiles::{Device, Signal, Velocity, Voltage};
use serde::{Deserialize, Serialize};

use super::axes::{change, list};
use crate::core::Core;
use crate::status::table;

/// What a client wants to know or to have done.
#[derive(Clone, Debug, PartialEq)]
pub enum SignalOrder {
    /// Set one.
    Set {
        /// Name of the device.
        device: String,
        /// Number of the axis, from 1; all of the device without it.
        axis: Option<usize>,
        /// What it is to be.
        signal: Signal,
    },
    /// Only tell.
    List {
        /// Name of the device; without it, every device.
        device: Option<String>,
    },
}

/// What comes to one axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AxisSignals {
    /// Name of the device.
    pub device: String,
    /// Number of the axis, from 1.
    pub axis: usize,
    /// Voltage at the analogue input.
    pub analog_input_v: f64,
    /// Speed of the external encoder.
    pub external_encoder_counts_per_s: f64,
}

impl SignalOrder {
    /// Does it in `core`, and tells what then comes to each axis of the device. A wrong order changes nothing.
    ///
    /// # Errors
    /// There is no such device or axis.
    pub fn carry_out(&self, now: Instant, core: &mut Core) -> Result<Vec<AxisSignals>, String> {
        let device = match self {
            Self::Set { device, axis, signal } => {
                change(core, device, *axis, |core, device, axis| {
                    core.set_signal(now, device, axis, *signal)
                })?;
                Some(device)
            }
            Self::List { device } => device.as_ref(),
        };
        list(core, device.map(String::as_str), told)
    }

    /// The device that it changes, and how, for the log.
    pub(crate) fn change(&self) -> Option<(&str, String)> {
        match self {
            Self::Set { device, signal, .. } => Some((device, format!("signal {signal} set"))),
            Self::List { .. } => None,
        }
    }
}

/// The signals of every axis as a table for people.
#[must_use]
pub fn signals_text(axes: &[AxisSignals]) -> String {
    let row = |axis: &AxisSignals| {
        let AxisSignals { device, axis, analog_input_v, external_encoder_counts_per_s } = axis;
        [
            device.clone(),
            axis.to_string(),
            format!("{analog_input_v} V"),
            format!("{external_encoder_counts_per_s}/s"),
        ]
    };
    let rows: Vec<_> = axes.iter().map(row).collect();
    table(&["DEVICE", ">AXIS", ">ANALOG INPUT", ">EXTERNAL ENCODER"], &rows)
}

fn told(name: &str, device: &Device, axis: usize) -> Option<AxisSignals> {
    let (Voltage(volts), Velocity(speed)) = device.signals(axis)?;
    Some(AxisSignals {
        device: name.to_owned(),
        axis: axis + 1,
        analog_input_v: volts,
        external_encoder_counts_per_s: speed,
    })
}
