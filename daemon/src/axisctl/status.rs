//! `axisctl status`, `axisctl watch`, and what is shown of NMT and LSS.

use core::time::Duration;
use std::io::{self, IsTerminal};
use std::thread;

use super::client::{Client, Heard};
use super::{Output, json, refusal};
use crate::cli::Failure;
use crate::commands::print;
use crate::control::{Commanded, LssResult, Request, Response};
use crate::status::{self, Status, table};

/// How long the daemon may take.
const PATIENCE: Duration = Duration::from_secs(10);
/// Clears a terminal and begins at its top.
const CLEAR: &str = "\x1b[2J\x1b[H";

pub(super) fn show(client: &Client, output: Output) -> Result<(), Failure> {
    match client.ask(&Request::Status {})? {
        Response::Status(status) if output.is_json => {
            let text =
                serde_json::to_string_pretty(&status).map_err(|error| Failure::Other(error.to_string()))?;
            print(&(text + "\n"))
        }
        Response::Status(status) => print(&status::text(&status)),
        other => Err(refusal(other)),
    }
}

/// Shows the status until the daemon ends, or so many times.
pub(super) fn watch(
    client: &Client,
    output: Output,
    interval: Duration,
    count: Option<u64>,
) -> Result<(), Failure> {
    let mut connection = client.connect(&Request::Status {})?;
    let mut shown = 0;
    loop {
        match connection.hear(PATIENCE)? {
            Heard::Response(response) => match *response {
                Response::Status(status) => show_once(&status, output, shown)?,
                other => return Err(refusal(other)),
            },
            Heard::Nothing => return Err(Failure::Other("the daemon does not answer".to_owned())),
            Heard::End => {
                eprintln!("axisctl: the daemon has ended");
                return Ok(());
            }
        }
        shown += 1;
        if count.is_some_and(|count| shown >= count) {
            return Ok(());
        }
        thread::sleep(interval);
        // One that has ended is found when it is listened to.
        let _ = connection.say(&Request::Status {});
    }
}

fn show_once(status: &Status, output: Output, shown: u64) -> Result<(), Failure> {
    if output.is_json {
        return print(&(json(status)? + "\n"));
    }
    let text = status::text(status);
    if io::stdout().is_terminal() {
        print(&format!("{CLEAR}{text}"))
    } else {
        print(&format!("{}{text}", if shown == 0 { "" } else { "\n" }))
    }
}

/// NMT commands that were sent, as a table.
pub(super) fn commanded(commanded: &[Commanded]) -> String {
    let row = |Commanded { bus, node_id, state }: &Commanded| {
        let node = if *node_id == 0 { "all".to_owned() } else { node_id.to_string() };
        [bus.clone(), node, state.clone().unwrap_or_else(|| "sent".to_owned())]
    };
    table(&["BUS", ">NODE", "STATE"], &commanded.iter().map(row).collect::<Vec<_>>())
}

/// An LSS slave, as a table.
pub(super) fn slave(found: &LssResult) -> String {
    let LssResult { bus, vendor_id, product_code, revision, serial, node_id } = found;
    let [vendor_id, product_code, revision, serial] =
        [vendor_id, product_code, revision, serial].map(|number| format!("0x{number:08X}"));
    let node_id = node_id.map_or_else(|| "none".to_owned(), |node_id| node_id.to_string());
    let row = [bus.clone(), vendor_id, product_code, revision, serial, node_id];
    table(&["BUS", "VENDOR-ID", "PRODUCT", "REVISION", "SERIAL", ">NODE"], &[row])
}
