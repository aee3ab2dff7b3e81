//! JVL's motors behind their modules.

mod command;
mod fastmac;
mod follower;
mod groups;
mod module;
mod motor;
mod units;
mod veto;

pub(crate) use module::{Module, levels, stops_on_error};
pub(crate) use veto::{of_fastmac, of_register};
