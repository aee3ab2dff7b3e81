//! A recording of the bus, freed of what differs from run to run.

use std::collections::{BTreeMap, BTreeSet};

/// Objects that a master polls: how often, and which passing values it sees, is a matter of luck.
const POLLED: [&str; 4] = ["4160", "6160", "6460", "6C60"];

/// What a frame is by the pre-defined connection set (CiA 301, 7.3.5).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// NMT, boot-up, EMCY, RPDO. One side acts and the other waits for it, so the order is the same in every run.
    Told,
    /// TPDO1, event-driven. It belongs to what is told, but how often one state is sent does not matter.
    Status,
    /// TPDO2, event-driven, too; its place among the others is not certain.
    Echo,
    /// SDO, one request after the other, but at any time.
    Sdo,
    /// SYNC and what it triggers: as many as the run took time.
    Cyclic,
}

/// The recording as three lists: what was told (NMT, boot-up, EMCY, RPDOs and the changes in TPDO1, in bus order), the
/// changes in TPDO2, and the SDO transfers without the polling of statusword, mode, position and velocity; and the set
/// of cyclic frames with their lengths.
#[must_use]
pub fn story(frames: &[String]) -> String {
    let mut told = String::new();
    let mut echo = String::new();
    let mut sdo = String::new();
    let mut cyclic = BTreeSet::new();
    let mut last = BTreeMap::new();
    for frame in frames {
        let (id, data) = frame.split_once('#').unwrap_or((frame, ""));
        let line = format!("{frame}\n");
        let is_change = last.insert(id, data) != Some(data);
        match kind(id) {
            Kind::Told => told += &line,
            Kind::Status if is_change => told += &line,
            Kind::Echo if is_change => echo += &line,
            Kind::Sdo if !is_polling(data) => sdo += &line,
            Kind::Cyclic => {
                cyclic.insert(format!("{id} with {} bytes\n", data.len() / 2));
            }
            Kind::Status | Kind::Echo | Kind::Sdo => {}
        }
    }
    let cyclic = String::from_iter(cyclic);
    format!("told:\n{told}\nTPDO2:\n{echo}\nSDO:\n{sdo}\ncyclic:\n{cyclic}")
}

fn kind(id: &str) -> Kind {
    match u32::from_str_radix(id, 16).unwrap_or(u32::MAX) {
        0x080 | 0x381..=0x3FF | 0x481..=0x4FF => Kind::Cyclic,
        0x181..=0x1FF => Kind::Status,
        0x281..=0x2FF => Kind::Echo,
        0x581..=0x5FF | 0x601..=0x67F => Kind::Sdo,
        _ => Kind::Told,
    }
}

fn is_polling(data: &str) -> bool {
    data.get(2..6).is_some_and(|index| POLLED.contains(&index))
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
    fn a_second_boot_up_is_kept() {
        assert!(story(&frames("701#00 000#8101 701#00")).contains("701#00\n000#8101\n701#00\n"));
    }

    #[test]
    fn transfers_of_other_objects_are_kept() {
        let text = story(&frames("601#4000100000000000 581#4300100092010200"));

        assert!(text.contains("SDO:\n601#4000100000000000\n581#4300100092010200\n"), "{text}");
    }
}
