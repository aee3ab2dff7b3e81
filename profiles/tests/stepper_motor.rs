//! A stepper motor under CiA 402: a motor of a profile file with `kind = "stepper"`.

mod bench;

use axis::{Load, PlantFault};
use bench::Bench;
use profiles::{MotorKind, Profile, State, StepperMotor};

const KIND: &str =
    "kind = \"stepper\"\nfull_steps_per_revolution = 200\nrated_current_ma = 9000\nencoder = true\n";

/// The neutral profile with this at the end of its motor.
fn with_motor(kind: &str) -> String {
    let text = Profile::text("cia402-servo").unwrap();
    let resolution = ("counts_per_revolution = 4096", "counts_per_revolution = 409600");
    format!("{}{kind}", text.replace(resolution.0, resolution.1))
}

fn stepper(has_encoder: bool) -> Bench {
    let text = with_motor(KIND).replace("encoder = true", &format!("encoder = {has_encoder}"));
    let mut bench = Bench::of(Profile::parse("stepper.toml", &text, None).unwrap());
    bench.run(10);
    bench.set(0x607F, 20_480_000);
    bench.batch(&[(0x6081, 0, 4_096_000), (0x6083, 0, 40_960_000), (0x6084, 0, 40_960_000)]).unwrap();
    bench
}

#[test]
fn a_motor_is_a_servo_unless_it_says_otherwise() {
    let kind = |text: &str| Profile::parse("a.toml", text, None).unwrap().motor.unwrap().kind;
    assert_eq!(kind(Profile::text("cia402-servo").unwrap()), MotorKind::Servo);
    assert_eq!(kind(&with_motor("kind = \"servo\"\n")), MotorKind::Servo);
    let stepper = StepperMotor { full_steps_per_revolution: 200, rated_current_ma: 9000, has_encoder: true };
    assert_eq!(kind(&with_motor(KIND)), MotorKind::Stepper(stepper));
}

#[test]
fn a_stepper_needs_its_data_and_a_servo_has_none_of_them() {
    let found = |kind: &str| Profile::parse("a.toml", &with_motor(kind), None).unwrap_err().to_string();
    let missing = found("kind = \"stepper\"\nrated_current_ma = 0\nencoder = 1\n");
    for part in
        ["`full_steps_per_revolution` is missing", "`rated_current_ma` cannot be 0", "`encoder` cannot be 1"]
    {
        assert!(missing.contains(part), "{missing}");
    }
    assert!(found("kind = \"steper\"\n").contains("stepper"), "{}", found("kind = \"steper\"\n"));
    assert!(found("rated_current_ma = 9000\n").contains("unknown key `rated_current_ma`"));
}

#[test]
fn a_stepper_moves_to_the_step_in_profile_position_mode() {
    for has_encoder in [false, true] {
        let mut bench = stepper(has_encoder);
        bench.enable(1);
        bench.move_to(1_000_001, 0);
        bench.run_until(|b| b.is_set(10));
        bench.run(200);
        let error = bench.position() - 1_000_001;
        // Friction holds the rotor a few of its 409600 steps beside.
        assert!(error.abs() <= if has_encoder { 100 } else { 0 }, "{has_encoder}: {error}");
    }
}

#[test]
fn a_stepper_runs_at_3000_rpm_in_profile_velocity_mode_and_stops() {
    let mut bench = stepper(true);
    bench.enable(3);
    bench.set(0x60FF, 20_480_000);
    bench.run(3_000);
    assert!(bench.get(0x60F4).abs() < 200, "{}", bench.get(0x60F4));
    assert!((bench.velocity() - 20_480_000).abs() < 1_000_000, "{}", bench.velocity());
    let place = bench.position();
    bench.run(1_000);
    assert!((bench.position() - place - 20_480_000).abs() < 30_000, "{}", bench.position() - place);
    bench.set(0x60FF, 0);
    bench.run_until(|b| b.velocity() == 0);
}

#[test]
fn a_blocked_stepper_with_an_encoder_is_a_following_error() {
    let mut bench = stepper(true);
    bench.set(0x6065, 4096);
    bench.enable(1);
    bench.move_to(2_000_000, 0);
    bench.run(100);
    bench.plant().inject(PlantFault::BlockedShaft);
    bench.run_until(|b| b.state() == State::Fault);
    assert_eq!(bench.get(0x603F), 0x8611);
}

#[test]
fn a_load_beyond_the_holding_torque_turns_a_stepper() {
    let mut bench = stepper(true);
    bench.enable(1);
    bench.run(100);
    let held = bench.position();
    bench.plant().set_load(Load { inertia_kgm2: 5e-5, gravity_nm: -3.5, ..Load::default() });
    bench.run(1_000);
    assert!(bench.position() < held - 409_600, "{}", bench.position());
}
