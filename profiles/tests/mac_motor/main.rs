//! The registers of a MAC motor at work: the examples of JVL's Ethernet manual, and what its register list says.
//!
//! Registers are reached by 0x2012, as over CANopen.

#[path = "../bench/mod.rs"]
mod bench;
mod motor;

mod analogue;
mod faults;
mod gear;
mod groups;
mod homing;
mod modes;
mod positions;
