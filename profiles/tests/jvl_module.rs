//! What JVL's module shows and does beside the motor: the last error, its command register, its setup bits, what it
//! counts.

mod bench;

use std::time::Duration;

use axis::{DriveFault, Input, Load, PlantFault};
use bench::Bench;
use profiles::{DeviceEvent, Role, Space, State};

const MODE: u8 = 2;
const V_SOLL: u8 = 5;
const ERR_STAT: u8 = 35;
const RESET_ERRORS: i64 = 97;

/// What EMCYs carry behind error code and error register.
fn details(bench: &mut Bench) -> Vec<(u16, [u8; 5])> {
    let events = bench.events().into_iter();
    let raised = events.filter_map(|event| match event {
        DeviceEvent::Raised(fault) => Some((fault.code, fault.detail)),
        DeviceEvent::Cleared(_) | DeviceEvent::Store(_) => None,
    });
    raised.collect()
}

fn last_error(bench: &Bench) -> i64 {
    bench.get_sub(0x2011, 4)
}

/// A motor that turns by its registers.
fn turning(motor: &str) -> Bench {
    let mut bench = Bench::motor(motor);
    bench.write(&[(V_SOLL, 1000), (MODE, 1)]);
    bench.run(300);
    bench
}

#[test]
fn the_last_motor_error_is_err_stat_when_it_came_and_stays() {
    // IX_ERR on the small motors; bit 12, the bus voltage (bit 19) and any error (bit 23) on the large ones.
    for (motor, low, detail) in
        [("mac140", 1 << 11, [0x08, 0, 0, 0, 0]), ("mac800", 1 << 12, [0x10, 0, 0x88, 0, 0])]
    {
        let mut bench = turning(motor);
        assert_eq!((last_error(&bench), details(&mut bench)), (0, vec![]), "{motor}");
        bench.plant().inject(PlantFault::DriveFault(DriveFault::OverCurrent));
        bench.run(5);
        let shown = last_error(&bench);
        // The rest are the flags of the moment: in position, and that it slows down.
        assert_eq!(shown & !0b111_0000, low, "{motor}: {shown:#X}");
        let told = details(&mut bench);
        let [(0x1001, emcy)] = told.as_slice() else { panic!("{motor}: {told:X?}") };
        assert_eq!(i64::from(u16::from_be_bytes([emcy[0], emcy[1]])), shown, "{motor}");
        assert_eq!((emcy[0], &emcy[2..]), (detail[0], &detail[2..]), "{motor}");
        bench.plant().clear(PlantFault::DriveFault(DriveFault::OverCurrent));
        bench.run(1_000);
        bench.fastmac(RESET_ERRORS);
        bench.run(5);
        assert_eq!((bench.state(), last_error(&bench)), (State::SwitchOnDisabled, shown), "{motor}");
        assert_eq!(bench.register(ERR_STAT) & 0b1_1000_1000_1111, 0, "{motor}: no error any more");
    }
}

#[test]
fn the_last_error_of_a_stepper_is_its_err_bits() {
    let mut bench = Bench::new("jvl-mis34x");
    bench.plant().inject(PlantFault::DriveFault(DriveFault::Internal));
    bench.run(5);
    // Bit 7, internal, and bit 0, general.
    assert_eq!(last_error(&bench), 0x81);
    assert_eq!(details(&mut bench), [(0x1001, [0, 0x81, 0, 0, 0])]);
}

#[test]
fn the_next_motor_error_replaces_the_last_one_and_that_of_the_module_does_not() {
    let mut bench = turning("mac140");
    bench.plant().inject(PlantFault::DriveFault(DriveFault::OverCurrent));
    bench.run(5);
    bench.plant().clear(PlantFault::DriveFault(DriveFault::OverCurrent));
    bench.run(1_000);
    bench.fastmac(RESET_ERRORS);
    bench.run(5);
    let first = last_error(&bench);
    bench.plant().inject(PlantFault::ConnectionLoss);
    bench.run(50);
    assert_eq!(bench.get(0x603F), 0x1003);
    assert_eq!(last_error(&bench), first, "a motor that is not heard tells no error");
    bench.plant().clear(PlantFault::ConnectionLoss);
    bench.run(50);
    // FLWERRMAX: the torque is too little for the load.
    bench.write(&[(22, 300), (7, 5), (V_SOLL, 1000), (MODE, 1)]);
    bench.plant().set_load(Load { inertia_kgm2: 1.0e-3, ..Load::default() });
    bench.run(3_000);
    assert_eq!(bench.get(0x603F), 0x1001);
    assert_eq!(last_error(&bench) & 0xFF8F, 1 << 1, "FLW_ERR");
}

