use super::*;
use crate::opacity::mix;
use crate::{Light, Sampling, Sun};
use forest_soup::{AlphaMode, Material, Projection};
use std::f64::consts::FRAC_PI_2;

/// Numbers in `0..1`, always the same.
struct Draw(u32);

impl Draw {
    fn next(&mut self) -> f32 {
        self.0 = mix(self.0.wrapping_add(0x9e37_79b9));
        (self.0 >> 8) as f32 / 16_777_216.0
    }

    /// Somewhere in a unit cube about zero.
    fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) - 0.5
    }
}

fn soup(triangles: &[[Vec3; 3]]) -> TriangleSoup {
    let n = triangles.len() as u32;
    TriangleSoup {
        positions: triangles.as_flattened().to_vec(),
        triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        triangle_materials: vec![0; n as usize],
        materials: vec![Material::default()],
        ..TriangleSoup::default()
    }
}

/// A bush of scattered leaves, 2 high and about 1.5 wide, off the origin of its soup and with odd
/// normals, half of them missing.
fn bush(leaves: usize, size: f32) -> TriangleSoup {
    let mut draw = Draw(7);
    let triangles: Vec<[Vec3; 3]> = (0..leaves)
        .map(|_| {
            let at = draw.point() * Vec3::new(1.5, 2.0, 1.0) + Vec3::new(0.3, 1.0, 0.2);
            [(); 3].map(|()| at + draw.point() * size)
        })
        .collect();
    let mut bush = soup(&triangles);
    bush.origin = DVec3::new(40.0, -3.0, 8.0);
    bush.normals = (0..3 * leaves)
        .map(|i| if i % 2 == 0 { Vec3::ZERO } else { draw.point().normalize() })
        .collect();
    bush.colors = (0..3 * leaves).map(|_| [draw.next(), draw.next(), draw.next(), 1.0]).collect();
    bush
}

/// Uneven ground of `2 · half` a side about the origin.
fn ground(half: f32) -> TriangleSoup {
    let n = 12;
    let mut draw = Draw(99);
    let heights: Vec<f32> = (0..(n + 1) * (n + 1)).map(|_| 0.03 * half * draw.next()).collect();
    let at = |i: usize, k: usize| {
        let along = |i: usize| (i as f32 / n as f32 * 2.0 - 1.0) * half;
        Vec3::new(along(i), heights[i * (n + 1) + k], along(k))
    };
    let cells = (0..n * n).map(|c| (c / n, c % n));
    let pair = |(i, k)| {
        let [a, b, c, d] = [at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)];
        [[a, b, c], [a, c, d]]
    };
    soup(&cells.flat_map(pair).collect::<Vec<_>>())
}

/// A level square of half-width `h` about the origin.
fn square(h: f32) -> TriangleSoup {
    let v = |x: f32, z: f32| Vec3::new(x * h, 0.0, z * h);
    let [a, b, c, d] = [v(-1.0, -1.0), v(-1.0, 1.0), v(1.0, 1.0), v(1.0, -1.0)];
    soup(&[[a, b, c], [a, c, d]])
}

fn lit() -> Style {
    let to_sun = DVec3::new(-0.6, 0.7, 0.4).normalize();
    let sun = Sun { to_sun, sun: [0.7; 3], sky: [0.4; 3], translucency: 0.5, darkest: 1.0 };
    Style { light: Light::Sun(sun), sampling: Sampling::TRUTH }
}

fn planted(kind: u32, position: DVec3, yaw: f64, scale: f64) -> Planted {
    Planted { kind, position, yaw, scale }
}

/// Where instance `p` of a kind puts its soup's point `v` (a direction if `way`).
fn put(p: &Planted, kind: &Kind, v: Vec3, way: bool) -> DVec3 {
    let v = v.as_dvec3();
    let v = if way { v } else { (kind.soup.origin + v - kind.anchor) * p.scale };
    let (sin, cos) = p.yaw.sin_cos();
    let v = DVec3::new(v.x * cos + v.z * sin, v.y, -v.x * sin + v.z * cos);
    if way { v } else { v + p.position }
}

