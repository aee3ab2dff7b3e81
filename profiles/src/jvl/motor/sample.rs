//! What a motor works with in one sample: its registers in their units, its axis, its inputs.

use axis::{Acceleration, Axis, Position, Profile, Velocity};

use super::groups::Relative;
use super::inputs;
use super::mode::Mode;
use crate::Role;
use crate::jvl::inputs as module_inputs;
use crate::jvl::units::{Family, MacUnits};
use crate::vendor::Scope;

/// A motor's surroundings at one moment.
pub(in crate::jvl) struct Sample<'s, 'a> {
    pub(super) scope: &'s mut Scope<'a>,
    pub(super) units: MacUnits,
    /// ANINP.
    pub(super) analog: i32,
    /// The analogue input, taken for a digital one.
    pub(super) is_analog_high: bool,
    /// What position registers are.
    pub(super) relative: Relative,
}

/// Bits of CNTRL_BITS.
pub(super) struct ControlBits {
    /// Position registers are distances for P_SOLL.
    pub(super) relative_p_soll: i32,
    /// Position registers are distances for the generator.
    pub(super) relative_p_fnc: i32,
    /// Makes P_NEW the present place now.
    pub(super) sync_now: i32,
    /// Makes it a distance instead.
    pub(super) sync_relative: i32,
}

impl ControlBits {
    pub(super) const fn of(family: Family) -> Self {
        match family {
            // The small motors keep the first two in ERR_STAT.
            Family::Small => {
                Self { relative_p_soll: 0, relative_p_fnc: 0, sync_now: 1 << 10, sync_relative: 1 << 12 }
            }
            Family::Large => Self {
                relative_p_soll: 1 << 3,
                relative_p_fnc: 1 << 4,
                sync_now: 1 << 6,
                sync_relative: 1 << 8,
            },
        }
    }
}

impl<'s, 'a> Sample<'s, 'a> {
    pub(super) fn new(family: Family, small: Relative, scope: &'s mut Scope<'a>) -> Self {
        let units = MacUnits::new(family, scope.register(Role::Outloopdiv));
        let analog = MacUnits::analog(scope.analog_input, scope.register(Role::AninpOffset));
        let is_home = scope.axis.status().switches.home;
        let is_analog_high = inputs::is_high(scope.analog_input, is_home);
        let relative = match family {
            Family::Small => small,
            Family::Large => relative_of(scope.register(Role::CntrlBits)),
        };
        Self { scope, units, analog, is_analog_high, relative }
    }

    pub(super) fn register(&self, role: Role) -> i32 {
        self.scope.register(role)
    }

    pub(super) fn set(&mut self, role: Role, value: i32) {
        self.scope.show_register(role, value);
    }

    pub(super) fn velocity(&self, role: Role) -> Velocity {
        self.units.velocity(self.register(role))
    }

    pub(super) fn acceleration(&self, role: Role) -> Acceleration {
        self.units.acceleration(self.register(role))
    }

    /// V_SOLL without its sign, and A_SOLL both ways.
    pub(super) fn profile(&self) -> Profile {
        let ramp = self.acceleration(Role::ASoll);
        Profile {
            velocity: self.velocity(Role::VSoll).abs(),
            acceleration: ramp,
            deceleration: ramp,
            jerk: None,
        }
    }

    pub(super) fn axis(&self) -> &Axis {
        self.scope.axis
    }

    pub(super) fn axis_mut(&mut self) -> &mut Axis {
        self.scope.axis
    }

    /// Time of one raster step, in seconds.
    pub(super) fn raster(&self) -> f64 {
        self.axis().period().seconds()
    }

    pub(super) fn external_encoder(&self) -> Velocity {
        self.scope.external_encoder
    }

    /// MAC00_1.
    pub(super) fn inputs(&self) -> u32 {
        let levels = &self.axis().status().inputs;
        let module = module_inputs::active(self.scope.parameters(), levels);
        inputs::word(module, self.is_analog_high, self.register(Role::InputLevels))
    }

    /// The single-turn place at which the zero point is.
    pub(super) fn show_index_offset(&mut self, mark: Position) {
        let offset = self.scope.single_turn(mark);
        self.set(Role::IndexOffset, offset);
    }

    /// The zero search of HOME_MODE at power-on, else the start mode.
    pub(super) fn first_mode(&self) -> Mode {
        let home = self.register(Role::Homemode);
        let search = Mode::from_number(home & 0xFF).filter(|mode| mode.is_search());
        let is_kept_passive = home >> 8 & 0xFF == 0xFF;
        let start = Mode::from_number(self.register(Role::Startmode)).filter(|_| !is_kept_passive);
        search.or(start).unwrap_or_default()
    }

    /// The zero search that a command starts: bits 15 to 8 of HOME_MODE, else bits 7 to 0.
    pub(super) fn commanded_search(&self) -> Option<Mode> {
        let home = self.register(Role::Homemode);
        let modes = [home >> 8 & 0xFF, home & 0xFF].map(Mode::from_number);
        modes.into_iter().flatten().find(|mode| mode.is_search())
    }
}

/// What CNTRL_BITS of a large motor makes of position registers.
fn relative_of(bits: i32) -> Relative {
    let control = ControlBits::of(Family::Large);
    if bits & control.relative_p_soll != 0 {
        Relative::PSoll
    } else if bits & control.relative_p_fnc != 0 {
        Relative::PFnc
    } else {
        Relative::No
    }
}
