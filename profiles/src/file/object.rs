//! The objects of a profile file: `[[object]]` tables.
//!
//! Without `entries` and `array` an object is a VAR. `array = n` makes an ARRAY of n members, `entries` alone a
//! RECORD. What the object says of type, access, PDO, range, default and behaviour holds for every member that
//! does not say otherwise.

use std::collections::{HashMap, HashSet};

use od::{Access, Address, DataType, Entry, Initial, Mappable, Object, PdoTraits, Schema, Value};

use super::group::Place;
use super::reader::{Node, Scalar, Spanned, Table};
use super::registers::{Group, Lists};
use super::{FIRST_OF_APPLICATION, default};
use crate::profile::{Bound, Later};
use crate::{Binding, Motor, Report, Span};

/// What can be written and is never stored, whatever the file says: error history, store, restore.
pub(crate) const NEVER_STORED: [u16; 3] = [0x1003, 0x1010, 0x1011];

/// Everything read from `[[object]]` tables so far.
#[derive(Default)]
pub(super) struct Objects {
    pub(super) list: Vec<Object>,
    pub(super) spans: HashMap<Address, Span>,
    pub(super) bindings: Vec<Bound>,
    pub(super) later: Vec<Later>,
    pub(super) pdos: Vec<PdoTraits>,
    /// Whether some entry is bound to an axis or starts with a datum of its motor.
    pub(super) wants_motor: bool,
    /// The registers of the motor and of the module.
    pub(super) lists: Lists,
    /// Which axis of a group is being read.
    pub(super) place: Place,
    /// Indices at which the first axis has the objects of groups.
    repeated: HashSet<u16>,
    entries: usize,
}

impl Objects {
    /// No objects yet. Those that show registers find them in `lists`.
    pub(super) fn new(lists: Lists) -> Self {
        Self { lists, ..Self::default() }
    }

    /// Reads one object.
    pub(super) fn read(&mut self, node: Node<'_>, motor: Option<&Motor>, report: &mut Report) {
        let mut table = node.open(report);
        let index = table.require::<u16>("index");
        let name = table.require::<&str>("name");
        let mut common = Attributes::read(&mut table);
        self.place.refuse_axis(&mut table);
        common.axis = self.place.axis.or(common.axis);
        let length = array_length(&mut table);
        let member = table.get::<&str>("member");
        let count = table.get::<Node>("count");
        let names = table.get::<Vec<&str>>("names").unwrap_or_default();
        let entries = table.get::<Vec<Node>>("entries");
        let is_local = table.get::<bool>("local").unwrap_or(false);
        if table.has("registers") {
            return self.read_registers(table, &common, is_local);
        }
        let is_var = length.is_none() && entries.is_none();
        if is_var {
            refuse(&mut table, &["member", "count", "names"], "only an object with members has this");
        }
        let span = table.span();
        let (Some(index), Some(name)) = (self.placed(index, &mut table), name) else { return table.finish() };

        let mut builder = Builder { objects: self, index, motor, members: Vec::new() };
        if is_var {
            builder.add(0, name, &common, &span, table.report);
            let entry = builder.members.pop();
            let object = entry.map(|entry| visible(Object::var(index, entry), is_local));
            object.into_iter().for_each(|object| self.push(object, span.clone()));
            return table.finish();
        }
        for node in entries.unwrap_or_default() {
            builder.read_member(node, &names, &common, table.report);
        }
        for sub in 1..=length.unwrap_or(0) {
            builder.fill(sub, &names, member.unwrap_or(name), &common, &span, table.report);
        }
        let members = builder.members;
        let mut object = match length {
            Some(_) => Object::array(index, name, members),
            None => Object::record(index, name, members),
        };
        if let (Some(node), Some(first)) = (count, object.entries.first_mut()) {
            read_count(node, index, first, table.report);
        }
        self.push(visible(object, is_local), span);
        table.finish();
    }

