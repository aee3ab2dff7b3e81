//! A client and a server on one bus that may lose, repeat and reorder their frames, on virtual time.

use std::collections::VecDeque;

use canopen::{Frame, SdoClient, SdoEvent, SdoMode};
use od::Value;

use crate::bench::Bench;
use crate::{DOMAIN, LIMIT};

/// What happens to a frame on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    Arrives,
    IsLost,
    ComesTwice,
    /// The next one of the same sender overtakes it.
    IsOvertaken,
}

/// A client and the server of node 1, on one bus.
pub(crate) struct Pair {
    pub(crate) client: SdoClient,
    pub(crate) server: Bench,
    /// Frames in the order of the bus; whether they come from the client.
    pub(crate) wire: VecDeque<(bool, Frame)>,
}

impl Pair {
    pub(crate) fn new() -> Self {
        Self { client: SdoClient::of_node(1), server: Bench::new(), wire: VecDeque::new() }
    }

    pub(crate) fn server_with(data: &[u8]) -> Self {
        let mut pair = Self::new();
        let slot = pair.server.device.find(DOMAIN).unwrap();
        pair.server.device.set_bytes(slot, data);
        pair
    }

    /// Takes what the client has to send.
    pub(crate) fn collect(&mut self) {
        self.wire.extend(core::iter::from_fn(|| self.client.poll_transmit()).map(|frame| (true, frame)));
    }

    pub(crate) fn deliver(&mut self, is_request: bool, frame: &Frame) {
        if is_request {
            let answers = self.server.handle(frame);
            self.wire.extend(answers.into_iter().map(|answer| (false, answer)));
        } else {
            self.client.handle_frame(self.server.now, frame);
        }
        self.collect();
    }

    /// Lets everything happen until the client is done.
    pub(crate) fn run(&mut self, mut fate: impl FnMut(bool, &Frame) -> Fate) -> SdoEvent {
        self.collect();
        loop {
            if let Some(event) = self.client.poll_event() {
                return event;
            }
            let Some((is_request, frame)) = self.wire.pop_front() else {
                self.wait();
                continue;
            };
            match fate(is_request, &frame) {
                Fate::Arrives => self.deliver(is_request, &frame),
                Fate::IsLost => {}
                Fate::ComesTwice => {
                    self.deliver(is_request, &frame);
                    self.deliver(is_request, &frame);
                }
                Fate::IsOvertaken => {
                    let next = self.wire.front().filter(|(other, _)| *other == is_request).copied();
                    if let Some((_, next)) = next {
                        self.wire.pop_front();
                        self.deliver(is_request, &next);
                    }
                    self.deliver(is_request, &frame);
                }
            }
        }
    }

    /// Time passes to the next deadline of either side.
    pub(crate) fn wait(&mut self) {
        let deadlines = [self.client.poll_timeout(), self.server.node.poll_timeout()];
        let next = deadlines.into_iter().flatten().min().expect("a client that waits has a deadline");
        let answers = self.server.pass(next.saturating_since(self.server.now));
        self.wire.extend(answers.into_iter().map(|answer| (false, answer)));
        self.client.handle_timeout(self.server.now);
        self.collect();
    }

    pub(crate) fn upload(&mut self, mode: SdoMode, fate: impl FnMut(bool, &Frame) -> Fate) -> SdoEvent {
        assert!(self.client.upload(self.server.now, DOMAIN, LIMIT, mode));
        self.run(fate)
    }

    pub(crate) fn download(
        &mut self,
        data: &[u8],
        mode: SdoMode,
        fate: impl FnMut(bool, &Frame) -> Fate,
    ) -> SdoEvent {
        assert!(self.client.download(self.server.now, DOMAIN, data.to_vec(), mode));
        self.run(fate)
    }

    pub(crate) fn stored(&self) -> Vec<u8> {
        let slot = self.server.device.find(DOMAIN).unwrap();
        match self.server.device.value(slot).unwrap() {
            Value::Bytes(bytes) => bytes.to_vec(),
            Value::Fixed(_) => unreachable!("a domain"),
        }
    }

    /// Delivers what is still on the wire: nobody may be left waiting.
    pub(crate) fn run_out(&mut self) {
        while let Some((is_request, frame)) = self.wire.pop_front() {
            self.deliver(is_request, &frame);
        }
        assert_eq!(self.client.poll_timeout(), None);
        assert_eq!(self.server.node.poll_timeout(), None);
    }
}
