//! An evaluation for people and programs: text, CSV, plots and one HTML page.

mod csv;
mod gallery;
mod html;
mod plot;
mod text;

pub use csv::csv;
pub use gallery::{Exhibit, gallery};
pub use html::html;
pub use plot::{Axis, plot};
pub use text::text;

/// A number for people: three digits that count.
pub(crate) fn short(v: f64) -> String {
    let digits = match v.abs() {
        a if a >= 100.0 || a == 0.0 => 0,
        a if a >= 10.0 => 1,
        a if a >= 1.0 => 2,
        a if a >= 0.1 => 3,
        _ => 4,
    };
    format!("{v:.digits$}")
}

/// A count with separators.
pub(crate) fn count(v: f64) -> String {
    let digits = format!("{v:.0}");
    let n = digits.len();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (n - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(c);
    }
    out
}

/// A knob for people.
pub(crate) fn knob(k: crate::Knob) -> String {
    match k {
        crate::Knob::Points { s_max: 0.0, .. } => "triangles".into(),
        crate::Knob::Points { s_m, k: 0.0, .. } => format!("s_m {} px²", short(s_m)),
        crate::Knob::Points { s_m, k, .. } => format!("s_m {} px², k {}", short(s_m), short(k)),
        crate::Knob::Views { texels, .. } => format!("{texels}² texels"),
        crate::Knob::Volume { level } | crate::Knob::Foliage { level } => {
            format!("level {level}")
        }
        crate::Knob::Share(share) => format!("{} %", short(100.0 * share)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people() {
        let shown = [0.0, 0.012_34, 0.1234, 1.234, 12.34, 1234.5].map(short);
        assert_eq!(shown, ["0", "0.0123", "0.123", "1.23", "12.3", "1234"]);
        assert_eq!(
            [7.0, 999.0, 1234.0, 1_234_567.0].map(count),
            ["7", "999", "1,234", "1,234,567"]
        );
    }
}