/// All instances in one soup. The kinds have one material, all the same.
fn merged(kinds: &[Kind], planted: &[Planted]) -> TriangleSoup {
    let mut all = TriangleSoup { materials: kinds[0].soup.materials.clone(), ..soup(&[]) };
    for p in planted {
        let kind = &kinds[p.kind as usize];
        let (first, s) = (all.positions.len() as u32, kind.soup);
        all.positions.extend(s.positions.iter().map(|v| put(p, kind, *v, false).as_vec3()));
        let normals = s.positions.iter().enumerate().map(|(i, _)| match s.normals.get(i) {
            Some(n) => put(p, kind, *n, true).as_vec3(),
            None => Vec3::ZERO,
        });
        all.normals.extend(normals);
        let white = |i: usize| s.colors.get(i).copied().unwrap_or([1.0; 4]);
        all.colors.extend((0..s.positions.len()).map(white));
        all.triangles.extend(s.triangles.iter().map(|t| t.map(|v| v + first)));
        all.triangle_materials.extend(&s.triangle_materials);
    }
    all.validate().unwrap();
    all
}

/// Root mean square over pixels and colours.
fn rmse(a: &Picture, b: &Picture) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let (x, y) = (a.pixels.as_flattened(), b.pixels.as_flattened());
    let sum: f64 = x.iter().zip(y).map(|(x, y)| f64::from(x - y).powi(2)).sum();
    (sum / x.len() as f64).sqrt()
}

