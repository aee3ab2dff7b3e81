//! Stops in whole steps.
//!
//! Ways are divided by the step time here, so a step at speed `v` covers the way `v`.

/// Share of the braking rate that planning leaves unused, to make up for rounding.
pub(super) const RESERVE: f64 = 1e-9;

/// How a motion comes to rest: each step lowers the speed by at most a rate; the last one drops it to zero,
/// from at most that rate or the start/stop velocity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Brake {
    /// Counts/s a step, above zero.
    rate: f64,
    /// Counts/s; zero where every change of speed is a ramp.
    start_stop: f64,
}

impl Brake {
    pub(super) fn new(rate: f64, start_stop: f64) -> Self {
        Self { rate, start_stop }
    }

    /// The highest speed that the next step may drop to zero.
    pub(super) fn drop(self) -> f64 {
        self.rate.max(self.start_stop)
    }

    /// The lowest speed that may follow on `speed`.
    pub(super) fn lowest(self, speed: f64) -> f64 {
        if speed <= self.drop() { 0.0 } else { speed - self.rate }
    }

    /// The highest speed of a step that begins a stop within `way`; zero when there is none.
    ///
    /// A stop from `w` in `n` steps of `rate`, the last speed at most `drop`, takes the way
    /// `(n + 1) w - rate n (n + 1) / 2`; `n` is the highest number for which some such `w` fits.
    pub(super) fn highest(self, way: f64) -> f64 {
        if way <= 0.0 {
            return 0.0;
        }
        let rate = self.rate * (1.0 - RESERVE);
        let drop = rate.max(self.start_stop);
        let half = drop / rate - 1.5;
        let speeds = ((half * half + 2.0 * way / rate).sqrt() - half).floor().max(1.0);
        let full_steps = speeds - 1.0;
        let rest = (way - rate * full_steps * speeds / 2.0) / speeds;
        full_steps * rate + rest.min(drop)
    }

    /// The same, at most `top`.
    pub(super) fn highest_below(self, top: f64, way: f64) -> f64 {
        if self.has_plenty(top, way) { top } else { self.highest(way).min(top) }
    }

    /// The speed `wanted` after `speed`, above zero, cut so that a stop within `way` stays possible. When it is
    /// too late for this brake, it brakes by as much as it takes and is at most `most`.
    pub(super) fn cut(self, wanted: f64, speed: f64, way: f64, most: f64) -> f64 {
        if self.has_plenty(wanted, way) { wanted } else { wanted.min(self.highest_after(speed, way, most)) }
    }

    /// Whether `way` is enough for a stop from `speed` beyond doubt; most of the time it is.
    fn has_plenty(self, speed: f64, way: f64) -> bool {
        let rate = self.rate * (1.0 - RESERVE);
        speed * (speed + 2.0 * rate) <= 2.0 * rate * way
    }

    /// The highest speed that [`Brake::cut`] leaves.
    fn highest_after(self, speed: f64, way: f64, most: f64) -> f64 {
        let highest = self.highest(way);
        if highest >= self.lowest(speed) {
            return highest;
        }
        let rate = self.required(speed, way).min(most).max(self.rate);
        let hard = Self { rate, ..self };
        hard.highest(way).max(hard.lowest(speed))
    }

    /// Whether `speed` can be stopped within `way`.
    pub(super) fn can_stop(self, speed: f64, way: f64) -> bool {
        way >= 0.0 && self.highest(way) >= self.lowest(speed)
    }

    /// The rate that stops `speed` within `way` in the steps an even stop takes; infinite when none does.
    ///
    /// `n` steps of `rate` lead from `v` down to a speed that may drop, and take `n v - rate n (n + 1) / 2`.
    fn required(self, speed: f64, way: f64) -> f64 {
        if way < 0.0 {
            return f64::INFINITY;
        }
        let above = speed - self.start_stop;
        let steps = ((2.0 * way + above) / (speed + self.start_stop)).floor().max(1.0);
        let to_drop = (above / steps).min(speed / (steps + 1.0));
        let to_fit = 2.0 * (steps * speed - way) / (steps * (steps + 1.0));
        to_drop.max(to_fit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The way of a stop that begins with a step at `speed`.
    fn way(speed: f64, brake: Brake) -> f64 {
        let (mut speed, mut way) = (speed, 0.0);
        while speed > 0.0 {
            way += speed;
            speed = brake.lowest(speed);
        }
        way
    }

    #[test]
    fn the_highest_speed_is_the_last_one_that_stops_in_time() {
        for start_stop in [0.0, 3.0, 10.0, 35.0] {
            let brake = Brake::new(10.0, start_stop);
            for tenths in 1..5000 {
                let room = f64::from(tenths) / 10.0;
                let speed = brake.highest(room);
                assert!(way(speed, brake) <= room * (1.0 + 1e-6), "{start_stop} {room}: {speed}");
                assert!(way(speed * (1.0 + 1e-6), brake) > room, "{start_stop} {room}: {speed}");
            }
        }
    }

    #[test]
    fn plenty_of_way_is_never_too_little() {
        for start_stop in [0.0, 3.0, 35.0] {
            let brake = Brake::new(10.0, start_stop);
            for (speed, room) in (1..200).flat_map(|speed| (1..200).map(move |room| (speed, 13 * room))) {
                let (speed, room) = (f64::from(speed), f64::from(room));
                assert!(!brake.has_plenty(speed, room) || way(speed, brake) <= room, "{speed} {room}");
            }
            assert!(brake.has_plenty(100.0, 601.0));
        }
    }

    #[test]
    fn a_stop_that_is_too_late_brakes_as_hard_as_it_takes() {
        for start_stop in [0.0, 3.0, 35.0] {
            let gentle = Brake::new(1e-3, start_stop);
            for room in [5.0, 60.0, 123.4, 700.0] {
                let (mut speed, mut left) = (100.0, room);
                let mut hardest = 0.0_f64;
                while speed > 0.0 {
                    let next = gentle.highest_after(speed, left, 100.0);
                    hardest = hardest.max(if speed > start_stop { speed - next } else { 0.0 });
                    (speed, left) = (next, left - next);
                }
                assert!(left >= -1e-6, "{start_stop} {room}: {left}");
                let even = 100.0 * 100.0 / (2.0 * room + 100.0 * (1.0 - start_stop / 100.0));
                assert!(hardest <= even * 1.3 + 1e-6, "{start_stop} {room}: {hardest} {even}");
            }
        }
    }
}
