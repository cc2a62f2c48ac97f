//! Plots as SVG that takes the page's own colours: how far marks lie from a surface, how it came to rest.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::cli::terminal::text::number;
use crate::error::{Error, Result};

const SIZE: (u32, u32) = (480, 300);
const LETTERS: (&str, i32) = ("sans-serif", 16);
/// Lines and text: black, which [`themed`] replaces.
const INK: RGBColor = BLACK;
const GRID: RGBColor = RGBColor(136, 136, 144);
const LIMIT: RGBColor = RGBColor(216, 67, 60);

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// What an axis shows.
struct Axis {
    name: String,
    range: [f64; 2],
    labels: usize,
    form: fn(&f64) -> String,
}

/// How many `points` lie how far off; `line` is the length of a voxel, drawn where it is among them.
pub(super) fn histogram(bin_width: f64, counts: &[u64], line: f64, unit: &str, points: &str) -> Result<String> {
    let end = bin_width * counts.len().max(1) as f64;
    let most = counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    let across = Axis { name: format!("off the surface ({unit})"), range: [0.0, end], labels: 6, form: |v| number(*v) };
    let up = Axis { name: points.into(), range: [0.0, 1.06 * most], labels: 5, form: |v| format!("{v:.0}") };
    plot([across, up], |chart| {
        let bars = counts.iter().enumerate().map(|(n, &count)| {
            let (low, high) = (n as f64 * bin_width, (n as f64 + 0.92) * bin_width);
            Rectangle::new([(low, 0.0), (high, count as f64)], RGBColor(66, 133, 190).filled())
        });
        chart.draw_series(bars).map_err(failed)?;
        if line < end {
            let upright = [(line, 0.0), (line, 1.06 * most)];
            chart.draw_series(LineSeries::new(upright, LIMIT.stroke_width(2))).map_err(failed)?;
        }
        Ok(())
    })
}

/// What the rule that ends the motion looked at after each step, a line for each object in its colour, and where the rule ends it.
pub(super) fn motion(curves: &[(Vec<f64>, [u8; 3])], limit: f64) -> Result<String> {
    let height = |value: f64| libm::log10(value.max(f64::MIN_POSITIVE));
    let shown = |value: &f64| *value > 0.0 && value.is_finite();
    let values = || curves.iter().flat_map(|(curve, _)| curve.iter().copied()).filter(shown).chain([limit]);
    let (low, high) = values().map(height).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let steps = curves.iter().map(|(curve, _)| curve.len()).max().unwrap_or(0).max(2) as f64;
    let across = Axis { name: "time step".into(), range: [1.0, steps], labels: 6, form: |v| format!("{v:.0}") };
    let form = |v: &f64| two_digits(libm::pow(10.0, *v));
    let up = Axis { name: "motion".into(), range: [low - 0.1, high + 0.1], labels: 5, form };
    plot([across, up], |chart| {
        let ends = [(1.0, height(limit)), (steps, height(limit))];
        chart.draw_series(LineSeries::new(ends, LIMIT.stroke_width(1))).map_err(failed)?;
        for (curve, [r, g, b]) in curves {
            let places = curve.iter().enumerate().filter(|(_, value)| shown(value));
            let places: Vec<(f64, f64)> = places.map(|(n, &value)| ((n + 1) as f64, height(value))).collect();
            let color = RGBColor(*r, *g, *b);
            chart.draw_series(LineSeries::new(places.clone(), color.stroke_width(2))).map_err(failed)?;
            let dots = places.into_iter().map(|place| Circle::new(place, 2, color.filled()));
            chart.draw_series(dots).map_err(failed)?;
        }
        Ok(())
    })
}

/// Places on a chart, and their colour.
pub(super) type Curve = (Vec<(f64, f64)>, [u8; 3]);

/// A number of each object over time, a line for each in its colour.
pub(super) fn over_time(curves: &[Curve], [time, what]: [&str; 2]) -> Result<String> {
    let places = || curves.iter().flat_map(|(curve, _)| curve.iter().copied());
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    let [first, last] = range(&mut places().map(|(at, _)| at));
    let [low, high] = range(&mut places().map(|(_, value)| value));
    // A change is seen as what it is of the whole only where the axis begins at nothing.
    let across = Axis {
        name: time.into(),
        range: [first, if last > first { last } else { first + 1.0 }],
        labels: 8,
        form: |v| number(*v),
    };
    let up = Axis {
        name: what.into(),
        range: [low.min(0.0), 1.06 * high.max(f64::MIN_POSITIVE)],
        labels: 5,
        form: |v| number(*v),
    };
    plot([across, up], |chart| {
        for (curve, [r, g, b]) in curves {
            let color = RGBColor(*r, *g, *b);
            chart.draw_series(LineSeries::new(curve.iter().copied(), color.stroke_width(2))).map_err(failed)?;
            chart.draw_series(curve.iter().map(|&at| Circle::new(at, 2, color.filled()))).map_err(failed)?;
        }
        Ok(())
    })
}

/// A number to two digits, as `0.032`.
fn two_digits(value: f64) -> String {
    let last = libm::pow(10.0, libm::floor(libm::log10(value)) - 1.0);
    number((value / last).round() * last)
}

fn plot([across, up]: [Axis; 2], draw: impl FnOnce(&mut Chart<'_, '_>) -> Result<()>) -> Result<String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        let mut chart = ChartBuilder::on(&area)
            .margin(6)
            .margin_right(16)
            .x_label_area_size(48)
            .y_label_area_size(76)
            .build_cartesian_2d(across.range[0]..across.range[1], up.range[0]..up.range[1])
            .map_err(failed)?;
        chart
            .configure_mesh()
            .x_desc(across.name)
            .y_desc(up.name)
            .x_labels(across.labels)
            .y_labels(up.labels)
            .x_label_formatter(&across.form)
            .y_label_formatter(&up.form)
            .label_style(LETTERS.into_font().color(&INK))
            .axis_style(INK)
            .bold_line_style(GRID.mix(0.35))
            .light_line_style(TRANSPARENT)
            .draw()
            .map_err(failed)?;
        draw(&mut chart)?;
        area.present().map_err(failed)?;
    }
    Ok(themed(&svg))
}

/// The plot in the colour of the text around it, as wide as there is room.
fn themed(svg: &str) -> String {
    let (width, height) = SIZE;
    let scaled = format!("<svg role=\"img\" viewBox=\"0 0 {width} {height}\"");
    let start = format!("<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\"");
    svg.replace(&start, &scaled).replace("#000000", "currentColor")
}

fn failed(error: impl std::error::Error + Send + Sync + 'static) -> Error {
    Error::failed(format!("a plot cannot be drawn: {error}")).caused_by(error)
}
