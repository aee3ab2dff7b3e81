//! What a drive does when its master is gone: 0x6007, abort connection option code (IEC 61800-7-201).

mod bench;

use bench::Bench;
use od::AbortCode;
use profiles::{DeviceEvent, State};

const NEUTRAL: &str = "cia402-servo";
const JVL: &str = "jvl-mac00-fc4";
const PROFILE_VELOCITY: i64 = 3;

/// An axis that runs at 20,000 counts/s, with 0x6007 at `option`.
fn running(profile: &str, option: i64) -> Bench {
    let mut bench = Bench::new(profile);
    bench.fast_profile();
    bench.set(0x6007, option);
    bench.enable(PROFILE_VELOCITY);
    bench.set(0x60FF, 20_000);
    bench.run_until(|b| (b.velocity() - 20_000).abs() < 200);
    bench
}

fn lose_connection(bench: &mut Bench) {
    let now = bench.now;
    bench.device.connection_lost(now);
}

#[test]
fn from_factory_a_drive_that_loses_its_master_stops_quickly() {
    for profile in [NEUTRAL, JVL] {
        let mut bench = Bench::new(profile);
        assert_eq!(bench.get(0x6007), 3, "{profile}");
        bench.fast_profile();
        bench.enable(PROFILE_VELOCITY);
        bench.set(0x60FF, 20_000);
        bench.run(1_000);
        lose_connection(&mut bench);
        assert_eq!(bench.state(), State::QuickStopActive);
        // 20,000 counts/s at 200,000 counts/s^2 are 100 ms.
        bench.run(80);
        assert!(bench.velocity() > 0, "{profile}: it ramps down");
        bench.run(40);
        assert_eq!(bench.state(), State::SwitchOnDisabled, "{profile}");
        bench.run(1_000);
        assert!(bench.device.is_quiet(), "{profile}");
        assert_eq!(bench.events(), []);
    }
}

#[test]
fn option_0_does_nothing() {
    let mut bench = running(NEUTRAL, 0);
    lose_connection(&mut bench);
    bench.run(1_000);
    assert_eq!(bench.state(), State::OperationEnabled);
    assert!((bench.velocity() - 20_000).abs() < 200);
}

#[test]
fn option_1_is_a_fault() {
    for (profile, code) in [(NEUTRAL, 0x8100), (JVL, 0x1001)] {
        let mut bench = running(profile, 1);
        lose_connection(&mut bench);
        // The neutral drive ramps down first, 0x605E is 2; that of JVL coasts.
        bench.run_until(|b| b.state() == State::Fault);
        assert_eq!(bench.get(0x603F), code);
        let events = bench.events();
        assert!(
            matches!(events.as_slice(), [DeviceEvent::Raised(fault)] if i64::from(fault.code) == code),
            "{events:?}"
        );
        lose_connection(&mut bench); // once more changes nothing
        assert_eq!(bench.state(), State::Fault);
        bench.control(0x80);
        assert_eq!(bench.state(), State::SwitchOnDisabled);
        assert_eq!(bench.get(0x603F), 0);
    }
}

#[test]
fn option_2_cuts_the_power() {
    let mut bench = running(NEUTRAL, 2);
    lose_connection(&mut bench);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    bench.run(60);
    assert!(bench.velocity() > 10_000, "it coasts: {}", bench.velocity());
}

#[test]
fn option_3_stops_as_the_quick_stop_option_says() {
    let mut bench = running(NEUTRAL, 3);
    bench.set(0x605A, 6);
    lose_connection(&mut bench);
    bench.run(1_000);
    assert_eq!((bench.state(), bench.velocity()), (State::QuickStopActive, 0));
}

#[test]
fn other_options_do_not_exist() {
    let mut bench = Bench::new(NEUTRAL);
    assert_eq!(bench.batch(&[(0x6007, 0, 4)]), Err(AbortCode::ValueTooHigh));
    assert_eq!(bench.batch(&[(0x6007, 0, -1)]), Err(AbortCode::ValueTooLow));
}

#[test]
fn a_drive_that_does_not_operate_stays_as_it_is() {
    for word in [0x00, 0x06, 0x07] {
        for option in 0..=3 {
            let mut bench = Bench::new(NEUTRAL);
            bench.set(0x6007, option);
            bench.control(0x06);
            bench.control(word);
            bench.run(100);
            let before = bench.state();
            lose_connection(&mut bench);
            bench.run(100);
            assert_eq!(bench.state(), before, "{word:02X} with option {option}");
        }
    }
}

#[test]
fn power_that_is_coming_on_goes_off_again() {
    let mut bench = Bench::new(NEUTRAL);
    bench.control(0x06);
    bench.control(0x0F);
    lose_connection(&mut bench);
    bench.run(1_000);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
    assert!(bench.device.is_quiet());
}

#[test]
fn a_second_loss_does_not_disturb_the_stop() {
    let mut bench = running(NEUTRAL, 3);
    lose_connection(&mut bench);
    bench.run(50);
    lose_connection(&mut bench);
    bench.run(70);
    assert_eq!(bench.state(), State::SwitchOnDisabled);
}
