//! Limit and home switches, worked by cams on the load.

use super::{PlantConfig, within};
use crate::inputs::{Edges, Input, Inputs, Latches};
use crate::limits::PositionRange;
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

    /// Moves the load to `place`; where the switch was actuated and where it let go on the way.
    fn pass(&mut self, place: f64) -> (Option<f64>, Option<f64>) {
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
            (Side::Below, Side::On) => (Some(self.from), None),
            (Side::Above, Side::On) => (Some(self.to), None),
            (Side::On, Side::Above) => (None, Some(self.to + self.hysteresis)),
            (Side::On, Side::Below) => (None, Some(self.from - self.hysteresis)),
            (Side::Below, Side::Above) => (Some(self.from), Some(self.to + self.hysteresis)),
            (Side::Above, Side::Below) => (Some(self.to), Some(self.from - self.hysteresis)),
            (Side::Below, Side::Below) | (Side::On, Side::On) | (Side::Above, Side::Above) => (None, None),
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
    probe_1: Cam,
    probe_2: Cam,
    hysteresis: f64,
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
    probe_1: Option<bool>,
    probe_2: Option<bool>,
}

impl Switches {
    /// The switches with the load at `place`.
    pub(super) fn new(config: &PlantConfig, place: f64) -> Self {
        let hysteresis = within(config.hysteresis.0, 0.0, 1e9, 0.0);
        let width = config.limit_switch_width.map_or(f64::INFINITY, |width| within(width.0, 0.0, 1e15, 0.0));
        let cam = |from: f64, to: f64| Cam::new(from, to, hysteresis);
        let positive = config.positive_switch.map(|from| cam(from.0, from.0 + width));
        let negative = config.negative_switch.map(|to| cam(to.0 - width, to.0));
        let range = |range: Option<PositionRange>| range.map(|range| cam(range.min().0, range.max().0));
        let [probe_1, probe_2] = config.probe_switches.map(|probe| range(probe).unwrap_or(Cam::NONE));
        let mut new = Self {
            window: (0.0, 0.0),
            positive: positive.unwrap_or(Cam::NONE),
            negative: negative.unwrap_or(Cam::NONE),
            home: range(config.home_switch).unwrap_or(Cam::NONE),
            probe_1,
            probe_2,
            hysteresis,
            active_low: config.active_low,
            stuck: Stuck::default(),
        };
        new.change(place, 0.0, &mut Latches::default());
        new
    }

    /// Puts the cam of a switch somewhere else, with the load at `place`; other inputs have none.
    pub(super) fn set_cam(&mut self, input: Input, range: Option<PositionRange>, place: f64) {
        let cam = match input {
            Input::PositiveLimit => &mut self.positive,
            Input::NegativeLimit => &mut self.negative,
            Input::Home => &mut self.home,
            Input::Probe1 => &mut self.probe_1,
            Input::Probe2 => &mut self.probe_2,
            Input::DriveFault | Input::EmergencyStop => return,
        };
        *cam = range.map_or(Cam::NONE, |range| Cam::new(range.min().0, range.max().0, self.hysteresis));
        self.change(place, 0.0, &mut Latches::default());
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
            probe_1: stuck.probe_1.unwrap_or(self.probe_1.is_on() != wiring.probe_1),
            probe_2: stuck.probe_2.unwrap_or(self.probe_2.is_on() != wiring.probe_2),
        }
    }

    /// The inputs that stick, and the levels they keep.
    pub(super) fn stuck(&self) -> impl Iterator<Item = (Input, bool)> {
        let Stuck { positive_limit, negative_limit, home, drive_fault, emergency_stop, probe_1, probe_2 } =
            self.stuck;
        let all = [
            (Input::PositiveLimit, positive_limit),
            (Input::NegativeLimit, negative_limit),
            (Input::Home, home),
            (Input::DriveFault, drive_fault),
            (Input::EmergencyStop, emergency_stop),
            (Input::Probe1, probe_1),
            (Input::Probe2, probe_2),
        ];
        all.into_iter().filter_map(|(input, level)| Some((input, level?)))
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
            Input::Probe1 => self.stuck.probe_1 = level,
            Input::Probe2 => self.stuck.probe_2 = level,
        }
        let now = self.levels(false);
        latch(&mut latches.positive_limit, before.positive_limit != now.positive_limit, place);
        latch(&mut latches.negative_limit, before.negative_limit != now.negative_limit, place);
        latch(&mut latches.home, before.home != now.home, place);
        latches.probe_1 = edges(before.probe_1, now.probe_1, place).after(latches.probe_1);
        latches.probe_2 = edges(before.probe_2, now.probe_2, place).after(latches.probe_2);
    }

    #[cold]
    fn change(&mut self, place: f64, gap: f64, latches: &mut Latches) {
        let update = |cam: &mut Cam, stuck: Option<bool>, latch: &mut Option<Position>| {
            let (on, off) = cam.pass(place);
            if let (Some(edge), None) = (off.or(on), stuck) {
                *latch = Some(Position(edge + gap));
            }
            cam.window()
        };
        let positive = update(&mut self.positive, self.stuck.positive_limit, &mut latches.positive_limit);
        let negative = update(&mut self.negative, self.stuck.negative_limit, &mut latches.negative_limit);
        let home = update(&mut self.home, self.stuck.home, &mut latches.home);
        let wiring = self.active_low;
        let probe = |cam: &mut Cam, stuck: Option<bool>, is_low: bool, latch: &mut Edges| {
            let (on, off) = cam.pass(place);
            let at = |edge: Option<f64>| edge.filter(|_| stuck.is_none()).map(|edge| Position(edge + gap));
            let passed = Edges { rising: at(on), falling: at(off) };
            *latch = if is_low { passed.inverted() } else { passed }.after(*latch);
            cam.window()
        };
        let probe_1 = probe(&mut self.probe_1, self.stuck.probe_1, wiring.probe_1, &mut latches.probe_1);
        let probe_2 = probe(&mut self.probe_2, self.stuck.probe_2, wiring.probe_2, &mut latches.probe_2);
        let windows = [negative, home, probe_1, probe_2];
        self.window = windows.into_iter().fold(positive, |(low, high), w| (low.max(w.0), high.min(w.1)));
    }
}

/// The edge between two levels at `place`.
fn edges(before: bool, now: bool, place: Position) -> Edges {
    Edges { rising: (now && !before).then_some(place), falling: (before && !now).then_some(place) }
}

fn latch(latch: &mut Option<Position>, has_changed: bool, place: Position) {
    if has_changed {
        *latch = Some(place);
    }
}
