//! Whatever comes in, in whatever pieces: no panic, bounded memory, and answers that do not depend on the pieces.

mod bench;

use bench::{Bench, UNIT};
use modbus::{Bits, Dialect, IdentificationCode, Registers, Request, SdoRequest, tcp_adu};
use od::Address;
use proptest::collection::vec;
use proptest::prelude::*;

/// A request that is right or nearly so, with its frame.
fn frame() -> impl Strategy<Value = Vec<u8>> {
    let address =
        prop_oneof![0_u16..0x210, 0x2F0_u16..0x390, 0x0FF0_u16..0x1050, 0x7FF0_u16..0x8090, any::<u16>()];
    let code =
        prop_oneof![prop::sample::select(vec![1_u8, 2, 3, 4, 5, 6, 8, 15, 16, 17, 22, 23, 43]), any::<u8>()];
    let fields = (address, 0_u16..130, vec(any::<u8>(), 0..40));
    (code, fields, any::<bool>(), prop_oneof![Just(UNIT), any::<u8>()]).prop_map(
        |(code, fields, is_short, unit)| {
            let (address, quantity, data) = fields;
            let mut pdu = vec![code];
            pdu.extend(address.to_be_bytes());
            pdu.extend(quantity.to_be_bytes());
            if !is_short {
                pdu.push(data.len() as u8);
                pdu.extend(&data);
            }
            tcp_adu(quantity, unit, &pdu)
        },
    )
}

fn stream() -> impl Strategy<Value = Vec<u8>> {
    let junk = vec(any::<u8>(), 0..30);
    vec(prop_oneof![9 => frame(), 1 => junk], 0..20).prop_map(|parts| parts.concat())
}

fn all_at_once(dialect: Dialect, stream: &[u8]) -> (Vec<u8>, Vec<u64>) {
    let mut bench = Bench::new(dialect);
    let answers = bench.send(stream);
    (answers, values(&bench))
}

fn values(bench: &Bench) -> Vec<u64> {
    let schema = bench.dictionary.schema();
    schema.entries().map(|(address, _)| bench.dictionary.raw(schema.slot(address).unwrap())).collect()
}

proptest! {
    #[test]
    fn the_answers_do_not_depend_on_the_segments(
        stream in stream(), cuts in vec(any::<prop::sample::Index>(), 0..20), is_jvl: bool,
    ) {
        let dialect = if is_jvl { Dialect::Jvl } else { Dialect::Full };
        let mut cuts: Vec<usize> = cuts.iter().map(|cut| cut.index(stream.len() + 1)).collect();
        cuts.extend([0, stream.len()]);
        cuts.sort_unstable();
        let mut bench = Bench::new(dialect);
        let mut answers = Vec::new();
        for ends in cuts.windows(2) {
            answers.extend(bench.send(&stream[ends[0]..ends[1]]));
        }
        prop_assert_eq!((answers, values(&bench)), all_at_once(dialect, &stream));
    }

    #[test]
    fn any_bytes_are_survived(pieces in vec(vec(any::<u8>(), 0..300), 0..20)) {
        let mut bench = Bench::new(Dialect::Full);
        for piece in &pieces {
            bench.send(piece);
            prop_assert!(bench.server.output().len() <= 8 * 260);
        }
    }

    #[test]
    fn every_answer_is_a_frame_for_its_request(frames in vec(frame(), 1..10)) {
        let mut bench = Bench::new(Dialect::Full);
        for frame in &frames {
            let answer = bench.send(frame);
            prop_assert!(answer.len() >= 9 && answer.len() <= 260);
            prop_assert_eq!(&answer[..4], &[frame[0], frame[1], 0, 0]);
            prop_assert_eq!(usize::from(answer[5]) + 6, answer.len());
            prop_assert_eq!(answer[4], 0);
            prop_assert_eq!(answer[6], frame[6]);
            prop_assert_eq!(answer[7] & 0x7F, frame[7] & 0x7F);
        }
    }

    #[test]
    fn what_is_encoded_is_decoded(owned in request()) {
        let request = owned.borrow();
        let mut pdu = Vec::new();
        request.encode(&mut pdu);
        prop_assert_eq!(Request::decode(&pdu, Dialect::Full), Ok(request));
    }

    #[test]
    fn what_is_decoded_is_encoded(pdu in vec(any::<u8>(), 0..254), code in 0_u8..0x30) {
        let mut pdu = pdu;
        if let Some(first) = pdu.first_mut() {
            *first = code;
        }
        if let Ok(request) = Request::decode(&pdu, Dialect::Full) {
            let mut again = Vec::new();
            request.encode(&mut again);
            prop_assert_eq!(again, pdu);
        }
    }
}

/// A request whose bytes are its own.
#[derive(Clone, Debug)]
struct Owned {
    kind: u8,
    words: [u16; 3],
    flag: bool,
    bytes: Vec<u8>,
}

fn request() -> impl Strategy<Value = Owned> {
    (0_u8..15, any::<[u16; 3]>(), any::<bool>(), vec(any::<u8>(), 1..120))
        .prop_map(|(kind, words, flag, bytes)| Owned { kind, words, flag, bytes })
}

impl Owned {
    fn borrow(&self) -> Request<'_> {
        let [start, second, third] = self.words;
        let values = &self.bytes[..(self.bytes.len() / 2 * 2)];
        let values = if values.is_empty() { &[1, 2][..] } else { values };
        let address = Address::new(second, third as u8);
        let quantity = second % 125 + 1;
        match self.kind {
            0 => Request::ReadBits {
                table: if self.flag { Bits::Coils } else { Bits::DiscreteInputs },
                start,
                quantity: second % 2000 + 1,
            },
            1 => Request::ReadRegisters { table: Registers::Holding, start, quantity },
            2 => Request::ReadRegisters { table: Registers::Input, start, quantity },
            3 => Request::WriteCoil { address: start, on: self.flag },
            4 => Request::WriteRegister { address: start, value: second.to_be_bytes() },
            5 => Request::ReturnQueryData { data: values },
            6 => Request::WriteCoils { start, quantity: 8 * self.bytes.len() as u16, states: &self.bytes },
            7 => Request::WriteRegisters { start, values },
            8 => Request::ReportServerId,
            9 => Request::MaskWrite { address: start, and: second, or: third },
            10 => {
                Request::ReadWrite { read_start: start, read_quantity: quantity, write_start: third, values }
            }
            11 => Request::Sdo(SdoRequest::Upload { address, offset: start, length: third }),
            12 => Request::Sdo(SdoRequest::Download { address, data: &self.bytes }),
            13 => Request::Identification { code: IdentificationCode::Extended, object: third as u8 },
            _ => Request::Identification { code: IdentificationCode::Individual, object: third as u8 },
        }
    }
}
