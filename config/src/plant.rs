//! `[device.plant]`: the simulated machine behind the axes of a device, and what breaks in it by itself.

use core::ops::RangeInclusive;

use profiles::reader::{Node, Spanned, Table};
use profiles::{
    ANALOG_INPUT_V, EXTERNAL_ENCODER_COUNTS_PER_S, INPUT_WORDS, Input, NoiseSetup, PlantFault, PlantSetup,
    Position, PositionRange, Report, ScheduledFault, Supply, SupplySetup, UnknownFault, Velocity, Voltage,
};

/// Where something may be, in counts: all that 0x6064 can show.
const PLACES: RangeInclusive<f64> = -2_147_483_648.0..=2_147_483_647.0;
/// How long or wide something may be, in counts.
const LENGTHS: RangeInclusive<f64> = 0.0..=1e9;
/// Torques of either direction, in N·m.
const TORQUES: RangeInclusive<f64> = -1e5..=1e5;
/// Inertias in kg·m² and frictions in N·m or N·m·s/rad.
const AMOUNTS: RangeInclusive<f64> = 0.0..=1e5;
/// Voltages in V; a source or a threshold of zero is none.
const VOLTAGES: RangeInclusive<f64> = 1.0..=1e5;
/// Capacitances in F.
const CAPACITANCES: RangeInclusive<f64> = 1e-6..=100.0;
/// Times of the plant, in s.
const TIMES: RangeInclusive<f64> = 0.0..=1e9;

/// Reads the table, if there is one.
pub(crate) fn read(device: &mut Table<'_, '_>) -> PlantSetup {
    let Some(node) = device.get::<Node>("plant") else { return PlantSetup::default() };
    let mut table = node.open(device.report);
    let setup = PlantSetup {
        load_inertia_kg_m2: table.get_in("load_inertia_kg_m2", AMOUNTS),
        load_torque_nm: table.get_in("load_torque_nm", TORQUES),
        friction_nm: table.get_in("friction_nm", AMOUNTS),
        viscous_friction_nms: table.get_in("viscous_friction_nms_per_rad", AMOUNTS),
        backlash: length(&mut table, "backlash_counts"),
        start: place(&mut table, "start_counts"),
        index: place(&mut table, "index_counts"),
        positive_limit: place(&mut table, "positive_limit_counts"),
        negative_limit: place(&mut table, "negative_limit_counts"),
        limit_switch_width: length(&mut table, "limit_switch_width_counts"),
        home: range(&mut table, "home_counts"),
        hysteresis: length(&mut table, "hysteresis_counts"),
        stops: range(&mut table, "stops_counts"),
        active_low: active_low(&mut table),
        analog_input: table.get_in("analog_input_v", ANALOG_INPUT_V).map(Voltage),
        external_encoder: table
            .get_in("external_encoder_counts_per_s", EXTERNAL_ENCODER_COUNTS_PER_S)
            .map(Velocity),
        supply: supply(&mut table),
        noise: NoiseSetup {
            encoder: table.get_in("encoder_noise_counts", LENGTHS),
            velocity: table.get_in("velocity_noise_counts_per_s", LENGTHS),
            seed: table.get("noise_seed"),
        },
        faults: faults(&mut table),
    };
    check_places(&setup, &mut table);
    table.finish();
    setup
}

fn place(table: &mut Table<'_, '_>, key: &'static str) -> Option<Position> {
    table.get_in(key, PLACES).map(Position)
}

fn length(table: &mut Table<'_, '_>, key: &'static str) -> Option<Position> {
    table.get_in(key, LENGTHS).map(Position)
}

/// Two places, the lower one first.
fn range(table: &mut Table<'_, '_>, key: &'static str) -> Option<PositionRange> {
    let ends: Spanned<Vec<f64>> = table.get(key)?;
    let range = match ends.get_ref().as_slice() {
        [min, max] if PLACES.contains(min) && PLACES.contains(max) && min < max => {
            PositionRange::new(Position(*min), Position(*max))
        }
        _ => None,
    };
    if range.is_none() {
        let help = format!(
            "write two numbers from {} to {}, the lower one first, such as [-1000, 1000]",
            PLACES.start(),
            PLACES.end()
        );
        table.report.error(&ends.span(), format!("`{key}` is no range"), help);
    }
    range
}

