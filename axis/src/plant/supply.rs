//! The supply of the power stage: a source, and the capacitors between it and the motor.

use super::within;
use crate::drive::DriveFault;
use crate::units::Voltage;

/// What feeds the power stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supply {
    /// Voltage of the source; the two thresholds have to fit to it.
    pub voltage: Voltage,
    /// The power stage trips below this.
    pub under_voltage: Voltage,
    /// The power stage trips above this.
    pub over_voltage: Voltage,
    /// What the motor does to the voltage; `None` is a source that nothing moves.
    pub dc_link: Option<DcLink>,
}

impl Default for Supply {
    /// 48 V that nothing moves, good from 20 V to 75 V.
    fn default() -> Self {
        Self {
            voltage: Voltage(48.0),
            under_voltage: Voltage(20.0),
            over_voltage: Voltage(75.0),
            dc_link: None,
        }
    }
}

/// The DC link. The source feeds it through a rectifier, so that braking energy stays in the capacitor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DcLink {
    /// Resistance of the source, in ohms.
    pub resistance_ohm: f64,
    /// Capacitance, in farads.
    pub capacitance_f: f64,
    /// What the motor and the power stage turn into heat at rated torque, in watts.
    pub losses_at_rated_w: f64,
    /// What the electronics draw all the time, in watts.
    pub idle_w: f64,
    /// Voltage above which a brake chopper burns the energy; `None` without a chopper.
    pub chopper: Option<Voltage>,
}

impl Default for DcLink {
    /// 0.2 Ω and 2 mF, 20 W of losses at rated torque and 3 W idle, without a chopper.
    fn default() -> Self {
        Self { resistance_ohm: 0.2, capacitance_f: 2e-3, losses_at_rated_w: 20.0, idle_w: 3.0, chopper: None }
    }
}

/// The voltage as it is.
#[derive(Clone, Debug)]
pub(super) struct Feed {
    supply: Supply,
    /// Highest voltage the source has while it dips.
    dip: Option<f64>,
    voltage: f64,
    is_settled: bool,
}

impl Feed {
    /// The slowest change that matters, in V/s.
    const SETTLED: f64 = 1e-3;

    pub(super) fn new(supply: Supply) -> Self {
        let default = Supply::default();
        let volts = |given: Voltage, default: Voltage| Voltage(within(given.0, 0.0, 1e5, default.0));
        let supply = Supply {
            voltage: volts(supply.voltage, default.voltage),
            under_voltage: volts(supply.under_voltage, default.under_voltage),
            over_voltage: volts(supply.over_voltage, default.over_voltage),
            dc_link: supply.dc_link.map(sensible),
        };
        Self { voltage: supply.voltage.0, supply, dip: None, is_settled: true }
    }

    /// Whether the voltage follows anything but the source.
    pub(super) fn is_modelled(&self) -> bool {
        self.supply.dc_link.is_some()
    }

    /// Whether it would stay as it is while the motor is off.
    pub(super) fn is_settled(&self) -> bool {
        self.is_settled
    }

    pub(super) fn voltage(&self) -> Voltage {
        Voltage(self.voltage)
    }

    /// To what the source has sunk.
    pub(super) fn dip(&self) -> Option<Voltage> {
        self.dip.map(Voltage)
    }

    /// Lets the source sink to `dip`, or recover.
    pub(super) fn set_dip(&mut self, dip: Option<Voltage>) {
        self.dip = dip.map(|dip| within(dip.0, 0.0, 1e5, 0.0));
        if !self.is_modelled() {
            self.voltage = self.source();
        }
    }

    /// The motor takes `watts` for `seconds` at `load` times its rated torque; braking gives instead.
    pub(super) fn step(&mut self, watts: f64, load: f64, seconds: f64) {
        let Some(link) = &self.supply.dc_link else { return };
        let before = self.voltage;
        let drawn = watts + link.losses_at_rated_w * load * load + link.idle_w;
        let square = before * before - 2.0 * drawn * seconds / link.capacitance_f;
        self.voltage = square.max(0.0).sqrt();
        let missing = self.source() - self.voltage;
        if missing > 0.0 {
            self.voltage += missing * seconds / (link.resistance_ohm * link.capacitance_f + seconds);
        }
        let most = link.chopper.map_or(f64::MAX, |chopper| chopper.0);
        self.voltage = self.voltage.min(most);
        self.is_settled = (self.voltage - before).abs() <= Self::SETTLED * seconds;
    }

