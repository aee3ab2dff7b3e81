//! A MAC motor whose registers anybody writes: nothing panics, no set-point passes a limit, a motor without power
//! coasts, and one whose master is gone stops.

mod bench;

use std::time::Duration;

use axis::{DriveFault, PlantFault, Position, PositionRange, Velocity, Voltage};
use bench::Bench;
use proptest::prelude::*;

const MODE: u8 = 2;
const P_FNC: u8 = 8;
const P_IST: u8 = 10;
const V_IST: u8 = 12;

/// Modes in which the axis is free.
const WITHOUT_POWER: [i32; 8] = [0, 7, 8, 9, 15, 19, 22, 23];

/// How far a motor in a torque mode may pass a position limit, in counts.
const TORQUE_SLACK: f64 = 150.0;

/// How strictly the position limits hold.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bound {
    /// For every set-point.
    Strictly,
    /// The motor gives a torque and has no set-point: it brakes in time, but for what braking after a push of three times
    /// its rated torque takes.
    Nearly,
    /// It has coasted, or pushed, and may have been too fast to stop before a limit.
    Not,
}

impl Bound {
    fn next(self, mode: i32, velocity: i64, is_inside: bool) -> Self {
        match mode {
            mode if WITHOUT_POWER.contains(&mode) => Self::Not,
            4 | 17 if self != Self::Not => Self::Nearly,
            4 | 17 => Self::Not,
            _ if velocity == 0 && is_inside => Self::Strictly,
            _ if self == Self::Nearly => Self::Not,
            _ => self,
        }
    }
}

/// Something that happens to a motor.
#[derive(Clone, Debug)]
enum Event {
    Write(u8, i64),
    FastMac(u8),
    Module(u32),
    Controlword(u16),
    Drive(u16, i64),
    Lost,
    Fault(bool),
    Analog(f64),
    Encoder(f64),
    Wait(u16),
}

fn value() -> impl Strategy<Value = i64> {
    prop_oneof![
        4 => -5000_i64..5000,
        1 => any::<i16>().prop_map(i64::from),
        1 => any::<i32>().prop_map(i64::from),
        1 => prop::sample::select(vec![0, 1, -1, i64::from(i32::MAX), i64::from(i32::MIN), 32_767, -32_768, 65_535]),
    ]
}

/// Writes to any register; those that matter most often.
fn write() -> impl Strategy<Value = Event> {
    prop_oneof![
        4 => (0_i64..26).prop_map(|mode| Event::Write(MODE, mode)),
        4 => (prop::sample::select(vec![3_u8, 5, 6, 7, 14, 15]), value()).prop_map(|(n, v)| Event::Write(n, v)),
        3 => (1_u8..255, value()).prop_map(|(n, v)| Event::Write(n, v)),
    ]
}

fn surroundings() -> impl Strategy<Value = Event> {
    prop_oneof![
        1 => any::<bool>().prop_map(Event::Fault),
        1 => (-12.0..12.0).prop_map(Event::Analog),
        1 => (-1e6..1e6).prop_map(Event::Encoder),
        1 => Just(Event::Lost),
        4 => (1_u16..600).prop_map(Event::Wait),
    ]
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        6 => write(),
        2 => any::<u8>().prop_map(Event::FastMac),
        1 => prop_oneof![0x8000_0080_u32..0x8000_0100, any::<u32>()].prop_map(Event::Module),
        1 => prop::sample::select(vec![0_u16, 0x06, 0x07, 0x0F, 0x1F, 0x80, 0x02]).prop_map(Event::Controlword),
        1 => (prop::sample::select(vec![0x6060_u16, 0x607A, 0x60FF, 0x6007]), -3_i64..4).prop_map(|(i, v)| Event::Drive(i, v)),
        5 => surroundings(),
    ]
}

