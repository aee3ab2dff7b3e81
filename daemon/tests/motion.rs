//! Axes led by a local master, on virtual time.

mod common;

use std::sync::Arc;
use std::time::Duration;

use common::Bench;
use daemon::core::Authority;
use daemon::motion::{Goal, Next, READ, Sequence, Setting, View, part};
use daemon::objects;
use od::{Bus, Owner};
use profiles::{Instruction, Profile};

const CAN: Owner = Owner { bus: Bus::CanOpen, link: None };
const LOOK: Duration = Duration::from_millis(20);
const SECOND: Duration = Duration::from_secs(1);
/// Longer than any of these takes.
const PATIENCE: Duration = Duration::from_secs(60);

/// A device, and the master that leads its first axis.
struct Master {
    bench: Bench,
    profile: Arc<Profile>,
}

impl Master {
    fn of(profile: &str) -> Self {
        let profile = Arc::new(Profile::embedded(profile, None).unwrap().unwrap());
        let mut bench = Bench::of(&profile, &[&[(0, 1)]]);
        // The drive starts up.
        bench.run(Duration::from_millis(100));
        Self { bench, profile }
    }

    fn view(&self) -> View {
        let number = |index: &u16| {
            let address = part(*index, 0);
            let schema = &self.profile.application;
            let entry = schema.entry(schema.slot(address)?)?;
            let value = self.bench.core.read(0, 0, address).ok()?;
            i64::try_from(entry.data_type.integer(value.raw())).ok()
        };
        View::new(&READ.iter().map(number).collect::<Vec<_>>()).unwrap()
    }

    /// Writes through the gate; the first refusal.
    fn write(&mut self, settings: &[Setting]) -> Result<(), String> {
        self.write_with(settings, Authority::Owner)
    }

    fn write_with(&mut self, settings: &[Setting], authority: Authority) -> Result<(), String> {
        let schema = Arc::clone(&self.profile.application);
        let encoded = settings.iter().map(|(address, number)| {
            let entry = schema.entry(schema.slot(*address).unwrap()).unwrap();
            (*address, objects::parse(entry.data_type, &number.to_string()).unwrap())
        });
        let writes: Vec<_> = encoded.collect();
        let written = self.bench.core.write(self.bench.now, 0, 0, &writes, authority);
        written.map(|_| ()).map_err(|refused| format!("{}: {}", refused.address, refused.code.text()))
    }

    /// Looks once; how it has ended, if it has.
    fn look(&mut self, sequence: &mut Sequence) -> Option<Result<String, String>> {
        let view = self.view();
        match sequence.next(self.bench.now, &view) {
            Next::Wait => None,
            Next::Write(settings) => {
                let authority = if sequence.is_halting() { Authority::Stop } else { Authority::Owner };
                self.write_with(&settings, authority).err().map(Err)
            }
            Next::Done(text) => Some(Ok(text)),
            Next::Failed(text) => Some(Err(text)),
        }
    }

    /// Leads the axis for so long, or until it ends.
    fn lead(&mut self, sequence: &mut Sequence, time: Duration) -> Option<Result<String, String>> {
        let end = self.bench.now + time;
        while self.bench.now < end {
            if let Some(ended) = self.look(sequence) {
                return Some(ended);
            }
            self.bench.run(LOOK);
        }
        None
    }

    /// Leads the axis to the end.
    fn finish(&mut self, sequence: &mut Sequence) -> Result<String, String> {
        self.lead(sequence, PATIENCE).expect("a sequence always ends")
    }

    fn go(&mut self, goal: Goal) -> Result<String, String> {
        self.finish(&mut Sequence::new(goal, 0))
    }

    fn state(&self) -> &'static str {
        self.view().state().name()
    }

    fn velocity(&self) -> f64 {
        self.bench.core.devices().next().unwrap().axes().next().unwrap().velocity.0
    }

    fn is_near(&self, position: i64) -> bool {
        (self.view().position - position).abs() <= 10
    }
}

fn to(position: i64) -> Goal {
    Goal::Move { position, is_relative: false, velocity: None, acceleration: None }
}

fn by(position: i64) -> Goal {
    Goal::Move { position, is_relative: true, velocity: Some(20_000), acceleration: Some(100_000) }
}

fn jog(velocity: i64, time: Option<Duration>) -> Goal {
    Goal::Jog { velocity, acceleration: None, time }
}

fn done(text: &str) -> Result<String, String> {
    Ok(text.to_owned())
}

