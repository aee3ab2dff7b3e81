//! Registers in a device: sign extension, high words, reserved numbers, read-only ones, roles.

use std::sync::Arc;

use od::{AbortCode, Address, Bus, Data, Dictionary, Instant, Origin, Slot, Write};
use profiles::{Device, Identity, Profile, Role, Space};

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

/// The slot of a module register, as a bus that numbers registers finds it.
fn module(device: &Device, number: u16) -> Slot {
    let place = device.profile().register(Space::Module, number).unwrap().place.unwrap();
    device.dictionary().schema().slot(place).unwrap()
}

fn write_module(device: &mut Device, number: u16, raw: u32) -> Result<(), AbortCode> {
    let write = Write { slot: module(device, number), data: Data::Raw(raw.into()) };
    device.dictionary_mut().write(CAN, &[write]).map_err(|refusal| refusal.code)?;
    device.apply(Instant::from_nanos(0));
    Ok(())
}

#[test]
fn module_and_extended_registers_are_not_on_canopen() {
    let device = device("mac400");
    for index in [0x2F11, 0x2F13] {
        for sub in [0, 1, 6, 15, 254] {
            let found = device.dictionary().find(Address::new(index, sub));
            assert_eq!(found, Err(AbortCode::NoObject), "{index:04X}:{sub:02X}");
        }
        assert!(!device.profile().eds().contains(&format!("{index:04X}")));
    }
    assert!(device.profile().eds().contains("[2012subFE]"));
}

#[test]
fn another_bus_reads_and_writes_them_by_their_numbers() {
    let mut device = device("mac400");
    write_module(&mut device, 6, 0x21).unwrap();
    assert_eq!(device.dictionary().raw(module(&device, 6)), 0x21);
    write_module(&mut device, 10, 0xABCD_0023).unwrap();
    assert_eq!(device.dictionary().raw(module(&device, 10)), 0x23, "the time-out has 16 bits");
    let registers = Arc::clone(&device.profile().registers);
    assert_eq!(registers.get(device.dictionary(), Role::ModuleTimeout), Some(35));
    registers.show_number(device.dictionary_mut(), 509, -2);
    assert_eq!(registers.read_number(device.dictionary(), 509), Some(-2));
}

#[test]
fn one_output_register_has_two_views() {
    let mut device = device("mac140");
    assert_eq!(module(&device, 7), device.dictionary().find(Address::new(0x2011, 2)).unwrap());
    write_module(&mut device, 7, 0b10).unwrap();
    assert_eq!(device.axes().next().unwrap().outputs, 0b10);
}

#[test]
fn the_command_register_is_write_only_and_identity_read_only() {
    let mut device = device("mac140");
    assert_eq!(write_module(&mut device, 15, 0x10), Ok(()));
    assert_eq!(device.dictionary().read(module(&device, 15)).unwrap_err(), AbortCode::WriteOnly);
    for number in [0, 1, 2, 32, 33, 34, 35, 38, 47, 48, 49] {
        assert_eq!(write_module(&mut device, number, 1), Err(AbortCode::ReadOnly), "{number}");
    }
}

/// Ethernet module manual, section 9.1.1: 192.168.0.x, x being the last byte of the MAC address.
#[test]
fn addresses_follow_the_node_id() {
    let profile = Profile::embedded("jvl-mac00-fc4", None).unwrap().unwrap();
    let device = Device::new(Arc::new(profile), 20, Instant::from_nanos(0));
    let read = |number| device.dictionary().raw(module(&device, number));
    assert_eq!((read(1), read(2)), (0x0200, 20), "a MAC address that no vendor owns");
    assert_eq!((read(3), read(4), read(5)), (0xC0A8_0014, 0xFFFF_FF00, 0xC0A8_00FE));
}

#[test]
fn motor_and_module_tell_the_serial_number_of_the_device() {
    let identity = Identity { serial: Some(0x0001_2345), ..Identity::default() };
    let profile = Profile::embedded("jvl-mac00-fc4", None).unwrap().unwrap().with_identity(identity);
    let device = Device::new(Arc::new(profile), 1, Instant::from_nanos(0));
    assert_eq!((read(&device, 154), read(&device, 155)), (0x0001_2345, 1));
    assert_eq!(device.dictionary().raw(module(&device, 32)), 0x0001_2345);
}

#[test]
fn stored_registers_come_back_with_their_high_words() {
    let mut device = device("mac140");
    write(&mut device, &[(28, 0xFFFE_0000), (5, 0xFFFF), (2, 1), (3, 77)]).unwrap();
    let saved = device.dictionary().save(|index| index == 0x2012);
    assert_eq!(device.dictionary_mut().set_saved(saved), 0);
    device.reset(Instant::from_nanos(0));
    assert_eq!((read(&device, 28), read(&device, 29)), (0xFFFE_0000, 0xFFFF_FFFE), "MIN_P_IST");
    assert_eq!(read(&device, 5), 0xFFFF_FFFF, "V_SOLL");
    assert_eq!((read(&device, 2), read(&device, 3)), (0, 0), "mode and target belong to the moment");
}
