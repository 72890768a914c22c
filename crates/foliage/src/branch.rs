//! Branches: the skeleton cut into limbs, each hanging on another.

use crate::skeleton::Rings;
use crate::wood_graph::WoodGraph;
use glam::DVec3;

/// A limb from where it leaves its parent to its tip.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Branch {
    /// The branch that it grows from; `None` for the trunk.
    pub(crate) parent: Option<u32>,
    /// Where it leaves its parent: length along that from its base.
    pub(crate) at: f64,
    /// 0 for the trunk, one more than the parent's for others.
    pub(crate) order: u32,
    /// Its middle line from base to tip, two points or more, about the soup's origin. The first lies
    /// on the parent's line.
    pub(crate) line: Vec<DVec3>,
    /// Radius of the wood at each point of the line.
    pub(crate) radii: Vec<f64>,
    /// Length along the line of each of its points; starts at 0.
    pub(crate) along: Vec<f64>,
}

/// A place on a branch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct OnBranch {
    /// Number of the branch.
    pub(crate) branch: u32,
    /// Length along it from its base.
    pub(crate) at: f64,
}

/// All branches of a tree; parents come before their children, the trunk first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Branches {
    /// The branches.
    pub(crate) branches: Vec<Branch>,
}

impl Branch {
    /// Length of the line.
    pub(crate) fn length(&self) -> f64 {
        *self.along.last().expect("a line has points")
    }

    /// Radius at the base.
    pub(crate) fn base_radius(&self) -> f64 {
        // The first point lies inside the parent.
        self.radii[1.min(self.radii.len() - 1)]
    }

    /// Place, direction and radius `at` along.
    pub(crate) fn sample(&self, at: f64) -> (DVec3, DVec3, f64) {
        let i = self.along.partition_point(|&a| a <= at).clamp(1, self.along.len() - 1);
        let (from, to) = (self.along[i - 1], self.along[i]);
        let t = if to > from { ((at - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
        let direction = (self.line[i] - self.line[i - 1]).normalize_or(DVec3::Y);
        let radius = self.radii[i - 1] + (self.radii[i] - self.radii[i - 1]) * t;
        (self.line[i - 1].lerp(self.line[i], t), direction, radius)
    }

    /// How far along its nearest point to `p` lies.
    pub(crate) fn nearest(&self, p: DVec3) -> f64 {
        let mut best = (f64::INFINITY, 0.0);
        for i in 1..self.line.len() {
            let (a, b) = (self.line[i - 1], self.line[i]);
            let t = ((p - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE))
                .clamp(0.0, 1.0);
            let d = p.distance_squared(a.lerp(b, t));
            if d < best.0 {
                best = (d, self.along[i - 1] + (self.along[i] - self.along[i - 1]) * t);
            }
        }
        best.1
    }

    fn new(parent: Option<u32>, at: f64, order: u32, points: &[(DVec3, f64)]) -> Self {
        let mut along = vec![0.0];
        for w in points.windows(2) {
            along.push(along[along.len() - 1] + w[0].0.distance(w[1].0));
        }
        let (line, radii) = points.iter().copied().unzip();
        Self { parent, at, order, line, radii, along }
    }
}

impl Branches {
    /// One straight trunk from `base` to `tip`, for trees of leaves alone.
    pub(crate) fn trunk(base: DVec3, tip: DVec3, radius: f64) -> Self {
        let points = [(base, radius), (tip, 0.5 * radius)];
        Self { branches: vec![Branch::new(None, 0.0, 0, &points)] }
    }

    /// Cuts rings into branches, and says where on them each ring lies. Where a limb forks it goes on
    /// into the arm that bears more wood. Stubs shorter than their parent is thick are no branches.
    pub(crate) fn of(rings: &Rings) -> (Self, Vec<OnBranch>) {
        let n = rings.rings.len();
        let step = |r: usize| {
            let ring = &rings.rings[r];
            ring.parent.map_or(0.0, |p| ring.center.distance(rings.rings[p as usize].center))
        };
        // Wood and way to the farthest tip above each ring, its own piece included.
        let (mut wood, mut reach) = (vec![0.0; n], vec![0.0f64; n]);
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); n];
        for r in (0..n).rev() {
            wood[r] += step(r) * rings.rings[r].radius;
            reach[r] += step(r);
            if let Some(p) = rings.rings[r].parent.map(|p| p as usize) {
                wood[p] += wood[r];
                reach[p] = reach[p].max(reach[r]);
                children[p].push(r);
            }
        }
        let mut out = Self::default();
        let mut places = vec![OnBranch::default(); n];
        // First rings of branches that are yet to be walked, with the ring before them.
        let mut starts: Vec<(usize, usize, Option<u32>)> = Vec::new();
        let roots: Vec<usize> = (0..n).filter(|r| rings.rings[*r].parent.is_none()).collect();
        roots.iter().for_each(|&r| starts.push((r, r, None)));
        let mut next = 0;
        while let Some(&(before, first, parent)) = starts.get(next) {
            next += 1;
            let mut points = Vec::new();
            let at = places[before].at;
            let thick = rings.rings[before].radius;
            let number = out.branches.len() as u32;
            let is_stub = parent.is_some() && reach[first] < STUB * thick;
            let point = |r: usize| (rings.rings[r].center, rings.rings[r].radius);
            if before != first {
                points.push(point(before));
            }
            let mut r = first;
            let mut way =
                points.first().map_or(0.0, |p: &(DVec3, f64)| p.0.distance(point(first).0));
            loop {
                points.push(point(r));
                places[r] = match (is_stub, parent) {
                    (true, Some(branch)) => OnBranch { branch, at },
                    _ => OnBranch { branch: number, at: way },
                };
                let on = children[r]
                    .iter()
                    .copied()
                    .max_by(|a, b| wood[*a].total_cmp(&wood[*b]).then(b.cmp(a)));
                let arms = children[r].iter().copied().filter(|c| Some(*c) != on);
                // Arms of a stub hang where it does.
                let own = if is_stub { parent } else { Some(number) };
                arms.for_each(|c| starts.push((r, c, own)));
                let Some(on) = on else { break };
                way += point(r).0.distance(point(on).0);
                r = on;
            }
            if is_stub {
                continue;
            }
            if points.len() < 2 {
                // A single ring: as long as it is wide.
                let (p, radius) = points[0];
                points.push((p + DVec3::Y * radius.max(f64::MIN_POSITIVE), radius));
            }
            let order = parent.map_or(0, |p| out.branches[p as usize].order + 1);
            out.branches.push(Branch::new(parent, at, order, &points));
        }
        (out, places)
    }

    /// Where on the branches each corner of the graph lies.
    pub(crate) fn places(
        &self,
        graph: &WoodGraph,
        rings: &Rings,
        of_rings: &[OnBranch],
    ) -> Vec<OnBranch> {
        let corner = |(p, &r): (&DVec3, &u32)| {
            let branch = of_rings[r as usize].branch;
            OnBranch { branch, at: self.branches[branch as usize].nearest(*p) }
        };
        graph.positions.iter().zip(&rings.of).map(corner).collect()
    }
}

/// Stubs reach less far than this many radii of their parent.
const STUB: f64 = 1.5;
