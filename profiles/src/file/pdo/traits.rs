//! What a PDO table says beside the objects that hold its parameters: its length on the wire, and how long the device
//! takes to process it.

use core::ops::RangeInclusive;
use core::time::Duration;

use od::{Direction, PdoTraits, Scan};

use super::{Kind, map};
use crate::Report;
use crate::file::object::Objects;
use crate::file::reader::{Node, Spanned, Table};

/// Processing times in us, up to a second.
const TIMES_US: RangeInclusive<u32> = 1..=1_000_000;

/// What the table says of every PDO of a run, whose numbers are to be put in; `None` if nothing.
pub(super) fn read(table: &mut Table<'_, '_>, kind: Kind, objects: &Objects) -> Option<PdoTraits> {
    let length = table.get_in("length", 1..=8);
    let time = table.get_in("processing_us", TIMES_US);
    let scan = table.get::<Node>("scan").and_then(|node| scan(node, objects, table.report));
    if kind.direction == Direction::Receive && table.has("scan") {
        table.report.error(&table.key_span("scan"), "an RPDO has nothing to scan", "leave it out".to_owned());
    } else if table.has("scan") && !table.has("processing_us") {
        let help = "add `processing_us = ` with the time of a PDO that is not scanned".to_owned();
        table.report.error(&table.key_span("scan"), "a PDO that takes no time has nothing to scan", help);
    }
    (length.is_some() || time.is_some()).then(|| PdoTraits {
        direction: kind.direction,
        number: 0,
        length: length.unwrap_or(0),
        time: micros(time.unwrap_or(0)),
        scan,
    })
}

fn scan(node: Node<'_>, objects: &Objects, report: &mut Report) -> Option<Scan> {
    const HIGHEST_BIT: u8 = 63;
    let mut table = node.open(report);
    let entry = table.require::<Spanned<&str>>("entry");
    let entry = entry.and_then(|text| map::known(text.get_ref(), &text.span(), objects, table.report));
    let switch = table.require::<Spanned<&str>>("switch");
    let switch = switch.and_then(|text| map::known(text.get_ref(), &text.span(), objects, table.report));
    let bit = table.require_in("bit", 0..=HIGHEST_BIT);
    let time = table.require_in("processing_us", TIMES_US);
    table.finish();
    Some(Scan { entry: entry?, switch: switch?, bit: bit?, time: micros(time?) })
}

fn micros(micros: u32) -> Duration {
    Duration::from_micros(micros.into())
}
