//! A device profile, ready to build devices from.

use core::num::NonZeroU32;
use core::ops::RangeInclusive;
use std::sync::Arc;

use od::{
    AbortCode, Address, Configuration, DataType, DeviceInfo, Initial, PdoTraits, Schema, Sheet, Value, Veto,
    eds,
};

use crate::cia402::units::factors;
use crate::cia402::{JERK_LIMITED, LINEAR, is_homing_method, touch_probe};
use crate::{
    Binding, CardType, Diagnostics, Mode, Motor, MotorData, Register, RegisterFile, RegisterList, Role,
    Space, eds as eds_file, file, jvl, mac4,
};

/// Who a device says it is (0x1018; CiA 301 v4.2, section 7.5.2.21); what is `None` stays as its profile has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// Sub-index 1: the vendor's number, given by CiA.
    pub vendor_id: Option<u32>,
    /// Sub-index 2.
    pub product_code: Option<u32>,
    /// Sub-index 3: major number in the upper, minor in the lower 16 bits.
    pub revision: Option<u32>,
    /// Sub-index 4.
    pub serial: Option<u32>,
}

/// Everything the devices of one kind share.
#[derive(Clone, Debug)]
pub struct Profile {
    /// Name by which a configuration chooses it, such as `jvl-mac00-fc4`.
    pub name: String,
    /// What the device is, in one sentence.
    pub description: String,
    /// Vendor in words.
    pub vendor: String,
    /// Product in words.
    pub product: String,
    /// Vocabulary of faults and commands.
    pub dialect: Dialect,
    /// Objects 0x1000-0x1FFF, which the bus engine serves.
    pub communication: Arc<Schema>,
    /// Objects from 0x2000, which the device serves.
    pub application: Arc<Schema>,
    /// What the entries of the application do, in the order of the file.
    pub bindings: Vec<Bound>,
    /// What is only stored so far, in the order of the file.
    pub later: Vec<Later>,
    /// The registers of the motor, if it has any.
    pub motor_registers: Option<Arc<RegisterList>>,
    /// The registers of the module, if it has any.
    pub module_registers: Option<Arc<RegisterList>>,
    /// The way to both in a dictionary of the application.
    pub registers: Arc<RegisterFile>,
    /// What is to be said of its PDOs beside their objects, in the order of the file, RPDOs first.
    pub pdos: Vec<PdoTraits>,
    /// The chosen motor, the same on every axis; none if there are no axes.
    pub motor: Option<Motor>,
    /// Names of all motors there are to choose from, sorted.
    pub motors: Vec<String>,
    /// Number of RPDOs.
    pub rpdos: u16,
    /// Number of TPDOs.
    pub tpdos: u16,
    /// Where it was put into service, if its file says so.
    pub commissioning: Commissioning,
}

/// Where the device of a configuration file (DCF) was put into service (CiA 306-1 v1.4, section 7).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Commissioning {
    /// Its Node-ID, 1-127.
    pub node_id: Option<u8>,
    /// Bit rate of its network.
    pub bit_rate_kbit_s: Option<u16>,
}

/// An entry and the behaviour behind it. No two entries of an axis have the same behaviour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bound {
    /// The entry.
    pub address: Address,
    /// The axis it belongs to, 0-7.
    pub axis: u8,
    /// What it does.
    pub binding: Binding,
}

/// Entries whose behaviour a later version brings; until then they store what is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Later {
    /// The object.
    pub index: u16,
    /// Its sub-indices.
    pub subs: RangeInclusive<u8>,
    /// What is to come.
    pub what: String,
}

/// The vocabulary in which a device reports faults and takes commands beside the standard ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dialect {
    /// CiA 402 and nothing else.
    #[default]
    Cia402,
    /// JVL's CANopen modules.
    Jvl,
    /// MACCON's MAC4 axis controllers.
    Mac4(CardType),
}

/// The pre-defined error field, which is empty but for sub-index 0 at power-on (CiA 301 v4.2, section 7.5.2.3).
const ERROR_FIELD: u16 = 0x1003;

