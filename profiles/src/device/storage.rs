//! What a device wants to be stored by itself, without a node that was told to.

use od::{Instant, Saved};

use super::unit::Unit;
use super::{Device, DeviceEvent};
use crate::Space;
use crate::vendor::Wish;

/// What is to become of power-on values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoreOrder {
    /// Of which registers.
    pub space: Space,
    /// What they are to be.
    pub keep: Keep,
}

/// What power-on values are to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// The present values.
    Present,
    /// The defaults.
    Defaults,
}

/// An order under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Storing {
    /// Position of the unit whose motor then starts anew, if it does.
    restarts: Option<usize>,
}

impl Device {
    /// What the device is to have stored by `order`, everything else as it is stored.
    #[must_use]
    pub fn to_store(&self, order: StoreOrder) -> Saved {
        let is_meant = |index| self.profile.has_registers(order.space, index);
        match order.keep {
            Keep::Present => self.dictionary.save(is_meant),
            Keep::Defaults => self.dictionary.forget(is_meant),
        }
    }

    /// Ends the last [`DeviceEvent::Store`]: it is done, and the dictionary knows what is stored, or it failed and all
    /// is as before.
    pub fn stored(&mut self, now: Instant, is_done: bool) {
        let Some(Storing { restarts }) = self.storing.take() else { return };
        if let Some(number) = restarts.filter(|_| is_done) {
            self.restart_motor(number, now);
        }
        self.grant_wishes(now);
        self.publish();
    }

    /// Does what the vendors' vocabularies want, as long as nothing is being stored.
    pub(super) fn grant_wishes(&mut self, now: Instant) {
        for number in 0..self.units.len() {
            while self.storing.is_none()
                && let Some(wish) = self.units.get_mut(number).and_then(Unit::poll_wish)
            {
                match wish {
                    Wish::Reset => self.restart_motor(number, now),
                    Wish::ResetModule => self.restart_module(number, now),
                    Wish::Restore(space) => self.store(StoreOrder { space, keep: Keep::Defaults }, None),
                    Wish::Store { space, then_reset } => {
                        let restarts = then_reset.then_some(number);
                        self.store(StoreOrder { space, keep: Keep::Present }, restarts);
                    }
                }
            }
        }
    }

    fn store(&mut self, order: StoreOrder, restarts: Option<usize>) {
        self.storing = Some(Storing { restarts });
        self.events.push_back(DeviceEvent::Store(order));
    }

    /// The motor starts anew with the registers it has kept, as if its supply had been off.
    fn restart_motor(&mut self, number: usize, now: Instant) {
        let profile = &self.profile;
        self.dictionary.restart(|index| profile.has_registers(Space::Motor, index));
        self.profile.registers.refresh(&mut self.dictionary);
        if let Some(unit) = self.units.get_mut(number) {
            unit.restart_motor(&mut self.dictionary, now);
        }
    }

    /// The module starts anew with the registers it has kept; the motor runs on.
    fn restart_module(&mut self, number: usize, now: Instant) {
        let profile = &self.profile;
        self.dictionary.restart(|index| profile.has_registers(Space::Module, index));
        self.profile.registers.refresh(&mut self.dictionary);
        if let Some(unit) = self.units.get_mut(number) {
            unit.restart_module(&mut self.dictionary, now);
        }
    }
}