fn apply(bench: &mut Bench, event: &Event) {
    match event {
        // Whatever is refused is refused.
        Event::Write(number, value) => drop(bench.batch(&[(0x2012, *number, *value)])),
        Event::FastMac(number) => drop(bench.batch(&[(0x2013, 0, i64::from(*number))])),
        Event::Module(command) => drop(bench.command_module(*command)),
        Event::Controlword(word) => drop(bench.batch(&[(0x6040, 0, i64::from(*word))])),
        Event::Drive(index, value) => drop(bench.batch(&[(*index, 0, *value)])),
        Event::Lost => bench.device.connection_lost(bench.now),
        Event::Fault(is_on) => {
            let fault = PlantFault::DriveFault(DriveFault::OverCurrent);
            if *is_on { bench.plant().inject(fault) } else { bench.plant().clear(fault) }
        }
        Event::Analog(volts) => bench.device.set_analog_input(0, Voltage(*volts), bench.now),
        Event::Encoder(speed) => bench.device.set_external_encoder(0, Velocity(*speed), bench.now),
        Event::Wait(millis) => bench.run((*millis).into()),
    }
    while let Some(event) = bench.device.poll_event() {
        if let profiles::DeviceEvent::Store(order) = event {
            let saved = bench.device.to_store(order);
            assert_eq!(bench.device.dictionary_mut().set_saved(saved), 0, "all of it is a parameter");
            bench.device.stored(bench.now, true);
        }
    }
}

/// Calls `check` after each raster step of the next `millis`.
fn each_step(bench: &mut Bench, millis: u64, mut check: impl FnMut(&Bench)) {
    let end = bench.now + Duration::from_millis(millis);
    while let Some(due) = bench.device.poll_timeout().filter(|due| *due <= end) {
        bench.now = due;
        bench.device.advance(due);
        check(bench);
    }
    bench.now = end;
}

fn motor() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec!["mac140", "mac800"])
}

fn torque(bench: &Bench) -> i32 {
    let is_small = bench.device.profile().motor.as_ref().is_some_and(|motor| motor.name == "mac140");
    bench.register(if is_small { 121 } else { 169 })
}

/// Highest speed of the motor in counts/s.
fn fastest(bench: &Bench) -> f64 {
    let motor = bench.device.profile().motor.as_ref().unwrap();
    f64::from(motor.max_speed_rpm) / 60.0 * f64::from(motor.counts_per_revolution)
}

