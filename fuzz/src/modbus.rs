//! A Modbus server before a servo. Whatever comes in, on TCP in whatever segments, it answers the same and never panics; on a
//! serial line it goes on after a silence.

use std::sync::{Arc, LazyLock};
use std::time::Duration;

use modbus::{Dialect, Framing, Identification, Map, Permissions, Server, Target, WordOrder};
use od::{Address, Bus, Dictionary, Instant, Origin};
use profiles::Profile;

const ORIGIN: Origin = Origin { bus: Bus::Modbus, link: 0, client: 0 };
const UNIT: u8 = 1;
/// 3.5 characters above 19200 bit/s (Modbus over Serial Line V1.02, section 2.5.1.1).
const SILENCE: Duration = Duration::from_micros(1750);

static PROFILE: LazyLock<Profile> =
    LazyLock::new(|| Profile::embedded("cia402-servo", None).expect("shipped").expect("valid"));

/// Lets a server hear a stream; the first byte of `input` chooses dialect and framing, then come the lengths of segments.
pub fn run(input: &[u8]) {
    let Some(([kind, count], rest)) = input.split_first_chunk() else { return };
    let dialect = if kind & 1 == 1 { Dialect::Jvl } else { Dialect::Full };
    let (segments, stream) = rest.split_at(usize::from(*count).min(rest.len()));
    let line = |framing| Line::new(framing, dialect);
    match kind >> 1 & 3 {
        1 => _ = line(Framing::Rtu { silence: SILENCE }).hear(stream, segments),
        2 => _ = line(Framing::RtuOverTcp { silence: SILENCE }).hear(stream, segments),
        _ => {
            let answers = line(Framing::Tcp).hear(stream, segments);
            assert_eq!(answers, line(Framing::Tcp).hear(stream, &[]));
        }
    }
}

/// A connection and what is behind it.
struct Line {
    framing: Framing,
    now: Instant,
    server: Server,
    map: Map,
    dictionary: Dictionary,
    answers: Vec<u8>,
}

impl Line {
    fn new(framing: Framing, dialect: Dialect) -> Self {
        let schema = &PROFILE.application;
        let slot = |index, sub| schema.slot(Address::new(index, sub)).expect("a servo has it");
        let registers = (1..=40).map(|number| (number, slot(0x6040, 0)));
        let map = Map::new(dialect, WordOrder::LowFirst)
            .with_jvl(schema, registers.clone(), registers, None)
            .with_application(schema, &[slot(0x60FE, 1)], &[slot(0x60FD, 0)]);
        let now = Instant::ZERO;
        Self {
            framing,
            now,
            server: Server::new(now, framing, ORIGIN, Arc::new(Permissions::default()), None),
            map,
            dictionary: Dictionary::new(Arc::clone(schema), UNIT),
            answers: Vec::new(),
        }
    }

    /// The answers to `stream`, which comes in segments of these lengths and then as a whole, and how often it wrote. On a
    /// serial line it is silent behind segments whose length has bit 7.
    fn hear(mut self, stream: &[u8], segments: &[u8]) -> (Vec<u8>, u64) {
        let mut rest = stream;
        let mut lengths = segments.iter();
        while !rest.is_empty() {
            let length = lengths.next();
            let is_serial = self.framing != Framing::Tcp;
            let count = length.map_or(rest.len(), |length| match is_serial {
                true => usize::from(length & 0x7F).max(1),
                false => usize::from(*length).max(1),
            });
            let segment = rest.get(..count).unwrap_or(rest);
            let mut taken = self.server.handle_bytes(self.now, segment);
            if taken == 0 {
                self.keep_silent();
                taken = self.server.handle_bytes(self.now, segment);
                assert!(taken > 0, "it takes no more");
            }
            rest = rest.get(taken..).unwrap_or_default();
            self.answer();
            if is_serial && length.is_none_or(|length| length & 0x80 != 0) {
                self.keep_silent();
            }
        }
        (self.answers, self.dictionary.revision())
    }

    fn keep_silent(&mut self) {
        self.now = self.now + SILENCE;
        self.server.handle_timeout(self.now);
        self.answer();
    }

    fn answer(&mut self) {
        let identification = Identification::default();
        while let Some(unit) = self.server.poll_request() {
            let Self { server, map, dictionary, .. } = self;
            let target = Target { map, dictionary, communication: None, identification: &identification };
            server.answer(self.now, (unit == UNIT).then_some(target));
            assert!(server.output().len() <= 8 * modbus::MAX_ADU);
            self.answers.extend_from_slice(server.output());
            server.sent(server.output().len());
        }
    }
}
