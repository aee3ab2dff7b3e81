//! The text format of Prometheus, version 0.0.4 ("Exposition formats"): families of samples with labels.

use core::fmt::Display;
use core::time::Duration;
use std::fmt::Write;

use crate::latency::Histogram;

/// A page of metrics.
#[derive(Debug, Default)]
pub(super) struct Page(String);

/// Names and values that tell the samples of a family apart.
pub(super) type Labels<'l> = &'l [(&'static str, &'l str)];

impl Page {
    /// Begins a family of samples that only ever grow.
    pub(super) fn counter(&mut self, name: &'static str, help: &str) -> Family<'_> {
        self.family(name, "counter", help)
    }

    /// Begins a family of samples that may rise and fall.
    pub(super) fn gauge(&mut self, name: &'static str, help: &str) -> Family<'_> {
        self.family(name, "gauge", help)
    }

    /// Begins a family of histograms.
    pub(super) fn histogram(&mut self, name: &'static str, help: &str) -> Family<'_> {
        self.family(name, "histogram", help)
    }

    fn family(&mut self, name: &'static str, kind: &str, help: &str) -> Family<'_> {
        // Writing to a string does not fail.
        let _ = writeln!(self.0, "# HELP {name} {help}\n# TYPE {name} {kind}");
        Family { page: &mut self.0, name }
    }

    /// The whole page.
    pub(super) fn into_text(self) -> String {
        self.0
    }
}

/// Samples of one name.
pub(super) struct Family<'p> {
    page: &'p mut String,
    name: &'static str,
}

impl Family<'_> {
    /// Adds a sample.
    pub(super) fn sample(&mut self, labels: Labels<'_>, value: impl Display) {
        self.line("", labels, None, value);
    }

    /// Adds a histogram.
    pub(super) fn times(&mut self, labels: Labels<'_>, histogram: &Histogram) {
        for (bound, below) in histogram.below() {
            let bound = seconds(Duration::from_micros(bound));
            self.line("_bucket", labels, Some(&bound), below);
        }
        self.line("_bucket", labels, Some("+Inf"), histogram.count());
        self.line("_sum", labels, None, seconds(histogram.sum()));
        self.line("_count", labels, None, histogram.count());
    }

    fn line(&mut self, suffix: &str, labels: Labels<'_>, bound: Option<&str>, value: impl Display) {
        let Self { page, name } = self;
        let labels = labels.iter().copied().chain(bound.map(|bound| ("le", bound)));
        let labels: Vec<_> = labels.map(|(name, value)| format!("{name}=\"{}\"", escaped(value))).collect();
        let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
        let _ = writeln!(page, "{name}{suffix}{labels} {value}");
    }
}

fn seconds(time: Duration) -> String {
    format!("{}.{:09}", time.as_secs(), time.subsec_nanos())
}

fn escaped(value: &str) -> String {
    value.replace('\\', r"\\").replace('"', "\\\"").replace('\n', r"\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_may_hold_anything() {
        let mut page = Page::default();
        page.gauge("x", "Some x.").sample(&[("a", "1\"2\\3\n4"), ("b", "")], 5);
        let expected = "# HELP x Some x.\n# TYPE x gauge\nx{a=\"1\\\"2\\\\3\\n4\",b=\"\"} 5\n";
        assert_eq!(page.into_text(), expected);
    }

    #[test]
    fn a_histogram_has_cumulative_buckets_and_ends_with_all() {
        let mut histogram = Histogram::default();
        histogram.record(Duration::from_micros(1));
        histogram.record(Duration::from_secs(2));
        let mut page = Page::default();
        page.histogram("x_seconds", "Some x.").times(&[], &histogram);
        let text = page.into_text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[2], "x_seconds_bucket{le=\"0.000010000\"} 1");
        let last = &lines[lines.len() - 4..];
        let all = ["x_seconds_bucket{le=\"1.048576000\"} 1", "x_seconds_bucket{le=\"+Inf\"} 2"];
        assert_eq!(last, [all[0], all[1], "x_seconds_sum 2.000001000", "x_seconds_count 2"]);
    }
}