fn failed(text: &str) -> Result<String, String> {
    Err(text.to_owned())
}

#[test]
fn an_axis_without_power_is_switched_on_and_moved() {
    let mut master = Master::of("cia402-servo");
    assert_eq!(master.go(to(10_000)), done("target reached"));
    assert!(master.is_near(10_000) && master.state() == "OPERATION ENABLED", "{:?}", master.view());

    assert_eq!(master.go(by(-3000)), done("target reached"));
    assert!(master.is_near(7000), "{:?}", master.view());
    // Where it is already.
    assert_eq!(master.go(to(7000)), done("target reached"));
}

#[test]
fn a_jog_runs_until_its_time_is_over_and_leaves_no_velocity_behind() {
    let mut master = Master::of("cia402-servo");
    let mut sequence = Sequence::new(jog(5000, Some(SECOND)), 0);
    assert_eq!(master.lead(&mut sequence, SECOND / 2), None);
    assert!((master.velocity() - 5000.0).abs() < 100.0, "{}", master.velocity());

    assert_eq!(master.finish(&mut sequence), done("stopped, OPERATION ENABLED"));

    master.bench.run(SECOND);
    assert!(master.velocity().abs() < 10.0);
    // Whoever ends the halt finds an axis at rest.
    master.write(&[(part(0x6040, 0), 0x000F)]).unwrap();
    master.bench.run(SECOND);
    assert!(master.velocity().abs() < 10.0, "{}", master.velocity());
}

#[test]
fn who_interrupts_a_jog_stops_it() {
    for profile in ["cia402-servo", "jvl-mac00-fc4"] {
        let mut master = Master::of(profile);
        let mut sequence = Sequence::new(jog(500, None), 0);
        assert_eq!(master.lead(&mut sequence, 2 * SECOND), None);
        assert!(master.velocity().abs() > 100.0, "{profile}");
        sequence.interrupt();
        assert_eq!(master.finish(&mut sequence), done("stopped, OPERATION ENABLED"), "{profile}");
        master.bench.run(SECOND);
        assert!(master.velocity().abs() < 10.0, "{profile}");
    }
}

#[test]
fn who_interrupts_a_move_halts_it_and_the_next_one_does_not_go_on_with_it() {
    let mut master = Master::of("cia402-servo");
    let slow = Goal::Move { position: 100_000, is_relative: false, velocity: Some(5000), acceleration: None };
    let mut sequence = Sequence::new(slow, 0);
    assert_eq!(master.lead(&mut sequence, SECOND), None);
    sequence.interrupt();
    assert_eq!(master.finish(&mut sequence), failed("interrupted; OPERATION ENABLED"));
    let halted = master.view().position;
    master.bench.run(SECOND);
    assert!(master.is_near(halted));

    let mut back = Sequence::new(to(0), 0);
    let mut farthest = halted;
    let ended = loop {
        if let Some(ended) = master.look(&mut back) {
            break ended;
        }
        master.bench.run(LOOK);
        farthest = farthest.max(master.view().position);
    };
    assert_eq!(ended, done("target reached"));
    assert!(farthest - halted < 20 && master.is_near(0), "{halted} {farthest}");
}

#[test]
fn an_axis_interrupted_while_it_is_switched_on_does_not_run_later() {
    for looks in 1..12 {
        let mut master = Master::of("cia402-servo");
        let mut sequence = Sequence::new(jog(5000, None), 0);
        for _ in 0..looks {
            assert_eq!(master.look(&mut sequence), None);
            master.bench.run(Duration::from_millis(1));
        }
        sequence.interrupt();
        let _ = master.finish(&mut sequence);
        master.bench.run(2 * SECOND);
        assert!(master.velocity().abs() < 10.0, "after {looks} looks: {}", master.velocity());
    }
}

#[test]
fn a_mode_that_only_changes_without_power_is_changed_so() {
    let mut master = Master::of("jvl-mac00-fc4");
    assert_eq!(master.go(to(100)), done("target reached"));
    assert_eq!(master.go(jog(500, Some(SECOND))), done("stopped, OPERATION ENABLED"));
    assert_eq!(master.go(to(0)), done("target reached"));
    assert!(master.is_near(0), "{:?}", master.view());
}

