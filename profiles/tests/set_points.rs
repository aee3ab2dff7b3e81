//! The set-point handshake of profile position mode, as traces: what is written when, and what the drive says then.

mod bench;

use std::collections::VecDeque;

use bench::Bench;
use profiles::State;
use proptest::prelude::*;

const ACKNOWLEDGED: u32 = 12;
const REACHED: u32 = 10;

type Writes = &'static [(u16, u8, i64)];

/// One line of a trace.
///
/// With 100 000 counts/s² and 20 000 counts/s a move of 4000 counts takes 400 ms, half of them to the middle.
struct Row {
    /// Milliseconds since the trace began.
    at: u64,
    /// What one frame writes: the controlword, and a target with it.
    writes: Writes,
    /// Bit 12 and bit 10 after that.
    says: (bool, bool),
    /// 0x6062.
    demand: i64,
}

const fn row(at: u64, writes: Writes, says: (bool, bool), demand: i64) -> Row {
    Row { at, writes, says, demand }
}

const YES: bool = true;
const NO: bool = false;

fn enabled(profile: &str) -> Bench {
    let mut bench = Bench::new(profile);
    bench.fast_profile();
    bench.enable(1);
    bench.run(100);
    bench
}

fn trace(bench: &mut Bench, rows: &[Row]) {
    let start = bench.now;
    for (number, row) in rows.iter().enumerate() {
        let now = u64::try_from(bench.now.saturating_since(start).as_millis()).unwrap();
        bench.run(row.at - now);
        if !row.writes.is_empty() {
            bench.batch(row.writes).unwrap();
        }
        let said = (bench.is_set(ACKNOWLEDGED), bench.is_set(REACHED));
        let demand = bench.get(0x6062);
        assert_eq!(said, row.says, "row {number} at {} ms, demand {demand}", row.at);
        assert!((demand - row.demand).abs() <= 1, "row {number} at {} ms: demand {demand}", row.at);
    }
}

macro_rules! writes {
    ($word:literal) => {
        &[(0x6040, 0, $word)]
    };
    ($word:literal to $target:expr) => {
        &[(0x6040, 0, $word), (0x607A, 0, $target)]
    };
}

#[test]
fn one_set_point_with_its_handshake() {
    let rows = [
        row(0, &[], (NO, YES), 0),
        row(0, writes!(0x1F to 4_000), (YES, NO), 0),
        row(10, writes!(0x0F), (NO, NO), 5),
        row(100, &[], (NO, NO), 500),
        row(300, &[], (NO, NO), 3_500),
        row(401, &[], (NO, NO), 4_000),
        row(420, &[], (NO, YES), 4_000),
    ];
    trace(&mut enabled("cia402-servo"), &rows);
}

#[test]
fn a_bit_that_is_held_is_one_set_point() {
    let rows = [
        row(0, writes!(0x1F to 4_000), (YES, NO), 0),
        row(420, &[], (YES, YES), 4_000),
        row(430, writes!(0x1F to 8_000), (YES, YES), 4_000),
        row(900, &[], (YES, YES), 4_000),
        row(900, writes!(0x0F), (NO, YES), 4_000),
        row(900, writes!(0x1F), (YES, NO), 4_000),
        row(1_350, &[], (YES, YES), 8_000),
    ];
    trace(&mut enabled("cia402-servo"), &rows);
}

#[test]
fn set_points_within_one_raster_step_wait_and_a_full_buffer_takes_no_more() {
    let rows = [
        row(0, writes!(0x1F to 4_000), (YES, NO), 0),
        row(0, writes!(0x0F), (NO, NO), 0),
        row(0, writes!(0x1F to 0), (YES, NO), 0),
        row(0, writes!(0x0F), (NO, NO), 0),
        row(0, writes!(0x1F to 1_000), (YES, NO), 0),
        row(0, writes!(0x0F), (YES, NO), 0),
        row(0, writes!(0x1F to 9_999), (YES, NO), 0),
        row(0, writes!(0x0F), (YES, NO), 0),
        row(400, &[], (YES, NO), 4_000),
        row(420, &[], (NO, NO), 4_000 - 9),
        row(810, &[], (NO, NO), 0),
        row(1_100, &[], (NO, YES), 1_000),
    ];
    trace(&mut enabled("cia402-servo"), &rows[..9]);
    let mut bench = enabled("cia402-servo");
    trace(&mut bench, &rows[..8]);
    let mut visited = vec![0];
    while !bench.is_set(REACHED) {
        bench.run(1);
        let (demand, velocity) = (bench.get(0x6062), bench.get(0x606B));
        if velocity == 0 && visited.last() != Some(&demand) {
            visited.push(demand);
        }
    }
    assert_eq!(visited, [0, 4_000, 0, 1_000]);
    assert!(!bench.is_set(ACKNOWLEDGED));
}

