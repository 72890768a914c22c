use super::*;
use forest_soup::{Texture, Wrap};
use glam::Vec3;
use std::sync::Arc;

/// One right triangle with legs of 1, textured over the lower left half of the unit square.
fn soup(texture: Option<Texture>, alpha_mode: AlphaMode) -> TriangleSoup {
    TriangleSoup {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
        triangles: vec![[0, 1, 2]],
        triangle_materials: vec![0],
        materials: vec![Material {
            texture: texture.is_some().then_some(0),
            alpha_mode,
            ..Material::default()
        }],
        textures: texture.into_iter().map(Arc::new).collect(),
        ..TriangleSoup::default()
    }
}

fn texture(n: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
    let texels = (0..n * n).map(|i| texel(i % n, i / n)).collect();
    Texture { name: "t".into(), width: n, height: n, texels, wrap: [Wrap::Clamp; 2] }
}

fn shader<'a>(
    soup: &'a TriangleSoup,
    frame: BlockFrame,
    options: &BakeOptions,
) -> SurfelShader<'a> {
    let alpha = soup.colors.iter().any(|c| c[3] != 1.0);
    SurfelShader::new(&soup.materials, &soup.textures, alpha, frame, options)
}

fn surfels_of(soup: &TriangleSoup, surfel_size: SurfelSize) -> (Vec<Surfel>, Outcome) {
    let frame = BlockFrame::of(soup.bounds()).unwrap();
    let options = BakeOptions { surfel_size, ..BakeOptions::default() };
    let shader = shader(soup, frame, &options);
    let mut out = Vec::new();
    let outcome = SurfelMaker::new(&shader).push(soup, 0, &mut out);
    (out, outcome)
}

#[test]
fn a_triangle_becomes_a_disc_of_its_area_at_its_centroid() {
    let soup = soup(None, AlphaMode::Opaque);
    let (s, outcome) = surfels_of(&soup, SurfelSize::Triangle);
    assert_eq!(outcome, Outcome::Surfels(1));
    // The box's half diagonal is 0.7071, a block unit is 1, its middle (½, ½, 0).
    assert!((s[0].area - 0.5).abs() < 1e-7);
    assert!((s[0].position[0] + 1.0 / 6.0).abs() < 1e-7);
    assert_eq!(s[0].axis, [0.0, 0.0, 1.0]);
    assert!((s[0].radius() - (0.5 / PI).sqrt()).abs() < 1e-7);
}

#[test]
fn a_smaller_surfel_size_cuts_into_equal_areas() {
    let soup = soup(None, AlphaMode::Opaque);
    let (s, _) = surfels_of(&soup, SurfelSize::Units(0.1));
    // Opaque pieces may have 4·0.1² of area: 0.5/2⁴ is the first below it.
    assert_eq!(s.len(), 16);
    assert!(s.iter().all(|s| (s.area - 0.5 / 16.0).abs() < 1e-7));
    let mean = s.iter().map(|s| s.position[0]).sum::<f32>() / 16.0;
    assert!((mean + 1.0 / 6.0).abs() < 1e-6, "{mean}");
}

#[test]
fn a_card_is_cut_until_its_surfels_follow_the_leaves_on_it() {
    // Four round leaves on a card: 28 % of the square is covered.
    let card = texture(256, |x, y| {
        let local = |v: u32| (v % 128) as f32 + 0.5 - 64.0;
        let inside = local(x).hypot(local(y)) < 38.4;
        [40, 160, 30, if inside { 255 } else { 0 }]
    });
    let soup = soup(Some(card), AlphaMode::Mask { cutoff: 0.5 });
    let (whole, _) = surfels_of(&soup, SurfelSize::Triangle);
    assert_eq!(whole.len(), 1);
    let (fine, _) = surfels_of(&soup, SurfelSize::Units(0.02));
    let covered = |s: &[Surfel]| s.iter().map(|s| f64::from(s.area * s.opacity)).sum::<f64>();
    let truth = 0.5 * PI * 0.3 * 0.3; // half of the square
    assert!((covered(&whole) / truth - 1.0).abs() < 0.01, "{}", covered(&whole));
    assert!((covered(&fine) / truth - 1.0).abs() < 0.01, "{}", covered(&fine));
    // Bare pieces are gone, and what is left is nearly opaque.
    let wrong: f64 =
        fine.iter().map(|s| 2.0 * f64::from(s.area * s.opacity * (1.0 - s.opacity))).sum();
    assert!(wrong / truth <= 0.1, "footprint error {}", wrong / truth);
    assert!(fine.iter().all(|s| f64::from(s.area) <= 0.02 * 0.02));
}

