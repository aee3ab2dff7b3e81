//! JVL's motors behind their modules.

mod command;
mod ethernet;
mod fastmac;
mod follower;
mod groups;
mod inputs;
mod mirror;
mod module;
mod motor;
mod objects;
mod scope;
mod stepper;
mod traffic;
mod units;
mod veto;

pub(crate) use ethernet::reaction_to_silence;
pub(crate) use inputs::levels;
pub(crate) use module::{Module, is_endless, stops_on_error};
pub(crate) use objects::{is_stepper_homing, object_of, taken};
pub(crate) use veto::{of_fastmac, of_register};
