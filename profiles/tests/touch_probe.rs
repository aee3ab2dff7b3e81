//! Touch probes: positions caught at an edge, exact to the count whatever the speed (IEC 61800-7-201, 0x60B8 on).

mod bench;

use axis::{Input, Position, PositionRange};
use bench::Bench;
use od::AbortCode;

const ON: i64 = 0x01;
const CONTINUOUS: i64 = 0x02;
const ZERO_IMPULSE: i64 = 0x04;
const BY_SOURCE: i64 = 0x08;
const POSITIVE: i64 = 0x10;
const NEGATIVE: i64 = 0x20;

const INPUTS: [Input; 2] = [Input::Probe1, Input::Probe2];
const FUNCTION: u16 = 0x60B8;
const STATUS: u16 = 0x60B9;
/// Positive and negative edge of either probe.
const POSITIONS: [[u16; 2]; 2] = [[0x60BA, 0x60BB], [0x60BC, 0x60BD]];
const COUNTERS: [[u16; 2]; 2] = [[0x60D5, 0x60D6], [0x60D7, 0x60D8]];

/// An axis at rest, ready for profile positions, with a cam at each probe.
fn ready(from: i64, to: i64) -> Bench {
    let mut bench = Bench::new("cia402-servo");
    bench.batch(&[(0x6081, 0, 150_000), (0x6083, 0, 2_000_000), (0x6084, 0, 2_000_000)]).unwrap();
    for input in INPUTS {
        let cam = PositionRange::new(Position(from as f64), Position(to as f64));
        bench.plant().set_cam(input, cam);
    }
    bench.enable(1);
    bench
}

fn go(bench: &mut Bench, target: i64) {
    bench.move_to(target, 0);
    bench.run_until(|b| b.is_set(10));
}

fn caught(bench: &Bench, probe: usize) -> [i64; 2] {
    POSITIONS[probe].map(|index| bench.get(index))
}

fn counts(bench: &Bench, probe: usize) -> [i64; 2] {
    COUNTERS[probe].map(|index| bench.get(index))
}

fn status(bench: &Bench, probe: usize) -> i64 {
    bench.get(STATUS) >> (8 * probe) & 0xFF
}

#[test]
fn an_edge_at_speed_is_caught_to_the_count_by_either_probe_in_either_direction() {
    for probe in 0..2 {
        let function = (ON | POSITIVE | NEGATIVE) << (8 * probe);
        let mut bench = ready(12_345, 16_789);
        bench.set(FUNCTION, function);
        assert_eq!(bench.get(STATUS), 1 << (8 * probe));
        go(&mut bench, 40_000);
        assert_eq!(caught(&bench, probe), [12_345, 16_789]);
        assert_eq!(status(&bench, probe), 0b111);
        assert_eq!(
            (caught(&bench, 1 - probe), status(&bench, 1 - probe)),
            ([0, 0], 0),
            "the other one is off"
        );
        bench.batch(&[(FUNCTION, 0, 0)]).unwrap();
        assert_eq!(bench.get(STATUS), 0);
        bench.set(FUNCTION, function);
        go(&mut bench, 0);
        assert_eq!(caught(&bench, probe), [16_789, 12_345], "backwards the ends change places");
    }
}

#[test]
fn both_edges_of_a_cam_that_is_passed_within_one_step_are_caught() {
    // At 150,000 counts/s a step of 1 ms is 150 counts.
    let mut bench = ready(20_000, 20_007);
    bench.set(FUNCTION, ON | POSITIVE | NEGATIVE);
    go(&mut bench, 40_000);
    assert_eq!((caught(&bench, 0), counts(&bench, 0)), ([20_000, 20_007], [1, 1]));
}

#[test]
fn only_the_edges_that_are_sampled_are_caught() {
    for (edges, stored, expected) in
        [(0, 0b001, [0, 0]), (POSITIVE, 0b011, [12_000, 0]), (NEGATIVE, 0b101, [0, 16_000])]
    {
        let mut bench = ready(12_000, 16_000);
        bench.set(FUNCTION, ON | edges);
        go(&mut bench, 40_000);
        assert_eq!((status(&bench, 0), caught(&bench, 0)), (stored, expected));
    }
}

#[test]
fn the_first_event_stays_and_continuous_follows() {
    for (mode, expected, count) in [(0, [12_000, 16_000], [1, 1]), (CONTINUOUS, [16_000, 12_000], [2, 2])] {
        let mut bench = ready(12_000, 16_000);
        bench.set(FUNCTION, ON | POSITIVE | NEGATIVE | mode);
        go(&mut bench, 40_000);
        go(&mut bench, 0);
        assert_eq!((caught(&bench, 0), counts(&bench, 0)), (expected, count));
    }
}