#[test]
fn a_jvl_drive_lets_one_set_point_wait() {
    let rows: [(Writes, bool); 4] = [
        (writes!(0x1F to 4_000), true),
        (writes!(0x0F), false),
        (writes!(0x1F to 0), true),
        (writes!(0x0F), true),
    ];
    let mut bench = enabled("jvl-mac00-fc4");
    for (writes, is_acknowledged) in rows {
        bench.batch(writes).unwrap();
        assert_eq!(bench.is_set(ACKNOWLEDGED), is_acknowledged, "{writes:?}");
    }
    bench.run_until(|b| b.is_set(REACHED));
    assert!(!bench.is_set(ACKNOWLEDGED) && bench.position().abs() <= 1);
}

#[test]
fn a_target_counts_as_it_was_at_the_edge() {
    let rows = [
        row(0, writes!(0x1F to 4_000), (YES, NO), 0),
        row(1, &[(0x607A, 0, 8_000), (0x6081, 0, 1)], (YES, NO), 0),
        row(200, &[], (YES, NO), 2_000),
        row(500, &[], (YES, YES), 4_000),
    ];
    trace(&mut enabled("cia402-servo"), &rows);
}

#[test]
fn a_set_point_during_a_halt_waits_for_its_end() {
    let rows = [
        row(0, writes!(0x1F to 4_000), (YES, NO), 0),
        row(100, writes!(0x10F), (NO, NO), 500),
        row(210, &[], (NO, YES), 1_000),
        row(210, writes!(0x11F to 2_000), (YES, YES), 1_000),
        row(220, writes!(0x10F), (NO, YES), 1_000),
        row(300, writes!(0x0F), (NO, NO), 1_000),
        row(400, &[], (NO, NO), 1_500),
        row(648, &[], (NO, NO), 4_000),
        row(1_000, &[], (NO, YES), 2_000),
    ];
    trace(&mut enabled("cia402-servo"), &rows);
}

#[test]
fn an_immediate_set_point_during_a_halt_replaces_the_one_before() {
    let rows = [
        row(0, writes!(0x1F to 4_000), (YES, NO), 0),
        row(100, writes!(0x10F), (NO, NO), 500),
        row(210, writes!(0x13F to 0), (YES, YES), 1_000),
        row(220, writes!(0x10F), (NO, YES), 1_000),
        row(300, writes!(0x0F), (NO, NO), 1_000),
        row(400, &[], (NO, NO), 500),
        row(520, &[], (NO, YES), 0),
    ];
    trace(&mut enabled("cia402-servo"), &rows);
}

#[test]
fn a_quick_stop_drops_the_set_and_a_bit_held_through_it_is_no_edge() {
    let rows = [
        row(0, &[(0x605A, 0, 6)], (NO, YES), 0),
        row(0, writes!(0x1F to 4_000), (YES, NO), 0),
        row(0, writes!(0x0F), (NO, NO), 0),
        row(0, writes!(0x1F to 8_000), (YES, NO), 0),
        row(100, writes!(0x02), (NO, NO), 500),
        // Bit 10 in QUICK STOP ACTIVE: it stands.
        row(160, writes!(0x12 to 2_000), (NO, YES), 750),
        row(170, writes!(0x1F), (NO, NO), 750),
        row(400, &[], (NO, YES), 750),
        row(400, writes!(0x0F), (NO, YES), 750),
        row(400, writes!(0x1F to 750), (YES, NO), 750),
        row(420, &[], (YES, YES), 750),
    ];
    trace(&mut enabled("cia402-servo"), &rows);
}