/// The largest difference of finite depths.
fn depth_error(a: &Picture, b: &Picture) -> f32 {
    let both = a.depth.iter().zip(&b.depth).filter(|(a, b)| a.is_finite() && b.is_finite());
    both.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

fn perspective(eye: DVec3, to: DVec3, size: [u32; 2]) -> Camera {
    Camera::new(eye, to - eye, Projection::Perspective { fov_y: 0.9 }, size)
}

#[test]
fn one_instance_in_place_is_the_scene_itself() {
    // Partly transparent leaves too: the first instance covers as the soup does.
    let mut bush = bush(400, 0.4);
    bush.materials.push(Material {
        alpha_mode: AlphaMode::Blend,
        base_color: [0.5, 0.25, 1.0, 0.6],
        ..Material::default()
    });
    bush.triangle_materials.iter_mut().step_by(3).for_each(|m| *m = 1);
    let surfaces = Surfaces::new(&bush.materials, &[]);
    let scene = RayScene::new(&bush, &surfaces);
    for anchor in [DVec3::ZERO, DVec3::new(40.3, -3.0, 8.1)] {
        let kinds = [Kind { soup: &bush, surfaces: &surfaces, anchor }];
        let grove = Grove::new(&kinds, &[planted(0, anchor, 0.0, 1.0)]);
        let middle = bush.origin + DVec3::new(0.3, 1.0, 0.2);
        let parallel = Projection::Orthographic { height: 2.4 };
        for camera in [
            perspective(middle + DVec3::new(1.0, 1.0, 3.0), middle, [40, 32]),
            perspective(middle, middle + DVec3::X, [40, 32]),
            Camera::new(middle, DVec3::new(-0.3, -1.0, 0.1), parallel, [40, 32]),
        ] {
            for style in [Style::default(), lit()] {
                let want = scene.picture(&camera, &style);
                let got = grove.picture(&camera, &style, [0, 0], [40, 32]);
                let error = rmse(&got, &want);
                assert!(error < 1e-4, "{error}");
                assert!(depth_error(&got, &want) < 1e-4);
                assert!(want.mean_coverage() > 0.15, "{}", want.mean_coverage());
            }
        }
    }
}

#[test]
fn instances_are_the_soup_merged_by_hand() {
    let (bush, ground) = (bush(250, 0.5), ground(6.0));
    let surfaces = Surfaces::new(&bush.materials, &[]);
    let anchor = bush.origin + DVec3::new(0.2, 0.1, 0.0);
    let kinds = [
        Kind { soup: &ground, surfaces: &surfaces, anchor: DVec3::ZERO },
        Kind { soup: &bush, surfaces: &surfaces, anchor },
    ];
    let mut draw = Draw(3);
    let mut all = vec![planted(0, DVec3::ZERO, 0.0, 1.0)];
    for _ in 0..14 {
        let at = draw.point().as_dvec3() * DVec3::new(8.0, 0.4, 8.0);
        let (yaw, scale) = (f64::from(draw.next()) * 20.0 - 10.0, 0.5 + f64::from(draw.next()));
        all.push(planted(1, at, yaw, scale));
    }
    let whole = merged(&kinds, &all);
    let scene = RayScene::new(&whole, &surfaces);
    let grove = Grove::new(&kinds, &all);
    let parallel = Projection::Orthographic { height: 10.0 };
    for camera in [
        perspective(DVec3::new(2.0, 4.0, 8.0), DVec3::new(0.0, 0.5, 0.0), [64, 48]),
        perspective(DVec3::new(-0.7, 0.9, 0.6), DVec3::new(3.0, 0.5, -1.0), [64, 48]),
        Camera::new(DVec3::new(1.0, 0.5, 0.0), DVec3::new(0.1, -1.0, 0.2), parallel, [64, 48]),
    ] {
        for style in [Style::default(), lit()] {
            let want = scene.picture(&camera, &style);
            let got = grove.picture(&camera, &style, [0, 0], [64, 48]);
            let error = rmse(&got, &want);
            assert!(error < 1e-3, "{error}");
            assert!(depth_error(&got, &want) < 2e-2);
            let normal = |p: &Picture| p.normal.iter().map(|n| Vec3::from(*n)).collect::<Vec<_>>();
            let apart = normal(&got).into_iter().zip(normal(&want)).map(|(a, b)| a.distance(b));
            assert!(apart.sum::<f32>() / 3072.0 < 1e-3);
            // That the instances are there, and see each other: without them all is brighter.
            let bare = Grove::new(&kinds, &all[..1]).picture(&camera, &style, [0, 0], [64, 48]);
            assert!(rmse(&bare, &want) > 0.1);
        }
    }
    // Shadows alone: ground that is seen past all bushes is darker for them.
    let camera = Camera::new(DVec3::Y * 9.0, -DVec3::Y, parallel, [64, 64]);
    let with = grove.picture(&camera, &lit(), [0, 0], [64, 64]);
    let bare = Grove::new(&kinds, &all[..1]).picture(&camera, &lit(), [0, 0], [64, 64]);
    let ground_only = (0..64 * 64).filter(|&i| (with.depth[i] - bare.depth[i]).abs() < 1e-6);
    let darker = ground_only.clone().filter(|&i| with.pixels[i][0] < 0.7 * bare.pixels[i][0]);
    let (darker, n) = (darker.count(), ground_only.count());
    assert!(darker > 100 && n > darker + 100, "{darker} of {n}");
}

#[test]
fn a_window_is_the_crop_of_the_whole() {
    let mut bush = bush(200, 0.5);
    bush.materials[0] = Material {
        alpha_mode: AlphaMode::Blend,
        base_color: [1.0, 1.0, 1.0, 0.5],
        ..Material::default()
    };
    let surfaces = Surfaces::new(&bush.materials, &[]);
    let kinds = [Kind { soup: &bush, surfaces: &surfaces, anchor: bush.origin }];
    let all: Vec<Planted> = (0..5)
        .map(|i| planted(0, DVec3::new(f64::from(i) - 2.0, 0.0, 0.0), f64::from(i), 1.0))
        .collect();
    let grove = Grove::new(&kinds, &all);
    let camera = perspective(DVec3::new(0.0, 1.0, 5.0), DVec3::Y, [50, 30]);
    let whole = grove.picture(&camera, &lit(), [0, 0], [50, 30]);
    let part = grove.picture(&camera, &lit(), [13, 9], [22, 15]);
    assert_eq!((part.width, part.height), (22, 15));
    for (i, pixel) in part.pixels.iter().enumerate() {
        let k = (9 + i / 22) * 50 + 13 + i % 22;
        assert_eq!((*pixel, part.depth[i]), (whole.pixels[k], whole.depth[k]));
        assert_eq!(part.normal[i], whole.normal[k]);
    }
    assert!(part.mean_coverage() > 0.3);
}

#[test]
fn far_from_the_origin_nothing_is_lost() {
    // A slope of 20 km, y = x/8, and bushes of a hand's height, seen from a step away: the same
    // about the origin and 5 km off, where single precision is half a millimetre.
    let corner = |x: f32, z: f32| Vec3::new(x, x / 8.0, z) * 2048.0;
    let [a, b, c, d] = [corner(4.0, 1.0), corner(-1.0, 4.0), corner(-4.0, -1.0), corner(1.0, -4.0)];
    let (bush, slope) = (bush(250, 0.5), soup(&[[a, c, b], [a, d, c]]));
    let surfaces = Surfaces::new(&bush.materials, &[]);
    let kinds = [
        Kind { soup: &slope, surfaces: &surfaces, anchor: DVec3::ZERO },
        Kind { soup: &bush, surfaces: &surfaces, anchor: bush.origin },
    ];
    let bushes = [(0.0, 0.3, 0.05), (0.12, 2.0, 0.08), (-0.1, 4.0, 0.03)];
    let seen_at = |spot: DVec3, others: Planted| {
        let place = |x: f64| spot + DVec3::new(x, x / 8.0, 0.0);
        let mut all = vec![others];
        all.extend(bushes.map(|(x, yaw, scale)| planted(1, place(x), yaw, scale)));
        let camera =
            perspective(spot + DVec3::new(0.2, 0.9, 0.5), spot + DVec3::Y * 0.05, [48, 48]);
        Grove::new(&kinds, &all).picture(&camera, &lit(), [0, 0], [48, 48])
    };
    let (here, there) = (DVec3::new(8.0, 1.0, 16.0), DVec3::new(5000.0, 625.0, -1500.0));
    // The bushes, with one far away: as exact as numbers in a unit cube.
    let far = planted(1, DVec3::new(-7000.0, 0.0, 0.0), 0.0, 1.0);
    let [near, away] = [here, there].map(|spot| seen_at(spot, far));
    let (error, depth) = (rmse(&near, &away), depth_error(&near, &away));
    assert!(error < 1e-4 && depth < 1e-5, "{error} {depth}");
    assert!(near.mean_coverage() > 0.01, "{}", near.mean_coverage());
    // And on the slope, which is one soup of 20 km in single precision.
    let all_of_it = planted(0, DVec3::ZERO, 0.0, 1.0);
    let [near, away] = [here, there].map(|spot| seen_at(spot, all_of_it));
    let (error, depth) = (rmse(&near, &away), depth_error(&near, &away));
    assert!(error < 2e-3 && depth < 2e-3, "{error} {depth}");
    assert_eq!(near.mean_coverage(), 1.0);
}

#[test]
fn low_things_shade_wide_ground() {
    // A wall of 5 cm on 20 km of ground, 5 km off, under a sun at 45°: its shadow is as long, though
    // rays leave the ground 20 cm above it, for the ground itself.
    let [a, b, c, d] = [(0.0, -1.0), (0.05, -1.0), (0.05, 1.0), (0.0, 1.0)]
        .map(|(y, z): (f32, f32)| Vec3::new(0.0, y, z));
    let (wall, ground) = (soup(&[[a, b, c], [a, c, d]]), square(10_000.0));
    let surfaces = Surfaces::new(&wall.materials, &[]);
    let kinds =
        [&wall, &ground].map(|soup| Kind { soup, surfaces: &surfaces, anchor: DVec3::ZERO });
    let spot = DVec3::new(5000.0, 0.0, 3000.0);
    let all = [planted(0, spot, 0.0, 1.0), planted(1, DVec3::ZERO, 0.0, 1.0)];
    let projection = Projection::Orthographic { height: 0.2 };
    let camera = Camera::new(spot + DVec3::Y, -DVec3::Y, projection, [32; 2]);
    let to_sun = DVec3::new(-1.0, 1.0, 0.0).normalize();
    let sun =
        Sun { to_sun, sun: [2.0f32.sqrt(); 3], sky: [0.0; 3], translucency: 0.0, darkest: 1.0 };
    let style = Style { light: Light::Sun(sun), ..Style::default() };
    let p = Grove::new(&kinds, &all).picture(&camera, &style, [0, 0], [32; 2]);
    let mean = p.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / 1024.0;
    assert!((mean - 0.75).abs() < 5e-3, "{mean}");
}

#[test]
fn nothing_and_not_numbers_draw_nothing() {
    let (bush, none) = (bush(10, 0.5), soup(&[[Vec3::NAN, Vec3::X, Vec3::Y]]));
    let surfaces = Surfaces::new(&bush.materials, &[]);
    let anchor = bush.origin;
    let kinds = [
        Kind { soup: &bush, surfaces: &surfaces, anchor },
        Kind { soup: &none, surfaces: &surfaces, anchor: DVec3::ZERO },
        Kind { soup: &bush, surfaces: &surfaces, anchor: DVec3::NAN },
    ];
    let zero = DVec3::ZERO;
    let wrong = [
        planted(1, zero, 0.0, 1.0),
        planted(2, zero, 0.0, 1.0),
        planted(3, zero, 0.0, 1.0),
        planted(0, DVec3::X * f64::INFINITY, 0.0, 1.0),
        planted(0, DVec3::X * 1e300, 0.0, 1.0),
        planted(0, zero, f64::NAN, 1.0),
        planted(0, zero, 0.0, 0.0),
        planted(0, zero, 0.0, -1.0),
        planted(0, zero, 0.0, f64::INFINITY),
        planted(0, zero, 0.0, 1e-320),
    ];
    let camera = perspective(DVec3::Z * 3.0, zero, [8, 8]);
    let empty = Picture::empty(8, 8);
    let picture = |kinds: &[Kind], all: &[Planted]| {
        Grove::new(kinds, all).picture(&camera, &lit(), [0, 0], [8, 8])
    };
    assert_eq!(picture(&[], &[]), empty);
    assert_eq!(picture(&kinds, &[]), empty);
    assert_eq!(picture(&kinds, &wrong), empty);
    // What is wrong does not hide what is not, nor change its number.
    let right = [&wrong[..1], &[planted(0, zero, 0.0, 1.0)]].concat();
    assert!(picture(&kinds, &right).mean_coverage() > 0.01);
}

#[test]
fn two_panes_let_through_what_both_let_through() {
    let mut pane = square(10.0);
    pane.materials[0] = Material {
        alpha_mode: AlphaMode::Blend,
        base_color: [1.0, 1.0, 1.0, 0.4],
        ..Material::default()
    };
    let surfaces = Surfaces::new(&pane.materials, &[]);
    let kinds = [Kind { soup: &pane, surfaces: &surfaces, anchor: DVec3::ZERO }];
    let all = [0.0, -1.0].map(|y| planted(0, DVec3::Y * y, 0.0, 1.0));
    let projection = Projection::Orthographic { height: 4.0 };
    let camera = Camera::new(DVec3::Y, -DVec3::Y, projection, [32, 32]);
    let p = Grove::new(&kinds, &all).picture(&camera, &Style::default(), [0, 0], [32, 32]);
    // 65,536 draws: five deviations are 0.01.
    assert!((p.mean_coverage() - 0.64).abs() < 0.01, "{}", p.mean_coverage());
}

#[test]
fn a_hundred_thousand_instances() {
    // Tiles of a half on a grid of ones, in quarter turns and at heights of their own: seen from
    // above they cover a quarter, each at its depth.
    let tile = square(0.25);
    let surfaces = Surfaces::new(&tile.materials, &[]);
    let kinds = [Kind { soup: &tile, surfaces: &surfaces, anchor: DVec3::ZERO }];
    let height = |x: u32, z: u32| f64::from(mix(x * 1000 + z) % 8);
    let all: Vec<Planted> = (0..320u32 * 320)
        .map(|i| {
            let (x, z) = (i % 320, i / 320);
            let at = DVec3::new(f64::from(x) + 0.5, height(x, z), f64::from(z) + 0.5);
            planted(0, at, f64::from(i % 4) * FRAC_PI_2, 1.0)
        })
        .collect();
    let grove = Grove::new(&kinds, &all);
    // 4 pixels a tile; the window shows 8 × 8 of them.
    let projection = Projection::Orthographic { height: 320.0 };
    let camera = Camera::new(DVec3::new(160.0, 10.0, 160.0), -DVec3::Y, projection, [1280; 2]);
    let p = grove.picture(&camera, &Style::default(), [200, 400], [32, 32]);
    assert!((p.mean_coverage() - 0.25).abs() < 1e-3, "{}", p.mean_coverage());
    for (x, z) in (0..64).map(|i| (i % 8, i / 8)) {
        let want = 10.0 - height(50 + x, 100 + z) as f32;
        // The second of four pixels is covered, and so is the third.
        for (i, k) in [(1, 1), (2, 1), (1, 2), (2, 2)] {
            let got = p.depth[((4 * z + k) * 32 + 4 * x + i) as usize];
            assert!((got - want).abs() < 1e-4, "{x} {z}: {got} {want}");
        }
    }
}

#[test]
fn many_in_one_place_are_built_too() {
    let tile = square(1.0);
    let surfaces = Surfaces::new(&tile.materials, &[]);
    let kinds = [Kind { soup: &tile, surfaces: &surfaces, anchor: DVec3::ZERO }];
    let all = vec![planted(0, DVec3::ZERO, 0.0, 1.0); 20_000];
    let projection = Projection::Orthographic { height: 4.0 };
    let camera = Camera::new(DVec3::Y, -DVec3::Y, projection, [4; 2]);
    let style = Style { sampling: Sampling::MIDDLE, ..Style::default() };
    let p = Grove::new(&kinds, &all).picture(&camera, &style, [0, 0], [4; 2]);
    assert_eq!(p.mean_coverage(), 0.25);
}
