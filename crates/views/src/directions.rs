//! Where views are taken from, which of them is nearest, and which three to blend.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};

/// How views are spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Layout {
    /// Rings of equal elevation steps with as many views each, from the horizon up, and one view
    /// at the pole (paper 001, section 3.3, whose topmost ring is that one view many times).
    Rings {
        /// Rings from the horizon up, without the pole.
        rings: u32,
        /// Views on each ring.
        points: u32,
    },
    /// Points of a square grid, folded onto the octahedron, edges included. View
    /// `row·side + column` has u = column/(side−1), v = row/(side−1). On the upper half its
    /// direction is (u − v, 1 − |u − v| − |u + v − 1|, u + v − 1), normalised: the layout of the
    /// impostors of Unreal, Godot and three.js. On the full sphere x = 2u − 1, z = 2v − 1 and what
    /// lies outside of |x| + |z| = 1 is folded down.
    Octahedral {
        /// Views along a side of the grid.
        side: u32,
    },
}

/// Which directions have views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Dome {
    /// From the horizon up.
    Upper,
    /// All around.
    Full,
}

/// The directions of an atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Directions {
    /// How they are spread.
    pub layout: Layout,
    /// How far.
    pub dome: Dome,
}

/// Three views and their shares, which add to one; a share may be 0.
pub type Blend = [(u32, f32); 3];

/// No atlas has more views.
pub const MAX_VIEWS: u32 = 1 << 14;

impl Directions {
    /// The largest octahedral grid of at most `views` views; at least 2 × 2.
    pub fn octahedral(views: u32, dome: Dome) -> Self {
        Self { layout: Layout::Octahedral { side: views.isqrt().max(2) }, dome }
    }

    /// Rings of at most `views` views (at least 5), with the least distance between a direction and its
    /// nearest view.
    pub fn rings(views: u32, dome: Dome) -> Self {
        let views = views.max(5);
        let of = |rings: u32| {
            let all = match dome {
                Dome::Upper => (views - 1) / rings,
                Dome::Full => (views - 2) / (2 * rings - 1),
            };
            Layout::Rings { rings, points: all }
        };
        let gap = |layout: &Layout| match *layout {
            Layout::Rings { rings, points } => {
                (FRAC_PI_2 / f64::from(rings)).hypot(TAU / f64::from(points.max(1)))
            }
            Layout::Octahedral { .. } => f64::INFINITY,
        };
        let best = (1..=views.clamp(4, MAX_VIEWS) / 3)
            .map(of)
            .filter(|l| matches!(l, Layout::Rings { points, .. } if *points >= 3))
            .min_by(|a, b| gap(a).total_cmp(&gap(b)));
        Self { layout: best.unwrap_or(Layout::Rings { rings: 1, points: 3 }), dome }
    }

    /// Number of views.
    pub fn count(&self) -> u32 {
        match (self.layout, self.dome) {
            (Layout::Rings { rings, points }, Dome::Upper) => rings * points + 1,
            (Layout::Rings { rings, points }, Dome::Full) => (2 * rings - 1) * points + 2,
            (Layout::Octahedral { side }, _) => side * side,
        }
    }

    /// Checks the ranges of the layout.
    ///
    /// # Errors
    /// What is wrong, with value and limit.
    pub fn validate(&self) -> Result<(), String> {
        let (name, small, count) = match self.layout {
            Layout::Rings { rings, points } => {
                let small = (rings < 1).then_some(("rings", rings, 1));
                let small = small.or((points < 3).then_some(("points a ring", points, 3)));
                let all = (2 * u64::from(rings)).saturating_mul(points.into()).saturating_add(2);
                ("rings", small, all / if self.dome == Dome::Upper { 2 } else { 1 })
            }
            Layout::Octahedral { side } => {
                let small = (side < 2).then_some(("views a side", side, 2));
                ("octahedral", small, u64::from(side).pow(2))
            }
        };
        match small {
            Some((what, value, least)) => Err(format!("{value} {what}; at least {least}")),
            None if count > u64::from(MAX_VIEWS) => {
                Err(format!("{count} views in layout {name}; the limit is {MAX_VIEWS}"))
            }
            None => Ok(()),
        }
    }

