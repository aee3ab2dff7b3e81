//! The shipped profiles.

use od::{Access, Address, DataType, Initial, Mappable, Schema, Value};
use profiles::{Behind, Binding, Profile, RegisterList, Role};

fn shipped(name: &str) -> Profile {
    Profile::embedded(name, None).unwrap().unwrap_or_else(|wrong| panic!("{wrong}"))
}

#[test]
fn every_shipped_profile_loads_with_every_motor() {
    for name in Profile::names() {
        let default = shipped(name);
        assert_eq!(default.name, name);
        let axes = match name {
            "canopen-reference" => 0,
            card if card.starts_with("maccon-mac4") => 4,
            _ => 1,
        };
        assert_eq!(default.axes(), axes);
        for motor in &default.motors {
            let profile = Profile::embedded(name, Some(motor)).unwrap().unwrap();
            assert_eq!(profile.motor.map(|chosen| chosen.name).as_ref(), Some(motor));
        }
    }
    assert!(Profile::embedded("warp-drive", None).is_none());
    assert!(Profile::names().is_sorted());
}

#[test]
fn a_motor_that_a_profile_does_not_have_is_refused_with_the_list_of_those_it_has() {
    let wrong = Profile::embedded("jvl-mac00-fc4", Some("mac9000")).unwrap().unwrap_err().to_string();
    assert!(wrong.contains("unknown motor `mac9000`"), "{wrong}");
}

#[test]
fn every_bound_entry_exists_and_no_behaviour_is_bound_twice() {
    for name in Profile::names() {
        let profile = shipped(name);
        assert!(profile.bindings.iter().all(|b| profile.application.slot(b.address).is_some()));
        for binding in Binding::ALL.iter().filter(|binding| !binding.is_of_record()) {
            for axis in 0..8 {
                let is_same = |b: &&profiles::Bound| b.binding == *binding && b.axis == axis;
                assert!(profile.bindings.iter().filter(is_same).count() <= 1, "{name}: {binding}");
            }
        }
    }
}

#[test]
fn nothing_is_both_bound_and_postponed() {
    for name in Profile::names() {
        let profile = shipped(name);
        for bound in &profile.bindings {
            let at = bound.address;
            let postponed = profile.later.iter().find(|l| l.index == at.index && l.subs.contains(&at.sub));
            assert_eq!(postponed, None, "{name}");
        }
    }
}

/// Module manual, section 4.3.1: "both modules offer the same functions".
#[test]
fn the_fc2_is_the_fc4_by_another_name() {
    let (fc2, fc4) = (shipped("jvl-mac00-fc2"), shipped("jvl-mac00-fc4"));
    let name = Address::new(0x1008, 0);
    for (a, b) in [(&fc2.communication, &fc4.communication), (&fc2.application, &fc4.application)] {
        assert_eq!(a.entries().count(), b.entries().count());
        for ((at, a), (_, b)) in a.entries().zip(b.entries()).filter(|((at, _), _)| *at != name) {
            let sheet = Address::new(0x1021, 0);
            assert_eq!(
                (&a.name, a.data_type, a.access, a.mappable),
                (&b.name, b.data_type, b.access, b.mappable)
            );
            assert!(a.initial == b.initial || at == sheet, "{at}");
        }
    }
    assert_eq!((&fc2.bindings, &fc2.motors), (&fc4.bindings, &fc4.motors));
    assert_eq!((fc2.motors.len(), fc2.motor.unwrap().name.as_str()), (8, "mac140"));
    assert_eq!((fc2.vendor, fc2.product.as_str()), (fc4.vendor, "MAC00-FC2"));
}

#[test]
fn a_profile_says_what_it_has_otherwise_than_the_one_it_extends() {
    let text = "extends = \"jvl-mac00-fc4\"\nname = \"own\"\ndescription = \"b\"\nproduct = \"d\"\n\
                default_motor = \"mac800\"\nwithout = [0x2100]\n\
                object = [{ index = 0x605A, name = \"Stop\", type = \"I16\", default = 6 }]\n\
                rpdo = [{ number = 1, map = [\"0x6040:00\"], transmission = 1 }]";
    let (own, base) = (Profile::parse("own.toml", text, None).unwrap(), shipped("jvl-mac00-fc4"));
    let initial = |schema: &Schema, index, sub| {
        let slot = schema.slot(Address::new(index, sub))?;
        schema.entry(slot).map(|entry| entry.initial.clone())
    };
    assert_eq!(initial(&own.application, 0x605A, 0), Some(Initial::Value(Value::Fixed(6))));
    assert_eq!(initial(&own.application, 0x2100, 0), None);
    assert_eq!(initial(&own.communication, 0x1400, 2), Some(Initial::Value(Value::Fixed(1))));
    assert_eq!(initial(&own.application, 0x6067, 0), initial(&base.application, 0x6067, 0));
    assert_eq!(own.motor.unwrap().name, "mac800");
    assert_eq!((own.rpdos, own.tpdos, own.dialect), (base.rpdos, base.tpdos, base.dialect));
}

