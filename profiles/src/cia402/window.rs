//! "Inside a window for a time": target reached in every mode.

/// How long a value has been inside its window, in raster steps.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Window {
    inside: u64,
}

impl Window {
    /// Starts anew.
    pub(crate) fn restart(&mut self) {
        self.inside = 0;
    }

    /// Notes one raster step with the value inside the window or not.
    pub(crate) fn step(&mut self, is_inside: bool) {
        self.inside = if is_inside { self.inside.saturating_add(1) } else { 0 };
    }

    /// Whether the value has been inside for `millis` at a raster of `period_nanos`, and for one step at least.
    pub(crate) fn is_reached(self, millis: i64, period_nanos: u64) -> bool {
        let elapsed = u128::from(self.inside) * u128::from(period_nanos);
        self.inside > 0 && elapsed >= u128::from(millis.max(0).unsigned_abs()) * 1_000_000
    }
}