    /// Unit vector from the tree towards the camera of view `i`; y is up.
    pub fn direction(&self, i: u32) -> DVec3 {
        match self.layout {
            Layout::Rings { rings, points } => {
                let (ring, point) = self.ring_of(i, rings, points);
                let elevation = f64::from(ring) * FRAC_PI_2 / f64::from(rings);
                if ring.unsigned_abs() == rings {
                    return DVec3::Y * f64::from(ring.signum());
                }
                let (sin, cos) = (f64::from(point) * TAU / f64::from(points)).sin_cos();
                let (up, flat) = elevation.sin_cos();
                DVec3::new(sin * flat, up, cos * flat)
            }
            Layout::Octahedral { side } => {
                let at = |n: u32| f64::from(n) / f64::from(side - 1);
                self.unfolded(DVec2::new(at(i % side), at(i / side)))
            }
        }
    }

    /// The view whose direction is nearest to `d` of those around its place in the layout, by
    /// arithmetic: at most an eighth farther away than the nearest of all, unless rings are much
    /// closer than the views on them. Below an upper dome, that of the horizon below which it lies.
    pub fn nearest(&self, d: DVec3) -> u32 {
        let d = self.within(d);
        match self.layout {
            Layout::Rings { rings, points } => {
                let (ring, turn) = ring_place(d, rings, points);
                // The nearest view of a ring has the nearest azimuth.
                let lower = ring.floor() as i32;
                let near = |ring| self.ring_view(ring, turn.round() as i64, rings, points);
                let [a, b] = [lower, (lower + 1).min(rings as i32)].map(near);
                if self.direction(b).dot(d) > self.direction(a).dot(d) { b } else { a }
            }
            Layout::Octahedral { side } => {
                let (cell, _) = grid_place(self.folded(d), side);
                let corners = [0, 1, 2, 3].map(|k: u32| (cell.1 + k / 2) * side + cell.0 + k % 2);
                let closeness = |i: &u32| self.direction(*i).dot(d);
                corners
                    .into_iter()
                    .max_by(|a, b| closeness(a).total_cmp(&closeness(b)))
                    .unwrap_or(0)
            }
        }
    }

    /// The three views around `d` and their shares: barycentric in the triangle of the grid that
    /// holds `d`, so that they change without steps.
    pub fn blend(&self, d: DVec3) -> Blend {
        let d = self.within(d);
        match self.layout {
            Layout::Rings { rings, points } => {
                let (ring, turn) = ring_place(d, rings, points);
                let lower = (ring.floor() as i32).clamp(-(rings as i32), rings as i32 - 1);
                let (up, first) = ((ring - f64::from(lower)) as f32, turn.floor());
                let aside = (turn - first) as f32;
                let view =
                    |dr: i32, dp: i64| self.ring_view(lower + dr, first as i64 + dp, rings, points);
                if lower + 1 == rings as i32 {
                    let down = 1.0 - up;
                    return [
                        (view(1, 0), up),
                        (view(0, 0), down * (1.0 - aside)),
                        (view(0, 1), down * aside),
                    ];
                }
                if lower == -(rings as i32) {
                    return [
                        (view(0, 0), 1.0 - up),
                        (view(1, 0), up * (1.0 - aside)),
                        (view(1, 1), up * aside),
                    ];
                }
                let [near, middle, far] = triangle_shares(aside, up);
                let corner = if aside > up { view(0, 1) } else { view(1, 0) };
                [(view(0, 0), near), (corner, middle), (view(1, 1), far)]
            }
            Layout::Octahedral { side } => {
                let ((x, y), [fx, fy]) = grid_place(self.folded(d), side);
                let [near, middle, far] = triangle_shares(fx, fy);
                let corner = if fx > fy { y * side + x + 1 } else { (y + 1) * side + x };
                [(y * side + x, near), (corner, middle), ((y + 1) * side + x + 1, far)]
            }
        }
    }

    /// `d` as a unit vector that has views around it.
    fn within(&self, d: DVec3) -> DVec3 {
        let d = d.normalize_or(DVec3::Z);
        match self.dome {
            Dome::Upper if d.y < 0.0 => DVec3::new(d.x, 0.0, d.z).normalize_or(DVec3::Z),
            _ => d,
        }
    }

    /// Ring (negative below the horizon) and place on it of view `i`.
    fn ring_of(&self, i: u32, rings: u32, points: u32) -> (i32, u32) {
        let lowest = match self.dome {
            Dome::Upper => 0,
            Dome::Full => 1 - rings as i32,
        };
        let row = i / points;
        let rows = (rings as i32 - lowest) as u32;
        if row < rows {
            return (lowest + row as i32, i % points);
        }
        // After the rings: the zenith, then the nadir.
        (if i == rows * points { rings as i32 } else { -(rings as i32) }, 0)
    }

