//! The lines that candump prints and logs (can-utils): `(1700000000.000000) can0 601#40411600`, and
//! `  can0  601   [8]  40 41 60 00 00 00 00 00`, with what its options put in between.

use canopen::{Frame, Id};

/// A frame in a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLine {
    /// The time as the log has it, without parentheses.
    pub time: Option<String>,
    /// The interface.
    pub interface: String,
    /// The frame.
    pub frame: Frame,
}

/// What a line holds; `None` for one that is empty or a comment.
///
/// # Errors
/// Why it is no frame, for a reader.
pub fn log_line(line: &str) -> Result<Option<LogLine>, &'static str> {
    let line = line.trim();
    if line.is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    let (time, rest) = match line.strip_prefix('(') {
        Some(rest) => {
            rest.split_once(')').map(|(time, rest)| (Some(time.trim()), rest)).ok_or("`)` is missing")?
        }
        None => (None, line),
    };
    let mut words = rest.split_ascii_whitespace();
    let interface = words.next().ok_or("the interface is missing")?;
    // With -x candump tells the direction and two flags.
    let mut words = words.filter(|word| !matches!(*word, "TX" | "RX" | "-" | "B" | "E"));
    let word = words.next().ok_or("the frame is missing")?;
    let frame = match word.split_once('#') {
        Some((id, data)) => compact(id, data)?,
        None => spread(word, words)?,
    };
    Ok(Some(LogLine { time: time.map(str::to_owned), interface: interface.to_owned(), frame }))
}

/// `601#40411600`, or `601#R8` for a remote frame.
fn compact(id: &str, data: &str) -> Result<Frame, &'static str> {
    let id = identifier(id)?;
    if data.starts_with('#') {
        return Err("CAN FD is not decoded");
    }
    // Behind an underscore stands the length code of a frame that has eight bytes and says more.
    let data = data.split('_').next().unwrap_or_default();
    if let Some(length) = data.strip_prefix('R') {
        let length =
            if length.is_empty() { Some(0) } else { length.parse().ok().filter(|length| *length <= 8) };
        return length.map(|length| Frame::remote(id, length)).ok_or("the length is no digit from 0 to 8");
    }
    let digits: Vec<u8> = data.bytes().filter(|byte| *byte != b'.').collect();
    let byte = |pair: &[u8]| match pair {
        [_, _] => hex(str::from_utf8(pair).unwrap_or_default()).map(|byte| byte as u8),
        _ => None,
    };
    let payload: Option<Vec<u8>> = digits.chunks(2).map(byte).collect();
    framed(id, &payload.ok_or("the data are no bytes in hexadecimal")?)
}

/// `601   [8]  40 41 60 00 00 00 00 00`, or `601   [8]  remote request`.
fn spread<'w>(word: &str, mut words: impl Iterator<Item = &'w str>) -> Result<Frame, &'static str> {
    let id = identifier(word)?;
    let length = words.next().and_then(|word| word.strip_prefix('[')?.strip_suffix(']'));
    let length = length.ok_or("the length is missing")?;
    if length.len() > 1 {
        return Err("CAN FD is not decoded");
    }
    let length: u8 =
        length.parse().ok().filter(|length| *length <= 8).ok_or("the length is no digit from 0 to 8")?;
    let words: Vec<&str> = words.take(usize::from(length).max(1)).collect();
    if words.first() == Some(&"remote") {
        return Ok(Frame::remote(id, length));
    }
    let bytes = words.into_iter().take(usize::from(length));
    let payload: Option<Vec<u8>> =
        bytes.map(|word| hex(word).filter(|_| word.len() == 2).map(|byte| byte as u8)).collect();
    let payload = payload.filter(|payload| payload.len() == usize::from(length));
    framed(id, &payload.ok_or("the data are not as many bytes in hexadecimal as the length says")?)
}

fn framed(id: Id, payload: &[u8]) -> Result<Frame, &'static str> {
    if payload.len() <= 8 { Ok(Frame::new(id, payload)) } else { Err("a frame has at most eight bytes") }
}

