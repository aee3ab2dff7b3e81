//! What holds whatever a master writes, in whatever order, at whatever time.

mod bench;

use bench::Bench;
use profiles::State;
use proptest::prelude::*;

const MIN: i64 = -3_000;
const MAX: i64 = 5_000;
const FASTEST: i64 = 50_000;

/// Objects a master may write while the drive runs, the limits themselves left out.
const WRITABLE: [u16; 13] =
    [0x6040, 0x6060, 0x607A, 0x60FF, 0x6081, 0x6083, 0x6085, 0x6086, 0x605A, 0x6067, 0x6068, 0x606D, 0x6072];

#[derive(Clone, Debug)]
enum Action {
    Write(usize, i64),
    Control(i64),
    Wait(u64),
}

fn action() -> impl Strategy<Value = Action> {
    let number = prop_oneof![any::<i32>().prop_map(i64::from), -20_000_i64..20_000, 0_i64..4];
    let word = prop_oneof![
        prop::sample::select(vec![
            0x06_i64, 0x07, 0x0F, 0x1F, 0x3F, 0x5F, 0x7F, 0x21F, 0x10F, 0x02, 0x00, 0x80
        ]),
        0_i64..0x1_0000
    ];
    prop_oneof![
        2 => (0..WRITABLE.len(), number).prop_map(|(object, value)| Action::Write(object, value)),
        3 => word.prop_map(Action::Control),
        3 => (0_u64..200).prop_map(Action::Wait),
    ]
}

fn limited(profile: &str) -> Bench {
    let mut bench = Bench::new(profile);
    bench.fast_profile();
    bench.batch(&[(0x607D, 1, MIN), (0x607D, 2, MAX)]).unwrap();
    if profile == "cia402-servo" {
        bench.set(0x607F, FASTEST);
        bench.set(0x6065, 0xFFFF_FFFF);
    }
    bench
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn set_points_never_pass_a_limit(actions in prop::collection::vec(action(), 1..60), is_jvl: bool) {
        let mut bench = limited(if is_jvl { "jvl-mac00-fc4" } else { "cia402-servo" });
        // Enabled at first, so that most sequences move; the random words may do with it what they like.
        bench.enable(if actions.len() % 2 == 0 { 1 } else { 3 });
        let mut was_enabled = true;
        for action in actions {
            match action {
                Action::Write(object, value) => {
                    // What the gate refuses changes nothing.
                    let _ = bench.batch(&[(WRITABLE[object], 0, value)]);
                }
                Action::Control(word) => bench.control(word),
                Action::Wait(millis) => {
                    for _ in 0..millis {
                        bench.run(1);
                        let is_enabled = bench.state() == State::OperationEnabled;
                        // A coasting axis may lie beyond a limit when it is enabled; then it may only come back.
                        if is_enabled && was_enabled && !is_jvl {
                            let velocity = bench.get(0x606B);
                            prop_assert!(velocity.abs() <= FASTEST, "velocity {velocity}");
                        }
                        was_enabled = is_enabled;
                    }
                }
            }
            let statusword = bench.statusword();
            let expected = profiles::Statusword::of(bench.state()).bits();
            prop_assert_eq!(statusword & 0x6F, i64::from(expected), "the statusword tells the state");
        }
    }

    #[test]
    fn an_axis_that_is_never_switched_off_stays_inside_its_limits(
        targets in prop::collection::vec((any::<i32>(), 0_u64..300, any::<bool>(), 1_i64..400_000), 1..30),
    ) {
        let mut bench = limited("cia402-servo");
        bench.enable(1);
        for (target, millis, in_velocity_mode, acceleration) in targets {
            let mode = if in_velocity_mode { 3 } else { 1 };
            bench.batch(&[
                (0x6060, 0, mode),
                (0x607A, 0, i64::from(target)),
                (0x60FF, 0, i64::from(target)),
                (0x6083, 0, acceleration),
                (0x6084, 0, acceleration),
            ]).unwrap();
            bench.control(0x3F);
            bench.control(0x2F);
            for _ in 0..millis {
                bench.run(1);
                let demand = bench.get(0x6062);
                prop_assert!((MIN..=MAX).contains(&demand), "demand {demand}");
                prop_assert_eq!(bench.state(), State::OperationEnabled);
            }
        }
    }

    #[test]
    fn a_cut_of_the_power_is_coasting_to_rest(velocity in 2_000_i64..60_000) {
        let mut bench = Bench::new("cia402-servo");
        bench.fast_profile();
        bench.set(0x60FF, velocity);
        bench.enable(3);
        bench.run_until(|b| b.is_set(10));
        bench.control(0);
        let mut last = bench.velocity();
        while !bench.device.is_quiet() {
            bench.run(1);
            let velocity = bench.velocity();
            prop_assert!(velocity <= last && velocity >= 0, "from {last} to {velocity}");
            // Friction is a hundredth of the rated torque: 10 mNm on 100 µkg·m², 65190 counts/s²; the viscous
            // part adds some at speed.
            prop_assert!(last - velocity <= 140, "braked by more than friction: from {last} to {velocity}");
            last = velocity;
        }
    }
}
