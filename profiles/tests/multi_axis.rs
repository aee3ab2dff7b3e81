//! A device with four axes: their objects stand at 0x6000 + n x 0x800 (IEC 61800-7-201), one controlword each.

mod bench;

use axis::{DriveFault, PlantFault};
use bench::Bench;
use profiles::{DeviceEvent, Profile, State};

const AXES: u16 = 4;
const STRIDE: u16 = 0x800;

/// The neutral drive with its objects four times, and the type of each axis at its end (0x67FF on).
fn four_axes() -> Profile {
    let text = Profile::text("cia402-servo").unwrap();
    let (head, rest) = text.split_once("  # ---- Device control ----").unwrap();
    let (objects, tail) = rest.split_once("\n]\n").unwrap();
    let mut all = head.to_owned();
    for axis in 0..AXES {
        objects.lines().for_each(|line| all += &moved(line, axis));
        let index = 0x67FF + axis * STRIDE;
        all += &format!(
            "  {{ index = 0x{index:04X}, name = \"Single device type\", type = \"U32\", access = \"ro\", \
             default = 0x00020192 }},\n"
        );
    }
    let text = format!("{all}]\n{tail}");
    Profile::parse("four-axes.toml", &text, None).unwrap_or_else(|wrong| panic!("{wrong}"))
}

/// A line of the profile for another axis.
fn moved(line: &str, axis: u16) -> String {
    const START: &str = "  { index = 0x";
    let Some(rest) = line.strip_prefix(START) else { return format!("{line}\n") };
    let (digits, rest) = rest.split_at(4);
    let index = u16::from_str_radix(digits, 16).unwrap() + axis * STRIDE;
    format!("{START}{index:04X}, axis = {axis}{rest}\n")
}

fn at(index: u16, axis: u16) -> u16 {
    index + axis * STRIDE
}

fn states(bench: &Bench) -> Vec<State> {
    bench.device.axes().map(|axis| axis.state).collect()
}

/// All four axes in OPERATION ENABLED, profile velocity mode.
fn enabled() -> Bench {
    let mut bench = Bench::of(four_axes());
    bench.run(10);
    for axis in 0..AXES {
        bench.batch(&[(at(0x6083, axis), 0, 100_000), (at(0x6084, axis), 0, 100_000)]).unwrap();
        bench.set(at(0x6060, axis), 3);
        for word in [0x06, 0x07, 0x0F] {
            bench.set(at(0x6040, axis), word);
        }
    }
    bench.run(50);
    assert_eq!(states(&bench), [State::OperationEnabled; 4]);
    bench
}

#[test]
fn each_controlword_commands_its_axis_alone() {
    for axis in 0..AXES {
        let mut bench = Bench::of(four_axes());
        bench.run(10);
        bench.set(at(0x6040, axis), 0x06);
        let expected: Vec<_> = (0..AXES)
            .map(|n| if n == axis { State::ReadyToSwitchOn } else { State::SwitchOnDisabled })
            .collect();
        assert_eq!(states(&bench), expected);
        for n in 0..AXES {
            assert_eq!(bench.get(at(0x6041, n)) & 0x6F == 0x21, n == axis);
        }
    }
}

#[test]
fn each_axis_runs_at_its_own_speed() {
    let mut bench = enabled();
    for axis in 0..AXES {
        bench.set(at(0x60FF, axis), 1_000 * (i64::from(axis) - 2));
    }
    bench.run(1_000);
    for axis in 0..AXES {
        let speed = bench.get(at(0x606C, axis));
        assert!((speed - 1_000 * (i64::from(axis) - 2)).abs() < 50, "axis {axis}: {speed}");
    }
}

#[test]
fn one_controlword_write_may_command_all_axes_in_a_batch() {
    let mut bench = enabled();
    let batch: Vec<_> = (0..AXES).map(|axis| (at(0x6040, axis), 0, 0x00)).collect();
    bench.batch(&batch).unwrap();
    assert_eq!(states(&bench), [State::SwitchOnDisabled; 4]);
}

#[test]
fn the_fault_of_one_axis_is_told_with_its_number_and_leaves_the_others_alone() {
    for axis in 0..AXES {
        let mut bench = enabled();
        let now = bench.now;
        let fault = PlantFault::DriveFault(DriveFault::OverCurrent);
        bench.device.plant(usize::from(axis), now).unwrap().inject(fault);
        bench.run(5);
        let expected: Vec<_> =
            (0..AXES).map(|n| if n == axis { State::Fault } else { State::OperationEnabled }).collect();
        assert_eq!(states(&bench), expected);
        for n in 0..AXES {
            let code = if n == axis { 0x2310 } else { 0 };
            assert_eq!(bench.get(at(0x603F, n)), code);
        }
        let events = bench.events();
        let [DeviceEvent::Raised(told)] = events.as_slice() else { panic!("{events:?}") };
        assert_eq!((told.code, told.detail), (0x2310, [axis as u8 + 1, 0, 0, 0, 0]));
    }
}

#[test]
fn a_fault_that_two_axes_have_is_gone_when_both_are_reset() {
    let mut bench = enabled();
    for axis in [1, 3] {
        let now = bench.now;
        let fault = PlantFault::DriveFault(DriveFault::OverCurrent);
        bench.device.plant(axis, now).unwrap().inject(fault);
        bench.run(5);
        let now = bench.now;
        bench.device.plant(axis, now).unwrap().clear(fault);
    }
    assert_eq!(bench.events().len(), 2);
    bench.set(at(0x6040, 1), 0x80);
    bench.run(5);
    assert_eq!(states(&bench)[1], State::SwitchOnDisabled);
    assert_eq!(bench.events(), [], "axis 4 still has it");
    bench.set(at(0x6040, 3), 0x80);
    bench.run(5);
    assert_eq!(bench.events(), [DeviceEvent::Cleared(0x2310)]);
}

#[test]
fn a_lost_connection_acts_on_each_axis_by_its_own_0x6007() {
    let mut bench = enabled();
    for axis in 0..AXES {
        bench.set(at(0x6007, axis), i64::from(axis));
    }
    let now = bench.now;
    bench.device.connection_lost(now);
    bench.run(100);
    let expected = [State::OperationEnabled, State::Fault, State::SwitchOnDisabled, State::SwitchOnDisabled];
    assert_eq!(states(&bench), expected);
}

#[test]
fn each_axis_tells_its_device_type() {
    let bench = Bench::of(four_axes());
    for axis in 0..AXES {
        assert_eq!(bench.get(at(0x67FF, axis)), 0x0002_0192);
    }
}
