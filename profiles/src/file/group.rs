//! What every axis of a device has: `[group.<name>]` tables with `axes = n` and, in them, `object`, `rpdo` and `tpdo`.
//!
//! They say what the first axis has; each further one has the same at the places of [`Place`]. Without `axes` a group
//! is a part of the file with a name.

use super::object::Objects;
use super::pdo;
use super::reader::{Node, Table};
use crate::{Motor, Report};

/// Where the objects of an axis are, and its PDOs.
///
/// From 0x6000 on the axes lie 0x800 apart, and their PDOs have numbers 64 apart (IEC 61800-7-201); a manufacturer's
/// objects follow one another.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    /// The number of the axis, from 0 on, within a group that says how many there are.
    pub(super) axis: Option<u8>,
}

impl Place {
    const FIRST_OF_PROFILE: u16 = 0x6000;
    const STRIDE: u16 = 0x800;
    /// PDOs of an axis.
    pub(super) const PDOS: u16 = 64;

    /// The index of the object that the first axis has at `index`; `None` beyond 0xFFFF.
    pub(super) fn index(self, index: u16) -> Option<u16> {
        let stride = if index < Self::FIRST_OF_PROFILE { 1 } else { Self::STRIDE };
        u16::from(self.axis.unwrap_or(0)).checked_mul(stride)?.checked_add(index)
    }

    /// Reports the key `axis` where the group says which axis it is.
    pub(super) fn refuse_axis(self, table: &mut Table<'_, '_>) {
        if self.axis.is_some() && table.has("axis") {
            let help = "leave `axis` out".to_owned();
            table.report.error(
                &table.key_span("axis"),
                "the objects of a group are those of all its axes",
                help,
            );
        }
    }

    /// The number of the PDO that has `number` on the first axis.
    pub(super) fn pdo(self, number: u16) -> u16 {
        u16::from(self.axis.unwrap_or(0)) * Self::PDOS + number
    }
}

/// A group as it stands in the file.
pub(super) struct Group<'d> {
    axes: Option<u8>,
    object: Vec<Node<'d>>,
    rpdo: Vec<Node<'d>>,
    tpdo: Vec<Node<'d>>,
}

/// The groups of a file.
pub(super) fn read_all<'d>(file: &mut Table<'_, 'd>) -> Vec<Group<'d>> {
    let Some(groups) = file.get::<Node<'d>>("group") else { return Vec::new() };
    let groups = groups.tables(file.report);
    groups.into_iter().map(|(_, node)| Group::read(node, file.report)).collect()
}

impl<'d> Group<'d> {
    fn read(node: Node<'d>, report: &mut Report) -> Self {
        const MOST_AXES: u8 = 8;
        let mut table = node.open(report);
        let axes = table.get_in("axes", 1..=MOST_AXES);
        let mut list = |key| table.get::<Vec<Node<'d>>>(key).unwrap_or_default();
        let (object, rpdo, tpdo) = (list("object"), list("rpdo"), list("tpdo"));
        table.finish();
        Self { axes, object, rpdo, tpdo }
    }

    fn places(&self) -> impl Iterator<Item = Place> + use<> {
        let single = self.axes.is_none().then(Place::default);
        let axes = (0..self.axes.unwrap_or(0)).map(|axis| Place { axis: Some(axis) });
        single.into_iter().chain(axes)
    }

    /// Reads the objects, those of all axes.
    pub(super) fn read_objects(&self, objects: &mut Objects, motor: Option<&Motor>, report: &mut Report) {
        for place in self.places() {
            objects.place = place;
            self.object.iter().for_each(|node| objects.read(node.clone(), motor, report));
        }
        objects.place = Place::default();
    }

    /// Reads the PDOs of one kind, those of all axes, and says how many there are.
    pub(super) fn read_pdos(&self, kind: pdo::Kind, objects: &mut Objects, report: &mut Report) -> u16 {
        let nodes = if kind.is_receive() { &self.rpdo } else { &self.tpdo };
        let mut sum = 0;
        for place in self.places() {
            objects.place = place;
            sum += pdo::read_list(nodes, kind, objects, report);
        }
        objects.place = Place::default();
        sum
    }
}
