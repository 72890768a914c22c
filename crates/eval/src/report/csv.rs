//! One line a picture.

use crate::contender::Knob;
use crate::evaluation::Evaluation;
use std::fmt::Write;

/// The rows of an evaluation as comma-separated values with a header line. What is null is empty.
pub fn csv(e: &Evaluation) -> String {
    let mut out = String::from(
        "contender,height,view,elevation,s_m,s_max,k,share,texels,lookup,level,primitives,bytes,select_ns,render_ms,\
         rmse,psnr,ssim,flip,coverage,coverage_ratio,silhouette_iou,depth\n",
    );
    let some = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
    for r in &e.rows {
        let knob = match r.knob {
            Knob::Points { s_m, s_max, k } => format!("{s_m},{s_max},{k},,,,"),
            Knob::Share(share) => format!(",,,{share},,,"),
            Knob::Views { texels, lookup } => format!(",,,,{texels},{lookup:?},").to_lowercase(),
            Knob::Volume { level } | Knob::Foliage { level } => format!(",,,,,,{level}"),
        };
        let (c, x) = (&r.cost, &r.errors);
        let elevation = e.views[r.view as usize].elevation;
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "{},{},{},{elevation},{knob},{},{},{},{},{},{},{},{},{},{},{},{}",
            r.contender,
            r.height,
            r.view,
            c.primitives,
            c.bytes,
            some(c.select_ns),
            some(c.render_ms),
            x.rmse,
            some(x.psnr),
            x.ssim,
            x.flip,
            x.coverage,
            some(x.coverage_ratio),
            x.silhouette_iou,
            some(x.depth),
        );
    }
    out
}