    /// Reads an object whose members are registers.
    fn read_registers(&mut self, mut table: Table<'_, '_>, common: &Attributes<'_>, is_local: bool) {
        let (index, name) = (table.get::<u16>("index"), table.get::<&str>("name"));
        let group = table.word("registers", Group::from_name, Group::NAMES).map(Spanned::into_inner);
        let halves = table.get::<Vec<Spanned<&str>>>("halves").unwrap_or_default();
        let halves = group.map_or(Vec::new(), |group| self.lists.numbers(group, &halves, table.report));
        let span = table.span();
        refuse(
            &mut table,
            &["array", "entries", "member", "count", "names"],
            "the registers are the members",
        );
        let (Some(index), Some(name), Some(group)) = (index, name, group) else { return table.finish() };
        self.wants_motor |= group != Group::Module;
        match self.lists.members(group, index, common.pdo.unwrap_or_default(), &halves) {
            Some(members) if members.is_empty() => {}
            Some(members) => {
                self.entries += members.len();
                let mut object = Object::array(index, name, members);
                if let (Some(initial), Some(count)) =
                    (self.lists.count(group, index), object.entries.first_mut())
                {
                    count.initial = initial;
                }
                self.push(visible(object, is_local), span);
            }
            None => {
                let help = "add `registers = ` to the motor, `module_registers = ` at the head".to_owned();
                table.report.error(&table.key_span("registers"), "there is no register list", help);
            }
        }
        table.finish();
    }

    /// The index of the object on the axis that is being read.
    fn placed(&mut self, index: Option<u16>, table: &mut Table<'_, '_>) -> Option<u16> {
        let (index, place) = (index?, self.place);
        if place.axis.is_some() {
            self.repeated.insert(index);
        }
        let placed = place.index(index);
        if placed.is_none() {
            let message = "the last axes have no room for this object";
            table.report.error(&table.key_span("index"), message, "take a lower index".to_owned());
        }
        placed
    }

    /// The entry of the axis that is being read, where the first axis has that at `address`.
    pub(super) fn of_axis(&self, address: Address) -> Address {
        let placed = self.place.index(address.index).filter(|_| self.repeated.contains(&address.index));
        placed.map_or(address, |index| Address::new(index, address.sub))
    }

    /// Adds an object that stands at `span`.
    pub(super) fn push(&mut self, object: Object, span: Span) {
        self.spans.insert(Address::new(object.index, 0), span);
        self.list.push(object);
    }

    /// The entry at `address`, if it was read.
    pub(super) fn entry(&self, address: Address) -> Option<&Entry> {
        let mut objects = self.list.iter().filter(|o| o.index == address.index);
        objects.find_map(|o| o.entries.iter().find(|e| e.sub == address.sub))
    }
}

fn visible(object: Object, is_local: bool) -> Object {
    if is_local { object.local() } else { object }
}

fn array_length(table: &mut Table<'_, '_>) -> Option<u8> {
    const LONGEST: u8 = 254;
    table.has("array").then(|| table.require_in("array", 1..=LONGEST).unwrap_or(0))
}

fn refuse(table: &mut Table<'_, '_>, keys: &[&str], reason: &str) {
    for key in keys.iter().filter(|key| table.has(key)).copied().collect::<Vec<_>>() {
        let help = "add `array = ` or `entries = `".to_owned();
        table.report.error(&table.key_span(key), format!("`{key}`: {reason}"), help);
    }
}

/// Sub-index 0 where it is no constant: a list of errors, for example.
fn read_count(node: Node<'_>, index: u16, entry: &mut Entry, report: &mut Report) {
    let mut table = node.open(report);
    entry.is_volatile = NEVER_STORED.contains(&index);
    if let Some(access) = access(&mut table) {
        entry.access = access;
    }
    if let Some(number) = table.get::<u8>("default") {
        entry.initial = Initial::Value(Value::Fixed(number.into()));
    }
    if let Some(name) = table.get::<&str>("name") {
        entry.name = name.to_owned();
    }
    table.finish();
}

/// What an object may say for all its members and a member for itself.
struct Attributes<'d> {
    data_type: Option<Type>,
    access: Option<Access>,
    pdo: Option<Mappable>,
    range: Option<Spanned<Vec<Scalar<'d>>>>,
    default: Option<Spanned<Scalar<'d>>>,
    max_length: Option<u32>,
    command: Option<bool>,
    volatile: Option<bool>,
    axis: Option<u8>,
    behaviour: Option<Behaviour>,
}

#[derive(Clone, Copy)]
enum Type {
    Known(DataType),
    /// Something was written that is no type; that is reported.
    Unknown,
}

#[derive(Clone)]
enum Behaviour {
    Bound(Spanned<Binding>),
    Later(String),
}

