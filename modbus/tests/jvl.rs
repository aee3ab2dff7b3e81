//! What JVL's Ethernet manual prints (sections 7.2.4, 7.2.6, 7.4), byte for byte, with its misprints corrected.

mod bench;

use bench::Bench;
use modbus::Dialect;

fn jvl() -> Bench {
    Bench::new(Dialect::Jvl)
}

#[test]
fn the_ip_address_is_read_from_module_register_3() {
    let answer = jvl().exchange("00 01 00 00 00 06 01 03 80 06 00 02");
    assert_eq!(answer, "00 01 00 00 00 07 01 03 04 64 01 C0 A8");
}

#[test]
fn p_soll_is_written_low_word_first() {
    let mut bench = jvl();
    let answer = bench.exchange("00 02 00 00 00 0B 01 10 00 06 00 02 04 56 78 12 34");
    assert_eq!(answer, "00 02 00 00 00 06 01 10 00 06 00 02");
    assert_eq!(bench.raw(0x2012, 3), 0x1234_5678);
}

#[test]
fn one_request_writes_p_soll_and_reads_the_ip_address() {
    let mut bench = jvl();
    let answer = bench.exchange("00 02 00 00 00 0F 01 17 80 06 00 02 00 06 00 02 04 56 78 12 34");
    assert_eq!(answer, "00 02 00 00 00 07 01 17 04 64 01 C0 A8");
    assert_eq!(bench.raw(0x2012, 3), 0x1234_5678);
}

/// As printed, the length leaves out the four bytes that are to be written.
#[test]
fn the_request_with_the_printed_length_is_refused_and_writes_nothing() {
    let mut bench = jvl();
    let answer = bench.exchange("00 02 00 00 00 0B 01 17 80 06 00 02 00 06 00 02 04 56 78 12 34");
    assert_eq!(answer, "00 02 00 00 00 03 01 97 03");
    assert_eq!(bench.raw(0x2012, 3), 0);
}

#[test]
fn modbus_poll_reads_three_registers_at_address_20_and_one_at_70() {
    let mut bench = jvl();
    // P_IST, the reserved register 11, V_IST = -2 with its sign.
    assert_eq!(bench.ask("03 00 14 00 06"), "03 0C 00 02 00 01 00 00 00 00 FF FE FF FF");
    assert_eq!(bench.ask("03 00 46 00 02"), "03 04 80 10 00 00");
}

#[test]
fn quantities_must_be_even() {
    for quantity in ["00 00", "00 01", "00 03"] {
        assert_eq!(jvl().ask(&format!("03 00 14 {quantity}")), "83 03");
        assert_eq!(jvl().ask(&format!("17 00 14 {quantity} 00 06 00 02 04 00 00 00 00")), "97 03");
    }
    assert_eq!(jvl().ask("10 00 06 00 00 00"), "90 03");
    assert_eq!(jvl().ask("10 00 06 00 01 02 00 00"), "90 03");
    assert_eq!(jvl().ask("10 00 06 00 03 06 00 00 00 00 00 00"), "90 03");
    assert_eq!(jvl().ask("17 00 14 00 02 00 06 00 01 02 00 00"), "97 03");
}

#[test]
fn at_most_124_registers_are_read_and_32_written() {
    let zeros = |registers: usize| "00 00 ".repeat(registers);
    assert_eq!(jvl().ask("03 00 80 00 7C").len(), "03 F8".len() + 3 * 248);
    assert_eq!(jvl().ask("03 00 80 00 7E"), "83 03");
    assert_eq!(jvl().ask(&format!("10 00 80 00 20 40 {}", zeros(32))), "10 00 80 00 20");
    assert_eq!(jvl().ask(&format!("10 00 80 00 22 44 {}", zeros(34))), "90 03");
    let both = |read, written, values| {
        format!("17 00 80 00 {read:02X} 00 80 00 {written:02X} {:02X} {}", 2 * written, zeros(values))
    };
    assert_eq!(jvl().ask(&both(124, 32, 32)).len(), "17 F8".len() + 3 * 248);
    assert_eq!(jvl().ask(&both(126, 32, 32)), "97 03");
    assert_eq!(jvl().ask(&both(124, 34, 34)), "97 03");
}

#[test]
fn other_functions_are_not_supported() {
    for code in (0..=0x7F).filter(|code| ![0x03, 0x10, 0x17].contains(code)) {
        assert_eq!(jvl().ask(&format!("{code:02X} 00 00 00 02")), format!("{:02X} 01", code | 0x80));
    }
}

#[test]
fn other_addresses_do_not_exist() {
    for address in ["02 00", "02 58", "03 00", "10 00", "7F FE", "80 80", "FF FE"] {
        assert_eq!(jvl().ask(&format!("03 {address} 00 02")), "83 02", "{address}");
        assert_eq!(jvl().ask(&format!("10 {address} 00 02 04 00 00 00 00")), "90 02", "{address}");
    }
    // The last register of each space, and one too many.
    assert_eq!(jvl().ask("03 01 FE 00 02"), "03 04 00 00 00 00");
    assert_eq!(jvl().ask("03 01 FE 00 04"), "83 02");
    assert_eq!(jvl().ask("03 80 7E 00 02"), "03 04 00 00 00 00");
    assert_eq!(jvl().ask("03 80 7E 00 04"), "83 02");
    assert_eq!(jvl().ask("03 FF FF 00 02"), "83 02");
}

