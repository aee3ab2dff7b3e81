//! Groups of a profile file: what the first axis has, all axes have.

use od::{Address, Initial, Value};
use profiles::{Binding, Profile};

const HEAD: &str = "name = \"a\"\ndescription = \"b\"\nvendor = \"c\"\nproduct = \"d\"\n";
const MOTOR: &str = "\n[motors.m]\ncounts_per_revolution = 2000\nraster_ns = 1000000\nmax_speed_rpm = 3000\n\
                     rated_torque_nm = 1\npeak_torque_factor = 3\nrotor_inertia_kg_m2 = 1e-5\n";

fn parse(groups: &str) -> Result<Profile, String> {
    Profile::parse("text", &format!("{HEAD}{groups}{MOTOR}"), None).map_err(|wrong| wrong.to_string())
}

const THREE: &str = r#"
[group.drive]
axes = 3
object = [
  { index = 0x2100, name = "Own", entries = [{ sub = 7, name = "x", type = "U8" }] },
  { index = 0x6040, name = "Controlword", type = "U16", pdo = "both", bind = "controlword" },
]
rpdo = [{ number = 1, map = ["0x6040:00"] }, { number = 63, last = 64, map = [] }]

[group.device]
object = [{ index = 0x2200, name = "One", type = "U8", pdo = "both" }]
tpdo = [{ number = 2, map = ["0x2200:00"] }]
"#;

#[test]
fn the_objects_of_a_group_stand_at_the_place_of_each_axis() {
    let profile = parse(THREE).unwrap();
    for axis in 0..3_u16 {
        assert!(profile.application.slot(Address::new(0x2100 + axis, 7)).is_some());
        let address = Address::new(0x6040 + 0x800 * axis, 0);
        let bound = profile.bindings.iter().find(|bound| bound.address == address).unwrap();
        assert_eq!((bound.axis, bound.binding), (axis as u8, Binding::Controlword));
    }
    assert!(!profile.application.has_object(0x2103) && !profile.application.has_object(0x7840));
    assert!(profile.application.has_object(0x2200) && !profile.application.has_object(0x2201));
    assert_eq!(profile.axes(), 3);
}

#[test]
fn the_pdos_of_an_axis_begin_at_64_times_its_number_and_map_its_own_objects() {
    let profile = parse(THREE).unwrap();
    assert_eq!((profile.rpdos, profile.tpdos), (9, 1));
    let value = |index, sub| {
        let slot = profile.communication.slot(Address::new(index, sub)).unwrap();
        profile.communication.entry(slot).unwrap().initial.clone()
    };
    let fixed = |raw| Initial::Value(Value::Fixed(raw));
    assert_eq!([value(0x1600, 1), value(0x1640, 1)], [fixed(0x6040_0010), fixed(0x6840_0010)]);
    assert_eq!(value(0x1680, 1), fixed(0x7040_0010));
    assert_eq!(value(0x1400, 1), Initial::PlusNodeId(0x200));
    assert_eq!(value(0x1440, 1), fixed(0x8000_0000), "the master gives it a COB-ID");
    assert!(profile.communication.has_object(0x16BF), "PDO 192");
    assert_eq!(value(0x1A01, 1), fixed(0x2200_0008));
}

#[test]
fn what_is_wrong_with_a_group_is_said_once_and_where_it_stands() {
    let wrong = |from: &str, to: &str| parse(&THREE.replace(from, to)).unwrap_err();
    let found = wrong("axes = 3", "axes = 9");
    assert!(found.contains("text:7:8") && found.contains("write a number from 1 to 8"), "{found}");
    let found = wrong("type = \"U16\"", "type = \"U17\"");
    assert_eq!(found.matches("unknown type `U17`").count(), 1, "{found}");
    assert!(found.contains("text:10:50"), "{found}");
    let found = wrong("index = 0x6040", "axis = 1, index = 0x6040");
    assert!(found.contains("those of all its axes"), "{found}");
    let found = wrong("{ sub = 7", "{ axis = 1, sub = 7");
    assert!(found.contains("those of all its axes"), "{found}");
    let found = wrong("index = 0x6040", "index = 0xF040");
    assert!(found.contains("the last axes have no room for this object"), "{found}");
    let found = wrong("number = 1, map", "number = 65, map");
    assert!(found.contains("write a number from 1 to 64"), "{found}");
    let found = wrong("number = 1, map", "number = 1, cob_id = 0x201, map");
    assert!(found.contains("cannot have one COB-ID"), "{found}");
    let found = wrong("index = 0x2200", "index = 0x2101");
    assert!(found.contains("0x2101:00: the object is defined twice"), "{found}");
    let found = wrong("[group.device]", "[group.device]\naxis = 1");
    assert!(found.contains("unknown key `axis`") && found.contains("`axes`"), "{found}");
}