/// Does `event` let positions count anew, take the position limits away or write them?
fn moves_coordinates(event: &Event, is_small: bool) -> bool {
    match event {
        Event::Write(number, value) => match number {
            // Zero searches, and the program in the motor that can write any register.
            2 => matches!(value, 12 | 13 | 14 | 25),
            8..=11 | 28..=31 | 35 | 36 | 42 | 211 => true,
            37 => true,
            93..=104 => !is_small,
            188..=203 => is_small,
            _ => false,
        },
        Event::FastMac(number) => matches!(number & 0x7F, 99 | 100 | 104 | 105 | 112 | 119 | 120),
        Event::Module(_) | Event::Drive(..) | Event::Controlword(_) => true,
        Event::Lost | Event::Fault(_) | Event::Analog(_) | Event::Encoder(_) | Event::Wait(_) => false,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn random_traffic_harms_nobody(motor in motor(), events in prop::collection::vec(event(), 1..120)) {
        let mut bench = Bench::motor(motor);
        let most = fastest(&bench);
        for event in &events {
            apply(&mut bench, event);
            each_step(&mut bench, 40, |bench| {
                let demand = bench.get(0x606B).abs() as f64;
                // A motor without power may be driven by nobody here, but one that is slowed down was faster.
                assert!(demand <= 1.02 * most, "{demand} counts/s");
                let mode = bench.register(MODE);
                assert!((0..=25).contains(&mode), "mode {mode}");
            });
        }
        bench.device.shut_down(bench.now);
        bench.run(30_000);
        prop_assert!(bench.device.is_quiet(), "it comes to rest");
    }

    #[test]
    fn set_points_stay_within_the_position_limits(
        motor in motor(),
        events in prop::collection::vec(event(), 1..80),
        width in 2_000_i64..60_000,
    ) {
        let mut bench = Bench::motor(motor);
        let is_small = motor == "mac140";
        bench.write(&[(28, -width), (30, width), (22, 0), (26, 0)]);
        let mut bound = Bound::Strictly;
        for event in events.iter().filter(|event| !moves_coordinates(event, is_small)) {
            apply(&mut bench, event);
            each_step(&mut bench, 40, |bench| {
                let demand = f64::from(bench.register(P_FNC)) / 16.0;
                bound = bound.next(bench.register(MODE), bench.get(0x606B), demand.abs() <= width as f64);
                let slack = match bound {
                    Bound::Strictly => 0.07,
                    Bound::Nearly => TORQUE_SLACK,
                    Bound::Not => f64::INFINITY,
                };
                assert!(demand.abs() <= width as f64 + slack, "{demand} beyond {width}");
            });
        }
    }

    #[test]
    fn a_motor_without_power_coasts(motor in motor(), events in prop::collection::vec(event(), 1..40)) {
        let mut bench = Bench::motor(motor);
        for event in &events {
            apply(&mut bench, event);
        }
        // Whatever a program in the motor does, it does not do it after a reset of all.
        bench.device.shut_down(bench.now);
        bench.plant().inject(PlantFault::DriveFault(DriveFault::Internal));
        bench.run(4);
        let mut speed = f64::INFINITY;
        each_step(&mut bench, 20_000, |bench| {
            assert_eq!(torque(bench), 0);
            let now = bench.device.axes().next().unwrap().velocity.abs().0;
            assert!(now <= speed + 1.0, "{now} after {speed}");
            speed = now;
        });
    }

    #[test]
    fn a_lost_connection_stops_every_mode(
        motor in motor(),
        mode in 0_i64..26,
        registers in prop::collection::vec((prop::sample::select(vec![3_u8, 5, 6, 7, 32, 40]), value()), 0..12),
        option in 1_i64..4,
        action in prop::sample::select(vec![0_i64, 0x40]),
        volts in -10.0..10.0,
        encoder in -1e5..1e5,
    ) {
        let stops = PositionRange::new(Position(-1e9), Position(1e9));
        let mut bench = Bench::motor_with(motor, |plant| plant.stops = stops);
        bench.set(0x6007, option);
        bench.set_sub(0x2011, 8, action);
        bench.device.set_analog_input(0, Voltage(volts), bench.now);
        bench.device.set_external_encoder(0, Velocity(encoder), bench.now);
        bench.write(&[(MODE, mode)]);
        bench.run(40);
        for register in &registers {
            bench.write(&[*register]);
            bench.run(200);
        }
        bench.device.connection_lost(bench.now);
        // The gentlest ramp takes long.
        bench.run(40_000);
        prop_assert_eq!(bench.register(V_IST), 0, "mode {} has become {}", mode, bench.register(MODE));
        let place = bench.register(P_IST);
        bench.run(1_000);
        prop_assert!((i64::from(bench.register(P_IST)) - i64::from(place)).abs() <= 4);
    }
}

#[test]
fn an_hour_of_everything() {
    // One story with every mode, by turns, on both families; 3600 s together.
    for motor in ["mac140", "mac800"] {
        let mut bench = Bench::motor(motor);
        bench.write(&[(14, 1), (15, 3), (49, 20_000), (51, -20_000), (61, 777)]);
        for round in 0..90_i64 {
            let volts = (round % 21) as f64 - 10.0;
            bench.device.set_analog_input(0, Voltage(volts), bench.now);
            bench.device.set_external_encoder(0, Velocity(volts * 3_000.0), bench.now);
            bench.write(&[(MODE, round % 26), (5, round * 37 % 4_000 - 2_000), (6, round * 11 % 900 + 1)]);
            bench.write(&[(3, round * 7_919 % 100_000 - 50_000)]);
            bench.run(10_000);
            bench.fastmac(0x61);
            bench.fastmac(0x71);
            bench.run(10_000);
        }
        assert_eq!(bench.device.dropped_steps(), 0);
    }
}