/// The text of a MAC4 card: its head, what all cards have, and the parts that it has.
macro_rules! mac4 {
    ($head:literal, $($part:literal),+) => {
        concat!(
            include_str!(concat!("../devices/maccon-mac4/", $head, ".toml")),
            include_str!("../devices/maccon-mac4/card.toml"),
            $(include_str!(concat!("../devices/maccon-mac4/", $part, ".toml")),)+
        )
    };
}

/// When a device takes and gives its process data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Timing {
    /// At once.
    #[default]
    Immediate,
    /// When the real device would: after the processing times of its profile.
    Authentic,
}

/// The profiles that come with the program: name and text.
const SHIPPED: [(&str, &str); 8] = [
    ("canopen-reference", include_str!("../devices/canopen-reference.toml")),
    ("cia402-servo", include_str!("../devices/cia402-servo.toml")),
    ("jvl-mac00-fc2", include_str!("../devices/jvl-mac00-fc2.toml")),
    ("jvl-mac00-fc4", include_str!("../devices/jvl-mac00-fc4.toml")),
    ("jvl-mis34x", include_str!("../devices/jvl-mis34x.toml")),
    ("maccon-mac4-inc", mac4!("inc", "servo")),
    ("maccon-mac4-ssi", mac4!("ssi", "servo", "sensor")),
    ("maccon-mac4-stp", mac4!("stp", "stepper")),
];

impl Dialect {
    /// Raster steps in a cycle of the profile generator.
    pub(crate) fn generator_cycle(self) -> NonZeroU32 {
        match self {
            Self::Cia402 | Self::Jvl => NonZeroU32::MIN,
            Self::Mac4(_) => NonZeroU32::new(mac4::CYCLE).unwrap_or(NonZeroU32::MIN),
        }
    }
}

