//! The next deadline of each device, the earliest of all at hand.

use od::Instant;

/// No deadline.
const NEVER: Instant = Instant::from_nanos(u64::MAX);

/// A tournament: each place holds the earlier of the two places below it, the devices are at the bottom.
#[derive(Debug)]
pub(crate) struct Deadlines {
    places: Vec<Instant>,
    first_device: usize,
}

impl Deadlines {
    /// No deadlines for `devices` devices.
    pub(crate) fn new(devices: usize) -> Self {
        let first_device = devices.next_power_of_two();
        Self { places: vec![NEVER; 2 * first_device], first_device }
    }

    /// Makes room for `device`; the others keep their deadlines.
    pub(crate) fn reserve(&mut self, device: usize) {
        if device < self.first_device {
            return;
        }
        let mut larger = Self::new(device + 1);
        for known in 0..self.first_device {
            larger.set(known, Some(self.at(self.first_device + known)));
        }
        *self = larger;
    }

    /// Sets the deadline of `device`.
    pub(crate) fn set(&mut self, device: usize, deadline: Option<Instant>) {
        let mut place = self.first_device + device;
        let Some(bottom) = self.places.get_mut(place) else { return };
        *bottom = deadline.unwrap_or(NEVER);
        while place > 1 {
            place /= 2;
            let earlier = self.at(2 * place).min(self.at(2 * place + 1));
            if self.at(place) == earlier {
                return;
            }
            if let Some(winner) = self.places.get_mut(place) {
                *winner = earlier;
            }
        }
    }

    /// Whether `device` has something to do at `now`.
    pub(crate) fn is_due(&self, device: usize, now: Instant) -> bool {
        self.at(self.first_device + device) <= now
    }

    /// The earliest deadline.
    pub(crate) fn first(&self) -> Option<Instant> {
        Some(self.at(1)).filter(|deadline| *deadline != NEVER)
    }

    /// The device whose deadline is the earliest of those until `now`; of equals, the first device.
    pub(crate) fn due(&self, now: Instant) -> Option<usize> {
        if self.at(1) > now {
            return None;
        }
        let mut place = 1;
        while place < self.first_device {
            let left = 2 * place;
            place = if self.at(left) <= self.at(left + 1) { left } else { left + 1 };
        }
        Some(place - self.first_device)
    }

    fn at(&self, place: usize) -> Instant {
        self.places.get(place).copied().unwrap_or(NEVER)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(nanos: u64) -> Instant {
        Instant::from_nanos(nanos)
    }

    #[test]
    fn the_earliest_deadline_wins_and_of_equals_the_first_device() {
        let mut deadlines = Deadlines::new(5);
        assert_eq!(deadlines.first(), None);
        for (device, deadline) in [(4, 30), (2, 10), (1, 20), (3, 10)] {
            deadlines.set(device, Some(at(deadline)));
        }
        assert_eq!(deadlines.first(), Some(at(10)));
        assert_eq!(deadlines.due(at(9)), None);
        assert_eq!(deadlines.due(at(30)), Some(2));
        deadlines.set(2, None);
        assert_eq!(deadlines.due(at(30)), Some(3));
        deadlines.set(3, Some(at(40)));
        assert_eq!(deadlines.due(at(30)), Some(1));
        deadlines.set(1, None);
        assert_eq!(deadlines.due(at(29)), None);
        assert_eq!(deadlines.first(), Some(at(30)));
    }

    #[test]
    fn a_single_device_and_none_at_all_work() {
        let mut one = Deadlines::new(1);
        one.set(0, Some(at(1)));
        assert_eq!(one.due(at(1)), Some(0));
        let mut none = Deadlines::new(0);
        none.set(0, None);
        assert_eq!(none.due(at(u64::MAX - 1)), None);
        assert_eq!(none.first(), None);
    }
}
