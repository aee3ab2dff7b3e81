//! PDOs 7 and 21-25 of JVL's module on virtual time (manual, sections 4.3.15, 4.3.16 and 4.3.26).

mod common;

use std::time::Duration;

use common::{Bench, LINK};

const RPDO_21: u32 = 0x221;
const TPDO_21: u32 = 0x2A1;

/// A motor in OPERATIONAL whose master has given PDOs 21-25 their COB-IDs.
fn motor() -> Bench {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.run(Duration::from_millis(100));
    for (base, first, numbers) in [(0x1400, RPDO_21, 21..=24), (0x1800, TPDO_21, 21..=25)] {
        for number in numbers {
            let cob_id = first + u32::from(number) - 21;
            bench.write(1, base + number - 1, 1, &cob_id.to_le_bytes());
        }
    }
    bench.send("000#0101");
    bench
}

/// What the entry holds, in hexadecimal as on the wire.
fn read(bench: &mut Bench, index: u16, sub: u8) -> String {
    let [low, high] = index.to_le_bytes();
    let answers = bench.send(&format!("601#40{low:02X}{high:02X}{sub:02X}00000000"));
    let [answer] = &answers[..] else { panic!("one answer: {answers:?}") };
    answer[answer.len() - 8..].to_owned()
}

#[test]
fn rpdo_22_carries_velocity_acceleration_torque_and_mode_in_two_bytes_each() {
    let mut bench = motor();
    bench.write(1, 0x2012, 5, &[0xEF, 0xBE, 0xAD, 0x7E]);

    assert_eq!(bench.send("222#9CFF320064000000"), [""; 0]);

    let registers = [5, 6, 7, 2].map(|register| read(&mut bench, 0x2012, register));
    assert_eq!(registers, ["9CFFFFFF", "32000000", "64000000", "00000000"], "V_SOLL is -100");
}

#[test]
fn other_registers_and_other_widths_are_mapped_whole_or_refused_06040041() {
    let mut bench = Bench::new(&[&[(0, 1)]]);
    bench.write(1, 0x1615, 0, &[0]);
    let whole = [0x2012_0520_u32, 0x2012_0220];
    let halves = [0x2012_0510, 0x2012_0210];
    for parameter in [whole, halves].concat() {
        bench.write(1, 0x1615, 1, &parameter.to_le_bytes());
    }
    // P_SOLL and GEARF1 by halves, V_SOLL by 8 bits, V_IST in an RPDO, P_IST's high word by half.
    for parameter in [0x2012_0310_u32, 0x2012_0E10, 0x2012_0508, 0x2012_0C10, 0x2012_0B10] {
        let bytes: String = parameter.to_le_bytes().iter().map(|byte| format!("{byte:02X}")).collect();
        let refused = "581#8015160141000406";
        assert_eq!(bench.send(&format!("601#23151601{bytes}")), [refused], "{parameter:08X}");
    }
}

#[test]
fn rpdos_21_to_24_are_taken_with_their_reserved_bytes_and_without() {
    let mut bench = motor();
    for (short, long, index, sub) in [
        ("221#78563412", "221#7956341200000000", 0x2012, 3),
        ("223#E0", "223#60FFFFFFFFFFFFFF", 0x2013, 0),
        ("224#01", "224#0300000000000000", 0x2011, 2),
    ] {
        for frame in [short, long] {
            let emergencies = bench.send(frame).into_iter().filter(|sent| sent.starts_with("081"));
            assert_eq!(emergencies.collect::<Vec<_>>(), [""; 0], "{frame}");
            let carried = frame.split_once('#').unwrap().1;
            let shortest = short.len() - 4;
            assert!(read(&mut bench, index, sub).starts_with(&carried[..shortest]), "{frame}");
        }
    }
    assert_eq!(bench.send("221#785634"), ["081#1082111500030000"], "three bytes are too few");
}

#[test]
fn tpdos_21_to_25_have_eight_bytes_and_zeros_in_the_reserved_ones() {
    let mut bench = motor();
    let started = bench.run(Duration::from_millis(1));
    assert_eq!(started, [""; 0], "TPDO 25 went on entering OPERATIONAL");
    let answers = bench.send("080#");
    let own: Vec<_> = answers.iter().filter(|frame| frame.starts_with("2A")).collect();
    let zeros = |id: &str| format!("{id}#0000000000000000");
    assert_eq!(own, ["2A1", "2A2", "2A3", "2A4"].map(zeros).iter().collect::<Vec<_>>());
    // PL and NL count as active while their pins are low.
    bench.write(1, 0x2011, 6, &[0x0F]);
    let answers = bench.send("080#");
    assert!(answers.contains(&"2A1#0000000000300000".to_owned()), "behind the motor status: {answers:?}");
}

#[test]
fn tpdo_25_goes_when_the_inputs_or_the_motor_status_change() {
    let mut bench = motor();
    let changed = bench.send("601#2F1120062F000000");
    assert_eq!(changed, ["581#6011200600000000", "2A5#0010000000000000"]);
    let same = bench.send("601#2F1120062F000000");
    assert_eq!(same, ["581#6011200600000000"]);
    bench.turn(4_096);
    let told = bench.run(Duration::from_secs(1));
    assert!(told.contains(&"2A5#2010000000000000".to_owned()), "accelerating: {told:?}");
}

#[test]
fn tpdos_21_to_24_go_with_sync_only_and_25_with_sync_or_changes() {
    let mut bench = motor();
    for index in 0x1814..=0x1817_u16 {
        let [low, high] = index.to_le_bytes();
        let refused = format!("581#80{low:02X}{high:02X}0231000906");
        for transmission in ["FF", "FE", "FD", "FC"] {
            let request = format!("601#2F{low:02X}{high:02X}02{transmission}000000");
            assert_eq!(bench.send(&request), [refused.as_str()], "0x06090031");
        }
        bench.write(1, index, 2, &[240]);
    }
    bench.write(1, 0x1818, 2, &[1]);
    let answers = bench.send("080#");
    assert!(answers.contains(&"2A5#0000000000000000".to_owned()), "{answers:?}");
    assert!(answers.iter().all(|frame| !frame.starts_with("2A1")), "with the 240th SYNC: {answers:?}");
}

#[test]
fn pdos_7_and_21_to_25_wait_for_a_cob_id() {
    let mut bench = Bench::silent(&[&[(0, 1)]]);
    bench.core.start(bench.now, LINK);
    bench.run(Duration::from_millis(100));
    for (index, invalid) in
        [(0x1406, "00000080"), (0x1414, "00000080"), (0x1806, "000000C0"), (0x1818, "000000C0")]
    {
        assert_eq!(read(&mut bench, index, 1), invalid, "{index:04X}");
    }
    bench.send("000#0101");
    let answers = bench.send("080#");
    assert_eq!(answers.len(), 2, "PDOs 3 and 4: {answers:?}");
}