    fn ring_view(&self, ring: i32, point: i64, rings: u32, points: u32) -> u32 {
        let lowest = match self.dome {
            Dome::Upper => 0,
            Dome::Full => 1 - rings as i32,
        };
        let rows = (rings as i32 - lowest) as u32;
        if ring >= rings as i32 {
            return rows * points;
        }
        if ring < lowest {
            return rows * points + u32::from(self.dome == Dome::Full);
        }
        (ring - lowest) as u32 * points + point.rem_euclid(i64::from(points)) as u32
    }

    /// Place in the unit square of a direction.
    fn folded(&self, d: DVec3) -> DVec2 {
        let o = d / (d.x.abs() + d.y.abs() + d.z.abs());
        let place = match self.dome {
            Dome::Upper => DVec2::new(o.x + o.z, o.z - o.x),
            Dome::Full if o.y < 0.0 => {
                let fold = |a: f64, b: f64| (1.0 - b.abs()).copysign(a);
                DVec2::new(fold(o.x, o.z), fold(o.z, o.x))
            }
            Dome::Full => DVec2::new(o.x, o.z),
        };
        place * 0.5 + 0.5
    }

    /// Direction of a place in the unit square.
    fn unfolded(&self, p: DVec2) -> DVec3 {
        let (x, z) = match self.dome {
            Dome::Upper => (p.x - p.y, p.x + p.y - 1.0),
            Dome::Full => (2.0 * p.x - 1.0, 2.0 * p.y - 1.0),
        };
        let y = 1.0 - x.abs() - z.abs();
        // Sums like ⅔ + ⅓ − 1 miss zero by a rounding: the edge of the upper half is the horizon.
        let y = if y.abs() < 1e-12 { 0.0 } else { y };
        let (x, z) = if y < 0.0 && self.dome == Dome::Full {
            ((1.0 - z.abs()).copysign(x), (1.0 - x.abs()).copysign(z))
        } else {
            (x, z)
        };
        DVec3::new(x, y.max(if self.dome == Dome::Upper { 0.0 } else { y }), z).normalize()
    }
}

/// Rings above the horizon and views along the ring, as fractions.
fn ring_place(d: DVec3, rings: u32, points: u32) -> (f64, f64) {
    let ring = d.y.clamp(-1.0, 1.0).asin() / FRAC_PI_2 * f64::from(rings);
    (ring, d.x.atan2(d.z) / TAU * f64::from(points))
}

/// The cell of a grid of `side²` points that holds a place of the unit square, and the place in it.
fn grid_place(p: DVec2, side: u32) -> ((u32, u32), [f32; 2]) {
    let at = (p * f64::from(side - 1)).clamp(DVec2::ZERO, DVec2::splat(f64::from(side - 1)));
    let cell = at.floor().min(DVec2::splat(f64::from(side - 2)));
    ((cell.x as u32, cell.y as u32), (at - cell).as_vec2().to_array())
}

