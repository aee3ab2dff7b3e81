//! Register lists: files with one `register` table for each register of a family.
//!
//! `type` stands at the head for all registers that do not say otherwise. `takes_two` at the head says that a register
//! of 32 bits takes two numbers. Numbers that are not listed are reserved.

use od::{Access, Address, DataType, Entry, Initial, Mappable, Schema, Value};

use super::default;
use super::object;
use super::reader::{Document, Node, Scalar, Spanned, Table};
use crate::register::{Behind, Format, Register, RegisterList, Role};
use crate::{Diagnostics, Motor, Report, Span};

/// Highest number that a list may have: 254 extended registers beyond those of a byte.
const HIGHEST_NUMBER: u16 = 509;

/// See [`RegisterList::parse`].
pub(crate) fn parse(file: &str, text: &str, behind: Behind<'_>) -> Result<RegisterList, Diagnostics> {
    let mut report = Report::default();
    let document = Document::parse(text, &mut report);
    let list = document.and_then(|document| read(document.root(&mut report), behind));
    report.conclude(file, text, list)
}

fn read(mut file: Table<'_, '_>, behind: Behind<'_>) -> Option<RegisterList> {
    let name = file.require::<&str>("name");
    let description = file.require::<&str>("description");
    let last = file.require_in("last", 1..=HIGHEST_NUMBER);
    let common = format(&mut file);
    let mut builder = Builder {
        behind,
        common,
        takes_two: file.get("takes_two").unwrap_or(false),
        registers: (0..=last.unwrap_or(HIGHEST_NUMBER)).map(Register::reserved).collect(),
    };
    for node in file.get::<Vec<Node>>("register").unwrap_or_default() {
        builder.read(node, file.report);
    }
    file.finish();
    let Builder { registers, .. } = builder;
    Some(RegisterList { name: name?.to_owned(), description: description?.to_owned(), registers })
}

fn format(table: &mut Table<'_, '_>) -> Option<Format> {
    table.word("type", Format::from_name, ["I16", "U16", "I32", "U32"]).map(Spanned::into_inner)
}

struct Builder<'b> {
    behind: Behind<'b>,
    /// Format of the registers that do not say otherwise.
    common: Option<Format>,
    /// A register of 32 bits takes two numbers.
    takes_two: bool,
    registers: Vec<Register>,
}

