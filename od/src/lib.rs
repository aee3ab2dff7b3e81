//! The object dictionary: what a device shows to every bus, and the one gate through which a bus may change it.
//!
//! A [`Schema`] says which objects exist, with type, access, range and default; it is checked once when it is
//! built and then shared by all devices of a kind. A [`Dictionary`] holds the values of one device. Buses read
//! with [`Dictionary::read`] and change values only with [`Dictionary::write`], the write gate: a batch is
//! checked item by item (exists, access, length, range, owner, veto) and then committed whole or not at all.
//! What is stored for the next power-on is a [`Saved`]; it takes the place of the defaults on [`Dictionary::reset`].
//! The device behind the dictionary sees what was written with [`Dictionary::take_written`] and shows its own
//! state with [`Dictionary::set`].
//!
//! There is no I/O and no clock in here: time is an [`Instant`] that comes in as an argument.
#![forbid(unsafe_code)]
#![warn(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

mod abort;
mod address;
pub mod bits;
mod can_id;
mod data_type;
mod dictionary;
pub mod eds;
mod entry;
mod gate;
mod instant;
mod mapping;
mod pdo;
mod rule;
mod saved;
mod schema;
mod sheet;
mod slot_table;
mod value;
mod written;
pub mod xdd;

pub use abort::AbortCode;
pub use address::Address;
pub use can_id::is_restricted;
pub use data_type::DataType;
pub use dictionary::{Dictionary, Slot};
pub use entry::{Access, Entry, Initial, Mappable, Object, ObjectKind, Range, Veto};
pub use gate::{Bus, Commanded, Data, Origin, Owner, Refusal, RefusedCommand, Write};
pub use instant::Instant;
pub use mapping::{Direction, Field, Mapping};
pub use pdo::{PdoTraits, Scan};
pub use saved::{Group, Saved};
pub use schema::{Schema, SchemaError};
pub use sheet::{Configuration, DeviceInfo, Sheet};
pub use slot_table::SlotTable;
pub use value::Value;
