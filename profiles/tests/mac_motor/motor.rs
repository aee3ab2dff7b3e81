//! Registers of the motor by their names in the manual, and what all tests of it do.

use crate::bench::Bench;

pub(crate) const MODE: u8 = 2;
pub(crate) const P_SOLL: u8 = 3;
pub(crate) const V_SOLL: u8 = 5;
pub(crate) const A_SOLL: u8 = 6;
pub(crate) const T_SOLL: u8 = 7;
pub(crate) const P_FNC: u8 = 8;
pub(crate) const P_IST: u8 = 10;
pub(crate) const V_IST: u8 = 12;
pub(crate) const ERR_STAT: u8 = 35;
pub(crate) const CNTRL_BITS: u8 = 36;
pub(crate) const IN_POS: i32 = 1 << 4;

pub(crate) const FAMILIES: [&str; 2] = ["mac140", "mac800"];

/// The number of P_NEW.
pub(crate) fn p_new(motor: &str) -> u8 {
    if motor == "mac140" { 163 } else { 4 }
}

pub(crate) fn in_position(bench: &Bench) -> bool {
    bench.register(ERR_STAT) & IN_POS != 0
}

/// Waits until the motor is in position, and has come to rest there.
pub(crate) fn arrive(bench: &mut Bench) {
    bench.run(20);
    bench.run_until(in_position);
    bench.run(300);
}

/// Writes the registers and waits until the motor is in position.
pub(crate) fn go(bench: &mut Bench, registers: &[(u8, i64)]) {
    bench.write(registers);
    arrive(bench);
}

/// VF_OUT.
pub(crate) fn torque(bench: &Bench, motor: &str) -> i32 {
    bench.register(if motor == "mac140" { 121 } else { 169 })
}