impl Builder<'_> {
    /// Reads the register `number`, or the run of equal ones from `number` to `last`.
    fn read(&mut self, node: Node<'_>, report: &mut Report) {
        let highest = self.registers.len().saturating_sub(1) as u16;
        let mut table = node.open(report);
        let number = table.require_in("number", 0..=highest);
        let last = if table.has("last") { table.require_in("last", 0..=highest) } else { number };
        let span = table.key_span("number");
        let register = self.register(&mut table);
        table.finish();
        let (Some(first), Some(last), Some(register)) = (number, last, register) else { return };
        for number in first..=last {
            let name =
                if first == last { register.name.clone() } else { format!("{} {number}", register.name) };
            self.place(Register { number, name, ..register.clone() }, &span, report);
        }
    }

    /// Everything but the number.
    fn register(&self, table: &mut Table<'_, '_>) -> Option<Register> {
        let name = table.require::<&str>("name");
        let format = if table.has("type") { format(table) } else { self.common };
        if format.is_none() && !table.has("type") {
            let help = "add it here or at the head of the list".to_owned();
            table.report.error(&table.span(), "`type` is missing", help);
        }
        let access = object::access(table).unwrap_or(Access::ReadWrite);
        let default = table.get::<Spanned<Scalar<'_>>>("default");
        let range = table.get::<Spanned<Vec<Scalar<'_>>>>("range");
        let unit = table.get::<&str>("unit").unwrap_or_default();
        let meaning = table.get::<&str>("meaning").unwrap_or_default();
        let volatile = table.get::<bool>("volatile").unwrap_or(false);
        let role = self.role(table);
        let place = self.shown(table);
        let (name, format) = (name?, format?);
        let mut register = Register {
            name: name.to_owned(),
            format,
            access,
            unit: unit.to_owned(),
            meaning: meaning.to_owned(),
            role,
            is_volatile: volatile,
            place,
            ..Register::reserved(0)
        };
        if let Some(initial) = default.and_then(|default| self.initial(format, &default, table.report)) {
            register.initial = format.widened(initial);
        }
        register.range = range.and_then(|range| documented_range(format, &range, table.report));
        Some(register)
    }

    fn initial(&self, format: Format, default: &Spanned<Scalar<'_>>, report: &mut Report) -> Option<Initial> {
        match default.get_ref() {
            Scalar::Text(text) if text.starts_with(default::REGISTER) => {
                let registers = self.behind.registers?;
                let register = default::register(text, &default.span(), registers, report)?;
                Some(Initial::Value(Value::Fixed(register.number.into())))
            }
            _ => default::initial(format.data_type(), default, self.behind.motor, report),
        }
    }

    fn role(&self, table: &mut Table<'_, '_>) -> Option<Role> {
        let names = Role::ALL.iter().map(|role| role.name());
        let role = table.word("bind", |name| name.parse().ok(), names)?;
        let other = self.registers.iter().find(|register| register.role == Some(*role.get_ref()));
        if let Some(other) = other {
            let message = format!("`{}` is register {} already", role.get_ref(), other.number);
            table.report.error(&role.span(), message, None);
        }
        Some(role.into_inner())
    }

    /// The entry that `shows` names, which has the value instead of one of the register's own.
    fn shown(&self, table: &mut Table<'_, '_>) -> Option<Address> {
        let text = table.get::<Spanned<&str>>("shows")?;
        let address = super::pdo::address(text.get_ref());
        if address.is_none() {
            let help = "write index and sub-index in hexadecimal, such as `0x2011:02`".to_owned();
            table.report.error(&text.span(), format!("`{}` is no entry", text.get_ref()), help);
        }
        address
    }

    /// Puts a register at its number, and its high word behind it.
    fn place(&mut self, register: Register, span: &Span, report: &mut Report) {
        let takes_two = self.takes_two && register.format.bits() == 32;
        let high = takes_two.then(|| register.high_word());
        for register in [Some(register), high].into_iter().flatten() {
            let number = register.number;
            match self.registers.get_mut(usize::from(number)) {
                Some(place) if place.format == Format::Reserved => *place = register,
                Some(place) => {
                    report.error(span, format!("register {number} is `{}` already", place.name), None);
                }
                None => report.error(span, format!("there is no room for register {number}"), None),
            }
        }
    }
}

fn documented_range(
    format: Format,
    bounds: &Spanned<Vec<Scalar<'_>>>,
    report: &mut Report,
) -> Option<(i64, i64)> {
    match default::range(format.data_type(), bounds, report)? {
        od::Range::Integer { min, max } => Some((i64::try_from(min).ok()?, i64::try_from(max).ok()?)),
        od::Range::Real { .. } => None,
    }
}

/// The register lists of a device.
#[derive(Default)]
pub(super) struct Lists {
    pub(super) motor: Option<RegisterList>,
    pub(super) module: Option<RegisterList>,
}

/// Which registers are the members of an object.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Group {
    /// Motor registers 1-254, each at the sub-index of its number.
    Motor,
    /// Motor registers from 256 on, each at its number less 255.
    Extended,
    /// Module registers that have a value of their own, each at the sub-index of its number.
    Module,
}

impl Group {
    pub(super) const NAMES: [&str; 3] = ["motor", "extended", "module"];

    pub(super) fn from_name(name: &str) -> Option<Self> {
        match name {
            "motor" => Some(Self::Motor),
            "extended" => Some(Self::Extended),
            "module" => Some(Self::Module),
            _ => None,
        }
    }

    /// The sub-index at which this group shows a register.
    fn sub(self, register: &Register) -> Option<u8> {
        let sub = match self {
            Self::Motor => u8::try_from(register.number),
            Self::Extended => u8::try_from(register.number.checked_sub(255)?),
            Self::Module if register.format == Format::Reserved || register.place.is_some() => return None,
            Self::Module => u8::try_from(register.number),
        };
        sub.ok().filter(|sub| (1..=254).contains(sub))
    }
}

