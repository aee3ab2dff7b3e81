//! Registers in a device: sign extension, high words, reserved numbers, read-only ones, roles.

use std::sync::Arc;

use od::{AbortCode, Address, Bus, Data, Dictionary, Instant, Origin, Slot, Write};
use profiles::{Device, Profile, Role};

const CAN: Origin = Origin { bus: Bus::CanOpen, link: 0, client: 0 };

fn device(motor: &str) -> Device {
    let profile = Profile::embedded("jvl-mac00-fc4", Some(motor)).unwrap().unwrap();
    Device::new(Arc::new(profile), 1, Instant::from_nanos(0))
}

fn slot(dictionary: &Dictionary, number: u8) -> Slot {
    dictionary.find(Address::new(0x2012, number)).unwrap()
}

/// Writes all of `batch` at once, as one PDO would.
fn write(device: &mut Device, batch: &[(u8, u32)]) -> Result<(), AbortCode> {
    let dictionary = device.dictionary_mut();
    let item =
        |(number, raw): &(u8, u32)| Write { slot: slot(dictionary, *number), data: Data::Raw((*raw).into()) };
    let items: Vec<_> = batch.iter().map(item).collect();
    dictionary.write(CAN, &items).map_err(|refusal| refusal.code)?;
    device.apply(Instant::from_nanos(0));
    Ok(())
}

fn read(device: &Device, number: u8) -> u32 {
    let dictionary = device.dictionary();
    dictionary.raw(slot(dictionary, number)) as u32
}

#[test]
fn a_signed_word_reads_sign_extended_and_takes_the_low_16_bits() {
    let mut device = device("mac140");
    for (written, shown) in [
        (0x0000_1234, 0x0000_1234),
        (0x0000_FFFF, 0xFFFF_FFFF),
        (0x1234_8000, 0xFFFF_8000),
        (0xFFFF_7FFF, 0x0000_7FFF),
        (0xFFFF_FFFE, 0xFFFF_FFFE),
    ] {
        write(&mut device, &[(5, written)]).unwrap();
        assert_eq!(read(&device, 5), shown, "V_SOLL, {written:#X} written");
    }
}

#[test]
fn an_unsigned_word_reads_with_zeros_above() {
    let mut device = device("mac140");
    write(&mut device, &[(182, 0x1234_FFFF)]).unwrap();
    assert_eq!(read(&device, 182), 0xFFFF);
}

#[test]
fn a_register_of_32_bits_shows_its_high_word_at_the_next_number() {
    let mut device = device("mac140");
    write(&mut device, &[(22, 0x8001_2345)]).unwrap();
    assert_eq!((read(&device, 22), read(&device, 23)), (0x8001_2345, 0xFFFF_8001));
    write(&mut device, &[(22, 0x0012_3456)]).unwrap();
    assert_eq!((read(&device, 22), read(&device, 23)), (0x0012_3456, 0x0000_0012));
}

#[test]
fn writing_the_next_number_replaces_the_high_word() {
    let mut device = device("mac140");
    write(&mut device, &[(22, 0x0001_2345)]).unwrap();
    write(&mut device, &[(23, 0xABCD_FFFE)]).unwrap();
    assert_eq!((read(&device, 22), read(&device, 23)), (0xFFFE_2345, 0xFFFF_FFFE));
}

#[test]
fn both_halves_written_at_once_make_one_number() {
    for batch in [[(22, 0x4B40), (23, 0x004C)], [(23, 0x004C), (22, 0x4B40)]] {
        let mut device = device("mac140");
        write(&mut device, &batch).unwrap();
        assert_eq!((read(&device, 22), read(&device, 23)), (5_000_000, 0x4C));
    }
}

#[test]
fn printed_ranges_are_not_enforced() {
    let mut device = device("mac140");
    for raw in [i32::MIN, i32::MAX, 67_000_001].map(i32::cast_unsigned) {
        write(&mut device, &[(3, raw)]).unwrap();
        assert_eq!(read(&device, 3), raw, "P_SOLL");
    }
    write(&mut device, &[(7, 20_000)]).unwrap();
    assert_eq!(read(&device, 7), 20_000, "T_SOLL");
}

#[test]
fn a_reserved_register_reads_zero_and_ignores_what_is_written() {
    let mut device = device("mac140");
    for number in (204..=210).chain(214..=254) {
        write(&mut device, &[(number, 0xFFFF_FFFF)]).unwrap();
        assert_eq!(read(&device, number), 0, "{number}");
    }
}

#[test]
fn a_read_only_register_refuses_a_write() {
    let mut device = device("mac140");
    for number in [1, 12, 16, 18, 117, 151, 153, 154, 155, 158] {
        assert_eq!(write(&mut device, &[(number, 1)]), Err(AbortCode::ReadOnly), "{number}");
    }
}

#[test]
fn behaviours_find_registers_by_their_meaning() {
    let mut device = device("mac140");
    let registers = Arc::clone(&device.profile().registers);
    write(&mut device, &[(23, 1)]).unwrap();
    let dictionary = device.dictionary_mut();
    let at = |number| slot(dictionary, number);
    assert_eq!(registers.slot(Role::Flwerrmax), Some(at(22)));
    assert_eq!(registers.role_of(at(22)), Some(Role::Flwerrmax));
    assert_eq!(registers.role_of(at(23)), Some(Role::Flwerrmax), "its high word");
    assert_eq!(registers.role_of(at(89)), None, "KFF3");
    assert_eq!(registers.number_of(at(23)), Some(23));
    assert_eq!(registers.get(dictionary, Role::Flwerrmax), Some(0x1_0000));
    assert_eq!(registers.get(dictionary, Role::Ticks), None);
}

#[test]
fn what_the_motor_shows_is_held_to_the_width_of_the_register() {
    let mut device = device("mac140");
    let registers = Arc::clone(&device.profile().registers);
    let dictionary = device.dictionary_mut();
    let mut shown = |role, value| {
        registers.show(dictionary, role, value);
        registers.get(dictionary, role)
    };
    assert_eq!(shown(Role::VIst, -40_000), Some(-32_768), "a signed word");
    assert_eq!(shown(Role::I2t, 70_000), Some(65_535), "an unsigned word");
    assert_eq!(shown(Role::ErrStat, 0x8010), Some(0x8010), "bits");
    assert_eq!(shown(Role::PIst, i32::MIN), Some(i32::MIN));
    assert_eq!(shown(Role::Ticks, 1), None);
    assert_eq!(registers.read_number(dictionary, 11), Some(-32_768), "high word of P_IST");
}

#[test]
fn the_motor_reaches_its_registers_by_number() {
    let mut device = device("mac140");
    let registers = Arc::clone(&device.profile().registers);
    let dictionary = device.dictionary_mut();
    for (number, value, shown) in
        [(3, -5, -5), (4, 0x1_0002, 2), (5, 0x1_8000, -32_768), (204, 7, 0), (255, 7, 0)]
    {
        registers.show_number(dictionary, number, value);
        assert_eq!(registers.read_number(dictionary, number), Some(shown), "{number}");
    }
    assert_eq!(registers.read_number(dictionary, 3), Some(0x2_FFFB), "P_SOLL with another high word");
    assert_eq!(registers.read_number(dictionary, 256), None);
}
