//! The machine to be homed, and where it truly is.

use axis::{PlantConfig, Position, PositionRange};

use crate::bench::Bench;

pub(crate) const REVOLUTION: i64 = 4096;
pub(crate) const RAMP: i64 = 409_600;

/// Where everything is, in counts of the encoder at power-on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Machine {
    /// Upper edge of the negative limit switch.
    pub(crate) negative: Option<i64>,
    /// Lower edge of the positive limit switch.
    pub(crate) positive: Option<i64>,
    /// The home switch.
    pub(crate) home: Option<(i64, i64)>,
    /// An index pulse; the others are whole revolutions away.
    pub(crate) index: i64,
    pub(crate) start: i64,
    /// How much further a switch lets go.
    pub(crate) hysteresis: i64,
}

impl Machine {
    /// A home switch in the middle of the travel.
    pub(crate) const MIDDLE: Self = Self {
        negative: Some(-6_000),
        positive: Some(10_000),
        home: Some((3_000, 4_200)),
        index: 1_000,
        start: 0,
        hysteresis: 0,
    };
    /// Room behind a limit switch before the hard stop.
    pub(crate) const ROOM: i64 = 1_500;

    pub(crate) fn at(self, start: i64) -> Self {
        Self { start, ..self }
    }

    /// The machine with its drive operating in homing mode, the speeds moderate.
    pub(crate) fn enabled(self, profile: &str) -> Bench {
        let mut bench = Bench::with_plant(profile, |plant| self.arrange(plant));
        bench.batch(&[(0x6099, 1, 8_192), (0x6099, 2, 1_024), (0x609A, 0, RAMP)]).unwrap();
        bench.enable(6);
        bench
    }

    fn arrange(&self, plant: &mut PlantConfig) {
        let place = |at: i64| Position(at as f64);
        plant.negative_switch = self.negative.map(place);
        plant.positive_switch = self.positive.map(place);
        plant.home_switch = self.home.and_then(|(from, to)| PositionRange::new(place(from), place(to)));
        plant.index = place(self.index);
        plant.start = place(self.start);
        plant.hysteresis = place(self.hysteresis);
        if let (Some(negative), Some(positive)) = (self.negative, self.positive) {
            plant.stops = PositionRange::new(place(negative - Self::ROOM), place(positive + Self::ROOM));
        }
    }

    /// The first index pulse below a place.
    pub(crate) fn index_below(&self, place: i64) -> i64 {
        place - 1 - (place - 1 - self.index).rem_euclid(REVOLUTION)
    }

    /// The first index pulse above a place.
    pub(crate) fn index_above(&self, place: i64) -> i64 {
        place + 1 + (self.index - place - 1).rem_euclid(REVOLUTION)
    }
}

/// Bits 13, 12 and 10 of the statusword: homing error, homing attained, target reached.
pub(crate) fn bits(bench: &Bench) -> [bool; 3] {
    [13, 12, 10].map(|bit| bench.is_set(bit))
}

pub(crate) const RUNNING: [bool; 3] = [false, false, false];
pub(crate) const WAITING: [bool; 3] = [false, false, true];
pub(crate) const ATTAINED: [bool; 3] = [false, true, false];
pub(crate) const COMPLETED: [bool; 3] = [false, true, true];
pub(crate) const FAILING: [bool; 3] = [true, false, false];
pub(crate) const FAILED: [bool; 3] = [true, false, true];

/// Where the motor truly is, in counts since power-on.
pub(crate) fn place(bench: &mut Bench) -> i64 {
    bench.device.plant(0, bench.now).unwrap().encoder().0 as i64
}

pub(crate) fn start(bench: &mut Bench, method: i64) {
    bench.set(0x6098, method);
    bench.control(0x0F);
    bench.control(0x1F);
}

/// Homes by `method`; the bits at the end, at standstill.
pub(crate) fn home(bench: &mut Bench, method: i64) -> [bool; 3] {
    start(bench, method);
    for _ in 0..60_000 {
        bench.run(1);
        let now = bits(bench);
        if now == COMPLETED || now == FAILED {
            bench.run(50);
            return now;
        }
    }
    panic!("homing by {method} never ends: {:?} at {}", bits(bench), place(bench));
}
