//! One level: thick branches, sheets of thin ones, cards of leaves.

use crate::branch::OnBranch;
use crate::hang::{Gale, Grown, mover, shares};
use crate::header::WoodWay;
use crate::leaf::{Card, Leaf, cards, clusters};
use crate::mesh::Mesh;
use crate::panel::Panel;
use crate::sheet::sheets;
use crate::thick::{WoodErrors, thick};
use crate::visible::Visible;
use crate::wood::Wood;
use forest_raster::Surfaces;
use forest_soup::TriangleSoup;
use glam::DVec3;
use rayon::prelude::*;

/// What levels are made of.
pub(crate) struct Tree<'a> {
    pub(crate) soup: &'a TriangleSoup,
    pub(crate) surfaces: &'a Surfaces,
    pub(crate) wood: &'a Wood,
    pub(crate) leaves: &'a [Leaf],
    /// What is seen of the soup.
    pub(crate) visible: &'a Visible,
    /// How its branches move.
    pub(crate) gale: &'a Gale,
}

/// A panel in the tree.
pub(crate) struct Placed {
    pub(crate) panel: Panel,
    /// The branch record that moves it, and the share of its length of each corner of the grid.
    pub(crate) on: u32,
    pub(crate) along: Vec<f32>,
    /// Where it hangs; leaves turn about it, sheets do not turn.
    pub(crate) pivot: Option<DVec3>,
    pub(crate) openness: f64,
}

/// A level as it is baked.
pub(crate) struct Level {
    pub(crate) texel: f64,
    pub(crate) thick: Mesh,
    pub(crate) way: WoodWay,
    pub(crate) errors: [WoodErrors; 2],
    pub(crate) tubes: u32,
    pub(crate) hidden: u32,
    /// Sheets first, then cards.
    pub(crate) panels: Vec<Placed>,
    pub(crate) sheets: u32,
}

/// Radius in texels below which branches are thin.
const THIN: f64 = 0.75;

/// Groups of thin branches whose box is smaller than this many texels lie on cards with the leaves.
const SMALL_GROUP: f64 = 12.0;

/// Extent in texels of what lies on one card.
pub(crate) const CARD: f64 = 16.0;

/// Texels before a panel in which its own leaves lie.
const OWN: f64 = 0.5 * CARD;

/// What is seen of less than this many texels is left out.
const UNSEEN: f64 = 1.0;

