//! Pictures to look at: source, level, difference and FLIP side by side.

use crate::contender::{Contender, Knob};
use crate::error::EvalError;
use crate::frame::held_out_views;
use crate::metrics::{Comparison, Errors};
use crate::plan::{BACKGROUND, Plan};
use crate::sweep::{Row, Sweep};
use crate::truth::Truth;
use forest_raster::{Picture, Style};
use image::{ImageFormat, RgbImage};
use std::io::Cursor;

/// One contender's picture beside the source's, as PNG files of one size.
pub struct Exhibit {
    /// Name of the contender.
    pub contender: String,
    /// Setting of its knob.
    pub knob: Knob,
    /// Primitives drawn.
    pub primitives: f64,
    /// Errors of the picture that is shown: drawn at its own height.
    pub errors: Errors,
    /// Source, level, difference × 2 and FLIP heat, cropped to what they show.
    pub pictures: [Vec<u8>; 4],
}

/// Height at which pictures are shown, if the plan goes that far.
const SHOWN: u32 = 256;

/// For every contender the picture whose number of primitives is nearest to that of the pack's middle
/// setting, in the middle view.
///
/// # Errors
/// When a picture cannot be encoded.
pub fn gallery(
    truth: &Truth,
    contenders: &[Contender],
    plan: &Plan,
    sweep: &Sweep,
) -> Result<Vec<Exhibit>, EvalError> {
    let height = plan.heights.iter().copied().find(|h| *h <= SHOWN).unwrap_or(plan.heights[0]);
    let v = plan.views / 2;
    let view = held_out_views(plan.views)[v as usize];
    let side = truth.frame.side(f64::from(height), 1);
    let source = truth.picture(&view, f64::from(height), side);
    let camera = truth.frame.camera(&view, f64::from(height), side);
    let style = Style { sampling: plan.sampling, light: plan.light };
    let of = |name: &str| -> Vec<&Row> {
        let rows = sweep.rows.iter();
        rows.filter(|r| r.contender == name && r.height == height && r.view == v).collect()
    };
    let own = of("pack");
    let Some(wanted) = own.get(own.len() / 2).map(|r| r.cost.primitives) else {
        return Ok(vec![]);
    };
    let mut exhibits = Vec::new();
    for c in contenders {
        let far = |r: &Row| (r.cost.primitives.max(0.5) / wanted.max(0.5)).ln().abs();
        let rows = of(c.name);
        let Some(row) = rows.iter().min_by(|a, b| far(a).total_cmp(&far(b))) else { continue };
        let (picture, _) = c.draw(&camera, row.knob, &style);
        exhibits.push(exhibit(row, &source, &picture, truth.frame.radius)?);
    }
    Ok(exhibits)
}

fn exhibit(
    row: &Row,
    source: &Picture,
    picture: &Picture,
    radius: f64,
) -> Result<Exhibit, EvalError> {
    let comparison = Comparison::new(source, picture);
    let (a, b) = comparison.pictures();
    let shown = [a, b].map(|p| p.over(BACKGROUND));
    let difference: Vec<[u8; 3]> = shown[0]
        .iter()
        .zip(&shown[1])
        .map(|(a, b)| std::array::from_fn(|k| a[k].abs_diff(b[k]).saturating_mul(2)))
        .collect();
    let (width, height, heat) = comparison.flip(BACKGROUND).heat();
    let [source, level] = shown;
    let encode = |pixels: Vec<[u8; 3]>| png(width, height, &pixels);
    Ok(Exhibit {
        contender: row.contender.clone(),
        knob: row.knob,
        primitives: row.cost.primitives,
        errors: comparison.errors(BACKGROUND, radius),
        pictures: [encode(source)?, encode(level)?, encode(difference)?, encode(heat)?],
    })
}

fn png(width: u32, height: u32, pixels: &[[u8; 3]]) -> Result<Vec<u8>, EvalError> {
    let failed = |what: String| EvalError::Report(what);
    // An empty box still is a picture.
    let image = if pixels.is_empty() {
        RgbImage::new(1, 1)
    } else {
        RgbImage::from_raw(width, height, pixels.as_flattened().to_vec())
            .ok_or_else(|| failed("a picture of another size".into()))?
    };
    let mut out = Cursor::new(Vec::new());
    image.write_to(&mut out, ImageFormat::Png).map_err(|e| failed(e.to_string()))?;
    Ok(out.into_inner())
}