#[test]
fn writing_the_same_function_again_does_not_arm_it_but_a_toggle_does() {
    let mut bench = ready(12_000, 16_000);
    bench.set(FUNCTION, ON | POSITIVE);
    go(&mut bench, 40_000);
    bench.set(FUNCTION, ON | POSITIVE);
    assert_eq!(status(&bench, 0), 0b011);
    go(&mut bench, 0);
    assert_eq!(caught(&bench, 0)[0], 12_000);
    bench.set(FUNCTION, ON);
    assert_eq!((status(&bench, 0), caught(&bench, 0)[0]), (0b001, 12_000), "the value stays");
    bench.set(FUNCTION, ON | POSITIVE);
    go(&mut bench, 14_000);
    go(&mut bench, 40_000);
    go(&mut bench, 14_000);
    assert_eq!(caught(&bench, 0)[0], 12_000);
    assert_eq!(counts(&bench, 0)[0], 2);
}

#[test]
fn the_zero_impulse_is_caught_to_the_count() {
    for function in [ZERO_IMPULSE, BY_SOURCE] {
        let mut bench = ready(1_000_000, 1_000_001);
        bench.batch(&[(0x60D0, 1, 5)]).unwrap();
        bench.set(FUNCTION, ON | CONTINUOUS | POSITIVE | NEGATIVE | function);
        go(&mut bench, 10_000);
        // Every 4096 counts.
        assert_eq!((caught(&bench, 0), counts(&bench, 0)), ([8_192, 8_192], [2, 2]));
    }
}

#[test]
fn a_probe_listens_to_the_source_it_is_given() {
    let mut bench = ready(12_000, 16_000);
    let cam = PositionRange::new(Position(3_000.0), Position(5_000.0));
    bench.plant().set_cam(Input::Probe2, cam);
    bench.batch(&[(0x60D0, 1, 2), (0x60D0, 2, 1)]).unwrap();
    let both = ON | POSITIVE | BY_SOURCE;
    bench.set(FUNCTION, both | both << 8);
    go(&mut bench, 40_000);
    assert_eq!((caught(&bench, 0)[0], caught(&bench, 1)[0]), (3_000, 12_000));
}

#[test]
fn a_probe_works_while_the_drive_is_off() {
    let mut bench = ready(30_000, 1_000_000);
    bench.set(FUNCTION, ON | POSITIVE);
    bench.move_to(1_000_000, 0);
    bench.run_until(|b| b.position() > 10_000);
    bench.control(0x00);
    bench.run_until(|b| b.position() > 30_000);
    assert_eq!((status(&bench, 0), caught(&bench, 0)[0]), (0b011, 30_000));
}

#[test]
fn a_level_that_changes_at_rest_is_an_edge_there() {
    let mut bench = ready(1_000_000, 1_000_001);
    go(&mut bench, 777);
    let place = bench.position();
    bench.control(0x00);
    bench.run(2_000);
    bench.set(FUNCTION, ON | POSITIVE | NEGATIVE);
    let stuck = axis::PlantFault::StuckSwitch(Input::Probe1, true);
    bench.plant().inject(stuck);
    bench.run(5);
    assert_eq!((status(&bench, 0), caught(&bench, 0)[0]), (0b011, place));
    bench.plant().clear(stuck);
    bench.run(5);
    assert_eq!((status(&bench, 0), caught(&bench, 0)[1]), (0b111, place));
}

#[test]
fn sources_and_functions_that_do_not_exist_are_refused() {
    let mut bench = Bench::new("cia402-servo");
    for source in [-1, 0, 3, 4, 6, 256] {
        assert_eq!(bench.batch(&[(0x60D0, 1, source)]), Err(AbortCode::InvalidValue), "{source}");
    }
    assert_eq!(bench.batch(&[(0x60D0, 2, 5)]), Ok(()));
    for function in [0x0C, 0x0C00, 0x0F3D] {
        assert_eq!(bench.batch(&[(FUNCTION, 0, function)]), Err(AbortCode::InvalidValue), "{function:04X}");
    }
    assert_eq!(bench.batch(&[(FUNCTION, 0, 0x3737)]), Ok(()));
}

#[test]
fn reset_node_switches_the_probes_off() {
    let mut bench = ready(12_000, 16_000);
    bench.set(FUNCTION, ON | POSITIVE);
    go(&mut bench, 40_000);
    let now = bench.now;
    bench.device.reset(now);
    bench.run(10);
    assert_eq!((bench.get(STATUS), caught(&bench, 0), counts(&bench, 0)), (0, [0, 0], [0, 0]));
}
