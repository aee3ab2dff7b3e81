//! Line charts as SVG: panels one below the other over a common time axis. Texts are put in as they are, so
//! they must not contain `<` or `&`.

use std::fmt::Write as _;

/// A picture.
pub(crate) struct Chart {
    pub(crate) title: String,
    /// Label of the horizontal axis, with its unit.
    pub(crate) x_label: String,
    pub(crate) panels: Vec<Panel>,
}

/// One diagram of a picture.
pub(crate) struct Panel {
    /// What is drawn, with its unit.
    pub(crate) label: String,
    pub(crate) series: Vec<Series>,
}

/// One line of a diagram.
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
}

/// A horizontal or vertical scale: the numbers of its first and last tick, and what a tick is worth.
#[derive(Clone, Copy)]
struct Scale {
    first: f64,
    last: f64,
    tick: f64,
}

/// Where a panel is drawn, in pixels.
struct Frame {
    x: Scale,
    y: Scale,
    top: f64,
}

const WIDTH: f64 = 720.0;
const LEFT: f64 = 72.0;
const RIGHT: f64 = 16.0;
const HEAD: f64 = 40.0;
const FOOT: f64 = 48.0;
/// Room above a diagram for its label and its legend.
const CAPTION: f64 = 24.0;
const DIAGRAM: f64 = 160.0;
/// Room between a diagram and the next panel.
const GAP: f64 = 20.0;
const PANEL: f64 = CAPTION + DIAGRAM + GAP;

/// Distinguishable without red and green: blue, orange, violet, grey.
const COLOURS: [&str; 4] = ["#0b62a4", "#d9730d", "#7b4ea3", "#5f6b73"];

/// Between two names of a legend; spaces that count.
const SPACES: &str = "\u{a0}\u{a0}\u{a0}";

impl Chart {
    /// The picture as the text of an SVG file.
    pub(crate) fn svg(&self) -> String {
        let bottom = HEAD + self.panels.len() as f64 * PANEL - GAP;
        let height = bottom + FOOT;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" \
             font-size=\"12\" fill=\"#222\">\n<rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>\n"
        );
        text(&mut svg, (LEFT, 24.0), "font-size=\"15\" font-weight=\"bold\"", &self.title);
        let x = Scale::around(self.panels.iter().flat_map(Panel::points).map(|point| point.0));
        for (row, panel) in self.panels.iter().enumerate() {
            let y = Scale::around(panel.points().map(|point| point.1));
            let frame = Frame { x, y, top: HEAD + row as f64 * PANEL + CAPTION };
            frame.draw(&mut svg, panel);
        }
        self.draw_x_axis(&mut svg, x, bottom);
        svg.push_str("</svg>\n");
        svg
    }

    fn draw_x_axis(&self, svg: &mut String, x: Scale, bottom: f64) {
        for value in x.ticks() {
            text(svg, (across(x, value), bottom + 16.0), "text-anchor=\"middle\"", &x.label(value));
        }
        let middle = (LEFT + WIDTH - RIGHT) / 2.0;
        text(svg, (middle, bottom + 36.0), "text-anchor=\"middle\"", &self.x_label);
    }
}

impl Panel {
    fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        self.series.iter().flat_map(|series| series.points.iter().copied())
    }
}

impl Frame {
    fn draw(&self, svg: &mut String, panel: &Panel) {
        self.draw_grid(svg);
        text(svg, (LEFT, self.top - 9.0), "font-weight=\"bold\"", &panel.label);
        let coloured = || panel.series.iter().zip(COLOURS.iter().cycle());
        coloured().for_each(|(series, colour)| self.draw_line(svg, series, colour));
        let entry =
            |(series, colour): (&Series, _)| format!("<tspan fill=\"{colour}\">{}</tspan>", series.name);
        let legend: Vec<String> = coloured().map(entry).collect();
        if legend.len() > 1 {
            text(svg, (WIDTH - RIGHT, self.top - 9.0), "text-anchor=\"end\"", &legend.join(SPACES));
        }
    }

    fn draw_grid(&self, svg: &mut String) {
        let (right, bottom) = (WIDTH - RIGHT, self.top + DIAGRAM);
        for value in self.y.ticks() {
            let y = self.down(value);
            line(svg, (LEFT, y), (right, y));
            text(svg, (LEFT - 8.0, y + 4.0), "text-anchor=\"end\"", &self.y.label(value));
        }
        for x in self.x.ticks().map(|value| across(self.x, value)) {
            line(svg, (x, self.top), (x, bottom));
        }
    }

    fn draw_line(&self, svg: &mut String, series: &Series, colour: &str) {
        let place = |&(x, y): &(f64, f64)| format!("{:.1},{:.1}", across(self.x, x), self.down(y));
        let mut places: Vec<String> = series.points.iter().map(place).collect();
        places.dedup();
        append(
            svg,
            format_args!(
                "<polyline fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\" points=\"{}\"/>\n",
                places.join(" ")
            ),
        );
    }

    /// The vertical place of a value.
    fn down(&self, value: f64) -> f64 {
        self.top + (1.0 - self.y.part(value)) * DIAGRAM
    }
}

impl Scale {
    /// Ticks wanted on a scale.
    const TICKS: f64 = 5.0;

    /// The scale from tick to tick that holds all values.
    fn around(values: impl Iterator<Item = f64>) -> Self {
        let (min, max) =
            values.fold((0.0_f64, 0.0_f64), |(min, max), value| (min.min(value), max.max(value)));
        let tick = round_tick((max - min).max(1e-3) / Self::TICKS);
        let first = (min / tick).floor();
        Self { first, last: (max / tick).ceil().max(first + 1.0), tick }
    }

    /// The values that get a tick.
    fn ticks(self) -> impl Iterator<Item = f64> {
        let count = (self.last - self.first) as u32;
        (0..=count).map(move |number| (self.first + f64::from(number)) * self.tick)
    }

    /// The value as the text at its tick, with as many decimals as ticks have.
    fn label(self, value: f64) -> String {
        let units = [1.0, 0.1, 0.01, 0.001];
        let decimals = units.iter().position(|unit| self.tick >= 0.999 * unit).unwrap_or(units.len());
        format!("{value:.decimals$}")
    }

    /// Where a value lies between the ends, 0 to 1.
    fn part(self, value: f64) -> f64 {
        (value / self.tick - self.first) / (self.last - self.first)
    }
}

/// The least of 1, 2 and 5 times a power of ten that is not below `least`.
fn round_tick(least: f64) -> f64 {
    let mut power = 1e-6;
    loop {
        for digit in [1.0, 2.0, 5.0] {
            if digit * power >= least {
                return digit * power;
            }
        }
        power *= 10.0;
    }
}

/// The horizontal place of a value.
fn across(x: Scale, value: f64) -> f64 {
    LEFT + x.part(value) * (WIDTH - LEFT - RIGHT)
}

fn text(svg: &mut String, (x, y): (f64, f64), style: &str, content: &str) {
    append(svg, format_args!("<text x=\"{x:.1}\" y=\"{y:.1}\" {style}>{content}</text>\n"));
}

fn line(svg: &mut String, from: (f64, f64), to: (f64, f64)) {
    append(
        svg,
        format_args!(
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"#ddd\"/>\n",
            from.0, from.1, to.0, to.1
        ),
    );
}

/// Writing to a string does not fail.
fn append(svg: &mut String, what: std::fmt::Arguments<'_>) {
    let _ = svg.write_fmt(what);
}