impl<'d> Attributes<'d> {
    fn read(table: &mut Table<'_, 'd>) -> Self {
        const HIGHEST_AXIS: u8 = 7;
        let types = DataType::ALL.iter().map(|t| t.short_name());
        Self {
            data_type: table.has("type").then(|| {
                let known = table.word("type", DataType::from_name, types);
                known.map_or(Type::Unknown, |known| Type::Known(known.into_inner()))
            }),
            access: access(table),
            pdo: mappable(table),
            range: table.get("range"),
            default: table.get("default"),
            max_length: table.get("max_length"),
            command: table.get("command"),
            volatile: table.get("volatile"),
            axis: if table.has("axis") { table.require_in("axis", 0..=HIGHEST_AXIS) } else { None },
            behaviour: behaviour(table),
        }
    }

    /// Whether there must be an axis and a motor behind the entry.
    fn wants_motor(&self) -> bool {
        let default = self.default.as_ref().map(|default| *default.get_ref());
        matches!(self.behaviour, Some(Behaviour::Bound(_))) || default.is_some_and(default::is_motor_datum)
    }

    /// These attributes where given, otherwise those of the object.
    fn or(self, object: &Self) -> Self {
        Self {
            data_type: self.data_type.or(object.data_type),
            access: self.access.or(object.access),
            pdo: self.pdo.or(object.pdo),
            range: self.range.or_else(|| object.range.clone()),
            default: self.default.or_else(|| object.default.clone()),
            max_length: self.max_length.or(object.max_length),
            command: self.command.or(object.command),
            volatile: self.volatile.or(object.volatile),
            axis: self.axis.or(object.axis),
            behaviour: self.behaviour.or_else(|| object.behaviour.clone()),
        }
    }
}

pub(super) fn access(table: &mut Table<'_, '_>) -> Option<Access> {
    const ALL: [Access; 4] = [Access::Const, Access::ReadOnly, Access::ReadWrite, Access::WriteOnly];
    let parse = |word: &str| ALL.into_iter().find(|access| access.name() == word);
    table.word("access", parse, ALL.map(Access::name)).map(Spanned::into_inner)
}

fn mappable(table: &mut Table<'_, '_>) -> Option<Mappable> {
    let parse = |word: &str| match word {
        "no" => Some(Mappable::No),
        "receive" => Some(Mappable::Receive),
        "transmit" => Some(Mappable::Transmit),
        "both" => Some(Mappable::Both),
        _ => None,
    };
    table.word("pdo", parse, ["no", "receive", "transmit", "both"]).map(Spanned::into_inner)
}

fn behaviour(table: &mut Table<'_, '_>) -> Option<Behaviour> {
    let names = Binding::ALL.iter().map(|b| b.name());
    let bound = table.word("bind", |name| name.parse().ok(), names);
    let later = table.get::<Spanned<&str>>("later");
    match (bound, later) {
        (Some(_), Some(later)) => {
            let help = "leave out `bind` or `later`".to_owned();
            table.report.error(&later.span(), "an entry with a behaviour cannot be for later", help);
            None
        }
        (Some(bound), None) => Some(Behaviour::Bound(bound)),
        (None, Some(later)) => Some(Behaviour::Later((*later.get_ref()).to_owned())),
        (None, None) => None,
    }
}

/// Builds the entries of one object.
struct Builder<'o, 'm> {
    objects: &'o mut Objects,
    index: u16,
    motor: Option<&'m Motor>,
    members: Vec<Entry>,
}

impl Builder<'_, '_> {
    /// Reads an element of `entries`. Its sub-index follows that of the element before.
    fn read_member(&mut self, node: Node<'_>, names: &[&str], common: &Attributes<'_>, report: &mut Report) {
        let mut table = node.open(report);
        let next = self.members.last().map_or(1, |last| last.sub.saturating_add(1));
        let sub = if table.has("sub") { table.require_in("sub", 1..=254) } else { Some(next) };
        let listed = sub.and_then(|sub| name_of(names, sub));
        let name = if listed.is_some() { table.get("name").or(listed) } else { table.require("name") };
        self.objects.place.refuse_axis(&mut table);
        let attributes = Attributes::read(&mut table).or(common);
        let span = table.span();
        if let (Some(sub), Some(name)) = (sub, name) {
            self.add(sub, name, &attributes, &span, table.report);
        }
        table.finish();
    }

