//! Homing mode on a machine with limit switches, home switch, index and hard stops.

#[path = "../bench/mod.rs"]
mod bench;
mod figures;
mod handshake;
mod machine;
mod torque;
mod trouble;