#[test]
fn an_edge_in_the_frame_that_enables_the_drive_moves_nothing() {
    let mut bench = Bench::new("cia402-servo");
    bench.fast_profile();
    bench.batch(&[(0x6060, 0, 1), (0x6040, 0, 0x06)]).unwrap();
    bench.control(0x07);
    bench.batch(&[(0x6040, 0, 0x1F), (0x607A, 0, 4_000)]).unwrap();
    bench.run(500);
    assert_eq!(bench.state(), State::OperationEnabled);
    assert!(!bench.is_set(ACKNOWLEDGED));
    assert_eq!(bench.get(0x6062), 0);
    bench.control(0x0F);
    bench.control(0x1F);
    assert!(bench.is_set(ACKNOWLEDGED));
}

#[test]
fn an_edge_in_the_frame_of_a_mode_change_counts_if_the_mode_is_there_at_once() {
    for (velocity, is_taken) in [(0, true), (5_000, false)] {
        let mut bench = Bench::new("cia402-servo");
        bench.fast_profile();
        bench.set(0x60FF, velocity);
        bench.enable(3);
        bench.run(200);
        bench.batch(&[(0x6060, 0, 1), (0x6040, 0, 0x1F), (0x607A, 0, 20_000)]).unwrap();
        assert_eq!(bench.is_set(ACKNOWLEDGED), is_taken);
        bench.run(2_000);
        assert_eq!(bench.get(0x6061), 1);
        assert_eq!(bench.get(0x6062) == 20_000, is_taken, "{}", bench.get(0x6062));
    }
}

#[test]
fn a_change_on_the_set_point_passes_the_target_at_the_profile_velocity() {
    let rows = [
        row(0, writes!(0x1F to 4_000), (YES, NO), 0),
        row(0, writes!(0x20F), (NO, NO), 0),
        row(0, writes!(0x21F to 8_000), (YES, NO), 0),
        row(0, writes!(0x0F), (NO, NO), 0),
        row(200, &[], (NO, NO), 2_000),
        row(300, &[], (NO, NO), 4_000),
        row(400, &[], (NO, NO), 6_000),
        row(620, &[], (NO, YES), 8_000),
    ];
    trace(&mut enabled("cia402-servo"), &rows);
}

#[test]
fn a_change_on_the_set_point_that_turns_back_stops_at_the_target() {
    let mut bench = enabled("cia402-servo");
    bench.move_to(4_000, 0);
    bench.move_to(1_000, 1 << 9);
    let mut furthest = 0;
    while !bench.is_set(REACHED) {
        bench.run(1);
        furthest = furthest.max(bench.get(0x6062));
    }
    assert_eq!((furthest, bench.get(0x6062)), (4_000, 1_000));
}

#[test]
fn the_end_velocity_is_that_at_the_target_when_another_one_follows() {
    for (shape, name) in [(0, "linear"), (3, "jerk-limited")] {
        let mut bench = enabled("cia402-servo");
        bench.batch(&[(0x6086, 0, shape), (0x60A4, 1, 2_000_000), (0x6082, 0, 5_000)]).unwrap();
        bench.move_to(4_000, 0);
        bench.move_to(8_000, 0);
        bench.run_until(|b| b.get(0x6062) >= 4_000);
        let passed = bench.get(0x606B);
        assert!((4_900..=5_300).contains(&passed), "{name}: {passed}");
        bench.run_until(|b| b.is_set(REACHED));
        assert_eq!(bench.get(0x6062), 8_000, "{name}: stops at the last one");
    }
}

#[test]
fn the_relative_option_says_from_where() {
    for (option, from) in [(0, 4_000), (1, 500), (2, 500)] {
        let mut bench = enabled("cia402-servo");
        bench.set(0x60F2, option);
        bench.move_to(4_000, 0);
        bench.run(100);
        let base = if option == 2 { bench.position() } else { from };
        bench.move_to(1_000, 1 << 6 | 1 << 5);
        bench.run_until(|b| b.is_set(REACHED));
        assert!((bench.get(0x6062) - base - 1_000).abs() <= 1, "{option}: {}", bench.get(0x6062));
    }
}