/// What a module register holds.
fn module_register(bench: &Bench, role: Role) -> i32 {
    bench.device.profile().registers.get(bench.device.dictionary(), role).unwrap()
}

/// Writes a module register, which no CANopen master reaches.
fn set_module(bench: &mut Bench, number: u16, value: u32) {
    bench.write_module(number, value).unwrap();
}

#[test]
fn a_reset_of_the_module_brings_back_what_it_has_kept_and_the_motor_runs_on() {
    let mut bench = turning("mac140");
    set_module(&mut bench, 10, 25);
    bench.command_module(0x10).unwrap();
    let [DeviceEvent::Store(order)] = bench.events()[..] else { panic!("nothing to store") };
    assert_eq!(order.space, Space::Module);
    let saved = bench.device.to_store(order);
    assert_eq!(bench.device.dictionary_mut().set_saved(saved), 0);
    bench.device.stored(bench.now, true);
    set_module(&mut bench, 10, 99);
    bench.batch(&[(0x2011, 2, 0b11)]).unwrap();
    bench.command_module(1).unwrap();
    assert_eq!(module_register(&bench, Role::ModuleTimeout), 25);
    assert_eq!(bench.get_sub(0x2011, 2), 0, "outputs go off");
    bench.run(100);
    let (mode, speed) = (bench.register(MODE), bench.velocity());
    assert!(mode == 1 && speed > 1_000, "mode {mode}, {speed} counts/s");
    // Held in cyclic data it does not act again, after a zero it does.
    set_module(&mut bench, 10, 99);
    bench.command_module(1).unwrap();
    assert_eq!(module_register(&bench, Role::ModuleTimeout), 99);
    bench.command_module(0).unwrap();
    bench.command_module(1).unwrap();
    assert_eq!(module_register(&bench, Role::ModuleTimeout), 25);
}

#[test]
fn a_reset_of_motor_and_module_is_one_of_both() {
    let mut bench = turning("mac140");
    set_module(&mut bench, 10, 99);
    bench.command_module(0x101).unwrap();
    bench.run(100);
    assert_eq!((bench.register(MODE), bench.register(V_SOLL)), (0, 210));
    assert_eq!(module_register(&bench, Role::ModuleTimeout), 0);
}

#[test]
fn led_and_sync_pulse_commands_are_taken_and_change_nothing() {
    for command in [0, 0x11, 0x13, 0x14] {
        let mut bench = turning("mac140");
        let before = (bench.register(MODE), bench.register(V_SOLL), bench.get_sub(0x2011, 2));
        bench.command_module(command).unwrap();
        bench.run(10);
        let after = (bench.register(MODE), bench.register(V_SOLL), bench.get_sub(0x2011, 2));
        assert_eq!((after, bench.events()), (before, vec![]), "{command:#X}");
    }
}

const SETUP: u16 = 6;
const DEBOUNCE: u32 = 1 << 7;
const MIRROR_OUTPUTS: u32 = 1 << 8;
const MIRROR_INPUTS: u32 = 1 << 9;
const HW_PLIM: u8 = 210;

#[test]
fn the_inputs_are_copied_to_register_210_of_the_large_motors() {
    for (motor, shown) in [("mac800", 0b1000), ("mac140", 0)] {
        let mut bench = Bench::motor(motor);
        bench.run(3_000);
        bench.plant().inject(PlantFault::StuckSwitch(Input::Probe2, true));
        bench.run(5);
        assert_eq!(bench.register(HW_PLIM), 0, "{motor}: not without the setup bit");
        set_module(&mut bench, SETUP, MIRROR_INPUTS);
        assert_eq!(bench.register(HW_PLIM), shown, "{motor}");
        bench.plant().inject(PlantFault::StuckSwitch(Input::Probe2, false));
        bench.run(2);
        assert_eq!(bench.register(HW_PLIM), 0, "{motor}");
    }
    // The other bits of the register stay.
    let mut bench = Bench::motor("mac800");
    set_module(&mut bench, SETUP, MIRROR_INPUTS);
    bench.write(&[(HW_PLIM, 0xFFFF)]);
    assert_eq!(bench.register(HW_PLIM), 0xFFC3);
}

