//! A recording of the bus, freed of what differs from run to run.

use std::collections::BTreeSet;

/// Objects that a master polls: how often, and which passing values it sees, is a matter of luck.
const POLLED: [&str; 4] = ["4160", "6160", "6460", "6C60"];

/// The bits of the statusword that name the drive's state (CiA 402, table 30).
const STATE: u16 = 0x006F;
/// Target reached, and set-point acknowledge or speed: what changes within a state.
const WITHIN_STATE: u16 = 0x1400;

/// What a frame is by the pre-defined connection set (CiA 301, 7.3.5).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// NMT, boot-up, EMCY, RPDO. One side acts and the other waits for it, so the order is the same in every run.
    Told,
    /// TPDO1, event-driven.
    Status,
    /// TPDO2, event-driven, too; its place among the others is not certain.
    Echo,
    /// SDO, one request after the other, but at any time.
    Sdo,
    /// SYNC and what it triggers: as many as the run took time.
    Cyclic,
}

/// What happened on the bus, in four lists:
///
/// * told: NMT, boot-up, EMCY, RPDOs and, between them, what TPDO1 said in the end in each drive state that it went
///   through, in bus order;
/// * the changes of drive state and mode in TPDO2;
/// * the SDO transfers without the polling of statusword, mode, position and velocity;
/// * the cyclic frames, each once, with their lengths.
#[must_use]
pub fn story(frames: &[String]) -> String {
    let mut told: Vec<(&str, &str)> = Vec::new();
    let mut echo = Vec::new();
    let mut sdo = Vec::new();
    let mut cyclic = BTreeSet::new();
    for frame in frames {
        let (id, data) = frame.split_once('#').unwrap_or((frame, ""));
        match (kind(id), told.last_mut()) {
            (Kind::Status, Some(last)) if last.0 == id && same(last.1, data, STATE) => last.1 = data,
            (Kind::Told | Kind::Status, _) => told.push((id, data)),
            (Kind::Echo, _) => echo.push(format!("{id}#{}", without(data, WITHIN_STATE))),
            (Kind::Sdo, _) if is_polling(data) => {}
            (Kind::Sdo, _) => sdo.push(frame.as_str()),
            (Kind::Cyclic, _) => {
                cyclic.insert(format!("{id} with {} bytes\n", data.len() / 2));
            }
        }
    }
    echo.dedup();
    let told: String = told.iter().map(|(id, data)| format!("{id}#{data}\n")).collect();
    let cyclic = String::from_iter(cyclic);
    format!("told:\n{told}\nTPDO2:\n{}\n\nSDO:\n{}\n\ncyclic:\n{cyclic}", echo.join("\n"), sdo.join("\n"))
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

/// Whether two PDOs that begin with the statusword agree in these bits of it.
fn same(one: &str, other: &str, bits: u16) -> bool {
    match (statusword(one), statusword(other)) {
        (Some(one), Some(other)) => one & bits == other & bits,
        _ => false,
    }
}

/// A PDO that begins with the statusword, with these bits of it cleared.
fn without(data: &str, bits: u16) -> String {
    match (statusword(data), data.get(4..)) {
        (Some(word), Some(rest)) => format!("{:04X}{rest}", (word & !bits).swap_bytes()),
        _ => data.to_owned(),
    }
}

/// The statusword at the begin of a PDO, where it stands with its low byte first.
pub(crate) fn statusword(data: &str) -> Option<u16> {
    u16::from_str_radix(data.get(..4)?, 16).ok().map(u16::swap_bytes)
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
                   581#4B41600050060000 201#0F00 181#3702 181#3706 281#370201 281#370601 080# 381#370601000000";
        let two = "701#00 000#0101 181#5006 281#500601 080# 381#500602000000 201#0F00 181#3706 \
                   281#370601 080# 381#370603000000 080# 381#370604000000";

        assert_eq!(story(&frames(one)), story(&frames(two)));
    }

    #[test]
    fn a_run_with_another_statusword_tells_another_story() {
        let one = frames("201#0600 181#3106");
        let two = frames("201#0600 181#3306");

        assert_ne!(story(&one), story(&two));
    }

    #[test]
    fn every_drive_state_is_kept() {
        assert!(story(&frames("201#0200 181#1702 181#5002")).contains("201#0200\n181#1702\n181#5002\n"));
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