impl Lists {
    /// The lists that the chosen motor and `module_registers` at the head name.
    pub(super) fn read(file: &mut Table<'_, '_>, motor: Option<&Motor>) -> Self {
        let known = |name: &str| RegisterList::text(name).map(|_| name.to_owned());
        let module = file.word("module_registers", known, RegisterList::names());
        let name = motor.and_then(|motor| motor.registers.as_deref());
        let behind = Behind { motor, registers: None };
        let motor = name.and_then(|name| embedded(name, behind, &file.key_span("motors"), file.report));
        let behind = Behind { registers: motor.as_ref(), ..behind };
        let module = module.and_then(|name| embedded(name.get_ref(), behind, &name.span(), file.report));
        Self { motor, module }
    }

    /// Reports the registers that show an entry which is not there.
    pub(super) fn check_places(&self, application: &Schema, file: &mut Table<'_, '_>) {
        let registers = [&self.motor, &self.module].into_iter().flatten().flat_map(|list| &list.registers);
        for register in registers {
            if let Some(place) = register.place.filter(|place| application.slot(*place).is_none()) {
                let message = format!("`{}` shows {place}, which is missing", register.name);
                file.report.error(&file.key_span("object"), message, None);
            }
        }
    }

    /// The numbers of the registers of `group` that are meant by their roles, as far as there are such.
    pub(super) fn numbers(&self, group: Group, names: &[Spanned<&str>], report: &mut Report) -> Vec<u16> {
        let list = match group {
            Group::Motor | Group::Extended => self.motor.as_ref(),
            Group::Module => self.module.as_ref(),
        };
        let find = |name: &Spanned<&str>| {
            let roles = default::roles(name.get_ref(), &name.span(), report)?;
            roles.into_iter().find_map(|role| list?.with_role(role)).map(|register| register.number)
        };
        names.iter().filter_map(find).collect()
    }

    /// The entries that show the registers of `group` in the object `index`, which they are now placed in; `None`
    /// without such a list. PDOs may carry the low halves of those whose numbers are in `halves`.
    pub(super) fn members(
        &mut self,
        group: Group,
        index: u16,
        pdo: Mappable,
        halves: &[u16],
    ) -> Option<Vec<Entry>> {
        let list = match group {
            Group::Motor | Group::Extended => self.motor.as_mut(),
            Group::Module => self.module.as_mut(),
        };
        let mut members = Vec::new();
        for register in &mut list?.registers {
            if let Some(sub) = group.sub(register) {
                register.place = Some(Address::new(index, sub));
                let half = halves.contains(&register.number).then(|| register.format.half());
                members.push(Entry { part: half, ..entry(sub, register, pdo) });
            }
        }
        Some(members)
    }

    /// Register zero of the module counts the others, as sub-index 0 of the object `index` does.
    pub(super) fn count(&mut self, group: Group, index: u16) -> Option<Initial> {
        let list = self.module.as_mut().filter(|_| group == Group::Module)?;
        let register = list.registers.first_mut().filter(|first| first.format != Format::Reserved)?;
        register.place = Some(Address::new(index, 0));
        Some(register.initial.clone())
    }
}

/// A list that comes with the program. What is wrong with it is told at `span`.
fn embedded(name: &str, behind: Behind<'_>, span: &Span, report: &mut Report) -> Option<RegisterList> {
    let read = RegisterList::embedded(name, behind)?;
    read.map_err(|wrong| report.error(span, wrong.to_string(), None)).ok()
}

/// The entry of a register: 32 bits, as every bus carries it.
fn entry(sub: u8, register: &Register, pdo: Mappable) -> Entry {
    let mut entry = Entry::new(sub, &register.name, DataType::Unsigned32, register.access);
    let (receive, transmit) =
        (pdo.receive() && register.access.is_writable(), pdo.transmit() && register.access.is_readable());
    entry.mappable = match (receive, transmit) {
        (true, true) => Mappable::Both,
        (true, false) => Mappable::Receive,
        (false, true) => Mappable::Transmit,
        (false, false) => Mappable::No,
    };
    entry.initial = register.initial.clone();
    entry.is_volatile = register.is_volatile;
    // A motor also stores those that command it.
    if register.role.is_some_and(Role::commands) {
        entry.command = Some(0);
        entry.is_kept = true;
    }
    entry
}
