//! What the words of a file mean.

use od::{Access, Address, DataType, Initial, Mappable, ObjectKind, Range, Value};
use profiles::{Commissioning, Profile};

use crate::{entry, findings, number, read, read_clean, var, with};

fn one(lines: &str) -> od::Entry {
    entry(&read_clean(&with(&var(0x2000, lines))), 0x2000, 0).clone()
}

fn initial(lines: &str) -> Initial {
    one(lines).initial
}

#[test]
fn a_value_is_read_by_its_type() {
    let fixed = |number| Initial::Value(Value::Fixed(number));
    for (data_type, value, initial_value) in [
        ("0x0001", "1", fixed(1)),
        ("0x0002", "-1", fixed(0xFF)),
        ("0x0003", "0xFFFE", fixed(0xFFFE)),
        ("0x0010", "-2", fixed(0xFF_FFFE)),
        ("0x0015", "0x8000000000000000", fixed(1 << 63)),
        ("0x001B", "18446744073709551615", fixed(u64::MAX)),
        ("0x001A", "0xFF", fixed(0xFF)),
        ("0x0008", "1.5", fixed(0x3FC0_0000)),
        ("0x0011", "-2", fixed((-2.0_f64).to_bits())),
        ("0x000C", "0x010203040506", fixed(0x0102_0304_0506)),
        ("0x0009", "a = b", Initial::Value(Value::bytes(*b"a = b"))),
        ("0x000A", "0A 0b FF", Initial::Value(Value::bytes([10, 11, 255]))),
        ("0x000B", "h\u{E4}", Initial::Value(Value::bytes([b'h', 0, 0xE4, 0]))),
        ("0x000F", "00FF", Initial::Value(Value::bytes([0, 255]))),
        ("0x0005", "", fixed(0)),
        ("0x0005", "$NODEID", Initial::PlusNodeId(0)),
        ("0x0007", "0x180+$NODEID", Initial::PlusNodeId(0x180)),
        ("0x0007", "$NODEID + 0x40000180", Initial::PlusNodeId(0x4000_0180)),
    ] {
        let lines = format!("DataType={data_type}, AccessType=rw, DefaultValue={value}");
        assert_eq!(initial(&lines), initial_value, "{data_type} {value}");
    }
}

#[test]
fn a_number_may_be_octal_or_lack_its_prefix() {
    for (written, number, said) in [
        ("010", 8, "`DefaultValue`: `010` is read as octal, since it begins with 0"),
        ("09", 9, "is read as decimal"),
        ("1F", 0x1F, "is read as hexadecimal"),
        ("1Fh", 0x1F, "is read as hexadecimal"),
    ] {
        let (profile, findings) =
            read(&with(&var(0x2000, &format!("DataType=6, AccessType=rw, DefaultValue={written}"))));
        assert_eq!(crate::number(&profile, 0x2000, 0), number, "{written}");
        assert!(findings.to_string().contains(said), "{written}: {findings}");
    }
    assert_eq!(initial("DataType=0006, AccessType=rw, DefaultValue=007"), Initial::Value(Value::Fixed(7)));
}

#[test]
fn the_node_id_is_that_of_the_device() {
    let lines = "DataType=0x5, AccessType=ro, DefaultValue=$NODEID+2";
    let profile = read_clean(&with(&var(0x2000, lines)));
    let dictionary = od::Dictionary::new(profile.application, 5);
    let slot = dictionary.find(Address::new(0x2000, 0)).unwrap();
    assert_eq!(dictionary.raw(slot), 7);
    let too_much = findings(&var(0x2000, "DataType=0x5, AccessType=ro, DefaultValue=$NODEID+200"));
    assert_eq!(too_much, ["`DefaultValue`: `$NODEID+200` is no value of UNSIGNED8 and is left out"]);
}

#[test]
fn access_and_mapping_go_together() {
    use Access::{Const, ReadOnly, ReadWrite, WriteOnly};
    for (word, access, mappable) in [
        ("ro", ReadOnly, Mappable::Transmit),
        ("wo", WriteOnly, Mappable::Receive),
        ("rw", ReadWrite, Mappable::Both),
        ("RWR", ReadWrite, Mappable::Transmit),
        ("rww", ReadWrite, Mappable::Receive),
        ("Const", Const, Mappable::Transmit),
    ] {
        let entry = one(&format!("DataType=5, AccessType={word}, PDOMapping=0x1"));
        assert_eq!((entry.access, entry.mappable), (access, mappable), "{word}");
        assert_eq!(one(&format!("DataType=5, AccessType={word}, PDOMapping=0")).mappable, Mappable::No);
    }
}

