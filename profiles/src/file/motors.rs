//! The motors of a profile file: `[motors.<name>]` tables and `default_motor`. A device without axes has none.

use super::reader::{Node, Spanned, Table};
use crate::motor::limits;
use crate::{Motor, MotorData, MotorKind, RegisterList, Report, StepperMotor};

/// The chosen motor and the names of all.
pub(super) struct Motors {
    pub(super) chosen: Option<Motor>,
    pub(super) names: Vec<String>,
}

/// Reads all motors and chooses `wanted`, or the default one, which then has other `data`.
pub(super) fn read(file: &mut Table<'_, '_>, wanted: Option<&str>, data: &MotorData) -> Option<Motors> {
    let default = file.get::<Spanned<&str>>("default_motor");
    let (node, tables) = match file.get::<Node>("motors") {
        Some(node) => (node.span(), node.tables(file.report)),
        None if file.has("motors") => return None,
        None => (file.span(), Vec::new()),
    };
    let names: Vec<&str> = tables.iter().map(|(name, _)| *name.get_ref()).collect();
    let motors: Vec<Motor> =
        tables.iter().filter_map(|(name, node)| motor(name.get_ref(), node.clone(), file.report)).collect();

    let default = default.map(|name| (name.span(), name.into_inner()));
    if let Some((span, name)) = &default
        && !names.contains(name)
    {
        file.report.unknown(span, "motor", name, names.iter().copied());
    }
    if let Some(name) = wanted
        && !names.contains(&name)
    {
        file.report.unknown(&node, "motor", name, names.iter().copied());
    }
    let only = if let [name] = names.as_slice() { Some(*name) } else { None };
    let chosen = match wanted.or(default.map(|(_, name)| name)).or(only) {
        Some(name) => Some(motors.into_iter().find(|motor| motor.name == name)?),
        None if !file.has("motors") => None,
        None => {
            let help = format!("add `default_motor = ` with one of {}", names.join(", "));
            file.report.error(&node, "no motor is the default", help);
            return None;
        }
    };
    let chosen = chosen.map(|motor| data.apply(motor));
    Some(Motors { chosen, names: names.into_iter().map(str::to_owned).collect() })
}

fn motor(name: &str, node: Node<'_>, report: &mut Report) -> Option<Motor> {
    let mut table = node.open(report);
    let counts_per_revolution = table.require_in("counts_per_revolution", limits::COUNTS);
    let raster_ns = table.require_in("raster_ns", limits::RASTER);
    let max_speed_rpm = table.require_in("max_speed_rpm", limits::SPEED);
    let rated_torque_nm = table.require_in("rated_torque_nm", limits::TORQUE);
    let peak_torque_factor = table.require_in("peak_torque_factor", limits::PEAK);
    let rotor_inertia_kg_m2 = table.require_in("rotor_inertia_kg_m2", limits::INERTIA);
    let kind = kind(&mut table);
    let type_code = table.get("type_code").unwrap_or(0);
    let registers = registers(&mut table);
    table.finish();
    Some(Motor {
        name: name.to_owned(),
        counts_per_revolution: counts_per_revolution?,
        raster_ns: raster_ns?,
        max_speed_rpm: max_speed_rpm?,
        rated_torque_nm: rated_torque_nm?,
        peak_torque_factor: peak_torque_factor?,
        rotor_inertia_kg_m2: rotor_inertia_kg_m2?,
        kind: kind?,
        type_code,
        registers,
    })
}

/// The `kind`, with the data that belong to it.
fn kind(table: &mut Table<'_, '_>) -> Option<MotorKind> {
    let is_stepper = |word: &str| match word {
        "servo" => Some(false),
        "stepper" => Some(true),
        _ => None,
    };
    let named = table.word("kind", is_stepper, ["servo", "stepper"]);
    match named.map(Spanned::into_inner) {
        Some(true) => stepper(table).map(MotorKind::Stepper),
        Some(false) => Some(MotorKind::Servo),
        None => (!table.has("kind")).then_some(MotorKind::Servo),
    }
}

fn stepper(table: &mut Table<'_, '_>) -> Option<StepperMotor> {
    let full_steps_per_revolution = table.require_in("full_steps_per_revolution", 1..=1_000_000);
    let rated_current_ma = table.require_in("rated_current_ma", 1..=1_000_000);
    let has_encoder = table.require::<bool>("encoder");
    Some(StepperMotor {
        full_steps_per_revolution: full_steps_per_revolution?,
        rated_current_ma: rated_current_ma?,
        has_encoder: has_encoder?,
    })
}

/// The name of the register list, which must be one that comes with the program.
fn registers(table: &mut Table<'_, '_>) -> Option<String> {
    let known = |name: &str| RegisterList::text(name).map(|_| name.to_owned());
    table.word("registers", known, RegisterList::names()).map(Spanned::into_inner)
}