impl Profile {
    /// Names of the profiles that come with the program, sorted.
    pub fn names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// The text of the profile file `name` that comes with the program; `None` if there is no such profile.
    #[must_use]
    pub fn text(name: &str) -> Option<&'static str> {
        SHIPPED.iter().find(|(shipped, _)| *shipped == name).map(|(_, text)| *text)
    }

    /// The profile `name` that comes with the program, with the given motor or the profile's default one;
    /// `None` if there is no such profile.
    #[must_use]
    pub fn embedded(name: &str, motor: Option<&str>) -> Option<Result<Self, Diagnostics>> {
        Some(Self::parse(&format!("{name}.toml"), Self::text(name)?, motor))
    }

    /// Reads the profile file `text`, which diagnostics call `file`, with the given motor or the default one.
    ///
    /// # Errors
    /// Everything that is wrong with the file; also that it has no such motor.
    pub fn parse(file: &str, text: &str, motor: Option<&str>) -> Result<Self, Diagnostics> {
        Self::parse_with(file, text, motor, &MotorData::default())
    }

    /// As [`Profile::parse`], for a motor with other data than those of the file.
    ///
    /// # Errors
    /// Everything that is wrong with the file; also that it has no such motor.
    pub fn parse_with(
        file: &str,
        text: &str,
        motor: Option<&str>,
        data: &MotorData,
    ) -> Result<Self, Diagnostics> {
        file::parse(file, text, motor, data).map(|profile| profile.guarded().with_sheet())
    }

    /// Reads the electronic data sheet (EDS) or device configuration file (DCF) `bytes`, which diagnostics call `file`,
    /// and says all that is odd about it. Its objects are served as it describes them, without behaviour of an axis;
    /// there is no profile only if it describes none.
    #[must_use]
    pub fn from_data_sheet(file: &str, bytes: &[u8]) -> (Option<Self>, Diagnostics) {
        let (profile, findings) = eds_file::read(file, bytes);
        (profile.map(Self::with_sheet), findings)
    }

    /// The same profile with the device's own objections to what is written; what it shows of itself is marked.
    fn guarded(mut self) -> Self {
        let is_stepper = self.motor.as_ref().is_some_and(|motor| motor.stepper().is_some());
        let mut application = Arc::unwrap_or_clone(self.application);
        for bound in &self.bindings {
            let veto = own_veto(bound).or_else(|| veto(bound.binding, self.dialect, is_stepper));
            if let Some(veto) = veto {
                application.set_veto(bound.address, veto);
            }
            application.set_live(bound.address);
        }
        let lists = [&self.motor_registers, &self.module_registers].into_iter().flatten();
        for register in lists.flat_map(|list| &list.registers) {
            let (Some(place), Some(role)) = (register.place, register.role) else { continue };
            if let Some(veto) = jvl::of_register(role, is_stepper) {
                application.set_veto(place, veto);
            }
            application.set_live(place);
        }
        self.application = Arc::new(application);
        let communication = Arc::make_mut(&mut self.communication);
        (1..=u8::MAX).for_each(|sub| communication.set_live(Address::new(ERROR_FIELD, sub)));
        self
    }

    /// The same profile with its electronic data sheet in 0x1021, if it has that (CiA 301 v4.2, section 7.5.2.24).
    pub(crate) fn with_sheet(mut self) -> Self {
        let sheet = Address::new(0x1021, 0);
        if self.communication.slot(sheet).is_some() {
            let text = self.eds().into_bytes();
            Arc::make_mut(&mut self.communication).set_initial(sheet, Value::bytes(text));
        }
        self
    }

    /// The same profile as another product. Its data sheet says so, too.
    #[must_use]
    pub fn with_identity(mut self, identity: Identity) -> Self {
        let Identity { vendor_id, product_code, revision, serial } = identity;
        for (sub, number) in (1_u8..).zip([vendor_id, product_code, revision, serial]) {
            let value = number.and_then(|number| Value::integer(DataType::Unsigned32, number.into()));
            if let Some(value) = value {
                Arc::make_mut(&mut self.communication).set_initial(Address::new(0x1018, sub), value);
            }
        }
        if let Some(serial) = serial {
            self.number_registers(serial);
        }
        self.with_sheet()
    }

    /// Gives the registers of motor and module that tell it the serial number.
    fn number_registers(&mut self, serial: u32) {
        let lists = [&self.motor_registers, &self.module_registers].into_iter().flatten();
        let registers = lists.flat_map(|list| {
            [Role::SerialNumber, Role::ModuleSerial].into_iter().filter_map(|role| list.with_role(role))
        });
        for place in registers.filter_map(|register| register.place) {
            Arc::make_mut(&mut self.application).set_initial(place, Value::Fixed(serial.into()));
        }
    }

    /// The register `number` of motor or module, for a bus that numbers what it carries; `None` if there is no such
    /// number. One without a place reads zero and ignores what is written.
    #[must_use]
    pub fn register(&self, space: Space, number: u16) -> Option<&Register> {
        let list = match space {
            Space::Motor => self.motor_registers.as_deref(),
            Space::Module => self.module_registers.as_deref(),
        };
        list?.get(number)
    }

    /// Whether the object `index` has registers of motor or module among its entries.
    #[must_use]
    pub fn has_registers(&self, space: Space, index: u16) -> bool {
        let list = match space {
            Space::Motor => self.motor_registers.as_deref(),
            Space::Module => self.module_registers.as_deref(),
        };
        let mut places =
            list.into_iter().flat_map(|list| &list.registers).filter_map(|register| register.place);
        places.any(|place| place.index == index)
    }

    /// Whether the device takes its time for some PDO.
    #[must_use]
    pub fn has_processing_times(&self) -> bool {
        self.pdos.iter().any(|pdo| !pdo.time.is_zero())
    }

    /// How many axes the device has, 0-8.
    #[must_use]
    pub fn axes(&self) -> u8 {
        self.bindings.iter().map(|b| b.axis + 1).max().unwrap_or(0)
    }

    /// The electronic data sheet of the device.
    #[must_use]
    pub fn eds(&self) -> String {
        self.describe(None, eds::write)
    }

    /// What `form` makes of the objects of the device; with a configuration, of those of one device.
    #[must_use]
    pub fn describe(&self, configuration: Option<&Configuration>, form: fn(&Sheet<'_>) -> String) -> String {
        let info = DeviceInfo {
            name: self.name.clone(),
            vendor_name: self.vendor.clone(),
            vendor_number: self.identity(1),
            product_name: self.product.clone(),
            product_number: self.identity(2),
            revision_number: self.identity(3),
            rpdos: self.rpdos,
            tpdos: self.tpdos,
        };
        form(&Sheet { info: &info, schemas: &[&self.communication, &self.application], configuration })
    }

    /// The default of 0x1018:`sub`, zero if there is none.
    #[must_use]
    pub fn identity(&self, sub: u8) -> u32 {
        let slot = self.communication.slot(Address::new(0x1018, sub));
        match slot.and_then(|s| self.communication.entry(s)).map(|e| &e.initial) {
            Some(Initial::Value(value)) => u32::try_from(value.raw()).unwrap_or(0),
            Some(Initial::PlusNodeId(_)) | None => 0,
        }
    }
}