#[test]
fn limits_may_be_missing_empty_or_bit_patterns() {
    let range = |lines: &str| one(&format!("DataType=3, AccessType=rw, {lines}")).range;
    let integers = |min, max| Some(Range::Integer { min, max });
    assert_eq!(range("LowLimit=, HighLimit="), None);
    assert_eq!(range("LowLimit=-5"), integers(-5, 0x7FFF));
    assert_eq!(range("HighLimit=5"), integers(-0x8000, 5));
    assert_eq!(range("LowLimit=0x8000, HighLimit=0xFFFF"), integers(-0x8000, -1));
    let real = one("DataType=8, AccessType=rw, LowLimit=-1.5, HighLimit=2");
    assert_eq!(real.range, Some(Range::Real { min: -1.5, max: 2.0 }));
}

#[test]
fn an_entry_without_a_default_starts_within_its_limits() {
    let entry = one("DataType=5, AccessType=rw, LowLimit=3, HighLimit=9");
    assert_eq!(entry.initial, Initial::Value(Value::Fixed(3)));
    assert_eq!(entry.range, Some(Range::Integer { min: 3, max: 9 }));
}

#[test]
fn a_domain_needs_no_data_type() {
    let text = with("[2000]\nParameterName=Program\nObjectType=0x2\nAccessType=rw\n");
    assert_eq!(entry(&read_clean(&text), 0x2000, 0).data_type, DataType::Domain);
}

#[test]
fn an_object_in_one_section_has_entries_with_names_and_values_of_their_own() {
    let text = "[2000]\nParameterName=Place\nObjectType=0x8\nCompactSubObj=3\nDataType=0x0003\nAccessType=rw\n\
                DefaultValue=-7\nPDOMapping=1\n\
                [2000Name]\nNrOfEntries=1\n2=Middle\n\
                [2000Value]\nNrOfEntries=1\n3=9\n";
    let (profile, _) = Profile::from_data_sheet("device.dcf", with(text).as_bytes());
    let profile = profile.unwrap();
    let names: Vec<_> = (0..=3).map(|sub| entry(&profile, 0x2000, sub).name.clone()).collect();
    assert_eq!(names, ["NrOfObjects", "Place1", "Middle", "Place3"]);
    let values: Vec<_> = (0..=3).map(|sub| number(&profile, 0x2000, sub)).collect();
    assert_eq!(values, [3, 0xFFF9, 0xFFF9, 9]);
    let (_, _, kind, _) = profile.application.objects().next().unwrap();
    assert_eq!(kind, ObjectKind::Array);
}

const CONFIGURED: &str = "DataType=5, AccessType=rw, DefaultValue=1, ParameterValue=2";

#[test]
fn the_values_of_a_configuration_file_hold_at_power_on() {
    let text = with(&var(0x2000, CONFIGURED));
    let (profile, findings) = Profile::from_data_sheet("device.DCF", text.as_bytes());
    assert!(findings.0.is_empty(), "{findings}");
    assert_eq!(number(&profile.unwrap(), 0x2000, 0), 2);
    let (profile, findings) = read(&text);
    assert_eq!(number(&profile, 0x2000, 0), 1);
    assert!(findings.to_string().contains("`ParameterValue` is of one device"), "{findings}");
}

#[test]
fn a_configuration_file_says_where_the_device_stands() {
    let text =
        with(&var(0x2000, CONFIGURED)) + "[DeviceComissioning]\nNodeID=0x11\nBaudrate=500\nNetNumber=1\n";
    let profile = read_clean(&text);
    assert_eq!(profile.commissioning, Commissioning { node_id: Some(17), bit_rate_kbit_s: Some(500) });
    assert_eq!(number(&profile, 0x2000, 0), 2);
    assert_eq!(
        read_clean(&text.replace("Comissioning", "Commissioning")).commissioning,
        profile.commissioning
    );
    let (profile, findings) = read(&text.replace("0x11", "200"));
    assert_eq!(profile.commissioning.node_id, None);
    assert!(findings.to_string().contains("`NodeID`: `200` is no number from 0 to 127"), "{findings}");
}

#[test]
fn the_identity_is_completed_from_the_device_info() {
    let profile = read_clean(&with(""));
    assert_eq!(profile.identity(1), 0x1234_5678);
}

/// Objects of the communication area without defaults.
const WITHOUT_DEFAULTS: &str = include_str!("sheets/without_defaults.eds");