#[test]
fn inputs_that_bounce_are_copied_when_they_have_been_stable_for_15_to_25_ms() {
    let mut bench = Bench::motor("mac800");
    set_module(&mut bench, SETUP, MIRROR_INPUTS | DEBOUNCE);
    bench.run(3_000);
    assert_eq!(bench.device.poll_timeout().filter(|due| *due < bench.now + Duration::from_millis(50)), None);
    for _ in 0..10 {
        for is_high in [true, false] {
            bench.plant().inject(PlantFault::StuckSwitch(Input::Probe1, is_high));
            bench.run(10);
            assert_eq!(bench.register(HW_PLIM), 0);
        }
    }
    bench.plant().inject(PlantFault::StuckSwitch(Input::Probe1, true));
    let pressed = bench.now;
    bench.run_until(|b| b.register(HW_PLIM) == 0b100);
    let delay = bench.now.saturating_since(pressed);
    assert!((15..=25).contains(&delay.as_millis()), "{delay:?}");
}

#[test]
fn the_outputs_follow_bits_30_and_31_of_err_stat_where_they_mirror_it() {
    let outputs = |bench: &Bench| bench.device.axes().next().unwrap().outputs;
    let mut bench = Bench::motor("mac800");
    bench.batch(&[(0x2011, 2, 0b01)]).unwrap();
    bench.write(&[(ERR_STAT, 1 << 31)]);
    assert_eq!((outputs(&bench), bench.register(ERR_STAT) >> 30 & 0b11), (0b01, 0b10));
    set_module(&mut bench, SETUP, MIRROR_OUTPUTS);
    assert_eq!(outputs(&bench), 0b10);
    bench.write(&[(ERR_STAT, 0b11 << 30)]);
    assert_eq!(outputs(&bench), 0b11);
    bench.write(&[(ERR_STAT, 0)]);
    assert_eq!(outputs(&bench), 0);
    set_module(&mut bench, SETUP, 0);
    assert_eq!(outputs(&bench), 0b01, "0x2011:02 again");
}

#[test]
fn the_module_counts_what_it_passes_on_to_its_motor() {
    let mut bench = Bench::motor("mac140");
    let frames = |bench: &Bench| module_register(bench, Role::ModuleFrames);
    assert_eq!(frames(&bench), 0);
    bench.write(&[(V_SOLL, 100), (49, 5)]);
    assert_eq!(frames(&bench), 2, "a register each");
    // POS1 and KFF3, with which the motor has nothing to do yet.
    bench.write(&[(51, 5), (89, 1)]);
    assert_eq!(frames(&bench), 4);
    bench.fastmac(RESET_ERRORS);
    bench.command_module(0x8000_00E1).unwrap();
    assert_eq!(frames(&bench), 6, "a command each");
    set_module(&mut bench, 10, 7);
    bench.batch(&[(0x2011, 2, 1)]).unwrap();
    bench.run(100);
    assert_eq!(frames(&bench), 6, "what is the module's own is no frame");
    bench.device.set_overflow(true);
    bench.device.set_overflow(true);
    assert_eq!(module_register(&bench, Role::ModuleDiscarded), 2);
    for times in 1..=3 {
        bench.plant().inject(PlantFault::ConnectionLoss);
        bench.run(50);
        assert_eq!(module_register(&bench, Role::ModuleStatusBits) >> 7 & 1, 1, "no motor");
        bench.plant().clear(PlantFault::ConnectionLoss);
        bench.run(50);
        assert_eq!(module_register(&bench, Role::ModuleStatusBits) >> 7 & 1, 0);
        assert_eq!(module_register(&bench, Role::ModuleTimeouts), times);
    }
    assert_eq!(module_register(&bench, Role::ModuleRetries), 0, "nothing is repeated");
    bench.command_module(1).unwrap();
    let counters = [Role::ModuleFrames, Role::ModuleDiscarded, Role::ModuleTimeouts];
    assert_eq!(counters.map(|role| module_register(&bench, role)), [0; 3]);
}
