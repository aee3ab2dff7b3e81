//! From its construction on an axis allocates nothing, whatever it is told.
#![allow(unsafe_code, reason = "an allocator is unsafe by nature; this one only counts")]

mod fleet;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use axis::Velocity;
use fleet::{Kind, Member};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: everything is left to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Runs an axis through orders of every kind, faults and resets; the steps in motion.
fn work(member: Member) -> usize {
    let (mut axis, mut operator) = (member.axis(), member.operator());
    let before = ALLOCATIONS.get();
    let mut moving = 0;
    for _ in 0..200_000 {
        operator.command(&mut axis);
        axis.step();
        moving += usize::from(axis.status().demand.velocity != Velocity(0.0));
    }
    assert_eq!(ALLOCATIONS.get() - before, 0, "{member:?}");
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
    let before = ALLOCATIONS.get();
    let _axis = Member { kind: Kind::Incremental, number: 0 }.axis();
    assert!(ALLOCATIONS.get() > before);
}
