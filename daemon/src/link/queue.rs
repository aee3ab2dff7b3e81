//! What waits for room in the transmit queue of an interface.
//!
//! Frames leave in the order in which they came. While the interface has no room, a newer frame of a PDO or a newer heartbeat
//! takes the place of an older one that waits: receivers want the present values and the present state, and a queue that each
//! of them is in once stays short. All other frames are messages of their own, emergencies and boot-up messages among them:
//! none of them is replaced, and those that find the queue full are dropped and counted.

use std::collections::VecDeque;

use canopen::{Frame, Id, is_boot_up};

use super::wire_format::{self, Message, SIZE};

/// Frames that may wait.
pub(crate) const MAX_WAITING: usize = 1024;

/// What a frame is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Of one of our nodes, a PDO or a heartbeat: what it tells the next frame with the same identifier tells anew.
    Present,
    /// Of one of our nodes. While the interface has room a PDO or a heartbeat may be called so, too: it makes no difference
    /// then.
    Ours,
    /// Of a client, so nobody here knows what it is.
    Foreign,
}

#[derive(Clone, Copy, Debug)]
struct Waiting {
    id: Id,
    kind: Kind,
    bytes: [u8; SIZE],
}

/// See the module's documentation.
#[derive(Debug)]
pub(crate) struct Queue {
    frames: VecDeque<Waiting>,
    /// The interface has refused what is in front.
    is_stuck: bool,
    replaced: u64,
    dropped: u64,
}

impl Queue {
    /// Nothing waits.
    pub(crate) fn new() -> Self {
        Self { frames: VecDeque::with_capacity(MAX_WAITING), is_stuck: false, replaced: 0, dropped: 0 }
    }

    /// Frames that wait.
    pub(crate) fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether nothing waits.
    pub(crate) fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Whether there is room for no other frame.
    pub(crate) fn is_full(&self) -> bool {
        self.frames.len() >= MAX_WAITING
    }

    /// Whether the interface had no room when it was tried last.
    pub(crate) fn is_stuck(&self) -> bool {
        self.is_stuck
    }

    /// Frames whose place a newer one has taken.
    pub(crate) fn replaced(&self) -> u64 {
        self.replaced
    }

    /// Frames that found no room, or were waiting when the interface was lost.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// The frames in front, as the kernel takes them.
    pub(crate) fn front(&self) -> impl ExactSizeIterator<Item = &[u8; SIZE]> {
        self.frames.iter().map(|waiting| &waiting.bytes)
    }

    /// Lets a frame wait behind all others, or in the place of an older one that it replaces. Whether it waits.
    pub(crate) fn push(&mut self, frame: &Frame, kind: Kind) -> bool {
        let waiting = Waiting { id: frame.id, kind, bytes: wire_format::encode(frame) };
        if self.is_stuck
            && kind == Kind::Present
            && let Some(older) = self.frames.iter_mut().rfind(|older| older.precedes(&waiting))
            && !older.is_boot_up()
        {
            *older = waiting;
            self.replaced += 1;
            return true;
        }
        if self.is_full() {
            self.dropped += 1;
            return false;
        }
        self.frames.push_back(waiting);
        true
    }

    /// Counts a frame for which there is no interface.
    pub(crate) fn refuse(&mut self) {
        self.dropped += 1;
    }

    /// The interface has taken so many from the front.
    pub(crate) fn sent(&mut self, count: usize) {
        self.frames.drain(..count.min(self.frames.len()));
        self.is_stuck = false;
    }

    /// The interface has no room.
    pub(crate) fn stick(&mut self) {
        self.is_stuck = true;
    }

    /// The interface is lost, and what waits with it.
    pub(crate) fn lose(&mut self) {
        self.dropped += self.frames.len() as u64;
        self.frames.clear();
        self.is_stuck = false;
    }
}

impl Waiting {
    /// Whether it is of one of our nodes as `newer` is, and has the same identifier.
    fn precedes(&self, newer: &Self) -> bool {
        self.id == newer.id && self.kind != Kind::Foreign
    }

