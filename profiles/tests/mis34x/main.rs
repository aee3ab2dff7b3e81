//! A MIS stepper by its registers (JVL Ethernet manual, section 11.4).

#[path = "../bench/mod.rs"]
mod bench;
mod motor;

mod commands;
mod faults;
mod homing;
mod io;
mod modes;
mod owner;
mod registers;
mod traffic;
