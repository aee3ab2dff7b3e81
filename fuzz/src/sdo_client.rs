//! An SDO client and a server that answers anything at any time: every transfer ends, and takes no more than it may.
use std::time::Duration;

use canopen::{Frame, Id, SdoClient, SdoEvent, SdoMode};
use od::{Address, Instant};

const ADDRESS: Address = Address::new(0x200F, 0);
/// The most bytes of an upload.
const LIMIT: usize = 2000;
/// A block and a word beside it.
const MOST_AT_ONCE: usize = 128;

/// Lets a client meet `story`: what it does, then times and messages of eight bytes.
pub fn run(story: &[u8]) {
    let [kind, size, story @ ..] = story else { return };
    let mut client = SdoClient::of_node(1);
    let mut now = Instant::ZERO;
    let mode = if kind & 1 == 0 { SdoMode::Ordinary } else { SdoMode::Block { threshold: kind >> 2 } };
    let is_begun = if kind & 2 == 0 {
        client.set_block_size(*size);
        client.upload(now, ADDRESS, LIMIT, mode)
    } else {
        client.download(now, ADDRESS, vec![*kind; usize::from(*size) * 8], mode)
    };
    assert!(is_begun);
    // A time in units of 4 ms, then a message.
    for step in story.chunks(9) {
        let [time, message @ ..] = step else { continue };
        now = now + Duration::from_millis(u64::from(*time) * 4);
        while client.poll_timeout().is_some_and(|deadline| deadline <= now) {
            client.handle_timeout(now);
        }
        client.handle_frame(now, &Frame::new(Id::Standard(0x581), message));
        let sent = std::iter::from_fn(|| client.poll_transmit());
        assert!(
            sent.inspect(|frame| assert_eq!((frame.id, frame.len()), (Id::Standard(0x601), 8))).count()
                <= MOST_AT_ONCE
        );
        match client.poll_event() {
            None => assert!(client.is_busy() && client.poll_timeout().is_some_and(|next| next > now)),
            Some(SdoEvent::Uploaded { data, .. }) => return assert!(data.len() <= LIMIT),
            Some(SdoEvent::Downloaded { .. } | SdoEvent::Failed { .. }) => return,
        }
    }
}
