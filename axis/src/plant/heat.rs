//! What torque does to the motor: temperature, and the utilisation of its overload capacity (I²t).

use super::within;
use crate::drive::DriveFault;
use crate::units::{Temperature, Torque};

/// How the motor warms up: losses in proportion to the square of the torque, one time constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thermal {
    /// How much warmer than its surroundings rated torque makes it in the end, in kelvin.
    pub rise_at_rated: f64,
    /// Time to 63 % of a rise, in seconds.
    pub time_constant_seconds: f64,
    /// The drive trips above this.
    pub limit: Temperature,
}

impl Default for Thermal {
    /// 60 K at rated torque, 10 minutes, 90 °C.
    fn default() -> Self {
        Self { rise_at_rated: 60.0, time_constant_seconds: 600.0, limit: Temperature(90.0) }
    }
}

/// How long the motor may give more than its continuous torque (I²t).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overload {
    /// Torque that may last for ever.
    pub rated: Torque,
    /// How long twice that torque may last, in seconds. A torque of n times rated may last 3 / (n² - 1) times
    /// as long.
    pub seconds: f64,
}

impl Default for Overload {
    /// The rated torque, and twice of it for 3 s.
    fn default() -> Self {
        Self { rated: Torque(1000.0), seconds: 3.0 }
    }
}

/// Temperature and overload as they are.
#[derive(Clone, Debug)]
pub(super) struct Heat {
    ambient: f64,
    thermal: Option<Thermal>,
    overload: Option<Overload>,
    temperature: f64,
    utilisation: f64,
}

impl Heat {
    /// A temperature this near to that of the surroundings is theirs, in kelvin.
    const COLD: f64 = 0.01;
    /// Excess of the squared torque that an [`Overload`] is named after: 2² - 1.
    const EXCESS: f64 = 3.0;

    pub(super) fn new(ambient: Temperature, thermal: Option<Thermal>, overload: Option<Overload>) -> Self {
        let ambient = within(ambient.0, -273.0, 1e4, 25.0);
        Self {
            ambient,
            thermal: thermal.map(sensible),
            overload: overload.map(sensible_overload),
            temperature: ambient,
            utilisation: 0.0,
        }
    }

    pub(super) fn is_modelled(&self) -> bool {
        self.thermal.is_some() || self.overload.is_some()
    }

    /// Whether it would stay as it is while the motor is off.
    fn is_settled(&self) -> bool {
        self.utilisation == 0.0 && (self.temperature - self.ambient).abs() == 0.0
    }

    /// The motor is off for `seconds`: the same as that many in steps, up to a hundred of them.
    pub(super) fn rest(&mut self, seconds: f64) {
        const STEPS: u32 = 100;
        for _ in 0..STEPS {
            if self.is_settled() {
                return;
            }
            self.step(0.0, seconds / f64::from(STEPS));
        }
    }

    pub(super) fn temperature(&self) -> Temperature {
        Temperature(self.temperature)
    }

    /// Part of the overload capacity that is used up; 1 is the limit.
    pub(super) fn utilisation(&self) -> f64 {
        self.utilisation
    }

    /// `torque` works for `seconds`.
    pub(super) fn step(&mut self, torque: f64, seconds: f64) {
        if let Some(thermal) = &self.thermal {
            let load = torque / 1000.0;
            let target = self.ambient + thermal.rise_at_rated * load * load;
            let part = seconds / (thermal.time_constant_seconds + seconds);
            self.temperature += (target - self.temperature) * part;
            if torque == 0.0 && (self.temperature - self.ambient).abs() <= Self::COLD {
                self.temperature = self.ambient;
            }
        }
        if let Some(overload) = &self.overload {
            let load = torque / overload.rated.0;
            let excess = (load * load - 1.0) / (Self::EXCESS * overload.seconds);
            self.utilisation = (self.utilisation + excess * seconds).max(0.0);
        }
    }

    pub(super) fn fault(&self) -> Option<DriveFault> {
        if self.thermal.is_some_and(|thermal| self.temperature > thermal.limit.0) {
            Some(DriveFault::OverTemperature)
        } else {
            (self.utilisation >= 1.0).then_some(DriveFault::Overload)
        }
    }
}

