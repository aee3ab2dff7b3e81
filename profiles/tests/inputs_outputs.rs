//! Digital inputs and outputs: 0x60FD and 0x60FE, and those of JVL's module.

mod bench;

use axis::{Input, PlantFault, Voltage};
use bench::Bench;
use profiles::{Profile, Role};

const HIGH: bool = true;
const LOW: bool = false;

fn set_level(bench: &mut Bench, input: Input, level: bool) {
    bench.plant().inject(PlantFault::StuckSwitch(input, level));
    bench.run(5);
}

fn outputs(bench: &Bench) -> u32 {
    bench.device.axes().next().unwrap().outputs
}

#[test]
fn each_input_has_its_bit_also_while_the_drive_sleeps() {
    let table = [
        (Input::NegativeLimit, 0),
        (Input::PositiveLimit, 1),
        (Input::Home, 2),
        (Input::EmergencyStop, 3),
        (Input::Probe1, 16),
        (Input::Probe2, 17),
    ];
    for (input, bit) in table {
        let mut bench = Bench::new("cia402-servo");
        bench.run(2_000);
        assert_eq!((bench.get(0x60FD), bench.device.poll_timeout()), (0, None));
        set_level(&mut bench, input, HIGH);
        assert_eq!(bench.get(0x60FD), 1 << bit, "{input:?}");
        set_level(&mut bench, input, LOW);
        assert_eq!(bench.get(0x60FD), 0, "{input:?}");
    }
}

#[test]
fn outputs_pass_through_their_mask() {
    let mut bench = Bench::new("cia402-servo");
    bench.batch(&[(0x60FE, 1, 0xFFFF_0001)]).unwrap();
    assert_eq!(outputs(&bench), 0);
    bench.batch(&[(0x60FE, 2, 0x0005_0000)]).unwrap();
    assert_eq!(outputs(&bench), 0x0005_0000);
    bench.batch(&[(0x60FE, 1, 0x0004_0000)]).unwrap();
    assert_eq!(outputs(&bench), 0x0004_0000);
}

#[test]
fn the_inputs_of_jvls_module_have_levels_of_their_own() {
    let table =
        [(Input::Probe1, 0), (Input::Probe2, 1), (Input::NegativeLimit, 4), (Input::PositiveLimit, 5)];
    for (input, bit) in table {
        let mut bench = Bench::new("jvl-mac00-fc4");
        set_level(&mut bench, input, HIGH);
        assert_eq!(bench.get_sub(0x2011, 1), 1 << bit, "{input:?}");
        // Active low: now all others are active.
        bench.batch(&[(0x2011, 6, 0)]).unwrap();
        assert_eq!(bench.get_sub(0x2011, 1), 0b11_0011 & !(1 << bit), "{input:?}");
    }
}

/// Ethernet module manual, sections 8.1 (register 47) and 8.2.18 (register 48).
#[test]
fn the_module_registers_show_the_same_inputs_and_the_limit_switches_apart() {
    for (input, inputs, status) in [
        (Input::Probe1, 0b01, 0),
        (Input::Probe2, 0b10, 0),
        (Input::NegativeLimit, 0, 1 << 14),
        (Input::PositiveLimit, 0, 1 << 15),
    ] {
        let mut bench = Bench::new("jvl-mac00-fc4");
        set_level(&mut bench, input, HIGH);
        let registers = &bench.device.profile().registers;
        let register = |role| registers.get(bench.device.dictionary(), role);
        let shown = (register(Role::ModuleInputs), register(Role::ModuleStatusBits));
        assert_eq!(shown, (Some(inputs), Some(status)), "{input:?}");
    }
}

#[test]
fn the_limit_switches_of_jvls_module_act_only_where_they_are_enabled() {
    let mut bench = Bench::new("jvl-mac00-fc4");
    set_level(&mut bench, Input::PositiveLimit, HIGH);
    assert_eq!(bench.get(0x60FD), 0);
    bench.batch(&[(0x2011, 7, 0x20)]).unwrap();
    set_level(&mut bench, Input::NegativeLimit, HIGH);
    assert_eq!(bench.get(0x60FD), 0b10);
}

#[test]
fn the_analogue_input_counts_1023_at_10_volts() {
    let text = Profile::text("jvl-mac00-fc4").unwrap();
    let object = "object = [\n  { index = 0x2101, name = \"Analog input\", type = \"I16\", access = \"ro\", \
                  bind = \"jvl_analog_input\" },";
    let profile = Profile::parse("test.toml", &text.replacen("object = [", object, 1), None).unwrap();
    let mut bench = Bench::of(profile);
    for (volts, counts) in [(10.0, 1023), (-5.0, -512), (0.01, 1), (24.0, 1023), (0.0, 0)] {
        bench.device.set_analog_input(0, Voltage(volts), bench.now);
        assert_eq!(bench.get(0x2101), counts, "{volts} V");
    }
}

#[test]
fn the_outputs_of_jvls_module_are_set_or_tell_its_state() {
    let mut bench = Bench::new("jvl-mac00-fc4");
    bench.batch(&[(0x2011, 2, 0b10)]).unwrap();
    assert_eq!(outputs(&bench), 0b10);
    bench.batch(&[(0x2011, 2, 0), (0x60FE, 1, 0b01)]).unwrap();
    assert_eq!(outputs(&bench), 0b01, "the same pins as 0x60FE");
    bench.batch(&[(0x2011, 5, 0b11)]).unwrap();
    assert_eq!(outputs(&bench), 0, "neither in position nor an error");
    bench.plant().inject(PlantFault::DriveFault(axis::DriveFault::Internal));
    bench.run(5);
    assert_eq!(outputs(&bench), 0b10, "error");
}