#[test]
fn homing_ends_with_the_origin_or_with_the_error_of_the_drive() {
    let mut master = Master::of("cia402-servo");
    assert_eq!(master.go(to(5000)), done("target reached"));
    assert_eq!(master.go(Goal::Home { method: Some(37) }), done("homed"));
    assert!(master.is_near(0), "{:?}", master.view());
    assert_eq!(master.go(Goal::Home { method: Some(36) }), failed("0x6098:00: invalid value for parameter"));
}

#[test]
fn a_stop_reaches_a_motor_that_runs_by_its_registers() {
    const MODE_REG: od::Address = od::Address::new(0x2012, 2);
    let mut master = Master::of("jvl-mac00-fc4");
    master.write(&[(MODE_REG, 1)]).unwrap();
    master.bench.run(SECOND);
    assert!(master.velocity() > 1000.0, "{}", master.velocity());
    assert_eq!(master.go(Goal::Stop), done("stopped, SWITCH ON DISABLED"));
    assert!(master.velocity().abs() < 50.0, "{}", master.velocity());
    let position = master.view().position;
    master.bench.run(SECOND);
    assert!((master.view().position - position).abs() < 50, "it holds");
}

#[test]
fn a_stop_reaches_an_axis_that_runs_by_the_instructions_of_its_card() {
    for (card, speed) in [("maccon-mac4-inc", 25), ("maccon-mac4-ssi", 25), ("maccon-mac4-stp", 3_000)] {
        let mut master = Master::of(card);
        let instruction = |code: Instruction| od::Address::new(0x2100, code as u8);
        master.write(&[(instruction(Instruction::INIT), 1)]).unwrap();
        master.write(&[(instruction(Instruction::ME), 1), (instruction(Instruction::E), 1)]).unwrap();
        master.bench.run(SECOND);
        master.write(&[(instruction(Instruction::WSV), speed), (instruction(Instruction::WSA), 50)]).unwrap();
        master.write(&[(instruction(Instruction::MS), 1), (instruction(Instruction::E), 1)]).unwrap();
        master.bench.run(SECOND);
        assert!(master.velocity() > 500.0, "{card}: {}", master.velocity());

        assert_eq!(master.go(Goal::Stop), done("stopped, SWITCH ON DISABLED"), "{card}");

        assert!(master.velocity().abs() < 50.0, "{card}: {}", master.velocity());
        let position = master.view().position;
        master.bench.run(SECOND);
        assert!((master.view().position - position).abs() < 50, "{card}: it stays there");
    }
}

#[test]
fn a_stop_brings_an_axis_to_rest_and_leaves_one_without_power_alone() {
    let mut master = Master::of("cia402-servo");
    assert_eq!(master.go(Goal::Stop), done("has no power: SWITCH ON DISABLED"));
    let mut sequence = Sequence::new(jog(5000, None), 0);
    assert_eq!(master.lead(&mut sequence, SECOND), None);
    assert_eq!(master.go(Goal::Stop), done("stopped, SWITCH ON DISABLED"));
    assert!(master.velocity().abs() < 50.0, "{}", master.velocity());

    // Quick stop that holds (0x605A = 6).
    master.write(&[(part(0x605A, 0), 6)]).unwrap();
    let mut sequence = Sequence::new(jog(5000, None), 0);
    assert_eq!(master.lead(&mut sequence, SECOND), None);
    assert_eq!(master.go(Goal::Stop), done("stopped, QUICK STOP ACTIVE"));
    assert!(master.velocity().abs() < 50.0, "{}", master.velocity());
    // And it is moved from there.
    let here = master.view().position;
    assert_eq!(master.go(to(here + 500)), done("target reached"));
}

#[test]
fn an_axis_of_somebody_else_is_not_led_but_stopped() {
    let mut master = Master::of("cia402-servo");
    let mut sequence = Sequence::new(jog(5000, None), 0);
    assert_eq!(master.lead(&mut sequence, SECOND), None);
    master.bench.core.claim(master.bench.now, 0, 0, CAN).unwrap();
    let refused = "because of the present device state";
    assert!(master.go(to(0)).unwrap_err().contains(refused));
    assert!(master.write(&[(part(0x6040, 0), 0x0000)]).unwrap_err().contains(refused), "a write is no stop");
    assert!(master.velocity() > 1000.0, "{}", master.velocity());

    assert_eq!(master.go(Goal::Stop), done("stopped, SWITCH ON DISABLED"));

    assert!(master.velocity().abs() < 50.0, "{}", master.velocity());
    assert_eq!(master.bench.core.owner(0, 0), Some(CAN), "it stays whose it was");
    assert!(master.go(to(0)).unwrap_err().contains(refused));
}

