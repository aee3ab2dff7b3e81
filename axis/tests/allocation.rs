//! From its construction on an axis allocates nothing, whatever it is told.

mod fleet;

use allocation_counter::measure;
use axis::Velocity;
use fleet::{Kind, Member};

/// Runs an axis through orders of every kind, faults and resets; the steps in motion.
fn work(member: Member) -> usize {
    let (mut axis, mut operator) = (member.axis(), member.operator());
    let mut moving = 0;
    let allocations = measure(|| {
        for _ in 0..200_000 {
            operator.command(&mut axis);
            axis.step();
            moving += usize::from(axis.status().demand.velocity != Velocity(0.0));
        }
    });
    assert_eq!(allocations.count_total, 0, "{member:?}");
    moving
}

#[test]
fn orders_and_steps_of_no_drive_allocate() {
    let kinds = [Kind::Servo(1_000_000), Kind::Incremental, Kind::Ssi, Kind::StepCounter, Kind::StepEncoder];
    for kind in kinds {
        for number in 0..3 {
            let moving = work(Member { kind, number });
            assert!(moving > 10_000, "{kind:?} {number}: {moving}");
        }
    }
}

#[test]
fn an_axis_that_is_made_does_allocate_as_the_count_shows() {
    let allocations = measure(|| drop(Member { kind: Kind::Incremental, number: 0 }.axis()));
    assert!(allocations.count_total > 0);
}
