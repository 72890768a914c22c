//! Error against cost, as SVG.

use crate::error::EvalError;
use crate::evaluation::{Evaluation, Summary};
use crate::ratio::Metric;
use plotters::prelude::*;

/// What a plot has along x.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Points and triangles drawn.
    Primitives,
    /// Bytes of records that are looked at.
    Bytes,
    /// Milliseconds of a picture.
    Milliseconds,
}

impl Axis {
    fn of(self, s: &Summary) -> f64 {
        match self {
            Self::Primitives => s.primitives,
            Self::Bytes => s.bytes,
            Self::Milliseconds => s.row.cost.render_ms.unwrap_or(0.0),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Primitives => "primitives",
            Self::Bytes => "bytes",
            Self::Milliseconds => "milliseconds (CPU)",
        }
    }
}

/// Distinct for people who see red and green alike (after M. Okabe and K. Ito's set).
const COLORS: [RGBColor; 11] = [
    RGBColor(0, 0, 0),
    RGBColor(120, 70, 30),
    RGBColor(86, 180, 233),
    RGBColor(170, 68, 255),
    RGBColor(230, 159, 0),
    RGBColor(240, 228, 66),
    RGBColor(204, 121, 167),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(0, 114, 178),
    RGBColor(140, 140, 140),
];

/// A contender's dots, by cost.
struct Line<'a> {
    /// Its number among the contenders: its colour.
    index: usize,
    name: &'a str,
    points: Vec<(f64, f64)>,
    /// Costs of what has no error: the source itself.
    exact: Vec<f64>,
}

/// An SVG of error against cost at one height, both logarithmic: a line for each contender, a dot
/// for each setting, means over the views; an upright line for what has no error.
///
/// # Errors
/// When the plot cannot be laid out: a bug.
pub fn plot(e: &Evaluation, height: u32, metric: Metric, axis: Axis) -> Result<String, EvalError> {
    let summaries = e.summaries();
    let lines: Vec<Line> = e
        .contenders
        .iter()
        .enumerate()
        .map(|(index, c)| {
            let is = |s: &&Summary| s.row.contender == c.name && s.row.height == height;
            let own: Vec<&Summary> = summaries.iter().filter(is).collect();
            let mut points: Vec<(f64, f64)> = own
                .iter()
                .map(|s| (axis.of(s), metric.of(&s.errors)))
                .filter(|(x, y)| *x > 0.0 && *y > 0.0)
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let exact = own.iter().filter(|s| metric.of(&s.errors) == 0.0);
            let exact = exact.map(|s| axis.of(s)).filter(|x| *x > 0.0).collect();
            Line { index, name: &c.name, points, exact }
        })
        .filter(|l| !l.points.is_empty() || !l.exact.is_empty())
        .collect();
    let mut svg = String::new();
    draw(&mut svg, &lines, height, metric, axis).map_err(EvalError::Report)?;
    Ok(svg)
}

fn draw(
    svg: &mut String,
    lines: &[Line],
    height: u32,
    metric: Metric,
    axis: Axis,
) -> Result<(), String> {
    let all = || lines.iter().flat_map(|l| l.points.iter().copied());
    fn around(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
        let (low, high) =
            values.fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
        if high > 0.0 { low * 0.8..high * 1.25 } else { 0.1..1.0 }
    }
    let costs = all().map(|p| p.0).chain(lines.iter().flat_map(|l| l.exact.iter().copied()));
    let (xs, ys) = (around(costs), around(all().map(|p| p.1)));
    let failed = |e: &dyn std::fmt::Display| e.to_string();
    let root = SVGBackend::with_string(svg, (640, 380)).into_drawing_area();
    root.fill(&WHITE).map_err(|e| failed(&e))?;
    let (left, right) = root.split_horizontally(540);
    let name = match metric {
        Metric::Flip => "mean FLIP",
        Metric::Rmse => "RMSE",
    };
    let mut chart = ChartBuilder::on(&left)
        .caption(format!("{name}, tree {height} pixels high"), ("sans-serif", 15))
        .margin(8)
        .x_label_area_size(38)
        .y_label_area_size(52)
        .build_cartesian_2d(xs.log_scale(), ys.clone().log_scale())
        .map_err(|e| failed(&e))?;
    chart
        .configure_mesh()
        .x_desc(axis.name())
        .y_desc(name)
        .x_label_formatter(&|v| tick(*v))
        .y_label_formatter(&|v| tick(*v))
        .light_line_style(RGBColor(240, 240, 240))
        .bold_line_style(RGBColor(215, 215, 215))
        .label_style(("sans-serif", 12))
        .draw()
        .map_err(|e| failed(&e))?;
    for Line { index, points, exact, .. } in lines {
        let color = COLORS[index % COLORS.len()];
        let width = if *index == 0 { 3 } else { 1 };
        chart
            .draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(width)))
            .map_err(|e| failed(&e))?;
        // What has no error has no place on a logarithmic axis: a line from top to bottom.
        let upright = exact.iter().map(|&x| PathElement::new([(x, ys.start), (x, ys.end)], color));
        chart.draw_series(upright).map_err(|e| failed(&e))?;
        chart
            .draw_series(points.iter().map(|p| Circle::new(*p, 3, color.filled())))
            .map_err(|e| failed(&e))?;
    }
    // The legend stands beside the plot, where it hides nothing.
    for (row, Line { index, name, .. }) in (0..).zip(lines) {
        let (color, y) = (COLORS[index % COLORS.len()], 40 + 18 * row);
        let dash = PathElement::new([(0, y), (16, y)], color.stroke_width(3));
        right.draw(&dash).map_err(|e| failed(&e))?;
        let label = Text::new(*name, (22, y - 6), ("sans-serif", 12));
        right.draw(&label).map_err(|e| failed(&e))?;
    }
    root.present().map_err(|e| failed(&e))
}

/// 0.3, 1, 10, 1k, … for an axis.
fn tick(v: f64) -> String {
    let (v, unit) = match v {
        v if v >= 1e9 => (v / 1e9, "G"),
        v if v >= 1e6 => (v / 1e6, "M"),
        v if v >= 1e3 => (v / 1e3, "k"),
        v => (v, ""),
    };
    // Ticks are sums of powers of ten: what is beyond six places is rounding.
    let text = format!("{v:.6}");
    format!("{}{unit}", text.trim_end_matches('0').trim_end_matches('.'))
}

#[cfg(test)]
mod tests {
    use super::tick;

    #[test]
    fn ticks_are_short() {
        let shown = [0.300_000_000_000_000_04, 0.05, 1.0, 10.0, 2000.0, 3e6].map(tick);
        assert_eq!(shown, ["0.3", "0.05", "1", "10", "2k", "3M"]);
    }
}