#[test]
fn the_steppers_have_steps_and_none_of_the_torque_objects() {
    let profile = shipped("jvl-mis34x");
    let motor = profile.motor.as_ref().unwrap();
    assert_eq!((motor.name.as_str(), motor.counts_per_revolution), ("mis340", 409_600));
    for index in [0x2100, 0x6072, 0x606D, 0x606E] {
        assert!(!profile.application.has_object(index), "{index:04X}");
    }
    for index in [0x2204, 0x6073, 0x6075] {
        assert!(profile.application.has_object(index), "{index:04X}");
    }
}

#[test]
fn the_data_sheet_names_vendor_product_and_every_object() {
    let profile = shipped("jvl-mac00-fc4");
    let sheet = profile.eds();
    let lines = [
        "FileName=jvl-mac00-fc4.eds",
        "VendorName=JVL A/S",
        "VendorNumber=0x00000117",
        "ProductNumber=0x00000100",
        "NrOfRXPDO=9",
        "NrOfTXPDO=10",
        "[1803sub1]",
        "DefaultValue=$NODEID+0x40000480",
        "[2012subFE]",
    ];
    for line in lines {
        assert!(sheet.lines().any(|l| l == line), "{line}");
    }
}

#[test]
fn the_reference_device_has_every_type_access_and_direction() {
    let profile = shipped("canopen-reference");
    assert!(profile.motor.is_none() && profile.motors.is_empty());
    let entries: Vec<_> = profile.application.entries().map(|(_, entry)| entry).collect();
    for data_type in DataType::ALL {
        let writable = entries.iter().find(|e| e.data_type == *data_type && e.access == Access::ReadWrite);
        let mappable = writable.map(|e| e.mappable == Mappable::Both);
        assert_eq!(mappable, Some(data_type.bits().is_some()), "{data_type}");
    }
    for access in [Access::Const, Access::ReadOnly, Access::ReadWrite, Access::WriteOnly] {
        assert!(entries.iter().any(|e| e.access == access), "{}", access.name());
    }
    for mappable in [Mappable::No, Mappable::Receive, Mappable::Transmit, Mappable::Both] {
        assert!(entries.iter().any(|e| e.mappable == mappable), "{mappable:?}");
    }
    assert_eq!((profile.rpdos, profile.tpdos), (8, 8));
}

#[test]
fn a_device_without_an_axis_has_no_motor_and_one_with_an_axis_needs_one() {
    let head = "name = \"a\"\ndescription = \"b\"\nvendor = \"c\"\nproduct = \"d\"\n";
    let object =
        |more: &str| format!("{head}object = [{{ index = 0x2000, name = \"x\", type = \"U16\"{more} }}]");
    assert_eq!(Profile::parse("text", &object(""), None).unwrap().axes(), 0);
    for more in [", bind = \"controlword\"", ", default = \"$MOTOR.max_speed_rpm\""] {
        let wrong = Profile::parse("text", &object(more), None).unwrap_err().to_string();
        assert!(wrong.contains("`motors` is missing"), "{wrong}");
    }
    let wrong = Profile::parse("text", &object(""), Some("mac140")).unwrap_err().to_string();
    assert!(wrong.contains("unknown motor `mac140`"), "{wrong}");
}

