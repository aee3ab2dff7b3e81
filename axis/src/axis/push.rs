//! Torque instead of a place to be.

use crate::units::{Torque, Velocity};

/// A torque on its way to a target.
#[derive(Clone, Copy, Debug)]
pub(super) struct Push {
    target: Torque,
    /// Change in one raster step; infinite is at once.
    slope: f64,
    now: Torque,
}

impl Push {
    /// From `now` to `target` by `slope` a raster step; zero or not a number is at once.
    pub(super) fn new(target: Torque, slope: f64, now: Torque) -> Self {
        let slope = if slope.abs() > 0.0 { slope.abs() } else { f64::INFINITY };
        Self { target, slope, now }
    }

    /// The torque of the next raster step.
    pub(super) fn step(&mut self) {
        let way = (self.target - self.now).0;
        self.now = if way.abs() <= self.slope {
            self.target
        } else {
            Torque(self.now.0 + self.slope * way.signum())
        };
    }

    /// Whether the target is reached.
    pub(super) fn is_done(&self) -> bool {
        self.now == self.target
    }

    /// A velocity to the side that the torque pushes to.
    pub(super) fn direction(&self) -> Velocity {
        Velocity(self.target.0)
    }

    /// The torque of this raster step.
    pub(super) fn torque(&self) -> Torque {
        self.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_torque_rises_by_its_slope_and_ends_exactly() {
        let mut push = Push::new(Torque(-250.0), 100.0, Torque(0.0));
        let torques = [(); 4].map(|()| {
            push.step();
            push.torque()
        });
        assert_eq!(torques, [-100.0, -200.0, -250.0, -250.0].map(Torque));
        assert!(push.is_done());
    }

    #[test]
    fn no_slope_is_at_once() {
        let mut push = Push::new(Torque(300.0), f64::NAN, Torque(0.0));
        push.step();
        assert!(push.is_done());
    }
}