#[test]
fn with_the_option_to_continue_an_immediate_change_waits_for_the_target() {
    let mut bench = enabled("cia402-servo");
    bench.set(0x60F2, 1 << 2);
    bench.move_to(4_000, 0);
    bench.run(50);
    bench.move_to(8_000, 1 << 5);
    bench.run_until(|b| b.get(0x6062) >= 4_000);
    assert_eq!(bench.get(0x606B), 20_000);
}

#[test]
fn the_request_response_option_takes_the_bit_back() {
    for (option, back_at) in [(1_i64, 405..=420), (2, 1..=1)] {
        let mut bench = enabled("cia402-servo");
        bench.set(0x60F2, option << 4);
        bench.batch(&[(0x6040, 0, 0x1F), (0x607A, 0, 4_000)]).unwrap();
        assert!(bench.is_set(ACKNOWLEDGED));
        let start = bench.now;
        bench.run_until(|b| b.get(0x6040) == 0x0F);
        assert!(!bench.is_set(ACKNOWLEDGED));
        assert!(back_at.contains(&bench.now.saturating_since(start).as_millis()), "{option}");
        bench.batch(&[(0x6040, 0, 0x1F), (0x607A, 0, 0)]).unwrap();
        assert!(bench.is_set(ACKNOWLEDGED), "the next frame is another edge");
    }
}

#[test]
fn reserved_options_are_refused() {
    let mut bench = Bench::new("cia402-servo");
    for (index, values) in [(0x60F2, [3, 8, 0x30, 0x100]), (0x6086, [1, 2, -1, 4]), (0x60A3, [0, 3, 5, 255])]
    {
        for value in values {
            let refused = bench.batch(&[(index, 0, value)]);
            assert_eq!(refused, Err(od::AbortCode::InvalidValue), "{index:04X} {value}");
        }
    }
}

#[test]
fn an_immediate_set_point_takes_the_place_of_all_before_it() {
    let rows = [
        row(0, writes!(0x1F to 4_000), (YES, NO), 0),
        row(0, writes!(0x0F), (NO, NO), 0),
        row(0, writes!(0x1F to 0), (YES, NO), 0),
        row(0, writes!(0x0F), (NO, NO), 0),
        row(0, writes!(0x1F to 1_000), (YES, NO), 0),
        row(0, writes!(0x0F), (YES, NO), 0),
        row(100, writes!(0x3F to 2_000), (YES, NO), 500),
        row(110, writes!(0x0F), (NO, NO), 605),
        row(310, &[], (NO, YES), 2_000),
        row(900, &[], (NO, YES), 2_000),
    ];
    trace(&mut enabled("cia402-servo"), &rows);
}

#[test]
fn a_halt_before_a_target_that_would_be_passed_keeps_the_order_of_the_set() {
    let rows = [
        row(0, writes!(0x1F to 4_000), (YES, NO), 0),
        row(0, writes!(0x0F), (NO, NO), 0),
        row(0, writes!(0x21F to 8_000), (YES, NO), 0),
        row(0, writes!(0x0F), (NO, NO), 0),
        row(100, writes!(0x10F), (NO, NO), 500),
        row(210, writes!(0x11F to 0), (YES, YES), 1_000),
        row(220, writes!(0x10F), (YES, YES), 1_000),
        row(300, writes!(0x0F), (YES, NO), 1_000),
        row(500, &[], (YES, NO), 3_000),
        row(550, &[], (YES, NO), 4_000),
        row(560, &[], (NO, NO), 4_200),
        row(850, &[], (NO, NO), 8_000),
    ];
    trace(&mut enabled("cia402-servo"), &rows);
}

#[test]
fn no_target_is_passed_beyond_a_position_limit() {
    let mut bench = enabled("cia402-servo");
    bench.batch(&[(0x607D, 1, -10_000), (0x607D, 2, 4_500)]).unwrap();
    bench.move_to(4_000, 0);
    bench.move_to(4_400, 1 << 9);
    let mut furthest = 0;
    while !bench.is_set(REACHED) {
        bench.run(1);
        furthest = furthest.max(bench.get(0x6062));
    }
    assert!((4_400..=4_500).contains(&furthest), "{furthest}");
    assert_eq!(bench.get(0x6062), 4_400);
}

