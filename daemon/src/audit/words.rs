//! Orders in words: those of `axisctl`.

use canopen::NetworkOrder;
use profiles::Repair;

use crate::control::NMT_COMMANDS;
use crate::motion::Goal;

/// The kind of an order, the node that it is for, and the order.
pub(super) fn network(order: NetworkOrder) -> (&'static str, Option<u8>, String) {
    match order {
        NetworkOrder::Nmt { command, node_id } => {
            let word =
                NMT_COMMANDS.into_iter().find(|(_, known)| *known == command).map_or("?", |(word, _)| word);
            ("nmt", Some(node_id), word.to_owned())
        }
        NetworkOrder::LssNodeId(node_id) => ("lss", None, format!("node-id {node_id}")),
        NetworkOrder::LssBitTiming { table, entry } => {
            ("lss", None, format!("bit-timing, table {table}, entry {entry}"))
        }
        NetworkOrder::LssStore => ("lss", None, "store".to_owned()),
    }
}

/// What is repaired.
pub(super) fn repair(repair: Repair) -> String {
    match repair {
        Repair::All => "all".to_owned(),
        Repair::One(fault) => fault.to_string(),
    }
}

/// The kind of a motion, and how it is to be.
pub(super) fn motion(goal: Goal) -> (&'static str, String) {
    let option =
        |name: &str, value: Option<i64>| value.map(|value| format!(" --{name} {value}")).unwrap_or_default();
    match goal {
        Goal::Move { position, is_relative, velocity, acceleration } => {
            let relative = if is_relative { " --relative" } else { "" };
            let ramps = option("velocity", velocity) + &option("acceleration", acceleration);
            ("move", format!("{position}{relative}{ramps}"))
        }
        Goal::Jog { velocity, acceleration, time } => {
            let time = time.map(|time| format!(" --time {}", time.as_secs_f64())).unwrap_or_default();
            ("jog", format!("{velocity}{}{time}", option("acceleration", acceleration)))
        }
        Goal::Home { method } => ("home", option("method", method).trim_start().to_owned()),
        Goal::Stop => ("stop", String::new()),
    }
}
