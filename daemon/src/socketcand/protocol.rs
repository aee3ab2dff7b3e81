//! The text that socketcand and its clients exchange (`doc/protocol.md` of socketcand): `< word argument ... >`.
//!
//! Standard identifiers have up to three hexadecimal digits, extended ones eight. Remote frames cannot pass.

use core::fmt::Write;
use core::time::Duration;

use canopen::{Frame, Id};

/// The longest command that is read; a `send` has at most 49 bytes.
const LONGEST: usize = 256;

/// What a client asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Command {
    /// Choose the bus of this name.
    Open(String),
    /// Hear every frame.
    RawMode,
    /// Show a sign of life.
    Echo,
    /// Put a frame on the bus.
    Send(Frame),
}

/// Why a command is refused; its text goes to the client.
pub(crate) type Refusal = &'static str;

impl Command {
    /// Reads what stands between `<` and `>`.
    fn parse(text: &[u8]) -> Result<Self, Refusal> {
        let text = str::from_utf8(text).map_err(|_| "not ASCII")?;
        let mut words = text.split_ascii_whitespace();
        match words.next().unwrap_or_default() {
            "open" => words.next().map(|bus| Self::Open(bus.to_owned())).ok_or("open needs a bus"),
            "rawmode" => Ok(Self::RawMode),
            "echo" => Ok(Self::Echo),
            "send" => parse_send(words).map(Self::Send).ok_or("syntax error in send command"),
            "bcmmode" | "isotpmode" | "controlmode" => Err("only rawmode is supported"),
            _ => Err("unknown command"),
        }
    }
}

/// `ID LENGTH BYTE...`, all hexadecimal.
fn parse_send<'t>(mut words: impl Iterator<Item = &'t str>) -> Option<Frame> {
    let id = parse_id(words.next()?)?;
    let length = hex(words.next()?, 1)? as usize;
    let mut payload = [0; 8];
    for place in payload.get_mut(..length)? {
        *place = hex(words.next()?, 2)? as u8;
    }
    words.next().is_none().then(|| Frame::new(id, payload.get(..length).unwrap_or_default()))
}

fn parse_id(word: &str) -> Option<Id> {
    const HIGHEST_STANDARD: u32 = 0x7FF;
    const HIGHEST_EXTENDED: u32 = 0x1FFF_FFFF;
    if word.len() == 8 {
        return hex(word, 8).filter(|id| *id <= HIGHEST_EXTENDED).map(Id::Extended);
    }
    hex(word, 3).filter(|id| *id <= HIGHEST_STANDARD).map(|id| Id::Standard(id as u16))
}

/// The number of at most `digits` digits; unlike `from_str_radix` alone without a sign.
fn hex(word: &str, digits: usize) -> Option<u32> {
    let is_number = word.len() <= digits && word.bytes().all(|byte| byte.is_ascii_hexdigit());
    u32::from_str_radix(word, 16).ok().filter(|_| is_number)
}

/// Adds a frame as a client in raw mode hears it. `stamp` is the time since 1970.
pub(crate) fn write_frame(text: &mut String, stamp: Duration, frame: &Frame) {
    let (seconds, micros) = (stamp.as_secs(), stamp.subsec_micros());
    // A String takes whatever is written.
    let _ = write!(text, "< frame {} {seconds}.{micros:06} ", frame.id);
    for byte in frame.payload() {
        let _ = write!(text, "{byte:02X}");
    }
    text.push_str(" >");
}

/// Cuts what a client sends into commands. What it keeps is bounded, whatever comes.
#[derive(Debug, Default)]
pub(crate) struct Scanner {
    /// What stands behind the last `<`; `None` before it.
    command: Option<Vec<u8>>,
    is_too_long: bool,
}

