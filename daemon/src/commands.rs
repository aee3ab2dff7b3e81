//! The short commands, and reading configurations.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use config::{Device, Diagnostic, Diagnostics, Gateway};

use crate::cli::Failure;
use crate::{modbus_tcp, registers};

/// The configuration in `file`.
pub(crate) fn load(file: &Path) -> Result<Gateway, Failure> {
    read(file).map_err(|wrong| Failure::Configuration(wrong.to_string()))
}

/// The configuration `text`, which diagnostics call `name`.
pub(crate) fn parse(name: &str, text: &str) -> Result<Gateway, Diagnostics> {
    config::load(name, text, &|path: &Path| fs::read_to_string(path))
}

/// The configuration in `file`; a file that cannot be read is wrong at its beginning.
fn read(file: &Path) -> Result<Gateway, Diagnostics> {
    let name = file.display().to_string();
    let text = fs::read_to_string(file).map_err(|error| {
        let file = name.clone();
        Diagnostics(vec![Diagnostic { file, line: 1, column: 1, message: error.to_string(), help: None }])
    })?;
    parse(&name, &text)
}

/// `axisd check`: for a reader, or all findings as JSON for a program.
pub(crate) fn check(file: &Path, as_json: bool) -> Result<(), Failure> {
    let outcome = read(file);
    if as_json {
        let none = Diagnostics::default();
        let wrong = outcome.as_ref().err().unwrap_or(&none);
        let text = serde_json::to_string_pretty(wrong).map_err(|error| Failure::Other(error.to_string()))?;
        print(&format!("{text}\n"))?;
        return if outcome.is_ok() { Ok(()) } else { Err(Failure::ConfigurationShown) };
    }
    let gateway = outcome.map_err(|wrong| Failure::Configuration(wrong.to_string()))?;
    let count = |number: usize, what: &str| format!("{number} {what}{}", if number == 1 { "" } else { "s" });
    let buses = gateway.buses.len();
    let buses = if buses == 1 { "1 bus".to_owned() } else { format!("{buses} buses") };
    print(&format!("{}: ok ({buses}, {})\n", file.display(), count(gateway.devices.len(), "device")))?;
    let rates = gateway.buses.iter().filter_map(|bus| Some((&bus.name, bus.bit_rate_kbit_s?)));
    let lines = rates
        .map(|(name, rate)| format!("bus `{name}`: {rate} kbit/s; axisd leaves its interface as it is\n"));
    print(&lines.collect::<String>())
}

/// `axisd eds`.
pub(crate) fn eds(file: &Path, name: &str) -> Result<(), Failure> {
    let gateway = load(file)?;
    let device = find(&gateway, file, name)?;
    let identity = profiles::Identity { serial: device.serial, ..profiles::Identity::default() };
    print(&profiles::Profile::clone(&device.profile).with_identity(identity).eds())
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
