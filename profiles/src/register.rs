//! Motor and module registers: numbered values that a device shows on every bus.
//!
//! A [`RegisterList`] is data: the registers of a family of motors, or of a module, by number. The entries of the
//! dictionary that hold them are made from it, and [`RegisterFile`] gives behaviours a way to them by [`Role`].

mod file;
mod groups;
mod list;
mod role;

pub use file::RegisterFile;
pub(crate) use file::WrittenRegister;
pub use list::{Behind, Format, Register, RegisterList, Space};
pub use role::{Role, UnknownRole};
