//! An LSS master and slaves that say anything at any time: every task ends, in bounded time and with few questions.

use std::time::Duration;

use canopen::{Id, LssMaster, LssStep, LssTask};
use od::Instant;

/// Questions of the longest task, a fastscan with the configuration behind it.
const MOST_QUESTIONS: usize = 160;
/// Each question may be answered for some time, the longest ones for three seconds.
const LONGEST: Duration = Duration::from_secs(20);

/// Lets a master meet `story`: what is to be done, then times in milliseconds and answers.
pub fn run(story: &[u8]) {
    let Some(([kind, node_id, numbers @ ..], story)) = story.split_first_chunk::<6>() else { return };
    let address = numbers.map(u32::from);
    let mut master = LssMaster::new(match kind % 4 {
        0 => LssTask::Scan,
        1 => LssTask::Configure { node_id: *node_id, address: None },
        2 => LssTask::Configure { node_id: *node_id, address: Some(address) },
        _ => LssTask::Inquire(address),
    });
    let (mut now, mut questions) = (Instant::ZERO, 0);
    let mut answers = story.chunks(9);
    let mut answer = None;
    loop {
        match master.next(now, answer.take()) {
            LssStep::Send(frame) => {
                questions += 1;
                assert!(
                    questions <= MOST_QUESTIONS && frame.len() == 8 && frame.id == Id::Standard(0x7E5),
                    "{frame}"
                );
            }
            LssStep::Wait(deadline) => {
                assert!(deadline > now, "a past time");
                match answers.next() {
                    Some([millis, message @ ..]) => {
                        now = deadline.min(now + Duration::from_millis(u64::from(*millis)));
                        answer = message.first_chunk().copied();
                    }
                    Some([]) | None => now = deadline,
                }
            }
            LssStep::Done(_) => break,
        }
    }
    assert!(now <= Instant::ZERO + LONGEST, "{now:?}");
}
