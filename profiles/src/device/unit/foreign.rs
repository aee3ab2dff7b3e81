//! An axis that the vendor's vocabulary alone moves, rather than CiA 402.

use od::{Dictionary, Instant};

use super::Unit;
use crate::mac4;
use crate::mac4::{Controller, Instruction, Outcome, Record};
use crate::vendor::{Mover, Scope, Vendor};

impl Unit {
    /// Follows who moves the axis: CiA 402 puts its limits on it again when another one that had it alone gives it up.
    pub(super) fn hand_over(&mut self, dictionary: &mut Dictionary) {
        let before = core::mem::replace(&mut self.mover, self.vendor.mover());
        if before == Mover::Foreign && self.mover != Mover::Foreign {
            self.axis.set_target_window(None);
            let (drive, _, mut context) = self.split(dictionary);
            drive.handle_parameters(&mut context);
        }
    }

    /// Lets the controller of a MAC4 axis act, if this is one.
    pub(in crate::device) fn with_controller(
        &mut self,
        dictionary: &mut Dictionary,
        now: Instant,
        act: impl FnOnce(&mut Controller, &mut Scope<'_>),
    ) {
        if let (Vendor::Mac4(controller), mut scope) = self.scope(dictionary) {
            act(controller, &mut scope);
            self.hand_over(dictionary);
            self.wake(now);
        }
    }

    /// What the controller has said that concerns more than its axis.
    pub(in crate::device) fn take_outcome(&mut self) -> Outcome {
        match &mut self.vendor {
            Vendor::None | Vendor::Jvl(_) => Outcome::default(),
            Vendor::Mac4(controller) => controller.take_outcome(),
        }
    }

    /// The instructions of a MAC4 axis.
    pub(in crate::device) fn record(&self) -> Option<&Record> {
        match &self.vendor {
            Vendor::None | Vendor::Jvl(_) => None,
            Vendor::Mac4(controller) => Some(controller.record()),
        }
    }

    /// Expects signs of life of the host as `<wd>` says.
    pub(in crate::device) fn watch_host(&mut self, dictionary: &Dictionary) {
        let millis = self.record().map_or(0, |record| record.get(dictionary, Instruction::WWD));
        let steps = mac4::periods(millis, self.axis.period());
        self.axis.set_supervision(core::num::NonZeroU32::new(steps));
    }
}
