//! The short commands, and reading configurations.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use config::Gateway;

use crate::cli::Failure;

/// The configuration in `file`.
pub(crate) fn load(file: &Path) -> Result<Gateway, Failure> {
    let name = file.display().to_string();
    let text =
        fs::read_to_string(file).map_err(|error| Failure::Configuration(format!("{name}: {error}")))?;
    parse(&name, &text)
}

/// The configuration `text`, which diagnostics call `name`.
pub(crate) fn parse(name: &str, text: &str) -> Result<Gateway, Failure> {
    let read = |path: &Path| fs::read_to_string(path);
    config::load(name, text, &read).map_err(|diagnostics| Failure::Configuration(diagnostics.to_string()))
}

/// `axisd check`.
pub(crate) fn check(file: &Path) -> Result<(), Failure> {
    let gateway = load(file)?;
    gateway.notes.iter().for_each(|note| eprintln!("{note}"));
    let count = |number: usize, what: &str| format!("{number} {what}{}", if number == 1 { "" } else { "s" });
    let buses = gateway.buses.len();
    let buses = if buses == 1 { "1 bus".to_owned() } else { format!("{buses} buses") };
    print(&format!("{}: ok ({buses}, {})\n", file.display(), count(gateway.devices.len(), "device")))
}

/// `axisd eds`.
pub(crate) fn eds(file: &Path, name: &str) -> Result<(), Failure> {
    let gateway = load(file)?;
    let Some(device) = gateway.devices.iter().find(|device| device.name == name) else {
        let known: Vec<_> = gateway.devices.iter().map(|device| device.name.as_str()).collect();
        let text = format!("no device `{name}` in {}; there are: {}", file.display(), known.join(", "));
        return Err(Failure::Other(text));
    };
    print(&device.profile.eds())
}

/// Writes to standard output; a reader that has left has seen enough.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().write_all(text.as_bytes()).and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::Other(error.to_string())),
        Ok(()) | Err(_) => Ok(()),
    }
}