#[test]
fn communication_objects_without_a_default_have_that_of_the_standard() {
    let byte = var(0x2000, "DataType=0x5, AccessType=ro, PDOMapping=1");
    let profile = read_clean(&with(&(byte + WITHOUT_DEFAULTS)));
    let initial = |index, sub| entry(&profile, index, sub).initial.clone();
    assert_eq!(initial(0x1005, 0), Initial::Value(Value::Fixed(0x80)));
    assert_eq!(initial(0x1014, 0), Initial::PlusNodeId(0x80));
    assert_eq!(initial(0x1200, 1), Initial::PlusNodeId(0x600));
    assert_eq!(initial(0x1801, 1), Initial::PlusNodeId(0x280));
    assert_eq!(initial(0x1804, 1), Initial::Value(Value::Fixed(0x8000_0000)));
    assert_eq!(initial(0x1801, 2), Initial::Value(Value::Fixed(255)));
    assert_eq!(initial(0x1010, 1), Initial::Value(Value::Fixed(1)));
    // The mapping has one object, whatever the file does not say.
    assert_eq!(initial(0x1A01, 0), Initial::Value(Value::Fixed(1)));
    assert!(entry(&profile, 0x1010, 1).is_volatile);
    assert_eq!((profile.rpdos, profile.tpdos), (0, 2));
}

#[test]
fn what_a_node_works_with_has_room_for_its_value() {
    let byte = var(0x2000, "DataType=0x5, AccessType=ro, PDOMapping=1");
    let text = with(&(byte + WITHOUT_DEFAULTS));
    for (own, becomes) in [("0x2", 7), ("0x5", 7), ("0x4", 7), ("0x9", 7), ("0x1B", 0x1B)] {
        let text = text.replace(
            "ParameterName=COB-ID\nObjectType=0x7\nDataType=0x7",
            &format!("ParameterName=COB-ID\nDataType={own}"),
        );
        let (profile, _) = read(&text);
        let cob_id = entry(&profile, 0x1801, 1);
        assert_eq!(cob_id.data_type as u16, becomes, "{own}");
    }
}

#[test]
fn no_default_makes_a_node_disturb_others() {
    let bad = |index: &str, value: &str| {
        let text = with(WITHOUT_DEFAULTS)
            .replace(&format!("[{index}]"), &format!("[{index}]\nDefaultValue={value}"));
        let (profile, findings) = read(&text);
        let (object, sub) = index.split_once("sub").unwrap_or((index, "0"));
        let index = u16::from_str_radix(object, 16).unwrap();
        (number(&profile, index, sub.parse().unwrap()), findings.0[0].message.clone())
    };
    assert_eq!(bad("1801sub1", "0").0, 0x8000_0000);
    assert_eq!(bad("1801sub1", "0x601").0, 0x8000_0000);
    assert_eq!(bad("1801sub1", "$NODEID+0x580").0, 0x8000_0000);
    assert_eq!(bad("1005", "0").0, 0x80);
    assert_eq!(bad("1014", "0x701").0, 0x8000_0000);
    let (period, message) = bad("1006", "20");
    assert_eq!((period, message.as_str()), (0, "no SYNC is produced every 20 us: this becomes 0"));
}

#[test]
fn pdos_that_need_not_be_described_are_there() {
    let text =
        with("").replace("ProductNumber=2", "ProductNumber=2\nCompactPDO=0x13\nNrOfRXPDO=1\nNrOfTXPDO=5");
    let profile = read_clean(&text);
    assert_eq!((profile.rpdos, profile.tpdos), (1, 5));
    assert_eq!(entry(&profile, 0x1400, 1).initial, Initial::PlusNodeId(0x200));
    assert_eq!(number(&profile, 0x1804, 1), 0x8000_0000);
    assert!(profile.communication.slot(Address::new(0x1400, 3)).is_none());
    assert_eq!(entry(&profile, 0x1400, 5).data_type, DataType::Unsigned16);
    assert_eq!(number(&profile, 0x1A04, 0), 0);
}

#[test]
fn what_is_mapped_by_default_can_be_mapped() {
    let word = var(0x2000, "DataType=0x6, AccessType=ro, PDOMapping=0");
    let text = with(&(word + WITHOUT_DEFAULTS)).replace("0x20000008", "0x20000010");
    let (profile, findings) = read(&text);
    assert_eq!(entry(&profile, 0x2000, 0).mappable, Mappable::Transmit);
    assert!(findings.to_string().contains("0x2000:00 is mapped by default"), "{findings}");
}

#[test]
fn a_pdo_may_carry_the_lower_part_of_an_entry() {
    let long = var(0x2000, "DataType=0x4, AccessType=ro, PDOMapping=1");
    let (profile, findings) = read(&with(&(long + WITHOUT_DEFAULTS)));
    assert_eq!(entry(&profile, 0x2000, 0).part, Some(DataType::Integer8));
    assert!(findings.to_string().contains("the lower 8 bits of 0x2000:00"), "{findings}");
}

#[test]
fn a_drive_is_served_without_its_motion() {
    let (profile, findings) = read(&with("").replace("0x00000191", "0x00020192"));
    assert_eq!(profile.axes(), 0);
    assert!(findings.to_string().contains("this is a drive of CiA 402"), "{findings}");
}
