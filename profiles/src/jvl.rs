//! JVL's motors behind their modules.

mod module;

pub(crate) use module::{Module, levels, outputs, stops_on_error};