#[test]
fn a_register_begins_at_an_even_address() {
    assert_eq!(jvl().ask("03 00 15 00 02"), "83 02");
    assert_eq!(jvl().ask("10 00 07 00 02 04 00 00 00 00"), "90 02");
    assert_eq!(jvl().ask("17 00 15 00 02 00 06 00 02 04 00 00 00 00"), "97 02");
}

#[test]
fn the_motor_starts_by_mode_1_at_address_4() {
    let mut bench = jvl();
    assert_eq!(bench.ask("10 00 04 00 02 04 00 01 00 00"), "10 00 04 00 02");
    assert_eq!(bench.raw(0x2012, 2), 1);
}

#[test]
fn a_velocity_run_at_1200_rpm_is_three_requests() {
    let mut bench = jvl();
    bench.ask("10 00 0A 00 02 04 0D 4C 00 00");
    bench.ask("10 00 0C 00 02 04 01 71 00 00");
    bench.ask("10 00 04 00 02 04 00 01 00 00");
    assert_eq!([5, 6, 2].map(|register| bench.raw(0x2012, register)), [3404, 369, 1]);
}

#[test]
fn a_position_run_to_5_000_000_puts_the_low_word_at_address_6() {
    let mut bench = jvl();
    bench.ask("10 00 04 00 04 08 00 02 00 00 4B 40 00 4C");
    assert_eq!(bench.raw(0x2012, 2), 2);
    assert_eq!(bench.raw(0x2012, 3), 5_000_000);
}

#[test]
fn a_register_of_16_bits_takes_the_low_word_and_shows_its_sign() {
    let mut bench = jvl();
    assert_eq!(bench.ask("10 00 0A 00 02 04 FF 38 12 34"), "10 00 0A 00 02");
    assert_eq!(bench.raw(0x2012, 5), 0xFF38);
    assert_eq!(bench.ask("03 00 0A 00 02"), "03 04 FF 38 FF FF");
}

#[test]
fn reserved_registers_read_zero_and_ignore_what_is_written() {
    let mut bench = jvl();
    assert_eq!(bench.ask("10 00 08 00 02 04 12 34 56 78"), "10 00 08 00 02");
    assert_eq!(bench.ask("03 00 08 00 02"), "03 04 00 00 00 00");
    assert_eq!(bench.ask("10 80 00 00 02 04 12 34 56 78"), "10 80 00 00 02");
    assert_eq!(bench.ask("03 80 00 00 02"), "03 04 00 00 00 00");
}

#[test]
fn what_may_only_be_written_reads_zero() {
    let mut bench = jvl();
    bench.ask("10 80 1E 00 02 04 00 10 00 00");
    assert_eq!(bench.raw(0x2011, 15), 0x10);
    assert_eq!(bench.ask("03 80 1E 00 02"), "03 04 00 00 00 00");
}

#[test]
fn what_may_only_be_read_is_refused_and_with_it_the_whole_request() {
    let mut bench = jvl();
    // Registers 10 (read and write) to 12 (read only).
    assert_eq!(bench.ask("10 00 14 00 06 0C 00 01 00 00 00 00 00 00 00 03 00 00"), "90 02");
    assert_eq!(bench.raw(0x2012, 10), 0x0001_0002);
    assert_eq!(bench.ask("10 80 5E 00 02 04 00 00 00 00"), "90 02");
}

/// There is no exception 4.
#[test]
fn what_the_state_forbids_is_exception_3() {
    let mut bench = jvl();
    bench.set(0x2104, 0, 1);
    assert_eq!(bench.ask("10 00 0A 00 02 04 00 01 00 00"), "90 03");
    assert_eq!(bench.raw(0x2012, 5), 0);
}

#[test]
fn module_registers_are_mirrored_at_0300_while_setup_bit_5_is_set() {
    let mut bench = jvl();
    assert_eq!(bench.ask("03 03 06 00 02"), "83 02");
    bench.ask("10 80 0C 00 02 04 00 20 00 00");
    assert_eq!(bench.ask("03 03 06 00 02"), "03 04 64 01 C0 A8");
    assert_eq!(bench.ask("03 03 7E 00 02"), "03 04 00 00 00 00");
    assert_eq!(bench.ask("03 03 80 00 02"), "83 02");
    // The request that takes the mirror away still reads it.
    assert_eq!(bench.ask("17 03 06 00 02 03 0C 00 02 04 00 00 00 00"), "17 04 64 01 C0 A8");
    assert_eq!(bench.ask("03 03 06 00 02"), "83 02");
}