    /// Whether it tells that a node has started, which no heartbeat tells.
    fn is_boot_up(&self) -> bool {
        matches!(wire_format::decode(&self.bytes), Some(Message::Frame(frame)) if is_boot_up(&frame))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use proptest::prelude::*;

    const PDOS: [u16; 3] = [0x181, 0x182, 0x281];
    const OTHERS: [u16; 3] = [0x081, 0x581, 0x701];

    fn frame(id: u16, number: u32) -> Frame {
        Frame::new(Id::Standard(id), &number.to_le_bytes())
    }

    /// What the interface takes when it takes `count` frames.
    fn take(queue: &mut Queue, count: usize) -> Vec<(Id, u32)> {
        let read = |bytes: &[u8; SIZE]| match wire_format::decode(bytes) {
            Some(Message::Frame(frame)) => {
                let number = frame.payload().first_chunk().map(|number| u32::from_le_bytes(*number));
                (frame.id, number.expect("four bytes"))
            }
            other => panic!("{other:?}"),
        };
        let taken = queue.front().take(count).map(read).collect();
        queue.sent(count);
        taken
    }

    #[test]
    fn a_newer_pdo_takes_the_place_of_an_older_one_that_has_to_wait() {
        let mut queue = Queue::new();
        queue.stick();
        for (number, id) in (0..).zip([0x181, 0x081, 0x182, 0x181, 0x081, 0x182, 0x181]) {
            let kind = if id == 0x081 { Kind::Ours } else { Kind::Present };
            assert!(queue.push(&frame(id, number), kind));
        }
        assert_eq!((queue.len(), queue.replaced(), queue.dropped()), (4, 3, 0));
        let expected = [(0x181, 6), (0x081, 1), (0x182, 5), (0x081, 4)];
        assert_eq!(take(&mut queue, 9), expected.map(|(id, number)| (Id::Standard(id), number)));
    }

    #[test]
    fn of_several_older_ones_the_last_is_replaced_so_that_none_is_overtaken() {
        let mut queue = Queue::new();
        queue.push(&frame(0x181, 0), Kind::Ours);
        queue.push(&frame(0x181, 1), Kind::Ours);
        queue.stick();
        queue.push(&frame(0x181, 2), Kind::Present);
        let numbers: Vec<u32> = take(&mut queue, 9).into_iter().map(|(_, number)| number).collect();
        assert_eq!((numbers, queue.replaced()), (vec![0, 2], 1));
    }

    #[test]
    fn an_interface_with_room_gets_every_pdo() {
        let mut queue = Queue::new();
        queue.stick();
        queue.push(&frame(0x181, 0), Kind::Present);
        take(&mut queue, 1);
        queue.push(&frame(0x181, 1), Kind::Present);
        queue.push(&frame(0x181, 2), Kind::Present);
        assert_eq!((queue.len(), queue.replaced()), (2, 0));
    }

    #[test]
    fn a_frame_of_a_client_with_the_identifier_of_a_pdo_is_left_alone() {
        let mut queue = Queue::new();
        queue.stick();
        queue.push(&frame(0x181, 0), Kind::Foreign);
        queue.push(&frame(0x181, 1), Kind::Present);
        queue.push(&frame(0x181, 2), Kind::Foreign);
        queue.push(&frame(0x181, 3), Kind::Present);
        let numbers: Vec<u32> = take(&mut queue, 9).into_iter().map(|(_, number)| number).collect();
        assert_eq!(numbers, [0, 3, 2]);
    }

    /// A frame with one byte, as it waits.
    fn error_control(queue: &mut Queue, state: u8, kind: Kind) {
        queue.push(&Frame::new(Id::Standard(0x701), &[state]), kind);
    }

    /// All that waits, as candump shows it.
    fn waiting(queue: &Queue) -> Vec<String> {
        let read = |bytes: &[u8; SIZE]| match wire_format::decode(bytes) {
            Some(Message::Frame(frame)) => frame.to_string(),
            other => panic!("{other:?}"),
        };
        queue.front().map(read).collect()
    }

    #[test]
    fn a_newer_heartbeat_takes_the_place_of_an_older_one_and_every_emergency_stays() {
        let mut queue = Queue::new();
        // While there is room nobody asks what a frame is.
        error_control(&mut queue, 0x7F, Kind::Ours);
        queue.stick();
        for number in 0..3 {
            queue.push(&frame(0x081, number), Kind::Ours);
            error_control(&mut queue, 0x05, Kind::Present);
        }
        assert_eq!(waiting(&queue), ["701#05", "081#00000000", "081#01000000", "081#02000000"]);
        assert_eq!((queue.replaced(), queue.dropped()), (3, 0));
    }

    #[test]
    fn a_boot_up_message_stays_and_no_heartbeat_passes_it() {
        let mut queue = Queue::new();
        queue.stick();
        error_control(&mut queue, 0x05, Kind::Present);
        error_control(&mut queue, 0x00, Kind::Ours);
        error_control(&mut queue, 0x7F, Kind::Present);
        error_control(&mut queue, 0x00, Kind::Ours);
        error_control(&mut queue, 0x7F, Kind::Present);
        error_control(&mut queue, 0x05, Kind::Present);
        assert_eq!(waiting(&queue), ["701#05", "701#00", "701#7F", "701#00", "701#05"]);
        assert_eq!(queue.replaced(), 1);
    }

    #[test]
    fn emergencies_that_find_no_room_are_the_newest_and_are_counted() {
        let mut queue = Queue::new();
        queue.stick();
        let count = MAX_WAITING as u32 + 3;
        let taken = (0..count).filter(|number| queue.push(&frame(0x081, *number), Kind::Ours)).count();
        assert_eq!(taken, MAX_WAITING);
        assert_eq!((queue.len(), queue.replaced(), queue.dropped()), (MAX_WAITING, 0, 3));
        let numbers: Vec<u32> = take(&mut queue, MAX_WAITING).into_iter().map(|(_, number)| number).collect();
        assert!(numbers.into_iter().eq(0..MAX_WAITING as u32));
    }

    #[test]
    fn a_full_queue_takes_a_newer_pdo_for_an_older_one_and_counts_what_it_does_not_take() {
        let mut queue = Queue::new();
        queue.stick();
        queue.push(&frame(0x181, 0), Kind::Present);
        for number in 1..MAX_WAITING as u32 {
            assert!(queue.push(&frame(0x581, number), Kind::Ours));
        }
        assert!(queue.is_full());
        assert!(queue.push(&frame(0x181, 5000), Kind::Present));
        assert!(!queue.push(&frame(0x182, 0), Kind::Present));
        assert!(!queue.push(&frame(0x581, 5001), Kind::Ours));
        assert_eq!((queue.len(), queue.replaced(), queue.dropped()), (MAX_WAITING, 1, 2));
        queue.lose();
        assert_eq!((queue.len(), queue.dropped()), (0, 2 + MAX_WAITING as u64));
    }

    /// What happens to a queue.
    #[derive(Clone, Debug)]
    enum Step {
        /// Frames with the same identifier, by its position among [`PDOS`] and [`OTHERS`], are to be sent.
        Push(usize, usize),
        /// The interface takes so many, and then has no room.
        Take(usize),
        /// The interface takes all.
        Clear,
    }

    fn step() -> impl Strategy<Value = Step> {
        prop_oneof![
            6 => (0..PDOS.len() + OTHERS.len(), 1..4_usize).prop_map(|(id, count)| Step::Push(id, count)),
            1 => (0..PDOS.len() + OTHERS.len(), 1..900_usize).prop_map(|(id, count)| Step::Push(id, count)),
            3 => (0..6_usize).prop_map(Step::Take),
            1 => Just(Step::Clear),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn whatever_the_interface_takes_nothing_is_reordered_and_all_is_accounted_for(
            steps in prop::collection::vec(step(), 1..60)
        ) {
            let mut queue = Queue::new();
            let (mut number, mut sent) = (0, Vec::new());
            let (mut accepted, mut refused) = (BTreeMap::new(), 0);
            for step in steps {
                match step {
                    Step::Push(position, count) => for _ in 0..count {
                        let is_pdo = position < PDOS.len();
                        let id = PDOS.iter().chain(&OTHERS).copied().nth(position).expect("an identifier");
                        let kind = if is_pdo && queue.is_stuck() { Kind::Present } else { Kind::Ours };
                        let was_full = queue.is_full();
                        if queue.push(&frame(id, number), kind) {
                            accepted.insert(number, is_pdo);
                        } else {
                            prop_assert!(was_full);
                            refused += 1;
                        }
                        number += 1;
                    },
                    Step::Take(count) => {
                        sent.extend(take(&mut queue, count));
                        if !queue.is_empty() {
                            queue.stick();
                        }
                    }
                    Step::Clear => sent.extend(take(&mut queue, usize::MAX)),
                }
                prop_assert!(queue.len() <= MAX_WAITING);
            }
            let waiting = queue.len();
            sent.extend(take(&mut queue, usize::MAX));

            prop_assert_eq!(queue.dropped(), refused);
            prop_assert_eq!(sent.len() as u64 + queue.replaced() + queue.dropped(), u64::from(number));
            prop_assert!(waiting <= MAX_WAITING);
            // Of each identifier in order, and the messages of their own all of them, in order among each other.
            for id in PDOS.into_iter().chain(OTHERS).map(Id::Standard) {
                let numbers: Vec<u32> = sent.iter().filter(|(own, _)| *own == id).map(|(_, n)| *n).collect();
                prop_assert!(numbers.is_sorted_by(|a, b| a < b), "{}: {:?}", id, numbers);
            }
            let is_other = |id: &Id| OTHERS.map(Id::Standard).contains(id);
            let others: Vec<u32> = sent.iter().filter(|(id, _)| is_other(id)).map(|(_, n)| *n).collect();
            let expected: Vec<u32> =
                accepted.iter().filter(|(_, is_pdo)| !**is_pdo).map(|(number, _)| *number).collect();
            prop_assert_eq!(others, expected);
        }
    }
}