    /// Adds the member `sub` of an array if it was not read.
    fn fill(
        &mut self,
        sub: u8,
        names: &[&str],
        stem: &str,
        common: &Attributes<'_>,
        span: &Span,
        report: &mut Report,
    ) {
        if self.members.iter().all(|m| m.sub != sub) {
            let name = name_of(names, sub).map_or_else(|| format!("{stem} {sub}"), str::to_owned);
            self.add(sub, &name, common, span, report);
        }
    }

    fn add(&mut self, sub: u8, name: &str, attributes: &Attributes<'_>, span: &Span, report: &mut Report) {
        self.objects.entries += 1;
        if self.objects.entries > Schema::MAX_ENTRIES {
            if self.objects.entries == Schema::MAX_ENTRIES + 1 {
                report.error(span, "a device cannot have more than 65535 entries", None);
            }
            return;
        }
        let address = Address::new(self.index, sub);
        self.objects.spans.insert(address, span.clone());
        let data_type = match attributes.data_type {
            Some(Type::Known(data_type)) => data_type,
            Some(Type::Unknown) => return,
            None => {
                let help = "add `type = `, such as \"U16\"".to_owned();
                return report.error(span, format!("`type` is missing for `{name}`"), help);
            }
        };
        let mut entry = Entry::new(sub, name, data_type, attributes.access.unwrap_or(Access::ReadWrite));
        entry.mappable = attributes.pdo.unwrap_or_default();
        entry.range = attributes.range.as_ref().and_then(|bounds| default::range(data_type, bounds, report));
        self.objects.wants_motor |= attributes.wants_motor();
        if let Some(default) = &attributes.default
            && let Some(initial) = default::initial(data_type, default, self.motor, report)
        {
            entry.initial = initial;
        }
        entry.max_length = attributes.max_length.map_or(Entry::DEFAULT_MAX_LENGTH, |length| length as usize);
        entry.command = attributes.command.unwrap_or(false).then_some(attributes.axis.unwrap_or(0));
        entry.is_volatile = attributes.volatile.unwrap_or(false) || NEVER_STORED.contains(&self.index);
        self.members.push(entry);

        match &attributes.behaviour {
            Some(Behaviour::Bound(binding)) => {
                let axis = attributes.axis.unwrap_or(0);
                self.bind(
                    Bound { address, axis, binding: *binding.get_ref() },
                    data_type,
                    &binding.span(),
                    report,
                );
            }
            Some(Behaviour::Later(what)) => self.postpone(address, what),
            None => {}
        }
    }

    fn bind(&mut self, bound: Bound, data_type: DataType, span: &Span, report: &mut Report) {
        let name = bound.binding.name();
        let is_single = !bound.binding.is_of_record();
        let same = |other: &&Bound| is_single && other.axis == bound.axis && other.binding == bound.binding;
        if let Some(other) = self.objects.bindings.iter().find(same) {
            report.error(span, format!("`{name}` is bound to {} already", other.address), None);
        }
        if data_type.integer_limits().is_none_or(|(_, max)| max > i64::MAX.into()) {
            let message = format!("`{name}` cannot be bound to a {}", data_type.short_name());
            report.error(span, message, "bind it to an integer below U64".to_owned());
        }
        if bound.address.index < FIRST_OF_APPLICATION {
            report.error(span, "objects 0x1000-0x1FFF are served by the bus", "leave `bind` out".to_owned());
        }
        self.objects.bindings.push(bound);
    }

    fn postpone(&mut self, address: Address, what: &str) {
        let Address { index, sub } = address;
        match self.objects.later.last_mut() {
            Some(last)
                if last.index == index
                    && last.what == what
                    && last.subs.end().checked_add(1) == Some(sub) =>
            {
                last.subs = *last.subs.start()..=sub;
            }
            Some(_) | None => {
                self.objects.later.push(Later { index, subs: sub..=sub, what: what.to_owned() });
            }
        }
    }
}

/// The name of member `sub` in a list of names, where an empty one is none.
fn name_of<'n>(names: &[&'n str], sub: u8) -> Option<&'n str> {
    names.get(usize::from(sub).checked_sub(1)?).copied().filter(|name| !name.is_empty())
}
