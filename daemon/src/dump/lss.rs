//! LSS in words (CiA 305 v3.0, section 6).

/// What the master or a slave says.
pub(super) fn text(is_master: bool, [specifier, data @ ..]: [u8; 8]) -> String {
    let [a, b, c, d, e, f, g] = data;
    let number = u32::from_le_bytes([a, b, c, d]);
    let words = if is_master {
        match specifier {
            0x04 => format!("switch all to {}", mode(a)),
            0x11 => format!("configure Node-ID {a}"),
            0x13 => format!("configure bit timing, table {a}, entry {b}"),
            0x15 => format!("activate bit timing in {} ms", u16::from_le_bytes([a, b])),
            0x17 => "store configuration".to_owned(),
            0x40..=0x43 => format!("switch selective, {} 0x{number:08X}", part(specifier - 0x40)),
            0x46..=0x4B => format!("identify, {} 0x{number:08X}", limit(specifier)),
            0x4C => "identify non-configured slaves".to_owned(),
            0x51 => format!("fastscan, {} 0x{number:08X}, bit {e}, next {}", part(f), part(g)),
            0x5A..=0x5D => format!("inquire {}", part(specifier - 0x5A)),
            0x5E => "inquire Node-ID".to_owned(),
            _ => format!("unknown command 0x{specifier:02X}"),
        }
    } else {
        match specifier {
            0x11 => format!("Node-ID: {}", outcome(a, b)),
            0x13 => format!("bit timing: {}", outcome(a, b)),
            0x17 => format!("store configuration: {}", outcome(a, b)),
            0x44 => "selected".to_owned(),
            0x4F => "a slave is identified".to_owned(),
            0x50 => "there is a non-configured slave".to_owned(),
            0x5A..=0x5D => format!("{} 0x{number:08X}", part(specifier - 0x5A)),
            0x5E => format!("Node-ID {a}"),
            _ => format!("unknown answer 0x{specifier:02X}"),
        }
    };
    format!("LSS {}: {words}", if is_master { "master" } else { "slave" })
}

fn mode(mode: u8) -> String {
    match mode {
        0 => "waiting".to_owned(),
        1 => "configuration".to_owned(),
        _ => format!("unknown state {mode}"),
    }
}

/// The parts of an identity (0x1018), by their number from 0.
const fn part(number: u8) -> &'static str {
    match number {
        0 => "vendor-ID",
        1 => "product code",
        2 => "revision number",
        3 => "serial number",
        _ => "unknown part",
    }
}

const fn limit(specifier: u8) -> &'static str {
    match specifier {
        0x46 => "vendor-ID",
        0x47 => "product code",
        0x48 => "revision number from",
        0x49 => "revision number to",
        0x4A => "serial number from",
        _ => "serial number to",
    }
}

fn outcome(error: u8, specific: u8) -> String {
    match error {
        0 => "done".to_owned(),
        1 => "refused".to_owned(),
        0xFF => format!("refused, specific error {specific}"),
        _ => format!("refused, error {error}"),
    }
}
