//! What each radius rule and order keeps, level by level.

use crate::bake::Preparation;
use crate::bake::cluster::{self, Leaves, Tree};
use crate::bake::surfel::SurfelMaker;
use crate::header::BakeCounts;
use crate::options::{BakeOptions, Order};
use crate::size::SizeCode;
use crate::spheroid;
use forest_soup::TriangleSoup;
use rayon::prelude::*;
use std::ops::Range;

/// One level of a block: what a threshold draws, summed over cells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CutAudit {
    /// s_m as an area in block units².
    pub threshold: f64,
    /// Points drawn.
    pub points: u64,
    /// Mean projected area of what is drawn, over that of the surfels: opacity × footprint,
    /// averaged over directions. What leaves hide of each other is not counted as lost by
    /// [`crate::RadiusRule::Area`], and is by [`crate::RadiusRule::Opacity`].
    pub area_kept: f64,
    /// Points drawn together with an ancestor of theirs.
    pub under_ancestor: u64,
    /// Share of the surfels' area that nothing represents.
    pub missing: f64,
    /// Share of the surfels' area that is represented more than once.
    pub doubled: f64,
}

/// Audits the cuts at thresholds a factor of four apart, from one surfel each to one point a cell,
/// under the options' radius rule and order. `ratio` is s_M / s_m: it ends the paper's range.
/// Triangles are not drawn: above s_M the exact order draws surfels.
///
/// # Errors
/// As [`crate::bake()`].
pub fn audit(
    soup: &TriangleSoup,
    options: &BakeOptions,
    ratio: f64,
) -> Result<Vec<CutAudit>, crate::BakeError> {
    let ready = Preparation::of_soup(soup, options)?;
    let near = ready.cells.batch(0..ready.cells.len())?;
    let shader = ready.shader();
    let cells: Vec<Vec<Sums>> = (0..ready.cells.len())
        .into_par_iter()
        .map_init(
            || SurfelMaker::new(&shader),
            |maker, c| {
                let cell = near.cell(c);
                let counts = &mut BakeCounts::default();
                let (surfels, _) = ready.baker.surfels(&cell, maker, counts);
                if surfels.is_empty() {
                    return vec![];
                }
                let quantiser = ready.baker.lattice.quantiser(cell.bounds(&ready.baker.frame));
                let rules = ready.baker.rules(Leaves::Surfels(&surfels), quantiser);
                let mut tree = Tree::with_parents();
                cluster::build(&rules, &mut tree);
                LEVELS.map(|l| sums(&tree, threshold(l), ratio, options.order)).collect()
            },
        )
        .collect();
    if cells.iter().all(Vec::is_empty) {
        return Err(crate::BakeError::NothingVisible(ready.counts));
    }
    let levels = LEVELS.enumerate().map(|(k, l)| {
        let mut sum = Sums::default();
        cells.iter().filter_map(|c| c.get(k)).for_each(|s| sum.add(s));
        CutAudit {
            threshold: threshold(l),
            points: sum.points,
            area_kept: sum.drawn / sum.base,
            under_ancestor: sum.under_ancestor,
            missing: sum.missing / sum.base,
            doubled: sum.doubled / sum.base,
        }
    });
    Ok(levels.collect())
}

/// Thresholds 4^l, from far below a leaf to the block's size.
const LEVELS: Range<i32> = -14..1;

fn threshold(level: i32) -> f64 {
    f64::from(2 * level).exp2()
}

#[derive(Default)]
struct Sums {
    points: u64,
    drawn: f64,
    base: f64,
    under_ancestor: u64,
    missing: f64,
    doubled: f64,
}

impl Sums {
    fn add(&mut self, o: &Self) {
        self.points += o.points;
        self.drawn += o.drawn;
        self.base += o.base;
        self.under_ancestor += o.under_ancestor;
        self.missing += o.missing;
        self.doubled += o.doubled;
    }
}

fn sums(tree: &Tree, threshold: f64, ratio: f64, order: Order) -> Sums {
    let parents = tree.parents.as_ref().expect("an audited tree has parents");
    let fine = SizeCode::at_most(threshold);
    let range = SizeCode::at_least(threshold)
        ..=SizeCode::at_most(threshold * ratio).unwrap_or(SizeCode::MIN);
    let draws = |i: usize| {
        let p = &tree.records[i];
        match order {
            Order::Exact => Some(p.parent()) > fine && (p.is_leaf() || Some(p.own()) <= fine),
            Order::Paper => range.contains(&p.own()),
        }
    };
    let area = |i: usize| {
        let p = &tree.records[i];
        spheroid::mean_projected_area(p.own().radius(), p.flatness_step(), p.opacity())
    };
    let mut s = Sums::default();
    for (i, record) in tree.records.iter().enumerate() {
        let drawn = draws(i);
        if drawn {
            s.points += 1;
            s.drawn += area(i);
        }
        if !drawn && !record.is_leaf() {
            continue;
        }
        let mut above = 0;
        let mut at = i;
        while parents[at] as usize != at {
            at = parents[at] as usize;
            above += u32::from(draws(at));
        }
        s.under_ancestor += u64::from(drawn && above > 0);
        if record.is_leaf() {
            s.base += area(i);
            match above + u32::from(drawn) {
                0 => s.missing += area(i),
                1 => {}
                _ => s.doubled += area(i),
            }
        }
    }
    s
}

#[cfg(test)]
mod tests;