#[test]
fn a_run_of_pdos_counts_its_numbers_and_cob_ids() {
    let text = "name = \"a\"\ndescription = \"b\"\nvendor = \"c\"\nproduct = \"d\"\n\
                rpdo = [{ number = 1, last = 3, map = [] }, { number = 4, last = 512, cob_id = 0x20000400, map = [] }]\n\
                tpdo = [{ number = 3, last = 6, capacity = 64, map = [] }]";
    let profile = Profile::parse("text", text, None).unwrap();
    assert_eq!((profile.rpdos, profile.tpdos), (512, 4));
    let initial = |index, sub| {
        let slot = profile.communication.slot(Address::new(index, sub))?;
        profile.communication.entry(slot).map(|entry| entry.initial.clone())
    };
    let fixed = |raw| Some(Initial::Value(Value::Fixed(raw)));
    assert_eq!(initial(0x1402, 1), Some(Initial::PlusNodeId(0x400)));
    assert_eq!(initial(0x1403, 1), fixed(0x2000_0400));
    assert_eq!(initial(0x15FF, 1), fixed(0x2000_05FC));
    assert_eq!(initial(0x1803, 1), Some(Initial::PlusNodeId(0x4000_0480)));
    assert_eq!(initial(0x1804, 1), fixed(0xC000_0000));
    assert_eq!((initial(0x1A05, 64), initial(0x17FF, 8)), (fixed(0), fixed(0)));
    let wrong = Profile::parse("text", &text.replace("last = 6", "last = 2"), None).unwrap_err().to_string();
    assert!(wrong.contains("write a number from 3 to 512"), "{wrong}");
}

/// A name that a profile file may bind to and that nothing acts on would be a promise without a witness.
#[test]
fn every_behaviour_has_code_behind_it() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let code = code_in(&folder);
    for binding in Binding::ALL {
        assert!(code.contains(&format!("Binding::{binding:?}")), "`{binding}` has nothing behind it");
    }
}

/// Roles of registers that only hold a value, and why.
const HELD: [(&str, &[Role]); 6] = [
    (
        "what the motor or the module is, as a default in its list or by the profile",
        &[
            Role::ProgVersion,
            Role::MotorType,
            Role::HwVersion,
            Role::Checksum,
            Role::MaxVoltageCurrent,
            Role::ModuleMacHigh,
            Role::ModuleMacLow,
            Role::ModuleHwVersion,
            Role::ModuleSwVersion,
            Role::ModuleProtocol,
        ],
    ),
    (
        "addresses and bit rates: the configuration of the gateway has the ones that count",
        &[
            Role::MyAddr,
            Role::FieldbusAddr,
            Role::FieldbusSpeed,
            Role::ModuleIp,
            Role::ModuleNetMask,
            Role::ModuleGateway,
        ],
    ),
    (
        "for buses that are not there, or for the engine of their bus",
        &[Role::ModulePollDivision, Role::ModuleStationAlias, Role::ModuleTimeout, Role::ModuleInputMask],
    ),
    (
        "parts of a motor that are not simulated (docs/jvl.md)",
        &[
            Role::SOrder,
            Role::HwSetup,
            Role::InvOutput,
            Role::OutputCtrl,
            Role::Useroutval,
            Role::Mac002,
            Role::Mac008,
            Role::Mac009,
            Role::PIstTurntab,
            Role::TurntabCount,
            Role::POffset,
            Role::PMultiturn,
            Role::Aninp2,
            Role::Aninp2Offset,
            Role::U24v,
            Role::CviVoltage,
        ],
    ),
    (
        "nothing on the way to a simulated motor is repeated or garbled",
        &[Role::ModuleRetries, Role::ModuleCrcErrors],
    ),
    ("a view of 0x2011:02", &[Role::ModuleOutputs]),
];

#[test]
fn every_register_with_a_meaning_has_code_behind_it_or_only_holds_a_value() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let code = code_in(&folder);
    let groups = std::fs::read_to_string(folder.join("register/groups.rs")).unwrap();
    let has_word = |text: &str, word: &str| {
        let mut places = text.match_indices(word);
        places.any(|(at, _)| !text[at + word.len()..].starts_with(|c: char| c.is_alphanumeric()))
    };
    let asks_for = |role: Role| {
        has_word(&code, &format!("Role::{role:?}")) || has_word(&groups, &format!("Self::{role:?}"))
    };
    let is_held = |role: Role| HELD.iter().any(|(_, roles)| roles.contains(&role));
    for list in RegisterList::names() {
        let list = RegisterList::embedded(list, Behind::default()).unwrap().unwrap();
        for register in &list.registers {
            let Some(role) = register.role else { continue };
            assert!(asks_for(role) != is_held(role), "{}: {} ({role:?})", list.name, register.name);
        }
    }
}

/// All that stands in the source files of a folder and those below it.
fn code_in(folder: &std::path::Path) -> String {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .map(|path| if path.is_dir() { code_in(&path) } else { std::fs::read_to_string(path).unwrap() })
        .collect()
}
