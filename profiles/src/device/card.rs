//! A card with several axes of MACCON's MAC4: what one axis does to the others.

use axis::Motion;
use od::{Address, Dictionary, Instant};

use super::Device;
use super::unit::Unit;
use crate::mac4::{Answer, Card, Controller, Instruction, Message, OverallStatus};

impl Device {
    /// Takes what was written for a sign of life: whatever it is, the host lives (MAC4 User Manual, section 4.7).
    pub(super) fn confirm(&mut self) {
        if self.card.is_some() {
            self.units.iter_mut().for_each(|unit| unit.axis.confirm());
        }
    }

    /// Acts on what was written for the card, and on what an axis has said that concerns all; whether it did.
    pub(super) fn act_card(&mut self, now: Instant) -> bool {
        let Self { card: Some(card), dictionary, units, .. } = self else { return false };
        let mut has_acted = false;
        for axis in card.take_stops(dictionary) {
            if let Some(unit) = units.get_mut(axis) {
                unit.with_controller(dictionary, now, Controller::stop);
                has_acted = true;
            }
        }
        if let Some(message) = card.take_message(dictionary) {
            handle(message, card, dictionary, units, now);
            has_acted = true;
        }
        share(card, dictionary, units, now);
        has_acted
    }

    /// Looks at what the axes have said in their raster steps.
    pub(super) fn watch_card(&mut self, now: Instant) {
        if let Self { card: Some(card), units, dictionary, .. } = self {
            share(card, dictionary, units, now);
        }
    }

    /// Shows the overall status.
    pub(super) fn show_card(&mut self) {
        let Self { card: Some(card), units, dictionary, .. } = self else { return };
        let live = live(units);
        card.show(live, units.iter().filter_map(Unit::record), dictionary);
    }

    pub(super) fn note_card(&mut self, address: Address) {
        if let Some(card) = &mut self.card {
            card.note(address);
        }
    }
}

/// Acts on a message and responds to it.
fn handle(message: Message, card: &mut Card, dictionary: &mut Dictionary, units: &mut [Unit], now: Instant) {
    let axis = usize::from(message.axis);
    let last = usize::from(card.last_axis(&message, axis < units.len()));
    let answer = match units.get_mut(axis) {
        None => card.refuse_axis(),
        Some(unit) => {
            unit.with_controller(dictionary, now, |controller, scope| {
                controller.interrupt(Instruction::WIRQ1, scope.dictionary);
            });
            let answer = message.deliver(dictionary);
            match answer {
                Answer::Value(_) => {}
                Answer::Done => {
                    while let Some(slot) = dictionary.take_written() {
                        unit.note(slot, crate::Binding::Mac4Instruction);
                    }
                    unit.act(dictionary, now);
                }
                Answer::Refused(refused) => unit.with_controller(dictionary, now, |controller, _| {
                    controller.report(refused.user_bit());
                }),
            }
            answer
        }
    };
    share(card, dictionary, units, now);
    if let Some(unit) = units.get_mut(last) {
        unit.with_controller(dictionary, now, |controller, scope| {
            controller.interrupt(Instruction::WIRQ2, scope.dictionary);
        });
    }
    card.show(live(units), units.iter().filter_map(Unit::record), dictionary);
    units.iter_mut().for_each(|unit| unit.publish(dictionary));
    card.respond(&message, answer, dictionary);
}

/// Does to all axes what one has said.
fn share(card: &mut Card, dictionary: &mut Dictionary, units: &mut [Unit], now: Instant) {
    for axis in 0..units.len() {
        let outcome = units.get_mut(axis).map(Unit::take_outcome).unwrap_or_default();
        if let Some(fault) = outcome.fault {
            card.report(shown(fault));
            raise(fault, units);
        }
        if outcome.resets {
            *card = Card::default();
            for unit in units.iter_mut() {
                unit.with_controller(dictionary, now, Controller::reset);
            }
        }
        if outcome.acknowledges {
            card.acknowledge();
            for unit in units.iter_mut().filter(|unit| concerns_all(unit)) {
                unit.with_controller(dictionary, now, Controller::clear_fault);
            }
        }
        if outcome.shares {
            copy(axis, dictionary, units);
        }
    }
}

/// The bit of a fault that concerns all axes.
fn shown(fault: axis::Fault) -> OverallStatus {
    match fault {
        axis::Fault::EmergencyStop => OverallStatus::H_STOP,
        axis::Fault::Supervision => OverallStatus::WATCH_F,
        axis::Fault::FollowingError
        | axis::Fault::Drive(_)
        | axis::Fault::Lost
        | axis::Fault::DriveSignal => OverallStatus::empty(),
    }
}

/// Lets every axis that may move have a fault that concerns all (sections 6.3.5 and 6.3.6).
fn raise(fault: axis::Fault, units: &mut [Unit]) {
    for unit in units.iter_mut().filter(|unit| !unit.axis.is_quiet()) {
        unit.axis.raise(fault);
    }
}

fn concerns_all(unit: &Unit) -> bool {
    match unit.axis.status().fault {
        Some(axis::Fault::EmergencyStop | axis::Fault::Supervision) => true,
        Some(
            axis::Fault::FollowingError
            | axis::Fault::Drive(_)
            | axis::Fault::Lost
            | axis::Fault::DriveSignal,
        )
        | None => false,
    }
}

/// Gives the parameters that are valid for all axes to the others, and the time of the watchdog to all.
fn copy(from: usize, dictionary: &mut Dictionary, units: &mut [Unit]) {
    for instruction in [Instruction::WWD, Instruction::WIRQ5] {
        let value = units.get(from).and_then(Unit::record).map(|record| record.get(dictionary, instruction));
        let Some(value) = value else { continue };
        units.iter().filter_map(Unit::record).for_each(|record| record.show(dictionary, instruction, value));
    }
    units.iter_mut().for_each(|unit| unit.watch_host(dictionary));
}

/// What the overall status shows of the present: emergency stop, signals FC0-2, power.
///
/// FC0 and FC1 are the general inputs of axis 1, FC2 is the first one of axis 2.
fn live(units: &[Unit]) -> OverallStatus {
    let switches = |axis: usize| units.get(axis).map(|unit| unit.axis.status().switches).unwrap_or_default();
    let mut bits = OverallStatus::empty();
    let is_stopped = |unit: &Unit| unit.axis.status().switches.emergency_stop;
    bits.set(OverallStatus::H_STOP, units.iter().any(is_stopped));
    bits.set(OverallStatus::FCODE0, switches(0).probe_1);
    bits.set(OverallStatus::FCODE1, switches(0).probe_2);
    bits.set(OverallStatus::FCODE2, switches(1).probe_1);
    bits.set(OverallStatus::SERV_EN, units.iter().any(|unit| unit.axis.status().motion != Motion::Off));
    bits
}
