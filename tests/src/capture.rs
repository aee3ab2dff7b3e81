//! A recording of the bus, freed of what differs from run to run.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Objects that a master polls: how often, and which passing values it sees, is a matter of luck.
const POLLED: [&str; 4] = ["4160", "6160", "6460", "6C60"];

/// What a frame is by the pre-defined connection set (CiA 301, 7.3.5).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// One side acts and the other waits for it: the order is the same in every run.
    Told,
    /// Event-driven TPDO2, whose place among the others is not certain.
    Echo,
    /// SDO, one request after the other, but at any time.
    Sdo,
    /// SYNC and what it triggers: as many as the run took time.
    Cyclic,
}

/// The recording as three lists: what was told (NMT, boot-up, EMCY, RPDOs and TPDO1, in bus order), the changes that
/// TPDO2 of each node showed, and the SDO transfers; and the set of cyclic frames with their lengths. Left out are
/// repeats and the SDO polling of statusword, mode, position and velocity.
#[must_use]
pub fn story(frames: &[String]) -> String {
    let mut told = String::new();
    let mut echo = String::new();
    let mut sdo = String::new();
    let mut cyclic = BTreeSet::new();
    let mut last = BTreeMap::new();
    for frame in frames {
        let (id, data) = frame.split_once('#').unwrap_or((frame, ""));
        let kind = kind(id);
        if kind == Kind::Cyclic {
            cyclic.insert(format!("{id} with {} bytes", data.len() / 2));
        } else if kind == Kind::Sdo {
            if !data.get(2..6).is_some_and(|index| POLLED.contains(&index)) {
                sdo += &format!("{frame}\n");
            }
        } else if last.insert(id, data) != Some(data) {
            let list = if kind == Kind::Told { &mut told } else { &mut echo };
            *list += &format!("{frame}\n");
        }
    }
    let mut text = format!("told:\n{told}\nTPDO2:\n{echo}\nSDO:\n{sdo}\ncyclic:\n");
    for line in cyclic {
        // A String takes whatever is written.
        let _ = writeln!(text, "{line}");
    }
    text
}

fn kind(id: &str) -> Kind {
    match u32::from_str_radix(id, 16).unwrap_or(u32::MAX) {
        0x080 | 0x381..=0x3FF | 0x481..=0x4FF => Kind::Cyclic,
        0x281..=0x2FF => Kind::Echo,
        0x581..=0x5FF | 0x601..=0x67F => Kind::Sdo,
        _ => Kind::Told,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn two_runs_that_differ_in_timing_tell_the_same_story() {
        let one = "701#00 000#0101 080# 181#5006 281#500601 381#500600000000 601#4041600000000000 \
                   581#4B41600050060000 201#0600 181#3106 281#310601 080# 381#310601000000";
        let two = "701#00 000#0101 181#5006 281#500601 080# 381#500602000000 201#0600 181#3106 181#3106 \
                   281#310601 080# 381#310603000000 080# 381#310604000000";

        assert_eq!(story(&frames(one)), story(&frames(two)));
    }

    #[test]
    fn a_run_with_another_statusword_tells_another_story() {
        let one = frames("201#0600 181#3106");
        let two = frames("201#0600 181#3306");

        assert_ne!(story(&one), story(&two));
    }

    #[test]
    fn transfers_of_other_objects_are_kept() {
        let text = story(&frames("601#4000100000000000 581#4300100092010200"));

        assert!(text.contains("SDO:\n601#4000100000000000\n581#4300100092010200\n"), "{text}");
    }
}
