//! What a frame costs between its arrival in the core and the last frame of the answer, with nothing kept beside it and
//! with audit trail and metrics. `cargo bench -p daemon`.
//!
//! For the trail the core notes entries and the loop hands them on; writing is another thread's. For metrics the loop looks at
//! the clock once more in each turn and once for each answer, and counts both; the stamps of the kernel are not in it.

use std::hint::black_box;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::time::Duration;

use canopen::{Frame, Id};
use criterion::{Criterion, criterion_group, criterion_main};
use daemon::clock::Clock;
use daemon::core::{Core, LinkId, Plan};
use daemon::latency::Histogram;
use od::Instant;
use profiles::{PlantSetup, Profile};

const LINK: LinkId = LinkId(0);
/// From one frame to the next: a full bus of 1 Mbit/s.
const GAP: Duration = Duration::from_micros(110);

/// What is kept beside the answer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kept {
    Nothing,
    Trail,
    TrailAndMetrics,
}

impl Kept {
    const ALL: [Self; 3] = [Self::Nothing, Self::Trail, Self::TrailAndMetrics];

    fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing kept",
            Self::Trail => "audit trail",
            Self::TrailAndMetrics => "audit trail and metrics",
        }
    }
}

fn frame(id: u16, payload: &[u8]) -> Frame {
    Frame::new(Id::Standard(id), payload)
}

/// One servo drive that is OPERATIONAL and has no power.
fn core(now: Instant, kept: Kept) -> Core {
    let profile = Profile::embedded("cia402-servo", None).into_iter().flatten().map(Arc::new).next();
    let nodes = vec![(LINK, 1)];
    let (name, plant) = ("x".into(), PlantSetup::default());
    let plan = profile.map(|profile| Plan { name, profile, nodes, plant, serial: None });
    let mut core = Core::new(1, &plan.into_iter().collect::<Vec<_>>(), now).expect("the profile is good");
    if kept != Kept::Nothing {
        core.keep_audit();
    }
    core.start(now, LINK);
    core.handle_frame(now, LINK, &frame(0x000, &[0x01, 1]));
    while core.poll_transmit().is_some() {}
    core
}

/// Has the frames answered in turn, for ever.
fn measure(criterion: &mut Criterion, name: &str, frames: &[Frame]) {
    for kept in Kept::ALL {
        let (entries, trail) = sync_channel(1024);
        let (mut turns, mut answers) = (Histogram::default(), Histogram::default());
        let clock = Clock::start();
        let mut now = Instant::from_nanos(1_000_000_000);
        let mut core = core(now, kept);
        let mut frames = frames.iter().cycle();
        criterion.bench_function(&format!("{name}, {}", kept.name()), |bencher| {
            bencher.iter(|| {
                now = now + GAP;
                if core.poll_timeout().is_some_and(|deadline| deadline <= now) {
                    core.handle_timeout(now);
                }
                frames.next().into_iter().for_each(|frame| core.handle_frame(now, LINK, frame));
                while let Some(answer) = core.poll_transmit() {
                    black_box(answer);
                    if kept == Kept::TrailAndMetrics {
                        answers.record(Clock::wall().saturating_sub(Duration::from_nanos(now.as_nanos())));
                    }
                }
                while let Some(entry) = core.poll_audit() {
                    entries.try_send(entry).expect("there is room");
                    black_box(trail.try_recv().expect("it was just sent"));
                }
                if kept == Kept::TrailAndMetrics {
                    turns.record(clock.now().saturating_since(now));
                }
            });
        });
    }
}

fn frame_path(criterion: &mut Criterion) {
    measure(criterion, "SDO upload", &[frame(0x601, &[0x40, 0x41, 0x60, 0, 0, 0, 0, 0])]);
    // Controlword: shutdown and disable voltage.
    let command = |value| frame(0x601, &[0x2B, 0x40, 0x60, 0, value, 0, 0, 0]);
    measure(criterion, "SDO download of a command", &[command(6), command(0)]);
    // 0x6060:00 has no mode 99.
    measure(criterion, "refused command", &[frame(0x601, &[0x2F, 0x60, 0x60, 0, 99, 0, 0, 0])]);
    // RPDO 3: controlword and target position.
    let set_point = |target| frame(0x401, &[6, 0, target, 0, 0, 0]);
    measure(criterion, "set-point by RPDO", &[set_point(1), set_point(2)]);
}

criterion_group!(benches, frame_path);
criterion_main!(benches);
