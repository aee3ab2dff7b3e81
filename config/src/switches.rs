//! `switches`: how the dip switches SW1 of JVL's CANopen modules stand (module manual, section 4.3.2).

use profiles::reader::{Spanned, Table};
use profiles::{Dialect, Profile, Report};

/// What the switches say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Setting {
    pub(crate) node_id: u8,
    pub(crate) bit_rate_kbit_s: u16,
}

/// The keys that stand in place of `node_id`.
pub(crate) const SWITCHES: &str = "switches";
pub(crate) const MOTOR_ADDRESS: &str = "motor_address";

const HIGHEST_SWITCH: u8 = 10;
/// Switches 1-7, all on: the Node-ID is the address of the motor.
const MOTOR: u8 = 127;
/// By switches 8-10, the lowest bit first.
const BIT_RATES_KBIT_S: [u16; 8] = [1000, 500, 250, 125, 100, 50, 20, 10];

/// Whether the table says where the device stands by its switches.
pub(crate) fn are_in(table: &Table<'_, '_>) -> bool {
    table.has(SWITCHES) || table.has(MOTOR_ADDRESS)
}

/// Reads `switches`, the numbers of those that are on, and the `motor_address` that they may ask for.
pub(crate) fn read(table: &mut Table<'_, '_>, profile: Option<&Profile>) -> Option<Setting> {
    table.ignore(&["node_id"]);
    if table.has("node_id") {
        let help = "leave out one of them".to_owned();
        table.report.error(&table.key_span("node_id"), "`node_id` and `switches` exclude each other", help);
    }
    if profile.is_some_and(|profile| profile.dialect != Dialect::Jvl) {
        let help = "write `node_id = ` instead: only JVL's CANopen modules have them".to_owned();
        table.report.error(&table.key_span(SWITCHES), "this device has no switches", help);
    }
    let address = table.get_in(MOTOR_ADDRESS, 1..=MOTOR);
    let numbers = table.require::<Vec<Spanned<u8>>>(SWITCHES)?;
    let bits = numbers.iter().fold(0, |bits, number| bits | switch(number, bits, table.report));
    let node_id = match (bits & u16::from(MOTOR)) as u8 {
        0 => {
            let help = "put some of switches 1-7 on: they are the bits of the Node-ID".to_owned();
            table.report.error(&table.key_span(SWITCHES), "0 is no Node-ID", help);
            None
        }
        MOTOR if !table.has(MOTOR_ADDRESS) => {
            let message = "switches 1-7 are all on, so the Node-ID is the address of the motor";
            let help = format!("add `motor_address = ` with a number from 1 to {MOTOR}");
            table.report.error(&table.key_span(SWITCHES), message, help);
            None
        }
        MOTOR => address,
        node_id => {
            if table.has(MOTOR_ADDRESS) {
                let message = format!("the switches say Node-ID {node_id}");
                let help = "leave out `motor_address`, or put switches 1-7 all on".to_owned();
                table.report.error(&table.key_span(MOTOR_ADDRESS), message, help);
            }
            Some(node_id)
        }
    };
    let bit_rate_kbit_s = BIT_RATES_KBIT_S.get(usize::from(bits >> 7)).copied()?;
    Some(Setting { node_id: node_id?, bit_rate_kbit_s })
}

/// The bit of one switch that is on, beside those that are.
fn switch(number: &Spanned<u8>, others: u16, report: &mut Report) -> u16 {
    let bit = match *number.get_ref() {
        switch @ 1..=HIGHEST_SWITCH => 1 << (switch - 1),
        other => {
            let help = "write the numbers of the switches that are on, 1 to 10".to_owned();
            report.error(&number.span(), format!("there is no switch {other}"), help);
            return 0;
        }
    };
    if others & bit != 0 {
        report.error(&number.span(), format!("switch {} is on already", number.get_ref()), None);
    }
    bit
}