#[test]
fn a_jog_that_runs_when_its_axis_is_claimed_still_ends_at_rest() {
    let mut master = Master::of("cia402-servo");
    let mut sequence = Sequence::new(jog(5000, None), 0);
    assert_eq!(master.lead(&mut sequence, SECOND), None);
    master.bench.core.claim(master.bench.now, 0, 0, CAN).unwrap();
    sequence.interrupt();
    assert_eq!(master.finish(&mut sequence), done("stopped, OPERATION ENABLED"));
    assert!(master.velocity().abs() < 50.0, "{}", master.velocity());
}

#[test]
fn a_stop_of_somebody_else_ends_a_jog() {
    let mut master = Master::of("cia402-servo");
    let mut sequence = Sequence::new(jog(5000, None), 0);
    assert_eq!(master.lead(&mut sequence, SECOND), None);
    assert_eq!(master.go(Goal::Stop), done("stopped, SWITCH ON DISABLED"));
    let ended = master.finish(&mut sequence);
    assert_eq!(ended, failed("the axis has left OPERATION ENABLED: SWITCH ON DISABLED"));
}

#[test]
fn a_fault_ends_a_move_and_keeps_the_next_one_from_beginning() {
    let mut master = Master::of("cia402-servo");
    let mut sequence = Sequence::new(by(1_000_000), 0);
    assert_eq!(master.lead(&mut sequence, SECOND), None);
    let now = master.bench.now;
    master.bench.core.inject(now, 0, 0, "drive-fault:over-current".parse().unwrap()).unwrap();
    let ended = master.finish(&mut sequence).unwrap_err();
    assert!(ended.starts_with("the axis is in FAULT") && ended.contains(", error 0x"), "{ended}");
    master.bench.run(5 * SECOND);
    let ended = master.go(to(0)).unwrap_err();
    assert!(ended.starts_with("the axis is in FAULT, error 0x"), "{ended}");
}

#[test]
fn a_target_behind_a_limit_is_told_and_not_reached() {
    let mut master = Master::of("cia402-servo");
    let limits = [(0x607D, 1, -1000), (0x607D, 2, 1000)];
    let limits = limits.map(|(index, sub, number)| (od::Address::new(index, sub), number));
    master.write(&limits).unwrap();
    let ended = master.go(to(5000)).unwrap_err();
    assert!(ended.starts_with("a limit is in the way, 4000 before the target"), "{ended}");
    assert!(master.view().position <= 1000);
}

#[test]
fn an_axis_that_is_held_is_given_up_and_halted() {
    let mut master = Master::of("cia402-servo");
    assert_eq!(master.go(to(1000)), done("target reached"));
    // Neither a following error nor heat is to end it first.
    master.write(&[(part(0x6065, 0), i64::from(u32::MAX)), (part(0x6072, 0), 300)]).unwrap();
    let now = master.bench.now;
    master.bench.core.inject(now, 0, 0, "blocked-shaft".parse().unwrap()).unwrap();
    let slow = Goal::Move { position: 50_000, is_relative: false, velocity: Some(100), acceleration: None };
    let ended = master.go(slow).unwrap_err();
    assert_eq!(ended, "nothing has moved for 5 s, the target is not reached; OPERATION ENABLED");
    assert_ne!(master.view().controlword & 0x0100, 0, "halted");
}

#[test]
fn what_a_drive_refuses_is_told_and_nothing_begins() {
    let mut master = Master::of("jvl-mac00-fc4");
    let ended = master.go(Goal::Home { method: Some(35) });
    assert_eq!(ended, failed("0x6098:00: invalid value for parameter"));
    assert_eq!(master.state(), "SWITCH ON DISABLED");
}

#[test]
fn a_drive_with_several_axes_is_led_by_the_objects_of_each() {
    // Objects of the axes follow at a distance of 0x800 (CiA 402-1).
    let mut sequence = Sequence::new(jog(5000, None), 2);
    let off = View { statusword: 0x0640, ..View::default() };
    let Next::Write(settings) = sequence.next(od::Instant::ZERO, &off) else { panic!() };
    let written: Vec<u16> = settings.iter().map(|(address, _)| address.index).collect();
    assert_eq!(written, [0x70FF, 0x7060]);
    let Next::Write(settings) = sequence.next(od::Instant::ZERO, &off) else { panic!() };
    assert_eq!(settings, [(od::Address::new(0x7040, 0), 6)]);
}