fn sensible(thermal: Thermal) -> Thermal {
    let default = Thermal::default();
    Thermal {
        rise_at_rated: within(thermal.rise_at_rated, 0.0, 1e6, default.rise_at_rated),
        time_constant_seconds: within(
            thermal.time_constant_seconds,
            1e-3,
            1e9,
            default.time_constant_seconds,
        ),
        limit: Temperature(within(thermal.limit.0, -273.0, 1e9, default.limit.0)),
    }
}

fn sensible_overload(overload: Overload) -> Overload {
    let default = Overload::default();
    Overload {
        rated: Torque(within(overload.rated.0, 1.0, 1e6, default.rated.0)),
        seconds: within(overload.seconds, 1e-3, 1e9, default.seconds),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heat(thermal: Option<Thermal>, overload: Option<Overload>) -> Heat {
        Heat::new(Temperature(20.0), thermal, overload)
    }

    #[test]
    fn the_temperature_ends_where_the_losses_say_and_returns_to_the_surroundings() {
        let thermal = Thermal { time_constant_seconds: 2.0, ..Thermal::default() };
        let mut heat = heat(Some(thermal), None);
        (0..16_000).for_each(|_| heat.step(500.0, 125e-6));
        let rise = 15.0 * (1.0 - (-1.0_f64).exp());
        assert!((heat.temperature().0 - 20.0 - rise).abs() < 0.01, "{:?}", heat.temperature());
        (0..1_000_000).for_each(|_| heat.step(500.0, 125e-6));
        assert!((heat.temperature().0 - 35.0).abs() < 1e-6, "{:?}", heat.temperature());
        (0..1_000_000).for_each(|_| heat.step(0.0, 125e-6));
        assert!(heat.is_settled() && heat.temperature() == Temperature(20.0));
    }

    #[test]
    fn too_much_heat_trips_the_drive() {
        let mut heat = heat(Some(Thermal { time_constant_seconds: 1.0, ..Thermal::default() }), None);
        (0..80_000).for_each(|_| heat.step(1000.0, 125e-6));
        assert_eq!(heat.fault(), None);
        (0..80_000).for_each(|_| heat.step(1100.0, 125e-6));
        assert_eq!(heat.fault(), Some(DriveFault::OverTemperature));
    }

    #[test]
    fn a_constant_overload_trips_after_its_time() {
        for (torque, seconds) in [(2000.0, 3.0), (-2000.0, 3.0), (3000.0, 9.0 / 8.0), (1500.0, 7.2)] {
            let mut heat = heat(None, Some(Overload::default()));
            let mut elapsed = 0.0_f64;
            while heat.fault().is_none() {
                heat.step(torque, 125e-6);
                elapsed += 125e-6;
            }
            assert!((elapsed - seconds).abs() < 1e-3, "{torque}: {elapsed}");
        }
    }

    #[test]
    fn a_rest_cools_as_much_as_its_steps() {
        let thermal = Thermal { time_constant_seconds: 10.0, ..Thermal::default() };
        let mut stepped = heat(Some(thermal), Some(Overload::default()));
        (0..2000).for_each(|_| stepped.step(2000.0, 1e-3));
        let mut rested = stepped.clone();
        (0..5000).for_each(|_| stepped.step(0.0, 1e-3));
        rested.rest(5.0);
        assert!((rested.temperature() - stepped.temperature()).abs() < Temperature(0.1));
        assert!((rested.utilisation() - stepped.utilisation()).abs() < 1e-9);
        rested.rest(1e9);
        assert!(rested.is_settled());
    }

    #[test]
    fn rated_torque_lasts_for_ever_and_rest_restores_the_capacity() {
        let mut heat = heat(None, Some(Overload::default()));
        (0..100_000).for_each(|_| heat.step(1000.0, 1e-3));
        assert!(heat.utilisation() == 0.0 && heat.is_settled());
        (0..1500).for_each(|_| heat.step(2000.0, 1e-3));
        assert!((heat.utilisation() - 0.5).abs() < 1e-9);
        (0..4501).for_each(|_| heat.step(0.0, 1e-3));
        assert!(heat.is_settled());
    }
}
