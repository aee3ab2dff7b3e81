//! Limit and home switches, worked by cams on the load.

use super::{PlantConfig, within};
use crate::inputs::{Input, Inputs, Latches};
use crate::units::Position;

/// The side of a cam on which the load is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Below,
    On,
    Above,
}

/// A range in which a switch is actuated. It lets go a hysteresis later than it takes.
#[derive(Clone, Copy, Debug)]
struct Cam {
    from: f64,
    to: f64,
    hysteresis: f64,
    side: Side,
}

impl Cam {
    /// A cam that is nowhere.
    const NONE: Self = Self { from: f64::INFINITY, to: f64::INFINITY, hysteresis: 0.0, side: Side::Below };

    fn new(from: f64, to: f64, hysteresis: f64) -> Self {
        if from <= to { Self { from, to, hysteresis, ..Self::NONE } } else { Self::NONE }
    }

    fn is_on(&self) -> bool {
        self.side == Side::On
    }

    /// The ends of the cam as the load finds them from where it is.
    fn ends(&self) -> (f64, f64) {
        let wider = if self.is_on() { self.hysteresis } else { 0.0 };
        (self.from - wider, self.to + wider)
    }

    /// The range in which nothing changes.
    fn window(&self) -> (f64, f64) {
        let (low, high) = self.ends();
        match self.side {
            Side::Below => (f64::NEG_INFINITY, low),
            Side::On => (low, high),
            Side::Above => (high, f64::INFINITY),
        }
    }

    /// Moves the load to `place`; the edge at which the switch changed last on the way.
    fn pass(&mut self, place: f64) -> Option<f64> {
        let (low, high) = self.ends();
        let now = if place < low {
            Side::Below
        } else if place > high {
            Side::Above
        } else {
            Side::On
        };
        let before = core::mem::replace(&mut self.side, now);
        match (before, now) {
            (Side::Below, Side::On) => Some(self.from),
            (Side::Above, Side::On) => Some(self.to),
            (Side::On | Side::Below, Side::Above) => Some(self.to + self.hysteresis),
            (Side::On | Side::Above, Side::Below) => Some(self.from - self.hysteresis),
            (Side::Below, Side::Below) | (Side::On, Side::On) | (Side::Above, Side::Above) => None,
        }
    }
}

/// The switches and the wires from them, and from the emergency stop button, to the drive.
#[derive(Clone, Debug)]
pub(super) struct Switches {
    /// No switch changes while the load is strictly within.
    window: (f64, f64),
    positive: Cam,
    negative: Cam,
    home: Cam,
    active_low: Inputs,
    stuck: Stuck,
}

/// Levels that wires keep whatever the switch says.
#[derive(Clone, Copy, Debug, Default)]
struct Stuck {
    positive_limit: Option<bool>,
    negative_limit: Option<bool>,
    home: Option<bool>,
    drive_fault: Option<bool>,
    emergency_stop: Option<bool>,
}

impl Switches {
    /// The switches with the load at `place`.
    pub(super) fn new(config: &PlantConfig, place: f64) -> Self {
        let hysteresis = within(config.hysteresis.0, 0.0, 1e9, 0.0);
        let width = config.limit_switch_width.map_or(f64::INFINITY, |width| within(width.0, 0.0, 1e15, 0.0));
        let cam = |from: f64, to: f64| Cam::new(from, to, hysteresis);
        let positive = config.positive_switch.map(|from| cam(from.0, from.0 + width));
        let negative = config.negative_switch.map(|to| cam(to.0 - width, to.0));
        let home = config.home_switch.map(|range| cam(range.min().0, range.max().0));
        let mut new = Self {
            window: (0.0, 0.0),
            positive: positive.unwrap_or(Cam::NONE),
            negative: negative.unwrap_or(Cam::NONE),
            home: home.unwrap_or(Cam::NONE),
            active_low: config.active_low,
            stuck: Stuck::default(),
        };
        new.change(place, 0.0, &mut Latches::default());
        new
    }

    /// Moves the load to `place`, the encoder showing `gap` more.
    pub(super) fn pass(&mut self, place: f64, gap: f64, latches: &mut Latches) {
        let (low, high) = self.window;
        if !(low < place && place < high) {
            self.change(place, gap, latches);
        }
    }

    /// The levels the drive sees.
    pub(super) fn levels(&self, drive_fault: bool) -> Inputs {
        let (wiring, stuck) = (&self.active_low, &self.stuck);
        Inputs {
            positive_limit: stuck.positive_limit.unwrap_or(self.positive.is_on() != wiring.positive_limit),
            negative_limit: stuck.negative_limit.unwrap_or(self.negative.is_on() != wiring.negative_limit),
            home: stuck.home.unwrap_or(self.home.is_on() != wiring.home),
            drive_fault: stuck.drive_fault.unwrap_or(drive_fault != wiring.drive_fault),
            emergency_stop: stuck.emergency_stop.unwrap_or(wiring.emergency_stop),
        }
    }

    /// Makes an input stick at a level, or lets it go; a level that changes by it is latched at `place`.
    pub(super) fn stick(
        &mut self,
        input: Input,
        level: Option<bool>,
        place: Position,
        latches: &mut Latches,
    ) {
        let before = self.levels(false);
        match input {
            Input::PositiveLimit => self.stuck.positive_limit = level,
            Input::NegativeLimit => self.stuck.negative_limit = level,
            Input::Home => self.stuck.home = level,
            Input::DriveFault => self.stuck.drive_fault = level,
            Input::EmergencyStop => self.stuck.emergency_stop = level,
        }
        let now = self.levels(false);
        latch(&mut latches.positive_limit, before.positive_limit != now.positive_limit, place);
        latch(&mut latches.negative_limit, before.negative_limit != now.negative_limit, place);
        latch(&mut latches.home, before.home != now.home, place);
    }

    #[cold]
    fn change(&mut self, place: f64, gap: f64, latches: &mut Latches) {
        let update = |cam: &mut Cam, stuck: Option<bool>, latch: &mut Option<Position>| {
            if let (Some(edge), None) = (cam.pass(place), stuck) {
                *latch = Some(Position(edge + gap));
            }
            cam.window()
        };
        let positive = update(&mut self.positive, self.stuck.positive_limit, &mut latches.positive_limit);
        let negative = update(&mut self.negative, self.stuck.negative_limit, &mut latches.negative_limit);
        let home = update(&mut self.home, self.stuck.home, &mut latches.home);
        self.window = (positive.0.max(negative.0).max(home.0), positive.1.min(negative.1).min(home.1));
    }
}

fn latch(latch: &mut Option<Position>, has_changed: bool, place: Position) {
    if has_changed {
        *latch = Some(place);
    }
}
