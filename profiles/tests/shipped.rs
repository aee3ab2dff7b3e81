//! The shipped profiles.

use profiles::{Binding, Profile};

fn shipped(name: &str) -> Profile {
    Profile::embedded(name, None).unwrap().unwrap_or_else(|wrong| panic!("{wrong}"))
}

#[test]
fn every_shipped_profile_loads_with_every_motor() {
    for name in Profile::names() {
        let default = shipped(name);
        assert_eq!(default.name, name);
        assert_eq!(default.axes(), 1);
        for motor in &default.motors {
            let profile = Profile::embedded(name, Some(motor)).unwrap().unwrap();
            assert_eq!(&profile.motor.name, motor);
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
        for binding in Binding::ALL {
            let bound: Vec<_> = profile.bindings.iter().filter(|b| b.binding == *binding).collect();
            assert!(bound.len() <= 1, "{name}: {binding}");
            assert!(bound.iter().all(|b| profile.application.slot(b.address).is_some()));
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
