//! Whatever is written to the registers: set-points keep the limits, and nothing panics.

use core::time::Duration;

use axis::{DriveFault, PlantFault, Position, Velocity, Voltage};
use profiles::DeviceEvent;
use proptest::prelude::*;

use crate::bench::Bench;
use crate::motor::{range, reg};

#[derive(Clone, Debug)]
enum Event {
    Write(u8, i64),
    FastMac(u8),
    Module(u32),
    Controlword(i64),
    Object(u16, i64),
    Block(bool),
    Fault(bool),
    Analog(f64),
    Encoder(f64),
    Lost,
    Wait(u16),
}

fn value() -> impl Strategy<Value = i64> {
    prop_oneof![
        4 => -200_000_i64..200_000,
        2 => 0_i64..20,
        1 => any::<i32>().prop_map(i64::from),
        1 => prop::sample::select(vec![0, i64::from(i32::MIN), i64::from(i32::MAX)]),
    ]
}

fn write() -> impl Strategy<Value = Event> {
    let mode = prop::sample::select(vec![0, 1, 2, 2, 3, 13, 14]).prop_map(|mode| (reg::MODE_REG, mode));
    prop_oneof![
        3 => mode,
        4 => (prop::sample::select(vec![3_u8, 5, 6, 7, 10, 13, 16, 28, 30, 32, 33, 34, 40, 122, 124, 126, 127]), value()),
        3 => (1_u8..=254, value()),
    ]
    .prop_map(|(number, value)| Event::Write(number, value & 0xFFFF_FFFF))
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        8 => write(),
        2 => any::<u8>().prop_map(Event::FastMac),
        1 => prop_oneof![0x8000_0060_u32..0x8000_0110, any::<u32>()].prop_map(Event::Module),
        1 => prop::sample::select(vec![0_i64, 0x06, 0x07, 0x0F, 0x1F, 0x80, 0x02]).prop_map(Event::Controlword),
        1 => (prop::sample::select(vec![0x6060_u16, 0x607A, 0x60FF, 0x6007, 0x2204, 0x6073]), 0_i64..4)
            .prop_map(|(index, value)| Event::Object(index, value)),
        1 => any::<bool>().prop_map(Event::Block),
        1 => any::<bool>().prop_map(Event::Fault),
        1 => prop::sample::select(vec![0.0, 2.5, -7.0, f64::NAN]).prop_map(Event::Analog),
        1 => prop::sample::select(vec![0.0, 1e5, -1e7]).prop_map(Event::Encoder),
        1 => Just(Event::Lost),
        5 => (1_u16..250).prop_map(Event::Wait),
    ]
}

fn apply(bench: &mut Bench, event: &Event) {
    match event {
        // Whatever is refused is refused.
        Event::Write(number, value) => drop(bench.batch(&[(0x2012, *number, *value)])),
        Event::FastMac(number) => drop(bench.batch(&[(0x2013, 0, i64::from(*number))])),
        Event::Module(command) => drop(bench.command_module(*command)),
        Event::Controlword(word) => drop(bench.batch(&[(0x6040, 0, *word)])),
        Event::Object(index, value) => drop(bench.batch(&[(*index, 0, *value)])),
        Event::Block(true) => bench.block_shaft(),
        Event::Block(false) => bench.free_shaft(),
        Event::Fault(is_on) => {
            let fault = PlantFault::DriveFault(DriveFault::OverCurrent);
            if *is_on { bench.plant().inject(fault) } else { bench.plant().clear(fault) }
        }
        Event::Analog(volts) => bench.device.set_analog_input(0, Voltage(*volts), bench.now),
        Event::Encoder(speed) => bench.device.set_external_encoder(0, Velocity(*speed), bench.now),
        Event::Lost => bench.device.connection_lost(bench.now),
        Event::Wait(_) => {}
    }
    while let Some(event) = bench.device.poll_event() {
        if let DeviceEvent::Store(order) = event {
            let saved = bench.device.to_store(order);
            assert_eq!(bench.device.dictionary_mut().set_saved(saved), 0, "all of it is a parameter");
            bench.device.stored(bench.now, true);
        }
    }
}

/// A motor with all its switches.
fn machine() -> Bench {
    let mut bench = Bench::mis_with(|plant| {
        plant.positive_switch = Some(Position(400_000.0));
        plant.negative_switch = Some(Position(-400_000.0));
        plant.home_switch = range(100_000.0, 150_000.0);
        plant.index = Position(30_000.0);
    });
    bench.set_regs(&[(reg::NL_MASK, 1), (reg::PL_MASK, 2), (reg::HOME_MASK, 4)]);
    bench
}

/// Calls `check` after each raster step of the next `millis`.
fn each_step(bench: &mut Bench, millis: u16, mut check: impl FnMut(&Bench)) {
    let end = bench.now + Duration::from_millis(millis.into());
    while let Some(due) = bench.device.poll_timeout().filter(|due| *due <= end) {
        bench.now = due;
        bench.device.advance(due);
        check(bench);
    }
    bench.now = end;
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn no_traffic_breaks_the_motor_or_its_speed(events in prop::collection::vec(event(), 1..40)) {
        let mut bench = machine();
        for event in &events {
            apply(&mut bench, event);
            let millis = if let Event::Wait(millis) = event { *millis } else { 1 };
            each_step(&mut bench, millis, |bench| {
                let velocity = bench.reg(reg::V_IST);
                assert!(velocity.abs() <= 300_100, "3000 RPM: {velocity}");
                let errors = bench.reg(reg::ERR_BITS);
                assert!(errors == 0 || errors & 1 == 1, "general with any other: {errors:X}");
                assert!([0, 1, 2, 3, 13, 14].contains(&bench.reg(reg::MODE_REG)));
            });
        }
    }

    #[test]
    fn set_points_never_pass_the_position_limits(
        targets in prop::collection::vec((1_i64..=3, -3_000_000_i64..3_000_000, -300_000_i64..300_000, 1_i64..500_000, 1_u16..300), 1..12),
        low in -400_000_i64..-1,
        high in 1_i64..400_000,
    ) {
        let mut bench = Bench::mis();
        // No error, so that the motor goes on.
        bench.set_regs(&[(reg::MIN_P_IST, low), (reg::MAX_P_IST, high), (reg::RUN_CURRENT, 1533), (reg::SETUP_BITS, 1 << 17 | 1 << 2)]);
        for (mode, target, velocity, ramp, millis) in targets {
            bench.set_regs(&[(reg::V_SOLL, velocity), (reg::A_SOLL, ramp), (reg::P_SOLL, target), (reg::MODE_REG, mode)]);
            // What the gear mode follows.
            bench.device.set_external_encoder(0, Velocity(target as f64), bench.now);
            each_step(&mut bench, millis, |bench| {
                let place = bench.reg(reg::P_IST);
                assert!((low..=high).contains(&place), "{place} is not in {low}..={high}");
            });
        }
    }
}
