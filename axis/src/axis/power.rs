//! Power on and off, with the time a holding brake takes.

/// Raster steps between power and motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PowerDelays {
    /// From power on until the first order is taken: the brake opens while the axis holds.
    pub on: u32,
    /// From the order to switch off until power goes: the brake closes while the axis holds.
    pub off: u32,
}

/// Whether there is to be power.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Power {
    pub(super) delays: PowerDelays,
    state: State,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Off,
    /// Steps left until orders are taken, counted once the drive is enabled.
    Opening(u32),
    On,
    /// Steps left until power goes.
    Closing(u32),
    /// Off for good.
    Retired,
}

impl Power {
    /// Switches on, also amid switching off.
    pub(super) fn switch_on(&mut self) {
        self.state = match self.state {
            State::Off => State::Opening(self.delays.on),
            State::Closing(_) => State::On,
            state @ (State::Opening(_) | State::On | State::Retired) => state,
        };
    }

    /// Switches off after the delay; at once if the axis is not held.
    pub(super) fn switch_off(&mut self, is_held: bool) {
        self.state = match self.state {
            State::Closing(left) => State::Closing(left),
            State::Opening(_) | State::On if is_held && self.delays.off > 0 => {
                State::Closing(self.delays.off)
            }
            State::Off | State::Opening(_) | State::On => State::Off,
            State::Retired => State::Retired,
        };
    }

    /// Cuts the power at once.
    pub(super) fn cut(&mut self) {
        if self.state != State::Retired {
            self.state = State::Off;
        }
    }

    /// Cuts the power at once, and for good.
    pub(super) fn retire(&mut self) {
        self.state = State::Retired;
    }

    /// Follows one raster step with the drive enabled or not.
    pub(super) fn step(&mut self, is_enabled: bool) {
        self.state = match self.state {
            State::Opening(left) if is_enabled => left.checked_sub(1).map_or(State::On, State::Opening),
            State::Closing(left) => left.checked_sub(1).map_or(State::Off, State::Closing),
            state @ (State::Off | State::Opening(_) | State::On | State::Retired) => state,
        };
    }

    /// Whether the drive is to be enabled.
    pub(super) fn is_on(&self) -> bool {
        !matches!(self.state, State::Off | State::Retired)
    }

    /// Whether the brake is about to open.
    pub(super) fn is_opening(&self) -> bool {
        matches!(self.state, State::Opening(_))
    }

    /// Whether orders are taken.
    pub(super) fn is_ready(&self) -> bool {
        self.state == State::On
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_wait_for_the_brake_to_open() {
        let mut power = Power { delays: PowerDelays { on: 2, off: 0 }, ..Power::default() };
        power.switch_on();
        power.step(false);
        let ready: Vec<_> = (0..4)
            .map(|_| {
                power.step(true);
                power.is_ready()
            })
            .collect();
        assert_eq!(ready, [false, false, true, true]);
    }

    #[test]
    fn power_stays_until_the_brake_has_closed_unless_it_is_cut() {
        let mut power = Power { delays: PowerDelays { on: 0, off: 2 }, ..Power::default() };
        power.switch_on();
        power.step(true);
        power.switch_off(true);
        let on: Vec<_> = (0..4)
            .map(|_| {
                power.step(true);
                power.is_on()
            })
            .collect();
        assert_eq!(on, [true, true, false, false]);
        power.switch_on();
        power.step(true);
        power.switch_off(true);
        power.switch_on();
        assert!(power.is_ready());
        power.cut();
        assert!(!power.is_on());
    }

    #[test]
    fn what_is_retired_is_never_switched_on_again() {
        let mut power = Power { delays: PowerDelays { on: 0, off: 2 }, ..Power::default() };
        power.switch_on();
        power.step(true);
        power.retire();
        for order in
            [Power::switch_on, |power: &mut Power| power.switch_off(true), Power::cut, Power::switch_on]
        {
            order(&mut power);
            power.step(true);
            assert!(!power.is_on() && !power.is_ready());
        }
    }
}
