//! The registers of a device, from its profile.

use modbus::{Dialect, Flag, Identification, Map, WordOrder};
use od::{Address, Slot};
use profiles::{Binding, Profile, Role, Space};

/// Setup bit that mirrors the module registers (Ethernet manual, section 8.2.6).
const MIRROR_BIT: u8 = 5;
/// Sub-indices of 0x1018 and what device identification makes of them.
const REVISION: u8 = 3;
const SERIAL: u8 = 4;

/// The registers of a device of this profile: JVL's, if it has them, and but in JVL's dialect all of its dictionary.
#[must_use]
pub fn map(profile: &Profile, dialect: Dialect, order: WordOrder) -> Map {
    let map = with_jvl(profile, Map::new(dialect, order));
    match dialect {
        Dialect::Jvl => map,
        Dialect::Full => {
            let schema = &profile.application;
            let slots = |binding: Binding| -> Vec<Slot> {
                let bound = profile.bindings.iter().filter(|bound| bound.binding == binding);
                bound.filter_map(|bound| schema.slot(bound.address)).collect()
            };
            map.with_application(schema, &slots(Binding::DigitalOutputs), &slots(Binding::DigitalInputs))
        }
    }
}

fn with_jvl(profile: &Profile, map: Map) -> Map {
    if profile.motor_registers.is_none() && profile.module_registers.is_none() {
        return map;
    }
    let schema = &profile.application;
    let registers = |space: Space| {
        (0..=u8::MAX).filter_map(move |number| {
            let place: Address = profile.register(space, number.into())?.place?;
            Some((number, schema.slot(place)?))
        })
    };
    let setup = profile.registers.slot(Role::ModuleSetupBits);
    let mirror = setup.map(|slot| Flag { slot, bit: MIRROR_BIT });
    map.with_jvl(schema, registers(Space::Motor), registers(Space::Module), mirror)
}

/// Who the device called `name` says it is.
#[must_use]
pub fn identification(profile: &Profile, name: &str) -> Identification {
    let revision = profile.identity(REVISION);
    let mut private = vec![profile.name.clone()];
    private.extend(profile.motor.iter().map(|motor| motor.name.clone()));
    private.push(format!("{:08X}", profile.identity(SERIAL)));
    Identification {
        vendor_name: profile.vendor.clone(),
        product_code: profile.product.clone(),
        revision: format!("{}.{}", revision >> 16, revision & 0xFFFF),
        vendor_url: String::new(),
        product_name: profile.product.clone(),
        model_name: profile.motor.as_ref().map(|motor| motor.name.clone()).unwrap_or_default(),
        application_name: name.to_owned(),
        private,
    }
}
