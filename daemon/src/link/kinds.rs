//! Frames by what they are for, as the predefined connection set says it (CiA 301 v4.2, table 38).

use canopen::{Frame, Id};

/// What frames are for, and the word for it.
pub(crate) const NAMES: [&str; 9] =
    ["nmt", "sync", "emcy", "time", "pdo", "sdo", "error-control", "lss", "other"];

/// Counts frames of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Kinds([u64; NAMES.len()]);

impl Kinds {
    /// Counts a frame.
    pub(crate) fn count(&mut self, frame: &Frame) {
        if let Some(count) = self.0.get_mut(kind(frame.id)) {
            *count += 1;
        }
    }

    /// Each kind that there was any of, and how many there were.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&'static str, u64)> {
        NAMES.into_iter().zip(self.0).filter(|(_, count)| *count > 0)
    }
}

/// The position of its kind in [`NAMES`].
fn kind(id: Id) -> usize {
    match id {
        Id::Standard(0x000) => 0,
        Id::Standard(0x080) => 1,
        Id::Standard(0x081..=0x0FF) => 2,
        Id::Standard(0x100) => 3,
        Id::Standard(0x180..=0x57F) => 4,
        Id::Standard(0x580..=0x67F) => 5,
        Id::Standard(0x700..=0x77F) => 6,
        Id::Standard(0x7E4 | 0x7E5) => 7,
        Id::Standard(_) | Id::Extended(_) => 8,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_tell_what_frames_are_for() {
        let mut kinds = Kinds::default();
        for id in [0, 0x80, 0x81, 0x100, 0x181, 0x57F, 0x581, 0x601, 0x701, 0x7E5, 0x7FF] {
            kinds.count(&Frame::new(Id::Standard(id), &[]));
        }
        kinds.count(&Frame::new(Id::Extended(0x181), &[]));
        let counted: Vec<_> = kinds.iter().collect();
        assert_eq!(counted, NAMES.into_iter().zip([1, 1, 1, 1, 2, 2, 1, 1, 2]).collect::<Vec<_>>());
    }
}
