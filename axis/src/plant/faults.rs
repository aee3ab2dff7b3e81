//! Faults on demand.

use crate::drive::DriveFault;
use crate::inputs::Input;
use crate::units::Voltage;

/// Something that breaks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlantFault {
    /// The encoder shows no longer where the motor is.
    EncoderBreak,
    /// An input keeps this electrical level, whatever its switch says.
    StuckSwitch(Input, bool),
    /// The shaft cannot turn.
    BlockedShaft,
    /// The power electronics trip.
    DriveFault(DriveFault),
    /// The supply sinks to this voltage.
    SupplyDip(Voltage),
    /// Nothing passes between the drive and whoever commands it; meanwhile the drive is switched off.
    ConnectionLoss,
}

/// A fault that comes, and perhaps goes, at a time of the plant: the sum of all its steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScheduledFault {
    /// What breaks.
    pub fault: PlantFault,
    /// When, in seconds.
    pub from_seconds: f64,
    /// When it is over, in seconds; `None` is never.
    pub until_seconds: Option<f64>,
}

/// The beginning or the end of a scheduled fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change {
    at: f64,
    pub(super) fault: PlantFault,
    pub(super) begins: bool,
}

/// What is to come, in the order of time.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    changes: Vec<Change>,
    done: usize,
    time: f64,
}

impl Schedule {
    pub(super) fn new(faults: Vec<ScheduledFault>) -> Self {
        let begin = |s: ScheduledFault| Change { at: s.from_seconds, fault: s.fault, begins: true };
        let end = |s: ScheduledFault| {
            let at = s.until_seconds?.max(s.from_seconds);
            Some(Change { at, fault: s.fault, begins: false })
        };
        let both = faults.into_iter().flat_map(|s| [Some(begin(s)), end(s)]);
        let mut changes: Vec<_> = both.flatten().filter(|change| change.at.is_finite()).collect();
        changes.sort_by(|a, b| a.at.total_cmp(&b.at));
        Self { changes, done: 0, time: 0.0 }
    }

    /// Whether nothing is to come any more.
    pub(super) fn is_over(&self) -> bool {
        self.done >= self.changes.len()
    }

    /// The next change that is due in a step of `seconds` from now on; its nearer end counts.
    pub(super) fn take_due(&mut self, seconds: f64) -> Option<Change> {
        let next = self.changes.get(self.done)?;
        let is_due = next.at <= self.time + seconds / 2.0;
        self.done += usize::from(is_due);
        is_due.then_some(*next)
    }

    /// Time goes on.
    pub(super) fn pass(&mut self, seconds: f64) {
        self.time += seconds;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scheduled_faults_come_and_go_in_time() {
        let at = |fault, from_seconds, until_seconds| ScheduledFault { fault, from_seconds, until_seconds };
        let mut schedule = Schedule::new(vec![
            at(PlantFault::BlockedShaft, 0.003, Some(0.004)),
            at(PlantFault::EncoderBreak, 0.002, None),
            at(PlantFault::EncoderBreak, f64::NAN, None),
        ]);
        let mut seen = Vec::new();
        for step in 0..10 {
            while let Some(change) = schedule.take_due(0.001) {
                seen.push((step, change.fault, change.begins));
            }
            schedule.pass(0.001);
        }
        let blocked = PlantFault::BlockedShaft;
        assert_eq!(seen, [(2, PlantFault::EncoderBreak, true), (3, blocked, true), (4, blocked, false)]);
        assert!(schedule.is_over());
    }
}