/// Shares of the corners (0, 0), the one beside it, and (1, 1) at a place of the unit square.
fn triangle_shares(fx: f32, fy: f32) -> [f32; 3] {
    [1.0 - fx.max(fy), (fx - fy).abs(), fx.min(fy)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn all() -> Vec<Directions> {
        let layouts = [
            Layout::Rings { rings: 9, points: 33 },
            Layout::Rings { rings: 1, points: 3 },
            Layout::Octahedral { side: 17 },
            Layout::Octahedral { side: 2 },
            Layout::Octahedral { side: 12 },
        ];
        let both = |layout| [Dome::Upper, Dome::Full].map(|dome| Directions { layout, dome });
        layouts.into_iter().flat_map(both).collect()
    }

    #[test]
    fn every_view_is_its_own_nearest_and_blends_to_itself() {
        for d in all() {
            d.validate().unwrap();
            for i in 0..d.count() {
                let v = d.direction(i);
                assert!((v.length() - 1.0).abs() < 1e-12);
                assert!(d.dome == Dome::Full || v.y >= 0.0);
                let same = |n: u32| d.direction(n).distance(v) < 1e-9;
                assert!(same(d.nearest(v)), "{d:?} {i}");
                let shares = d.blend(v);
                let own: f32 = shares.iter().filter(|(n, _)| same(*n)).map(|s| s.1).sum();
                assert!((own - 1.0).abs() < 1e-4, "{d:?} {i} {shares:?}");
            }
        }
    }

    #[test]
    fn the_issue_s_counts() {
        let upper = |layout| Directions { layout, dome: Dome::Upper }.count();
        assert_eq!(Directions::octahedral(300, Dome::Upper).count(), 289);
        assert_eq!(Directions::rings(300, Dome::Upper).count(), 298);
        assert_eq!(Directions::rings(289, Dome::Upper).count(), 289);
        assert_eq!(upper(Layout::Rings { rings: 13, points: 23 }), 300);
        for n in [4, 5, 7, 16, 100, 5000] {
            for dome in [Dome::Upper, Dome::Full] {
                assert!(Directions::rings(n.max(6), dome).count() <= n.max(6));
                assert!(Directions::octahedral(n, dome).count() <= n);
            }
        }
        let bad = |layout| Directions { layout, dome: Dome::Full }.validate().unwrap_err();
        assert_eq!(bad(Layout::Octahedral { side: 1 }), "1 views a side; at least 2");
        assert_eq!(
            bad(Layout::Octahedral { side: u32::MAX }),
            "18446744065119617025 views in layout octahedral; the limit is 16384"
        );
        assert_eq!(bad(Layout::Rings { rings: 2, points: 2 }), "2 points a ring; at least 3");
        // Found by fuzzing: 2^64 views are not none.
        let wraps = bad(Layout::Rings { rings: 1 << 31, points: 1 << 31 });
        assert_eq!(wraps, "9223372036854775810 views in layout rings; the limit is 16384");
        let most = bad(Layout::Rings { rings: u32::MAX, points: u32::MAX });
        assert_eq!(most, "18446744073709551615 views in layout rings; the limit is 16384");
    }

    #[test]
    fn a_three_by_three_grid_has_the_corners_that_engines_know() {
        let d = Directions { layout: Layout::Octahedral { side: 3 }, dome: Dome::Upper };
        let corner = |c: u32, r: u32| d.direction(r * 3 + c);
        assert_eq!(corner(0, 0), DVec3::NEG_Z);
        assert_eq!(corner(2, 0), DVec3::X);
        assert_eq!(corner(1, 1), DVec3::Y);
        assert_eq!(corner(0, 2), DVec3::NEG_X);
        assert_eq!(corner(2, 2), DVec3::Z);
        let full = Directions { dome: Dome::Full, ..d };
        assert_eq!([0, 2, 6, 8].map(|i| full.direction(i)), [DVec3::NEG_Y; 4]);
        assert_eq!([1, 3, 4].map(|i| full.direction(i)), [DVec3::NEG_Z, DVec3::NEG_X, DVec3::Y]);
    }

    proptest! {
        #[test]
        fn nearest_is_nearest_and_shares_are_barycentric(
            x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64,
        ) {
            let v = DVec3::new(x, y, z);
            prop_assume!(v.length() > 1e-3);
            for d in all() {
                let unit = d.within(v);
                let best = (0..d.count()).map(|i| d.direction(i).dot(unit)).fold(-1.0, f64::max);
                let got = d.direction(d.nearest(v)).dot(unit);
                // The arithmetic look-up takes a corner of the cell; on the octahedron a view of
                // the next cell may be nearer by a little.
                prop_assert!(got >= best - 1e-9 || got.acos() < 1.12 * best.acos(), "{:?}", d);
                let shares = d.blend(v);
                prop_assert!(shares.iter().all(|s| s.0 < d.count() && s.1 >= -1e-6));
                prop_assert!((shares.iter().map(|s| s.1).sum::<f32>() - 1.0).abs() < 1e-5);
                // What is blended lies around: the three are no farther than two cells.
                let mean: DVec3 =
                    shares.iter().map(|s| d.direction(s.0) * f64::from(s.1)).sum();
                if d.count() > 100 {
                    prop_assert!(mean.normalize().dot(unit) > 0.99, "{:?} {} {}", d, mean, unit);
                }
            }
        }

        #[test]
        fn shares_change_without_steps(azimuth in 0.0..6.3f64, elevation in -1.5..1.5f64) {
            let at = |e: f64, a: f64| DVec3::new(a.sin() * e.cos(), e.sin(), a.cos() * e.cos());
            for d in all() {
                let [a, b] = [0.0, 1e-6].map(|s| d.blend(at(elevation + s, azimuth + s)));
                let share = |set: &Blend, n: u32| -> f32 {
                    let here = |m: u32| d.direction(m).distance(d.direction(n)) < 1e-9;
                    set.iter().filter(|s| here(s.0)).map(|s| s.1).sum()
                };
                for (n, _) in a.iter().chain(&b) {
                    prop_assert!((share(&a, *n) - share(&b, *n)).abs() < 1e-2, "{:?}", d);
                }
            }
        }
    }
}
