//! What a unit shows of itself.

use od::Dictionary;

use super::Unit;
use crate::Binding;
use crate::cia402::units;
use crate::cia402::{RpmUnits, View, inputs_outputs};
use crate::device::AxisStatus;
use crate::slots::Parameters;

impl Unit {
    /// The axis for display.
    pub(in crate::device) fn status(&self, dictionary: &Dictionary) -> AxisStatus {
        let view = self.view(dictionary);
        AxisStatus {
            state: self.drive.state(),
            mode: self.drive.mode(),
            statusword: self.drive.statusword(view),
            position: self.axis.status().actual.position,
            velocity: self.axis.status().actual.velocity,
            fault: self.drive.fault(),
            outputs: self.outputs(view),
        }
    }

    /// Shows the state of the axis in the dictionary.
    pub(in crate::device) fn publish(&mut self, dictionary: &mut Dictionary) {
        let status = self.axis.status();
        let view = self.view(dictionary);
        let statusword = self.drive.statusword(view);
        let rpm = RpmUnits::of(view.parameters, &self.motor);
        if !dictionary.has_written() {
            // Without the bits that the drive has taken back.
            self.slots.show(dictionary, Binding::Controlword, i64::from(self.drive.controlword().bits()));
        }
        let shown = |position| self.units.shown_position(position);
        self.touch_probe.show(dictionary, &self.slots, shown);
        let velocity = self.units.shown_velocity(status.actual.velocity);
        let mut show = |binding, value| self.slots.show(dictionary, binding, value);
        show(Binding::Statusword, i64::from(statusword.bits()));
        show(Binding::ModesOfOperationDisplay, self.drive.mode() as i64);
        show(Binding::ErrorCode, self.drive.fault().map_or(0, |f| i64::from(f.code)));
        show(Binding::VlVelocityDemand, rpm.shown(status.demand.velocity));
        show(Binding::VlVelocityActual, rpm.shown(status.actual.velocity));
        show(Binding::PositionDemandInternal, units::counter(status.demand.position));
        show(Binding::PositionDemand, shown(status.demand.position));
        show(Binding::PositionActual, shown(status.actual.position));
        show(Binding::FollowingErrorActual, self.units.shown_way(status.following_error));
        show(Binding::VelocityDemand, self.units.shown_velocity(status.demand.velocity));
        show(Binding::VelocitySensorActual, velocity);
        show(Binding::VelocityActual, velocity);
        show(Binding::TorqueDemand, self.units.shown_torque(self.axis.torque_demand()));
        show(Binding::InterpolationBufferPosition, self.drive.waiting_records() as i64);
        show(Binding::TorqueActual, self.units.shown_torque(status.actual.torque));
        show(Binding::DigitalInputs, i64::from(inputs_outputs::digital_inputs(status.switches)));
        let (vendor, mut scope) = self.scope(dictionary);
        vendor.show(&mut scope);
    }

    /// What the digital outputs give.
    fn outputs(&self, view: View<'_>) -> u32 {
        let standard = inputs_outputs::digital_outputs(view.parameters);
        self.vendor.outputs(&self.drive, view, standard)
    }

    fn view<'a>(&'a self, dictionary: &'a Dictionary) -> View<'a> {
        let parameters = Parameters { dictionary, slots: &self.slots, units: &self.units };
        View { parameters, axis: &self.axis }
    }
}