#[test]
fn pieces_do_not_depend_on_what_the_cache_holds() {
    let card = texture(64, |x, y| [200, 0, 0, ((x * 7 + y * 5) % 256) as u8]);
    let mut soup = soup(Some(card), AlphaMode::Blend);
    // The same card again, a millionth narrower: another triangle, the same pieces.
    soup.positions.extend([Vec3::ZERO, Vec3::X * 0.999_999, Vec3::Y]);
    soup.uvs.extend_from_within(..);
    soup.triangles.push([3, 4, 5]);
    soup.triangle_materials.push(0);
    let frame = BlockFrame::of(soup.bounds()).unwrap();
    let options = BakeOptions { surfel_size: SurfelSize::Units(0.05), ..BakeOptions::default() };
    let shader = shader(&soup, frame, &options);
    let made = |order: [usize; 2]| {
        let mut maker = SurfelMaker::new(&shader);
        let mut by_triangle = [Vec::new(), Vec::new()];
        for i in order {
            maker.push(&soup, i, &mut by_triangle[i]);
        }
        format!("{by_triangle:?}")
    };
    assert_eq!(made([0, 1]), made([1, 0]));
}

#[test]
fn fully_transparent_and_flat_triangles_make_no_surfel() {
    let clear = texture(4, |_, _| [255, 255, 255, 0]);
    let soup_ = soup(Some(clear), AlphaMode::Mask { cutoff: 0.5 });
    assert_eq!(surfels_of(&soup_, SurfelSize::Auto).1, Outcome::Transparent);
    let mut flat = soup(None, AlphaMode::Opaque);
    flat.positions[2] = Vec3::X * 0.5;
    assert_eq!(surfels_of(&flat, SurfelSize::Auto).1, Outcome::ZeroArea);
}

#[test]
fn a_needle_of_aspect_a_million_stays_on_its_line() {
    let mut needle = soup(None, AlphaMode::Opaque);
    needle.positions[2] = Vec3::new(0.0, 1e-6, 0.0);
    let (s, _) = surfels_of(&needle, SurfelSize::Units(0.01));
    // Slices of the surfel size along a length of 1.
    assert_eq!(s.len(), 101);
    let area: f64 = s.iter().map(|s| f64::from(s.area * s.opacity)).sum();
    // The half diagonal is just above ½: the block unit is 1.
    assert!((area / 0.5e-6 - 1.0).abs() < 1e-4, "{area}");
    let farthest = s.iter().map(|s| s.position[1].abs()).fold(0.0, f32::max);
    assert!(farthest < 1e-5);
}

#[test]
fn vertex_alpha_masks_piece_by_piece() {
    // The left of the card is bare. Vertex alpha 0.9 leaves the right covered.
    let half = texture(64, |x, _| [0, 200, 0, if x < 23 { 0 } else { 255 }]);
    let mut soup = soup(Some(half), AlphaMode::Mask { cutoff: 0.5 });
    let (plain, _) = surfels_of(&soup, SurfelSize::Units(0.05));
    soup.colors = vec![[1.0, 1.0, 1.0, 0.9]; 3];
    let (tinted, _) = surfels_of(&soup, SurfelSize::Units(0.05));
    let covered = |s: &[Surfel]| s.iter().map(|s| f64::from(s.area * s.opacity)).sum::<f64>();
    assert!(tinted.len() > 5, "{}", tinted.len());
    assert!((covered(&tinted) / covered(&plain) - 1.0).abs() < 0.03);
    // No black ghosts where the card is bare.
    assert!(tinted.iter().all(|s| s.rgb[1] > 0.4 && s.position[0] > -0.25), "{tinted:?}");
}

#[test]
fn vertex_colours_tint_and_vertex_alpha_moves_the_mask() {
    // Alpha ramps from 0 to 1 along u. With vertex alpha ½ the cutoff ½ passes nothing but the end.
    let ramp = texture(256, |x, _| [255, 255, 255, x as u8]);
    let mut soup = soup(Some(ramp), AlphaMode::Mask { cutoff: 0.5 });
    soup.colors = vec![[1.0, 0.5, 0.0, 0.8]; 3];
    let (s, _) = surfels_of(&soup, SurfelSize::Triangle);
    // 0.8·u ≥ ½ → u ≥ 0.625: the share of the triangle beyond it is 0.375².
    assert!((s[0].opacity - 0.140_6).abs() < 0.01, "{}", s[0].opacity);
    assert!((s[0].rgb[1] - 0.5).abs() < 0.01 && s[0].rgb[2] == 0.0, "{:?}", s[0].rgb);
}
