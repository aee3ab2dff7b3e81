//! The short commands, and reading configurations.

use std::fs;
use std::io::{self, Read, Write};
use std::path::Path;

use config::{Device, Diagnostic, Diagnostics, Gateway, Severity};
use od::Instant;
use serde::Serialize;

use crate::cli::Failure;
use crate::explain::Explanation;
use crate::{build, modbus_tcp, registers, run};

/// Bytes of a profile file that are read: more than any reader takes.
const LONGEST_PROFILE: u64 = 16 << 20;

/// The configuration in `file`.
pub(crate) fn load(file: &Path) -> Result<Gateway, Failure> {
    read(file).map_err(|wrong| Failure::Configuration(wrong.to_string()))
}

/// The configuration `text`, which diagnostics call `name`.
pub(crate) fn parse(name: &str, text: &str) -> Result<Gateway, Diagnostics> {
    config::load(name, text, &read_profile)
}

/// A profile file. Nobody waits for one that has no end.
fn read_profile(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    fs::File::open(path)?.take(LONGEST_PROFILE).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The configuration in `file`; a file that cannot be read is wrong at its beginning.
pub(crate) fn read(file: &Path) -> Result<Gateway, Diagnostics> {
    let name = file.display().to_string();
    let text = fs::read_to_string(file).map_err(|error| {
        let file = name.clone();
        let (severity, message) = (Severity::Error, error.to_string());
        Diagnostics(vec![Diagnostic { severity, file, line: 1, column: 1, message, help: None }])
    })?;
    parse(&name, &text)
}

/// `axisd check`: for a reader, or all findings as JSON for a program; on demand also what comes of it.
pub(crate) fn check(file: &Path, as_json: bool, explain: bool) -> Result<(), Failure> {
    let gateway = match read(file) {
        Ok(gateway) => gateway,
        Err(wrong) if as_json => {
            print(&json(&wrong)?)?;
            return Err(Failure::ConfigurationShown);
        }
        Err(wrong) => return Err(Failure::Configuration(wrong.to_string())),
    };
    // What only the bus engine can tell: mappings of PDOs, for example.
    build::core(&gateway, Instant::ZERO)?;
    let Diagnostics(warnings) = &gateway.warnings;
    if !as_json && !warnings.is_empty() {
        eprintln!("{}", gateway.warnings);
    }
    if explain {
        let explanation = Explanation::new(&gateway, run::storage_directory(&gateway).as_deref());
        let text = explanation.text().map_err(|error| Failure::Other(error.to_string()));
        return print(&if as_json { json(&explanation)? } else { text? });
    }
    if as_json {
        return print(&json(&gateway.warnings)?);
    }
    let count = |number: usize, what: &str| format!("{number} {what}{}", if number == 1 { "" } else { "s" });
    let buses = gateway.buses.len();
    let buses = if buses == 1 { "1 bus".to_owned() } else { format!("{buses} buses") };
    let mut what = format!("{buses}, {}", count(gateway.devices.len(), "device"));
    if !warnings.is_empty() {
        what += &format!(", {}", count(warnings.len(), "warning"));
    }
    print(&format!("{}: ok ({what})\n", file.display()))?;
    let rates = gateway.buses.iter().filter_map(|bus| Some((&bus.name, bus.bit_rate_kbit_s?)));
    let lines = rates
        .map(|(name, rate)| format!("bus `{name}`: {rate} kbit/s; axisd leaves its interface as it is\n"));
    print(&lines.collect::<String>())
}

fn json(value: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(value).map_err(|error| Failure::Other(error.to_string()))?;
    Ok(text + "\n")
}

/// `axisd eds`.
pub(crate) fn eds(file: &Path, name: &str, form: fn(&od::Sheet<'_>) -> String) -> Result<(), Failure> {
    let gateway = load(file)?;
    let device = find(&gateway, file, name)?;
    print(&device.profile.describe(None, form))
}

/// `axisd registers`.
pub(crate) fn registers(file: &Path, name: &str) -> Result<(), Failure> {
    let gateway = load(file)?;
    let device = find(&gateway, file, name)?;
    print(&registers::text(&device.profile, modbus_tcp::dialect(device.modbus.dialect)))
}

fn find<'g>(gateway: &'g Gateway, file: &Path, name: &str) -> Result<&'g Device, Failure> {
    gateway.devices.iter().find(|device| device.name == name).ok_or_else(|| {
        let known: Vec<_> = gateway.devices.iter().map(|device| device.name.as_str()).collect();
        let text = format!("no device `{name}` in {}; there are: {}", file.display(), known.join(", "));
        Failure::Other(text)
    })
}

/// Writes to standard output; a reader that has left has seen enough.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().write_all(text.as_bytes()).and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::Other(error.to_string())),
        Ok(()) | Err(_) => Ok(()),
    }
}
