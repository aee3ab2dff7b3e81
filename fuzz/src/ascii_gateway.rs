//! Any lines of two clients and any frames: each line has one answer or none, and everything ends.

use canopen::ascii::{AsciiGateway, Told};
use canopen::{Frame, Id};
use core::time::Duration;
use od::Instant;

/// Times at which something is due after the last input; a scan has a hundred and thirty questions.
const MOST_TIMES: usize = 2000;

/// Lets a gateway meet `bytes`, a line, a frame or a time each.
pub fn run(bytes: &[u8]) {
    let mut gateway = AsciiGateway::new([1, 2]);
    let mut now = Instant::ZERO;
    let mut waiting = [false; 2];
    (0..2).for_each(|client| gateway.connect(client));
    for line in bytes.split(|byte| *byte == b'\n') {
        match line {
            // A frame: its network, its identifier and its data.
            [b'!', network, low, high, data @ ..] => {
                let id = Id::Standard(u16::from_le_bytes([*low, high & 0x07]));
                let frame = if high & 0x80 != 0 { Frame::remote(id, 8) } else { Frame::new(id, data) };
                gateway.handle_frame(now, u16::from(network % 4), &frame);
            }
            // So many milliseconds.
            [b'+', millis, ..] => {
                now = now + Duration::from_millis(u64::from(*millis) * 10);
                gateway.handle_timeout(now);
            }
            [b'-', client, ..] => {
                let client = client % 2;
                gateway.disconnect(now, client.into());
                gateway.connect(client.into());
                waiting[usize::from(client)] = false;
            }
            line => {
                let client = usize::from(line.len() % 2 == 1);
                let is_taken = gateway.handle_line(now, client as u64, line);
                assert!(!(is_taken && waiting[client]), "it waits for an answer");
                waiting[client] |= is_taken;
            }
        }
        drain(&mut gateway, &mut waiting);
    }
    for _ in 0..MOST_TIMES {
        if waiting == [false; 2] {
            return;
        }
        let due = gateway.poll_timeout().expect("what is waited for has an end");
        now = due.max(now);
        gateway.handle_timeout(now);
        drain(&mut gateway, &mut waiting);
    }
}

fn drain(gateway: &mut AsciiGateway, waiting: &mut [bool; 2]) {
    while gateway.poll_transmit().is_some() {}
    while let Some((client, told)) = gateway.poll_line() {
        if let Told::Answer(text) = told {
            assert!(text.starts_with('[') && !text.contains(['\r', '\n']), "{text}");
            assert!(core::mem::take(&mut waiting[client as usize]), "an answer that nobody waits for");
        }
    }
}