impl Scanner {
    /// Takes the next byte; gives a command when it is complete.
    pub(crate) fn take(&mut self, byte: u8) -> Option<Result<Command, Refusal>> {
        match (byte, &mut self.command) {
            (b'<', _) => {
                self.command = Some(Vec::new());
                self.is_too_long = false;
                None
            }
            (_, None) => None,
            (b'>', Some(_)) => {
                let command = self.command.take().unwrap_or_default();
                Some(if self.is_too_long { Err("command too long") } else { Command::parse(&command) })
            }
            (_, Some(command)) if command.len() == LONGEST => {
                self.is_too_long = true;
                None
            }
            (_, Some(command)) => {
                command.push(byte);
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn scan(text: &str) -> Vec<Result<Command, Refusal>> {
        let mut scanner = Scanner::default();
        text.bytes().filter_map(|byte| scanner.take(byte)).collect()
    }

    #[test]
    fn commands_of_python_can_are_understood() {
        let text = "< open can0 >< rawmode >< send 601 8 40 0 10 0 0 0 0 0 >< send 080 0  >< echo >";
        assert_eq!(
            scan(text),
            [
                Ok(Command::Open("can0".to_owned())),
                Ok(Command::RawMode),
                Ok(Command::Send(Frame::new(Id::Standard(0x601), &[0x40, 0, 0x10, 0, 0, 0, 0, 0]))),
                Ok(Command::Send(Frame::new(Id::Standard(0x80), &[]))),
                Ok(Command::Echo),
            ]
        );
    }

    #[test]
    fn the_length_of_an_identifier_says_its_kind() {
        let frame = |id| Ok(Command::Send(Frame::new(id, &[0xAB])));
        assert_eq!(scan("<send 1 1 ab>"), [frame(Id::Standard(1))]);
        assert_eq!(scan("<send 00000001 1 ab>"), [frame(Id::Extended(1))]);
        for wrong in ["800", "0001", "20000000", "123456789", "+12", "", "xyz"] {
            assert_eq!(
                scan(&format!("<send {wrong} 1 ab>")),
                [Err("syntax error in send command")],
                "{wrong}"
            );
        }
    }

    #[test]
    fn malformed_frames_are_refused() {
        for wrong in
            ["601", "601 9 0 0 0 0 0 0 0 0 0", "601 2 0", "601 1 0 0", "601 1 100", "601 1 -1", "601 F 0"]
        {
            assert_eq!(scan(&format!("<send {wrong}>")), [Err("syntax error in send command")], "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn whatever_a_client_sends_is_survived_and_forgotten(noise: Vec<u8>) {
            let mut scanner = Scanner::default();
            noise.into_iter().for_each(|byte| drop(scanner.take(byte)));
            let echo: Vec<_> = b"<echo>".iter().filter_map(|byte| scanner.take(*byte)).collect();
            prop_assert_eq!(echo, [Ok(Command::Echo)]);
        }

        #[test]
        fn a_frame_that_is_shown_can_be_sent(id in 0_u32..=0x1FFF_FFFF, extended: bool, payload: Vec<u8>) {
            let id = if extended { Id::Extended(id) } else { Id::Standard((id & 0x7FF) as u16) };
            let frame = Frame::new(id, &payload);
            let bytes: Vec<_> = frame.payload().iter().map(|byte| format!("{byte:x}")).collect();
            let text = format!("< send {} {} {} >", frame.id, frame.len(), bytes.join(" "));
            prop_assert_eq!(scan(&text), [Ok(Command::Send(frame))]);
        }
    }

    #[test]
    fn noise_between_commands_is_skipped_and_endless_ones_are_cut() {
        assert_eq!(scan("> x < echo <echo> y"), [Ok(Command::Echo)]);
        assert_eq!(
            scan(&format!("<{}><echo>", "x".repeat(100_000))),
            [Err("command too long"), Ok(Command::Echo)]
        );
        assert_eq!(scan("<>"), [Err("unknown command")]);
        assert_eq!(scan("<\u{e4}>"), [Err("unknown command")]);
    }

    #[test]
    fn frames_are_shown_as_socketcand_shows_them() {
        let mut text = String::new();
        let stamp = Duration::new(1_700_000_000, 42_000);
        write_frame(&mut text, stamp, &Frame::new(Id::Standard(0x81), &[1, 0xAB]));
        write_frame(&mut text, stamp, &Frame::new(Id::Extended(0x81), &[]));
        assert_eq!(text, "< frame 081 1700000000.000042 01AB >< frame 00000081 1700000000.000042  >");
    }
}
