//! A hundred axes of all kinds do for an hour each what they are told, and every bit of what they report is the same
//! on every run and every machine.
//!
//! `INSTA_UPDATE=always cargo test -p axis --test an_hour` writes the sums anew.

mod fleet;

use std::fmt::Write as _;

use axis::{Status, Torque, Velocity};
use fleet::{Kind, Member};

const HOUR_NANOS: u64 = 3_600_000_000_000;

/// FNV-1a with 64 bits, a word at a time (Fowler, Noll, Vo). A bit that differs once makes the sum another one: both
/// operations are one-to-one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Sum(u64);

impl Sum {
    const START: Self = Self(0xCBF2_9CE4_8422_2325);
    const PRIME: u64 = 0x0000_0100_0000_01B3;

    fn add(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(Self::PRIME);
    }

    fn add_status(&mut self, status: &Status) {
        let Status { demand, actual, .. } = status;
        let numbers = [
            demand.position.0,
            demand.velocity.0,
            demand.acceleration.0,
            actual.position.0,
            actual.velocity.0,
            actual.torque.0,
            status.following_error.0,
            status.voltage.0,
            status.temperature.0,
            status.index.map_or(0.5, |place| place.0),
            status.mark.map_or(0.5, |place| place.0),
        ];
        numbers.into_iter().for_each(|number| self.add(number.to_bits()));
        let flags = [status.done, status.limited, status.on_target, status.fault.is_some()];
        self.add(flags.into_iter().fold(status.queued as u64, |flags, flag| flags << 1 | u64::from(flag)));
    }
}

/// What an axis has done in its hour.
#[derive(Debug)]
struct Record {
    sum: Sum,
    /// Steps in motion.
    moving: u64,
    faults: u32,
}

fn run(member: &Member, nanos: u64) -> Record {
    let (mut axis, mut operator) = (member.axis(), member.operator());
    let mut record = Record { sum: Sum::START, moving: 0, faults: 0 };
    let mut had_fault = false;
    for _ in 0..nanos / member.period().nanos() {
        operator.command(&mut axis);
        axis.step();
        let status = axis.status();
        record.sum.add_status(status);
        record.moving += u64::from(status.demand.velocity != Velocity(0.0));
        record.faults += u32::from(status.fault.is_some() && !had_fault);
        had_fault = status.fault.is_some();
    }
    record
}

/// Runs `count` axes of a kind, the first of which has this number.
fn check(name: &str, kind: Kind, first: u32, count: u32) {
    let mut text = String::new();
    for number in first..first + count {
        let member = Member { kind, number };
        let Record { sum, moving, faults } = run(&member, HOUR_NANOS);
        let minutes = moving * member.period().nanos() / 60_000_000_000;
        writeln!(text, "{number:02} {:016x}, {minutes} minutes in motion, {faults} faults", sum.0).unwrap();
        assert!(minutes > 5 && faults > 10, "it is to do something: {text}");
    }
    insta::assert_snapshot!(name, text);
}

#[test]
fn two_servos_of_250_us() {
    check("servos-250-us", Kind::Servo(250_000), 0, 2);
}

#[test]
fn eighteen_servos_of_1_ms() {
    check("servos-1-ms", Kind::Servo(1_000_000), 2, 18);
}

#[test]
fn fifteen_servos_of_1_3_ms() {
    check("servos-1.3-ms", Kind::Servo(1_300_000), 20, 15);
}

#[test]
fn fifteen_servos_of_1_92_ms() {
    check("servos-1.92-ms", Kind::Servo(1_920_000), 35, 15);
}

#[test]
fn thirteen_analogue_drives_with_encoder() {
    check("analogue-encoder", Kind::Incremental, 50, 13);
}

#[test]
fn twelve_analogue_drives_with_ssi() {
    check("analogue-ssi", Kind::Ssi, 63, 12);
}

#[test]
fn thirteen_steppers_that_count_pulses() {
    check("steppers-counter", Kind::StepCounter, 75, 13);
}

#[test]
fn twelve_steppers_with_encoder() {
    check("steppers-encoder", Kind::StepEncoder, 88, 12);
}

#[test]
fn the_last_bit_of_one_number_in_one_step_makes_another_sum() {
    let mut axis = Member { kind: Kind::Servo(1_000_000), number: 2 }.axis();
    axis.step();
    let (one, mut other) = (*axis.status(), *axis.status());
    other.actual.torque = Torque(f64::from_bits(one.actual.torque.0.to_bits() ^ 1));
    let sum = |first: &Status| {
        let mut sum = Sum::START;
        sum.add_status(first);
        (0..1000).for_each(|_| sum.add_status(&one));
        sum
    };
    assert_eq!(sum(&one), sum(&one));
    assert_ne!(sum(&one), sum(&other));
}