impl Tree<'_> {
    /// The level for texels of this size.
    pub(crate) fn level(&self, texel: f64) -> Level {
        let Self { soup, surfaces, wood, .. } = *self;
        let groups = wood.groups(THIN * texel);
        let is_seen = |triangles: &[u32]| {
            triangles.iter().map(|&i| self.visible.areas[i as usize]).sum::<f64>()
                >= UNSEEN * texel * texel
        };
        let mut hidden = 0;
        let mut which = Vec::new();
        let mut thin: Vec<Vec<u32>> = vec![Vec::new(); groups.len()];
        for (i, group) in (0u32..).zip(&groups) {
            let own = &wood.triangles[i as usize];
            match group {
                Some(g) => thin[*g as usize].extend(own),
                None if own.is_empty() => {}
                None if is_seen(own) => which.push(i),
                None => hidden += 1,
            }
        }
        let (mut mesh, way, errors) = thick(soup, surfaces, wood, &which, texel);
        // A texel before the surface, as that is not quite the source's.
        mesh.vertices.par_iter_mut().for_each(|v| {
            let before = v.position + v.normal * texel;
            v.skylit = self.visible.skylit(before, v.normal, texel);
        });
        let mut twigs: Vec<Leaf> = Vec::new();
        let mut large: Vec<(u32, Vec<u32>)> = Vec::new();
        for (g, triangles) in (0u32..).zip(thin).filter(|(_, t)| !t.is_empty()) {
            if !is_seen(&triangles) {
                hidden += 1;
            } else if extent(soup, &triangles) < SMALL_GROUP * texel {
                twigs.push(self.twig(g, triangles));
            } else {
                large.push((g, triangles));
            }
        }
        let sheets = large.into_par_iter().flat_map_iter(|(g, triangles)| {
            // The branch itself moves a sheet, so that its base stays where it grows.
            let on = wood.rig.place(OnBranch { branch: g, at: 0.0 }).0;
            let grown = self.grown(&triangles);
            sheets(soup, surfaces, &triangles, texel)
                .into_iter()
                .map(move |panel| self.placed(panel, on, &grown, None))
        });
        let mut panels: Vec<Placed> = sheets.collect();
        let sheets = panels.len() as u32;
        panels.extend(self.cards(twigs, texel));
        let tubes = which.len() as u32;
        Level { texel, thick: mesh, way, errors, tubes, hidden, panels, sheets }
    }

    /// A small group of thin branches, as something that lies on a card.
    fn twig(&self, branch: u32, triangles: Vec<u32>) -> Leaf {
        let soup = self.soup;
        let mut tensor = crate::tensor::NormalTensor::default();
        let mut center = DVec3::ZERO;
        for &i in &triangles {
            let [a, b, c] = soup.corners(i as usize).map(|p| p.as_dvec3());
            let cross = (b - a).cross(c - a);
            tensor.add(cross);
            center += (a + b + c) / 3.0 * (0.5 * cross.length());
        }
        let base = &self.wood.branches.branches[branch as usize];
        let middle = OnBranch { branch, at: 0.5 * base.length() };
        Leaf {
            triangles,
            center: center / tensor.area.max(f64::MIN_POSITIVE),
            area: tensor.area,
            // Across its thinnest side: tubes face all ways but along.
            facing: tensor.axes().1.x_axis,
            turns: false,
            on: self.wood.rig.place(middle),
            pivot: base.line[0],
        }
    }

    /// Where triangles of wood grow.
    fn grown(&self, triangles: &[u32]) -> Vec<Grown> {
        let grown = |&i: &u32| {
            let corners = self.soup.corners(i as usize).map(|p| p.as_dvec3());
            let [a, b, c] = corners;
            Grown {
                place: corners.iter().sum::<DVec3>() / 3.0,
                area: 0.5 * (b - a).cross(c - a).length(),
                on: self.wood.rig.place(self.wood.corners(i)[0]),
            }
        };
        triangles.iter().map(grown).collect()
    }

    fn placed(&self, panel: Panel, on: u32, grown: &[Grown], pivot: Option<DVec3>) -> Placed {
        let corners: Vec<DVec3> = panel.corners().map(|c| c.0).collect();
        let along = shares(&self.wood.rig.records, on, grown, &corners, panel.texel);
        Placed { on, along, pivot, openness: self.openness(&panel), panel }
    }

    /// Share of the sky that a panel sees: its middle, and halfway to its corners.
    fn openness(&self, panel: &Panel) -> f64 {
        let half = panel.half() * 0.5;
        let at =
            |x: f64, y: f64| panel.center + panel.axes * DVec3::new(x * half.x, y * half.y, 0.0);
        let places = [at(0.0, 0.0), at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
        self.visible.openness(&places, OWN * panel.texel)
    }

    /// Cards of leaves and twigs.
    fn cards(&self, twigs: Vec<Leaf>, texel: f64) -> Vec<Placed> {
        let mut all = self.leaves.to_vec();
        all.extend(twigs);
        let clusters = clusters(&all, CARD * texel);
        let cards: Vec<Card> =
            clusters.par_iter().flat_map_iter(|c| cards(self.soup, &all, c)).collect();
        let placed = cards.par_iter().filter_map(|card| {
            let panel = Panel::of_card(self.soup, self.surfaces, &all, card, texel)?;
            let area: f64 = card.leaves.iter().map(|&i| all[i as usize].area).sum();
            let weighted =
                card.leaves.iter().map(|&i| all[i as usize].pivot * all[i as usize].area);
            let pivot = weighted.sum::<DVec3>() / area.max(f64::MIN_POSITIVE);
            let grown: Vec<Grown> = card.leaves.iter().map(|&i| all[i as usize].grown()).collect();
            let on = mover(&self.wood.rig.records, self.gale, &grown);
            Some(self.placed(panel, on, &grown, Some(pivot)))
        });
        placed.collect()
    }
}

fn extent(soup: &TriangleSoup, triangles: &[u32]) -> f64 {
    let corners = triangles.iter().flat_map(|&i| soup.corners(i as usize));
    let (min, max) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
        (min.min(p.as_dvec3()), max.max(p.as_dvec3()))
    });
    (max - min).max_element()
}
