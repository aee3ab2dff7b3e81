//! `axisctl dump`: live traffic as the daemon tells it, or a log of candump.

use core::time::Duration;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::sync::Arc;

use config::{Gateway, Link};
use od::Dictionary;

use super::client::{Client, Heard};
use super::command_line;
use super::{Output, refusal};
use crate::cli::Failure;
use crate::commands;
use crate::control::{Request, Response, Traffic};
use crate::dump::{Decoder, Known, log_line};

/// How long is listened at a time.
const PATIENCE: Duration = Duration::from_secs(60);
/// The longest line of a log that is read, in bytes.
const LONGEST_LINE: u64 = 4096;
/// Lines that are no frames and told one by one.
const MOST_COMPLAINTS: u64 = 5;

pub(super) fn run(client: &Client, output: Output, dump: &command_line::Dump) -> Result<(), Failure> {
    let count = dump.count.unwrap_or(u64::MAX);
    match &dump.file {
        Some(file) => from_file(output, file, dump.config.as_deref(), dump.bus.as_deref(), count),
        None => live(client, output, dump.bus.clone(), count),
    }
}

fn live(client: &Client, output: Output, bus: Option<String>, count: u64) -> Result<(), Failure> {
    let mut connection = client.connect(&Request::Dump { bus })?;
    let mut shown = 0;
    while shown < count {
        match connection.hear(PATIENCE)? {
            Heard::Nothing => {}
            Heard::End => {
                eprintln!("axisctl: the daemon has ended");
                return Ok(());
            }
            Heard::Response(response) => match *response {
                Response::Watching(buses) => eprintln!("axisctl: watching {}", buses.join(", ")),
                Response::Dropped(dropped) => eprintln!("axisctl: {dropped} frames could not be shown"),
                Response::Frame(frame) => {
                    output.print(&frame, line)?;
                    shown += 1;
                }
                other => return Err(refusal(other)),
            },
        }
    }
    Ok(())
}

/// A frame as a line: time, bus, frame as candump shows it, and what it says.
fn line(frame: &Traffic) -> String {
    let Traffic { time, bus, id, remote, length, data, decoded, .. } = frame;
    let bytes: Vec<&str> = (0..data.len()).step_by(2).filter_map(|at| data.get(at..at + 2)).collect();
    let bytes = if *remote { "remote request".to_owned() } else { bytes.join(" ") };
    format!("({time:.6}) {bus}  {id:>3}  [{length}]  {bytes:<23}  {}", decoded.text).trim_end().to_owned()
        + "\n"
}

fn from_file(
    output: Output,
    file: &Path,
    config: Option<&Path>,
    bus: Option<&str>,
    count: u64,
) -> Result<(), Failure> {
    let failed = |error: io::Error| Failure::Other(format!("{}: {error}", file.display()));
    let reader: Box<dyn Read> = if file == Path::new("-") {
        Box::new(io::stdin())
    } else {
        Box::new(File::open(file).map_err(failed)?)
    };
    let mut nodes = Nodes::read(config)?;
    let (mut reader, mut text) = (BufReader::new(reader), Vec::new());
    let (mut number, mut shown, mut complaints) = (0_u64, 0, 0);
    while shown < count {
        text.clear();
        let length = (&mut reader).take(LONGEST_LINE).read_until(b'\n', &mut text).map_err(failed)?;
        if length == 0 {
            break;
        }
        number += 1;
        match log_line(&String::from_utf8_lossy(&text)) {
            Ok(None) => {}
            Ok(Some(read)) if bus.is_some_and(|bus| bus != read.interface) => {}
            Ok(Some(read)) => {
                let decoded = nodes.decoder(&read.interface).decode(&read.interface, &read.frame);
                let time = read.time.as_deref().and_then(|time| time.parse().ok()).unwrap_or(0.0);
                let traffic = Traffic::new(time, &read.interface, None, &read.frame, decoded);
                output.print(&traffic, line)?;
                shown += 1;
            }
            Err(why) => {
                complaints += 1;
                if complaints <= MOST_COMPLAINTS {
                    eprintln!("{}:{number}: {why}", file.display());
                }
            }
        }
    }
    if complaints > MOST_COMPLAINTS {
        eprintln!("{}: {complaints} lines are no frames", file.display());
    }
    if shown == 0 && complaints > 0 {
        return Err(Failure::Other(format!("{}: there is no frame in it", file.display())));
    }
    Ok(())
}

/// The nodes that a log is of, by the interfaces that it names.
#[derive(Default)]
struct Nodes {
    decoder: Decoder,
    gateway: Option<Gateway>,
    /// Interfaces of which the nodes are learned.
    learned: BTreeSet<String>,
}

impl Nodes {
    fn read(config: Option<&Path>) -> Result<Self, Failure> {
        let gateway = config.map(commands::load).transpose()?;
        Ok(Self { gateway, ..Self::default() })
    }

    /// The decoder, which knows the nodes on `interface`: a bus of that name or on that interface, or the only bus.
    fn decoder(&mut self, interface: &str) -> &mut Decoder {
        if let Some(gateway) = &self.gateway
            && self.learned.insert(interface.to_owned())
        {
            let is_it = |bus: &config::Bus| {
                bus.name == interface
                    || bus.link == Link::SocketCan(interface.to_owned())
                    || gateway.buses.len() == 1
            };
            let bus = gateway.buses.iter().position(is_it);
            for device in &gateway.devices {
                for place in device.on.iter().filter(|place| Some(place.bus) == bus) {
                    let profile = Arc::clone(&device.profile);
                    let communication = Dictionary::new(Arc::clone(&profile.communication), place.node_id);
                    let (node_id, device) = (place.node_id, device.name.clone());
                    self.decoder.learn(interface, Known { node_id, device, profile, communication });
                }
            }
        }
        &mut self.decoder
    }
}