/// A master that does what it likes with the handshake.
#[derive(Clone, Debug)]
enum Act {
    /// The new-set-point bit, with other bits of the controlword and a target.
    Bit(bool, i64, i64),
    Halt(bool),
    QuickStop,
    Disable,
    Wait(u64),
}

fn act() -> impl Strategy<Value = Act> {
    let flags = prop::sample::select(vec![0_i64, 0, 1 << 5, 1 << 9]);
    prop_oneof![
        8 => (any::<bool>(), flags, -3_000_i64..3_000).prop_map(|(bit, flags, to)| Act::Bit(bit, flags, to)),
        1 => any::<bool>().prop_map(Act::Halt),
        1 => Just(Act::QuickStop),
        1 => Just(Act::Disable),
        4 => (0_u64..300).prop_map(Act::Wait),
    ]
}

/// What the master was told to expect.
struct Book {
    bench: Bench,
    /// Acknowledged set-points that the axis has not left behind.
    due: VecDeque<i64>,
    last: i64,
    word: i64,
}

impl Book {
    fn write(&mut self, writes: &[(u16, u8, i64)]) {
        self.bench.batch(writes).unwrap();
        self.word = writes.iter().find(|write| write.0 == 0x6040).unwrap().2;
    }

    fn bit(&mut self, bit: bool, flags: i64, target: i64) {
        let (is_edge, was_acknowledged) = (bit && self.word & 0x10 == 0, self.bench.is_set(ACKNOWLEDGED));
        let word = (self.word & 0x100) | 0x0F | flags | if bit { 0x10 } else { 0 };
        self.write(&[(0x6040, 0, word), (0x607A, 0, target)]);
        let is_immediate = flags == 1 << 5;
        if is_edge && (is_immediate || !was_acknowledged) {
            assert!(self.bench.is_set(ACKNOWLEDGED), "every edge that may be taken is");
            if is_immediate {
                self.due.clear();
            }
            self.due.push_back(target);
            self.last = target;
        } else {
            assert!(was_acknowledged || !self.bench.is_set(ACKNOWLEDGED), "acknowledged without an edge");
        }
    }

    fn drop_all(&mut self, word: i64) {
        self.write(&[(0x6040, 0, word)]);
        self.wait(500);
        self.due.clear();
        self.write(&[(0x6040, 0, 0x0F)]);
        self.wait(50);
        assert_eq!(self.bench.state(), State::OperationEnabled);
        self.last = self.bench.get(0x6062);
        assert!(!self.bench.is_set(ACKNOWLEDGED));
    }

    fn wait(&mut self, millis: u64) {
        for _ in 0..millis {
            let was_acknowledged = self.bench.is_set(ACKNOWLEDGED);
            self.bench.run(1);
            assert!(was_acknowledged || !self.bench.is_set(ACKNOWLEDGED), "acknowledged by itself");
            self.leave_behind();
        }
    }

    /// Strikes out the set-points that the axis has come to, at rest or within the way of a step.
    fn leave_behind(&mut self) {
        while let [first, _, ..] = *self.due.make_contiguous()
            && (self.bench.get(0x6062) - first).abs() <= 20
        {
            self.due.pop_front();
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn an_acknowledged_set_point_is_executed_or_replaced(acts in prop::collection::vec(act(), 1..60)) {
        let mut bench = enabled("cia402-servo");
        bench.set(0x605A, 6);
        let mut book = Book { bench, due: VecDeque::new(), last: 0, word: 0x0F };
        for act in acts {
            match act {
                Act::Bit(bit, flags, target) => book.bit(bit, flags, target),
                Act::Halt(true) => book.write(&[(0x6040, 0, book.word | 0x100)]),
                Act::Halt(false) => book.write(&[(0x6040, 0, book.word & !0x100)]),
                Act::QuickStop => book.drop_all(0x02),
                Act::Disable => book.drop_all(0x07),
                Act::Wait(millis) => book.wait(millis),
            }
        }
        book.write(&[(0x6040, 0, book.word & !0x110)]);
        book.wait(4_000);
        prop_assert!(book.due.len() <= 1, "left out: {:?}", book.due);
        prop_assert_eq!(book.bench.get(0x6062), book.last);
        prop_assert!(book.bench.is_set(REACHED) && !book.bench.is_set(ACKNOWLEDGED));
    }
}
