//! How a motor follows another one in a gear mode.

use axis::{Position, Velocity};

/// Follows a moving place within a speed and a ramp.
pub(super) struct Follower {
    /// Time to the next set-point, in seconds.
    pub(super) raster: f64,
    /// Counts/s.
    pub(super) speed: f64,
    /// Counts/s².
    pub(super) ramp: f64,
}

impl Follower {
    /// The velocity of the next raster step, at whose end the axis would be at `behind` from here, if it can. That place
    /// moves at `pace`, the axis at `now`.
    pub(super) fn next(&self, behind: Position, pace: Velocity, now: Velocity) -> Velocity {
        // What is to be made up beside the way that the place itself has gone.
        let missing = behind.0 - pace.0 * self.raster;
        let step = self.ramp * self.raster;
        // The largest difference of velocities that the ramp takes back before the place is passed.
        let most = (step * step / 4.0 + 2.0 * self.ramp * missing.abs()).sqrt() - step / 2.0;
        let wanted = pace.0 + (missing / self.raster).clamp(-most, most);
        let within = wanted.clamp(-self.speed, self.speed);
        Velocity(within.clamp(now.0 - step, now.0 + step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FOLLOWER: Follower = Follower { raster: 0.002, speed: 10_000.0, ramp: 100_000.0 };

    /// Follows a place at `pace` from rest, `behind` it, for so many steps; the way to it and the velocities.
    fn follow(mut behind: f64, pace: f64, steps: usize) -> (f64, Vec<f64>) {
        let mut now = Velocity(0.0);
        let mut velocities = Vec::new();
        for _ in 0..steps {
            behind += pace * FOLLOWER.raster;
            now = FOLLOWER.next(Position(behind), Velocity(pace), now);
            behind -= now.0 * FOLLOWER.raster;
            velocities.push(now.0);
        }
        (behind, velocities)
    }

    #[test]
    fn it_catches_up_without_passing_and_then_stays() {
        for (behind, pace) in [(5000.0, 3000.0), (-5000.0, 3000.0), (0.0, -8000.0), (200.0, 0.0)] {
            let (left, velocities) = follow(behind, pace, 2000);
            assert!(left.abs() < 1e-6, "{behind} {pace}: {left}");
            assert!((velocities[1999] - pace).abs() < 1e-6);
        }
        // What a step of the ramp does not divide evenly is less than a tenth of a count.
        let (_, velocities) = follow(200.0, 0.0, 2000);
        assert!(velocities.iter().all(|v| v * FOLLOWER.raster > -0.1), "it hardly comes back");
    }

    #[test]
    fn speed_and_ramp_are_kept() {
        let (left, velocities) = follow(0.0, 12_000.0, 500);
        assert!((left - 2.0 * 1000.0).abs() < 600.0, "it falls behind: {left}");
        assert!(velocities.iter().all(|v| *v <= 10_000.0));
        assert!(velocities.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= 200.0 + 1e-9));
    }
}
