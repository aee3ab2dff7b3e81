//! Reads a profile file.

use std::collections::HashMap;
use std::sync::Arc;

use od::{Address, Object, Schema, SchemaError};

use crate::profile::{Commissioning, Dialect};
use crate::{CardType, Diagnostics, MotorData, Profile, RegisterFile, Report, Span};

mod base;
pub(crate) mod default;
mod group;
mod motors;
mod object;
mod pdo;
pub mod reader;
pub(crate) mod registers;

pub(crate) use object::NEVER_STORED;
use object::Objects;
use reader::{Document, Node, Table};
use registers::Lists;

/// Objects below this index belong to the bus, the others to the device (CiA 301 v4.2, table 40).
const FIRST_OF_APPLICATION: u16 = 0x2000;

/// See [`Profile::parse`].
pub(crate) fn parse(
    file: &str,
    text: &str,
    motor: Option<&str>,
    data: &MotorData,
) -> Result<Profile, Diagnostics> {
    let mut report = Report::default();
    let mut document = Document::parse(text, &mut report);
    document.iter_mut().for_each(|document| base::extend(document, &mut report));
    let profile = document.and_then(|document| read(document.root(&mut report), motor, data));
    report.conclude(file, text, profile)
}

fn read(mut file: Table<'_, '_>, motor: Option<&str>, data: &MotorData) -> Option<Profile> {
    let name = file.require::<&str>("name");
    let description = file.require::<&str>("description");
    let vendor = file.require::<&str>("vendor");
    let product = file.require::<&str>("product");
    let dialect = file.word("dialect", dialect, DIALECTS.map(|(word, _)| word)).map(|d| *d.get_ref());
    let motors = motors::read(&mut file, motor, data);

    let chosen = motors.as_ref().and_then(|motors| motors.chosen.as_ref());
    let mut objects = Objects::new(Lists::read(&mut file, chosen));
    for node in file.get::<Vec<Node>>("object").unwrap_or_default() {
        objects.read(node, chosen, file.report);
    }
    let groups = group::read_all(&mut file);
    groups.iter().for_each(|group| group.read_objects(&mut objects, chosen, file.report));
    if objects.wants_motor && !file.has("motors") {
        file.require::<Node>("motors");
    }
    let mut pdos = |kind| {
        let own = pdo::read_all(&mut file, kind, &mut objects);
        groups.iter().fold(own, |sum, group| sum + group.read_pdos(kind, &mut objects, file.report))
    };
    let (rpdos, tpdos) = (pdos(pdo::RECEIVE), pdos(pdo::TRANSMIT));
    let is_of_application = |object: &Object| object.index >= FIRST_OF_APPLICATION;
    let (application, communication) = objects.list.into_iter().partition(is_of_application);
    let communication = schema(communication, &objects.spans, file.report);
    let application = schema(application, &objects.spans, file.report);
    let lists = objects.lists;
    application.iter().for_each(|schema| lists.check_places(schema, &mut file));
    file.finish();

    let (motors, application) = (motors?, application?);
    let registers = RegisterFile::new(&application, lists.motor.as_ref(), lists.module.as_ref());
    Some(Profile {
        name: name?.to_owned(),
        description: description?.to_owned(),
        vendor: vendor?.to_owned(),
        product: product?.to_owned(),
        dialect: dialect.unwrap_or_default(),
        communication: Arc::new(communication?),
        application: Arc::new(application),
        motor_registers: lists.motor.map(Arc::new),
        module_registers: lists.module.map(Arc::new),
        registers: Arc::new(registers),
        bindings: objects.bindings,
        later: objects.later,
        pdos: objects.pdos,
        motor: motors.chosen,
        motors: motors.names,
        rpdos,
        tpdos,
        commissioning: Commissioning::default(),
    })
}

/// The words for them.
const DIALECTS: [(&str, Dialect); 5] = [
    ("cia402", Dialect::Cia402),
    ("jvl", Dialect::Jvl),
    ("mac4-inc", Dialect::Mac4(CardType::Inc)),
    ("mac4-ssi", Dialect::Mac4(CardType::Ssi)),
    ("mac4-stp", Dialect::Mac4(CardType::Stp)),
];

fn dialect(word: &str) -> Option<Dialect> {
    DIALECTS.iter().find(|(known, _)| *known == word).map(|(_, dialect)| *dialect)
}

fn schema(objects: Vec<Object>, spans: &HashMap<Address, Span>, report: &mut Report) -> Option<Schema> {
    let locate = |error: &SchemaError| {
        let whole = Address::new(error.address.index, 0);
        spans.get(&error.address).or_else(|| spans.get(&whole)).cloned().unwrap_or_default()
    };
    let checked = Schema::new(objects);
    checked.map_err(|errors| errors.iter().for_each(|e| report.error(&locate(e), e.to_string(), None))).ok()
}