    pub(super) fn fault(&self) -> Option<DriveFault> {
        if self.voltage > self.supply.over_voltage.0 {
            Some(DriveFault::OverVoltage)
        } else {
            (self.voltage < self.supply.under_voltage.0).then_some(DriveFault::UnderVoltage)
        }
    }

    fn source(&self) -> f64 {
        self.dip.unwrap_or(f64::MAX).min(self.supply.voltage.0)
    }
}

fn sensible(link: DcLink) -> DcLink {
    let default = DcLink::default();
    DcLink {
        resistance_ohm: within(link.resistance_ohm, 1e-6, 1e6, default.resistance_ohm),
        capacitance_f: within(link.capacitance_f, 1e-9, 1e3, default.capacitance_f),
        losses_at_rated_w: within(link.losses_at_rated_w, 0.0, 1e6, default.losses_at_rated_w),
        idle_w: within(link.idle_w, 0.0, 1e6, default.idle_w),
        chopper: link.chopper.filter(|chopper| chopper.0 > 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn link(chopper: Option<f64>) -> Feed {
        let dc_link = DcLink { idle_w: 0.0, chopper: chopper.map(Voltage), ..DcLink::default() };
        Feed::new(Supply { dc_link: Some(dc_link), ..Supply::default() })
    }

    #[test]
    fn a_load_pulls_the_voltage_down_by_the_source_resistance() {
        let mut feed = link(None);
        (0..10_000).for_each(|_| feed.step(480.0, 0.0, 125e-6));
        // u = 48 V - 0.2 Ω · 480 W / u
        let expected = 24.0 + (24.0_f64 * 24.0 - 96.0).sqrt();
        assert!((feed.voltage().0 - expected).abs() < 0.2, "{:?}", feed.voltage());
        assert!(feed.is_settled());
        (0..10_000).for_each(|_| feed.step(0.0, 0.0, 125e-6));
        assert!((feed.voltage().0 - 48.0).abs() < 1e-6);
    }

    #[test]
    fn braking_energy_fills_the_capacitor_to_the_joule() {
        let mut feed = link(None);
        (0..80).for_each(|_| feed.step(-100.0, 0.0, 125e-6));
        let joules = 1e-3 * (feed.voltage().0.powi(2) - 48.0 * 48.0);
        assert!((joules - 1.0).abs() < 1e-9, "{joules}");
        assert_eq!(feed.fault(), None);
        (0..800).for_each(|_| feed.step(-100.0, 0.0, 125e-6));
        assert_eq!(feed.fault(), Some(DriveFault::OverVoltage));
    }

    #[test]
    fn a_chopper_holds_the_voltage() {
        let mut feed = link(Some(60.0));
        (0..8000).for_each(|_| feed.step(-1000.0, 0.0, 125e-6));
        assert_eq!((feed.voltage(), feed.fault()), (Voltage(60.0), None));
    }

    #[test]
    fn a_dip_is_bridged_by_the_capacitor_until_the_load_has_emptied_it() {
        let mut feed = link(None);
        feed.set_dip(Some(Voltage(5.0)));
        assert_eq!((feed.voltage(), feed.fault()), (Voltage(48.0), None));
        // 100 W take 2 mF from 48 V to 20 V in 19.04 ms.
        let steps = (0..).take_while(|_| {
            feed.step(100.0, 0.0, 125e-6);
            feed.fault().is_none()
        });
        assert_eq!(steps.count(), 152);
        assert_eq!(feed.fault(), Some(DriveFault::UnderVoltage));
        feed.set_dip(None);
        (0..100).for_each(|_| feed.step(0.0, 0.0, 125e-6));
        assert_eq!(feed.fault(), None);
    }
}
