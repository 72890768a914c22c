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
            Self::Milliseconds => s.row.cost.render_ms,
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
const COLORS: [RGBColor; 10] = [
    RGBColor(0, 0, 0),
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
}

/// An SVG of error against cost at one height, both logarithmic: a line for each contender, a dot
/// for each setting, means over the views.
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
            let own = summaries.iter().filter(|s| s.row.contender == c.name);
            let mut points: Vec<(f64, f64)> = own
                .filter(|s| s.row.height == height)
                .map(|s| (axis.of(s), metric.of(&s.errors)))
                .filter(|(x, y)| *x > 0.0 && *y > 0.0)
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            Line { index, name: &c.name, points }
        })
        .filter(|l| !l.points.is_empty())
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
    let range = |of: fn((f64, f64)) -> f64| {
        let low = all().map(of).fold(f64::INFINITY, f64::min);
        let high = all().map(of).fold(0.0, f64::max);
        if high > 0.0 { low * 0.8..high * 1.25 } else { 0.1..1.0 }
    };
    let failed = |e: &dyn std::fmt::Display| e.to_string();
    let root = SVGBackend::with_string(svg, (560, 380)).into_drawing_area();
    root.fill(&WHITE).map_err(|e| failed(&e))?;
    let name = match metric {
        Metric::Flip => "mean FLIP",
        Metric::Rmse => "RMSE",
    };
    let mut chart = ChartBuilder::on(&root)
        .caption(format!("{name}, tree {height} pixels high"), ("sans-serif", 15))
        .margin(8)
        .x_label_area_size(38)
        .y_label_area_size(52)
        .build_cartesian_2d(range(|p| p.0).log_scale(), range(|p| p.1).log_scale())
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
    for Line { index, name, points } in lines {
        let color = COLORS[index % COLORS.len()];
        let width = if *index == 0 { 3 } else { 1 };
        chart
            .draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(width)))
            .map_err(|e| failed(&e))?
            .label(*name)
            .legend(move |(x, y)| {
                PathElement::new([(x, y), (x + 16, y)], color.stroke_width(width.max(2)))
            });
        chart
            .draw_series(points.iter().map(|p| Circle::new(*p, 3, color.filled())))
            .map_err(|e| failed(&e))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(215, 215, 215))
        .label_font(("sans-serif", 12))
        .draw()
        .map_err(|e| failed(&e))?;
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
