//! The text of a parameter file.
//!
//! ```text
//! axisd parameters 1
//! application
//! 6081:00=00A00000
//! node 0
//! lss 5 2
//! 1017:00=E803
//! crc32 1A2B3C4D
//! ```
//!
//! The first line has the version of the format. `application` begins the objects of the device, `node n` those of its
//! n-th place on a bus, in the order of the configuration; `lss` has the Node-ID and the index of the bit timing that an
//! LSS master has stored there, a hyphen if none. A value is the bytes that an SDO carries, in hexadecimal
//! digits; index and sub-index are hexadecimal, too. The last line is the CRC-32 of all bytes before it. Lines end
//! with a line feed, all of them.

use core::fmt::Write;

use canopen::LssSetting;
use od::{Address, Saved};
use thiserror::Error;

use crate::core::{NodeParameters, Parameters};

const FIRST_LINE: &str = "axisd parameters ";
const VERSION: &str = "1";

/// Why a file is not used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Corrupt {
    /// The last line is not there or not right: cut short, changed or something else altogether.
    #[error("the checksum is wrong")]
    Checksum,
    /// The file has another version.
    #[error("version {0:?} of the format is unknown")]
    Version(String),
    /// A line is not as it should be, although the checksum is right.
    #[error("line {0} makes no sense")]
    Line(usize),
    /// The same could have been written otherwise, and is by [`encode`].
    #[error("the spelling is not ours")]
    Spelling,
}

/// The text for `parameters`.
#[must_use]
pub fn encode(parameters: &Parameters) -> String {
    let mut text = format!("{FIRST_LINE}{VERSION}\n");
    text.push_str("application\n");
    values(&mut text, &parameters.application);
    for (number, NodeParameters { communication, lss }) in parameters.nodes.iter().enumerate() {
        // A String takes whatever is written.
        let _ = writeln!(text, "node {number}");
        setting(&mut text, *lss);
        values(&mut text, communication);
    }
    let end = last_line(&text);
    text + &end
}

fn setting(text: &mut String, lss: LssSetting) {
    if lss != LssSetting::default() {
        let timing = lss.bit_timing.map_or("-".to_owned(), |timing| timing.to_string());
        let _ = writeln!(text, "lss {} {timing}", lss.node_id);
    }
}

fn values(text: &mut String, saved: &Saved) {
    for (Address { index, sub }, bytes) in saved.iter() {
        let _ = write!(text, "{index:04X}:{sub:02X}=");
        for byte in bytes {
            let _ = write!(text, "{byte:02X}");
        }
        text.push('\n');
    }
}

fn last_line(text: &str) -> String {
    format!("crc32 {:08X}\n", crc32(text.as_bytes()))
}

/// The parameters in a file.
///
/// # Errors
/// Anything that [`encode`] would not have written.
pub fn decode(file: &[u8]) -> Result<Parameters, Corrupt> {
    let text = str::from_utf8(file).map_err(|_| Corrupt::Checksum)?;
    let end = text.rfind("crc32 ").ok_or(Corrupt::Checksum)?;
    let (text, end) = text.split_at(end);
    if end != last_line(text) {
        return Err(Corrupt::Checksum);
    }
    let mut lines = (1..).zip(text.lines());
    let version = lines.next().and_then(|(_, line)| line.strip_prefix(FIRST_LINE)).ok_or(Corrupt::Line(1))?;
    if version != VERSION {
        return Err(Corrupt::Version(version.to_owned()));
    }
    let mut parameters = Parameters::default();
    lines.next().filter(|(_, line)| *line == "application").ok_or(Corrupt::Line(2))?;
    for (number, line) in lines {
        take(&mut parameters, line).ok_or(Corrupt::Line(number))?;
    }
    if encode(&parameters).as_bytes() == file { Ok(parameters) } else { Err(Corrupt::Spelling) }
}

/// Reads one line behind `application`.
fn take(parameters: &mut Parameters, line: &str) -> Option<()> {
    let Parameters { application, nodes } = parameters;
    if let Some(number) = line.strip_prefix("node ") {
        let is_next = number.parse() == Ok(nodes.len());
        return is_next.then(|| nodes.push(NodeParameters::default()));
    }
    if let Some(setting) = line.strip_prefix("lss ") {
        let node = nodes.last_mut().filter(|node| node.is_empty())?;
        node.lss = lss(setting)?;
        return Some(());
    }
    let (address, digits) = line.split_once('=')?;
    let (index, sub) = address.split_once(':')?;
    let address = Address::new(u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?);
    let pairs = digits.as_bytes().chunks(2).map(|pair| {
        let pair = str::from_utf8(pair).ok().filter(|pair| pair.len() == 2)?;
        u8::from_str_radix(pair, 16).ok()
    });
    let bytes: Vec<u8> = pairs.collect::<Option<_>>()?;
    let saved = nodes.last_mut().map_or(application, |node| &mut node.communication);
    saved.insert(address, bytes).then_some(())
}

/// Node-ID and bit timing behind `lss`.
fn lss(setting: &str) -> Option<LssSetting> {
    let (node_id, timing) = setting.split_once(' ')?;
    let bit_timing = if timing == "-" { None } else { Some(timing.parse().ok()?) };
    Some(LssSetting { node_id: node_id.parse().ok()?, bit_timing }).filter(|setting| setting.is_valid())
}

/// CRC-32 of IEEE 802.3: reflected polynomial 0x04C11DB7, all ones before and inverted after.
fn crc32(bytes: &[u8]) -> u32 {
    const REFLECTED: u32 = 0xEDB8_8320;
    let shift = |crc: u32| if crc & 1 == 1 { crc >> 1 ^ REFLECTED } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| shift(crc)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_check_value_of_the_crc_is_right() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    }
}
