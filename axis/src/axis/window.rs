//! When an axis counts as arrived (MACCON MAC4 User Manual, section 5.6, target radius and target radius time).

use crate::units::Position;

/// How near the actual position has to be to the target, and for how long.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TargetWindow {
    /// Largest distance on either side; zero is the exact count.
    pub radius: Position,
    /// Raster steps on end; zero is at once.
    pub steps: u32,
}

/// Counts the time in the window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    window: TargetWindow,
    inside: u32,
}

impl Arrival {
    pub(super) fn new(window: TargetWindow) -> Self {
        Self { window, inside: 0 }
    }

    /// Starts anew with a new target.
    pub(super) fn restart(&mut self) {
        self.inside = 0;
    }

    /// Follows one step at this distance from the target; whether the axis has arrived.
    pub(super) fn step(&mut self, distance: Position) -> bool {
        self.inside =
            if distance.abs() <= self.window.radius.abs() { self.inside.saturating_add(1) } else { 0 };
        self.inside > 0 && self.inside >= self.window.steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaving_the_window_starts_its_time_anew() {
        let mut arrival = Arrival::new(TargetWindow { radius: Position(5.0), steps: 3 });
        let distances = [9.0, 5.0, -5.0, 6.0, 0.0, 1.0, 2.0, 3.0];
        let arrived = distances.map(|distance| arrival.step(Position(distance)));
        assert_eq!(arrived, [false, false, false, false, false, false, true, true]);
    }

    #[test]
    fn without_a_time_arriving_is_enough() {
        let mut arrival = Arrival::new(TargetWindow::default());
        assert_eq!([1.0, 0.0].map(|distance| arrival.step(Position(distance))), [false, true]);
    }
}
