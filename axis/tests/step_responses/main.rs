//! The answers of controllers and generators are what they were, and `docs/pictures` shows them.
//! `UPDATE_DOCS=1` draws the pictures anew, `INSTA_UPDATE=always` writes the numbers.

mod chart;
mod responses;

use std::fmt::Write as _;
use std::path::Path;

use chart::Chart;

/// Every how many points one is noted.
const NOTED: usize = 10;

fn numbers(chart: &Chart) -> String {
    let mut text = format!("{}\n", chart.title);
    for panel in &chart.panels {
        for series in &panel.series {
            writeln!(text, "\n{}: {}", panel.label, series.name).unwrap();
            for (x, y) in series.points.iter().step_by(NOTED) {
                writeln!(text, "{x:.3} {y:.3}").unwrap();
            }
        }
    }
    text
}

#[test]
fn the_responses_are_those_of_the_snapshot() {
    for (name, chart) in responses::pictures() {
        insta::assert_snapshot!(name, numbers(&chart));
    }
}

#[test]
fn the_pictures_in_the_documentation_show_the_responses() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/pictures");
    for (name, chart) in responses::pictures() {
        let (path, expected) = (folder.join(format!("{name}.svg")), chart.svg());
        if std::env::var_os("UPDATE_DOCS").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &expected).unwrap();
        }
        let drawn = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(drawn == expected, "{} is out of date: run with UPDATE_DOCS=1", path.display());
    }
}