/// What an entry itself objects to, among those that share a behaviour.
fn own_veto(bound: &Bound) -> Option<Veto> {
    if bound.binding == Binding::Mac4Instruction { mac4::veto(bound.address) } else { None }
}

/// What a drive of this dialect objects to at `binding`: what it does not have, what the standard reserves, and
/// fractions with a zero.
fn veto(binding: Binding, dialect: Dialect, is_stepper: bool) -> Option<Veto> {
    use Dialect::{Cia402, Jvl, Mac4};
    match (binding, dialect) {
        (Binding::Controlword, Mac4(_)) => Some(mac4::check_controlword),
        (Binding::ModesOfOperation, Cia402 | Mac4(_)) => Some(|_, _, raw| check_mode(raw, Cia402)),
        (Binding::ModesOfOperation, Jvl) => Some(|_, _, raw| check_mode(raw, Jvl)),
        (Binding::HomingMethod, Cia402 | Mac4(_)) => Some(|_, _, raw| check_method(raw, Cia402)),
        (Binding::HomingMethod, Jvl) if is_stepper => {
            Some(|_, _, raw| check(jvl::is_stepper_homing(i64::from(raw as u8 as i8))))
        }
        (Binding::HomingMethod, Jvl) => Some(|_, _, raw| check_method(raw, Jvl)),
        (Binding::MotionProfileType, Cia402 | Mac4(_)) => {
            Some(|_, _, raw| check([LINEAR, JERK_LIMITED].contains(&i64::from(raw as u16 as i16))))
        }
        (Binding::MotionProfileType, Jvl) => Some(|_, _, raw| check(LINEAR == i64::from(raw as u16 as i16))),
        (Binding::JvlFastMac, _) => Some(jvl::of_fastmac),
        (Binding::ProfileJerkUse, _) => Some(|_, _, raw| check(matches!(raw as u8, 1 | 2 | 4))),
        (Binding::PositioningOption, _) => Some(|_, _, raw| check(has_positioning_options(raw as u16))),
        (Binding::TouchProbeFunction, _) => Some(touch_probe::check_function),
        (Binding::TouchProbe1Source | Binding::TouchProbe2Source, _) => Some(touch_probe::check_source),
        // Bits 0-5 of 0x607E are reserved.
        (Binding::Polarity, _) => Some(|_, _, raw| check(raw & 0x3F == 0)),
        (part, _) if factors::is_fraction(part) => Some(|_, _, raw| check(raw != 0)),
        (_, _) => None,
    }
}

/// Whether 0x60F2 holds none but the options that a linear axis with one interpolator has.
fn has_positioning_options(raw: u16) -> bool {
    let [relative, immediately, response] = [raw & 3, raw >> 2 & 3, raw >> 4 & 3];
    relative < 3 && immediately < 2 && response < 3 && raw >> 6 == 0
}

fn check(is_allowed: bool) -> Result<(), AbortCode> {
    if is_allowed { Ok(()) } else { Err(AbortCode::InvalidValue) }
}

/// Whether a drive of this dialect has the mode in the low byte of `raw`.
fn check_mode(raw: u64, dialect: Dialect) -> Result<(), AbortCode> {
    let mode = Mode::from_code(i64::from(raw as u8 as i8)).filter(|mode| mode.is_in(dialect));
    mode.map(|_| ()).ok_or(AbortCode::InvalidValue)
}

/// Whether a drive of this dialect has the homing method in the low byte of `raw`.
fn check_method(raw: u64, dialect: Dialect) -> Result<(), AbortCode> {
    check(is_homing_method(i64::from(raw as u8 as i8), dialect))
}
