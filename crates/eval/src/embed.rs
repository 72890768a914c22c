//! The measured table that a pack carries.

use crate::contender::Knob;
use crate::evaluation::Summary;
use crate::frame::Band;
use crate::plan::Plan;
use crate::sweep::{Row, Sweep};
use forest_pack::kind;
use forest_pack::measures::{Light, Measure, Measures};

/// The rows of the pack's own contenders (with and without depth bias), means by band of elevation.
pub fn measures(sweep: &Sweep, plan: &Plan) -> Measures {
    let mut rows: Vec<Measure> = Vec::new();
    for band in [Band::Level, Band::Oblique, Band::High] {
        let mut groups: Vec<Vec<&Row>> = Vec::new();
        for row in &sweep.rows {
            if !is_own(&row.contender) || sweep.views[row.view as usize].band != band {
                continue;
            }
            match groups.iter_mut().find(|g| g[0].knob == row.knob && g[0].height == row.height) {
                Some(group) => group.push(row),
                None => groups.push(vec![row]),
            }
        }
        rows.extend(groups.iter().filter_map(|g| measure(&Summary::new(g), band, plan)));
    }
    let method = format!(
        "{}: {} held-out views, parallel, {} samples a pixel at {} px and more below, over linear grey {}",
        plan.light_name(),
        plan.views,
        plan.sampling.count(),
        plan.heights[0],
        crate::BACKGROUND,
    );
    Measures { method, rows }
}

/// Whether a contender draws what is in the pack as it is.
pub(crate) fn is_own(name: &str) -> bool {
    ["pack", "triangles", "bias-1/4", "bias-1"].contains(&name)
        || name.starts_with("views")
        || ["volume", "foliage"].contains(&name)
}

fn measure(s: &Summary, band: Band, plan: &Plan) -> Option<Measure> {
    let (representation, level) = match s.row.knob {
        Knob::Points { s_m, s_max, k } => (kind::POINTS_HEADER, [s_m, s_max, k].map(|v| v as f32)),
        Knob::Views { texels, lookup } => {
            (kind::VIEWS_HEADER, [texels as f32, f32::from(lookup as u8), 0.0])
        }
        Knob::Volume { level } => (kind::VOLUME_HEADER, [level as f32, 0.0, 0.0]),
        Knob::Foliage { level } => (kind::FOLIAGE_HEADER, [level as f32, 0.0, 0.0]),
        Knob::Share(_) => return None,
    };
    Some(Measure {
        representation,
        level,
        pixel_height: s.row.height as f32,
        elevation: band.range(),
        light: match plan.light {
            forest_raster::Light::Albedo => Light::Albedo,
            forest_raster::Light::Sun(_) => Light::Sun,
        },
        primitives: s.primitives as f32,
        bytes: s.bytes as f32,
        rmse: s.errors.rmse as f32,
        rmse_worst: s.worst[1] as f32,
        flip: s.errors.flip as f32,
        flip_worst: s.worst[0] as f32,
        ssim: s.errors.ssim as f32,
        coverage: s.errors.coverage_ratio.unwrap_or(0.0) as f32,
    })
}