/// Three digits are a standard identifier, eight an extended one.
fn identifier(word: &str) -> Result<Id, &'static str> {
    const HIGHEST_STANDARD: u32 = 0x7FF;
    const HIGHEST_EXTENDED: u32 = 0x1FFF_FFFF;
    let number = hex(word).ok_or("the identifier is no number in hexadecimal")?;
    match word.len() {
        3 if number <= HIGHEST_STANDARD => Ok(Id::Standard(number as u16)),
        8 if number <= HIGHEST_EXTENDED => Ok(Id::Extended(number)),
        8 => Err("an error frame"),
        _ => Err("an identifier has three digits or eight"),
    }
}

fn hex(word: &str) -> Option<u32> {
    let is_number = (1..=8).contains(&word.len()) && word.bytes().all(|byte| byte.is_ascii_hexdigit());
    u32::from_str_radix(word, 16).ok().filter(|_| is_number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn shown(line: &str) -> String {
        match log_line(line) {
            Ok(Some(LogLine { time, interface, frame })) => {
                format!("{} {interface} {frame}", time.unwrap_or_default())
            }
            Ok(None) => "nothing".to_owned(),
            Err(why) => why.to_owned(),
        }
    }

    #[test]
    fn every_way_in_which_candump_writes_a_frame_is_read() {
        for (line, expected) in [
            (
                "(1436509052.249713) vcan0 601#4041600000000000",
                "1436509052.249713 vcan0 601#4041600000000000",
            ),
            ("(1436509052.249713) vcan0 601#40.41.60 T", "1436509052.249713 vcan0 601#404160"),
            ("(0.0) can0 00000081#", "0.0 can0 00000081#"),
            ("(0.0) can0 701#R", "0.0 can0 701#R0"),
            ("(0.0) can0 701#R1", "0.0 can0 701#R1"),
            ("(0.0) can0 601#1122334455667788_9", "0.0 can0 601#1122334455667788"),
            ("  vcan0  044   [5]  2A 36 6C 2B BA", " vcan0 044#2A366C2BBA"),
            (" (000.000012)  vcan0  080   [0] ", "000.000012 vcan0 080#"),
            ("  vcan0  701   [1]  remote request", " vcan0 701#R1"),
            ("  vcan0  TX - -  0000044F   [1]  2A   '*'", " vcan0 0000044F#2A"),
            ("", "nothing"),
            ("# a comment", "nothing"),
        ] {
            assert_eq!(shown(line), expected, "{line}");
        }
    }

    #[test]
    fn what_is_no_frame_is_said() {
        for (line, why) in [
            ("(1.0 can0 601#00", "`)` is missing"),
            ("can0", "the frame is missing"),
            ("(1.0)", "the interface is missing"),
            ("(1.0) can0 601##1112233", "CAN FD is not decoded"),
            ("  can0  601  [12]  00 11", "CAN FD is not decoded"),
            ("(1.0) can0 20000004#0000000000000000", "an error frame"),
            ("(1.0) can0 60#00", "an identifier has three digits or eight"),
            ("(1.0) can0 xyz#00", "the identifier is no number in hexadecimal"),
            ("(1.0) can0 601#0", "the data are no bytes in hexadecimal"),
            ("(1.0) can0 601#001122334455667788", "a frame has at most eight bytes"),
            ("(1.0) can0 601#R9", "the length is no digit from 0 to 8"),
            ("can0 601 [2] 00", "the data are not as many bytes in hexadecimal as the length says"),
            ("can0 601 00 00", "the length is missing"),
        ] {
            assert_eq!(shown(line), why, "{line}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_a_frame_or_none(line: String) {
            let _ = log_line(&line);
        }

        #[test]
        fn what_a_log_holds_is_read_again(raw in 0_u32..=0x1FFF_FFFF, extended: bool, payload in proptest::collection::vec(any::<u8>(), 0..=8)) {
            let id = if extended { Id::Extended(raw) } else { Id::Standard((raw & 0x7FF) as u16) };
            let frame = Frame::new(id, &payload);
            let read = log_line(&format!("(1.5) can0 {frame}")).unwrap().unwrap();
            prop_assert_eq!(read.frame, frame);
            let bytes: Vec<String> = payload.iter().map(|byte| format!("{byte:02X}")).collect();
            let read = log_line(&format!("  can0  {id}   [{}]  {}", payload.len(), bytes.join(" "))).unwrap().unwrap();
            prop_assert_eq!(read.frame, frame);
        }
    }
}
