//! Who commands an axis: every order there is, at random, the same on every run.

use std::num::NonZeroU32;

use axis::{
    Acceleration, Axis, Base, BehindLimit, DriveFault, DriveState, Finish, Guard, Input, Jerk, Mark, Order,
    Period, PlantFault, Position, Profile, Seek, Switch, Torque, Velocity, Voltage,
};

use super::Size;

/// Commands one axis.
#[derive(Debug)]
pub(crate) struct Operator {
    random: Random,
    size: Size,
    /// Steps of a second.
    second: u32,
    /// Steps until the next command.
    wait: u32,
    /// Set-points of a master still to come.
    streamed: u32,
    broken: Option<PlantFault>,
}

/// Numbers that look random: SplitMix64 (Steele, Lea, Flood 2014).
#[derive(Debug)]
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, end: u32) -> u32 {
        (self.next() % u64::from(end.max(1))) as u32
    }

    /// From 0 up to 1.
    fn share(&mut self) -> f64 {
        f64::from(self.below(1 << 30)) / f64::from(1 << 30)
    }

    /// From -1 up to 1.
    fn signed(&mut self) -> f64 {
        2.0 * self.share() - 1.0
    }

    fn one_of<T: Copy, const N: usize>(&mut self, choices: [T; N]) -> T {
        choices[self.below(N as u32) as usize]
    }
}

impl Operator {
    pub(crate) fn new(seed: u64, size: Size, period: Period) -> Self {
        let second = (1_000_000_000 / period.nanos()) as u32;
        Self { random: Random(seed), size, second, wait: 0, streamed: 0, broken: None }
    }

    /// Does what is to be done before the next step.
    pub(crate) fn command(&mut self, axis: &mut Axis) {
        if let Some(left) = self.wait.checked_sub(1) {
            self.wait = left;
        } else if axis.status().drive != DriveState::Enabled {
            self.wait = self.second / 4;
            self.revive(axis);
        } else if let Some(left) = self.streamed.checked_sub(1) {
            self.streamed = left;
            self.stream(axis);
        } else {
            self.wait = self.random.below(2 * self.second);
            self.act(axis);
        }
    }

    /// Repairs what is broken and switches on.
    fn revive(&mut self, axis: &mut Axis) {
        if let (Some(fault), Some(plant)) = (self.broken.take(), axis.plant()) {
            plant.clear(fault);
        }
        axis.reset_fault();
        axis.power_on();
    }

    fn act(&mut self, axis: &mut Axis) {
        match self.random.below(100) {
            0..64 => {
                let order = self.order(axis);
                axis.order(order);
            }
            64..72 => self.streamed = 100,
            72..84 => self.queue(axis),
            84..88 => axis.set_position(Position((self.random.signed() * self.size.way).floor())),
            88..93 => self.change_limits(axis),
            93..96 => self.break_something(axis),
            96..98 => axis.power_off(),
            _ => axis.cut_power(),
        }
    }

    /// A set-point of a master, a few steps from now.
    fn stream(&mut self, axis: &mut Axis) {
        let over = NonZeroU32::new(1 + self.random.below(4)).unwrap();
        let reach = self.size.velocity * f64::from(over.get()) / f64::from(self.second);
        self.wait = over.get() - 1;
        let order = if self.random.below(5) == 0 {
            Order::TrackVelocity { target: Velocity(self.random.signed() * self.size.velocity), over }
        } else {
            let place = axis.status().demand.position.0 + self.random.share() * reach;
            Order::TrackPosition { target: Position(place), over }
        };
        axis.order(order);
    }

    /// Some orders, one after the other.
    fn queue(&mut self, axis: &mut Axis) {
        for _ in 0..self.random.below(6) {
            let order = self.order(axis);
            // A full queue is a case, too.
            let _ = axis.then(order);
        }
    }

    fn order(&mut self, axis: &Axis) -> Order {
        let (place, profile) = (self.place(), self.profile());
        match self.random.below(20) {
            0..8 => Order::MoveTo(place, profile),
            8..11 => {
                let from = self.random.one_of([Base::Target, Base::Demand, Base::Actual]);
                Order::MoveBy { distance: Position(place.0 / 4.0), from, profile }
            }
            11..14 => Order::RunAt(Velocity(self.random.signed() * self.size.velocity), profile),
            14 => Order::Stop(profile.deceleration),
            15 => Order::Brake,
            16 => Order::Push {
                torque: Torque(self.random.signed() * 300.0),
                slope: Torque(self.random.share() * 3000.0),
            },
            17 => Order::Output(self.random.signed() * 0.05),
            18 if axis.status().limited => Order::MoveTo(Position(0.0), profile),
            _ => self.search(),
        }
    }

    fn search(&mut self) -> Order {
        let switch = self.random.one_of([Switch::Home, Switch::PositiveLimit, Switch::NegativeLimit]);
        let mark = self.random.one_of([
            Mark::Switch { switch, actuated: true },
            Mark::Switch { switch: Switch::Home, actuated: false },
            Mark::Index,
            Mark::Torque { limit: Torque(200.0), steps: NonZeroU32::MIN },
        ]);
        let ramp = Acceleration(self.random.share() * self.size.acceleration);
        Order::Seek(Seek {
            mark,
            velocity: Velocity(self.random.signed() * self.size.velocity / 4.0),
            acceleration: ramp,
            deceleration: ramp,
            finish: self.random.one_of([Finish::Ramp, Finish::Abrupt, Finish::Return]),
        })
    }

    fn profile(&mut self) -> Profile {
        let Size { velocity, acceleration, jerk, .. } = self.size;
        Profile {
            velocity: Velocity(velocity * (0.02 + self.random.share())),
            acceleration: Acceleration(acceleration * self.random.share()),
            deceleration: Acceleration(acceleration * self.random.share()),
            jerk: (self.random.below(3) == 0).then_some(Jerk(jerk * (0.01 + self.random.share()))),
        }
    }

    fn place(&mut self) -> Position {
        Position((self.random.signed() * self.size.way).floor())
    }

    fn change_limits(&mut self, axis: &mut Axis) {
        let behind_limit = self.random.one_of([BehindLimit::Open, BehindLimit::Closed]);
        axis.set_guard(Guard { behind_limit, ..*axis.guard() });
        let mut limits = *axis.limits();
        limits.velocity = Velocity(self.size.velocity * (0.5 + self.random.share()));
        limits.jerk = (self.random.below(2) == 0).then_some(Jerk(self.size.jerk));
        axis.set_limits(limits);
    }

    fn break_something(&mut self, axis: &mut Axis) {
        let fault = self.random.one_of([
            PlantFault::EncoderBreak,
            PlantFault::BlockedShaft,
            PlantFault::StuckSwitch(Input::PositiveLimit, true),
            PlantFault::StuckSwitch(Input::EmergencyStop, true),
            PlantFault::DriveFault(DriveFault::OverCurrent),
            PlantFault::SupplyDip(Voltage(5.0)),
        ]);
        if let (None, Some(plant)) = (self.broken, axis.plant()) {
            plant.inject(fault);
            self.broken = Some(fault);
        }
    }
}