fn active_low(table: &mut Table<'_, '_>) -> Vec<Input> {
    let words: Vec<Spanned<&str>> = table.get("active_low").unwrap_or_default();
    let find = |word: &Spanned<&str>| {
        let found = INPUT_WORDS.iter().find(|(known, _)| known == word.get_ref());
        if found.is_none() {
            let known = INPUT_WORDS.iter().map(|(known, _)| *known);
            table.report.unknown(&word.span(), "input", word.get_ref(), known);
        }
        found.map(|(_, input)| *input)
    };
    words.iter().filter_map(find).collect()
}

fn supply(table: &mut Table<'_, '_>) -> SupplySetup {
    let mut voltage = |key| table.get_in(key, VOLTAGES).map(Voltage);
    let setup = SupplySetup {
        voltage: voltage("supply_v"),
        under_voltage: voltage("under_voltage_v"),
        over_voltage: voltage("over_voltage_v"),
        chopper: voltage("chopper_v"),
        capacitance_f: table.get_in("dc_link_capacitance_f", CAPACITANCES),
    };
    check_supply(&setup, table);
    setup
}

/// Below the source the stage trips, above it the chopper works, and above that the stage trips, too.
fn check_supply(setup: &SupplySetup, table: &mut Table<'_, '_>) {
    let Supply { voltage: Voltage(volts), under_voltage, over_voltage, .. } = setup.apply(Supply::default());
    let mut check = |key, is_good: bool, help: String| {
        if !is_good && table.has(key) {
            table.report.error(&table.key_span(key), format!("`{key}` does not fit the supply"), help);
        }
    };
    check("under_voltage_v", under_voltage.0 < volts, format!("write less than {volts}, its voltage"));
    check("over_voltage_v", volts < over_voltage.0, format!("write more than {volts}, its voltage"));
    let is_between = |chopper: Voltage| volts < chopper.0 && chopper.0 < over_voltage.0;
    let help = format!("write more than {volts}, its voltage, and less than {}", over_voltage.0);
    check("chopper_v", setup.chopper.is_none_or(is_between), help);
}

fn faults(table: &mut Table<'_, '_>) -> Vec<ScheduledFault> {
    let nodes: Vec<Node> = table.get("faults").unwrap_or_default();
    nodes.into_iter().filter_map(|node| fault(node, table.report)).collect()
}

fn fault(node: Node<'_>, report: &mut Report) -> Option<ScheduledFault> {
    let mut table = node.open(report);
    let what = table.require::<Spanned<&str>>("what");
    let from_seconds = table.require_in("from_s", TIMES);
    let until_seconds = table.get_in("until_s", TIMES);
    if let (Some(from), Some(until)) = (from_seconds, until_seconds)
        && until <= from
    {
        let help = format!("write more than {from}, or leave it out: then the fault stays");
        table.report.error(&table.key_span("until_s"), "the fault is over before it comes", help);
    }
    let fault = what.and_then(|what| match what.get_ref().parse() {
        Ok(PlantFault(fault)) => Some(fault),
        Err(UnknownFault { message, help }) => {
            table.report.error(&what.span(), message, help);
            None
        }
    });
    table.finish();
    Some(ScheduledFault { fault: fault?, from_seconds: from_seconds?, until_seconds })
}

/// Places that exclude each other.
fn check_places(setup: &PlantSetup, table: &mut Table<'_, '_>) {
    let start = setup.start.unwrap_or_default();
    if setup.stops.is_some_and(|stops| !stops.contains(start)) {
        let key = if setup.start.is_some() { "start_counts" } else { "stops_counts" };
        let help = "put `start_counts`, which is 0 without a word, between the stops".to_owned();
        table.report.error(&table.key_span(key), "the start is beyond a hard stop", help);
    }
    if let (Some(negative), Some(positive)) = (setup.negative_limit, setup.positive_limit)
        && negative >= positive
    {
        let help = format!("write less than {}", positive.0);
        let message = "the negative limit switch is not below the positive one";
        table.report.error(&table.key_span("negative_limit_counts"), message, help);
    }
}
