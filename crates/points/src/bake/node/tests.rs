use super::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

fn leaf(at: [f32; 3], axis: DVec3, area: f32) -> Node {
    surfel_node(at, axis, area, RadiusRule::Opacity)
}

fn surfel_node(at: [f32; 3], axis: DVec3, area: f32, rule: RadiusRule) -> Node {
    let s =
        Surfel { position: at, axis: axis.as_vec3().to_array(), area, rgb: [0.5; 3], opacity: 1.0 };
    Node::of_surfel(&s, rule)
}

#[test]
fn the_papers_formula_keeps_46_percent_of_two_equal_children_at_60_degrees() {
    let tilted = DVec3::new(0.75f64.sqrt(), 0.0, 0.5); // |N·N'| = ½
    let a = surfel_node([0.0; 3], DVec3::Z, 1e-4, RadiusRule::Paper);
    let b = surfel_node([0.01, 0.0, 0.0], tilted, 1e-4, RadiusRule::Paper);
    let parent = Node::merged(&[a, b], RadiusRule::Paper, false, None);
    // R = 2/π·(1 + ½·(2 − 1)) = 0.9549 of a child's: 0.9119 of one area, 45.6 % of two.
    let kept = parent.radius.powi(2) / (2.0 * a.radius.powi(2));
    assert!((kept - 0.455_945).abs() < 1e-4, "{kept}");
}

#[test]
fn opposite_leaf_normals_do_not_cancel() {
    let a = leaf([0.0; 3], DVec3::Z, 1e-4);
    let b = leaf([0.01, 0.0, 0.0], -DVec3::Z, 1e-4);
    let parent = Node::merged(&[a, b], RadiusRule::Opacity, true, None);
    assert!(parent.axis.dot(DVec3::Z).abs() > 1.0 - 1e-12);
    assert_eq!(parent.flatness, 0);
}

#[test]
fn a_plane_of_discs_hides_nothing_of_itself() {
    // Coplanar: the union is the sum, so both rules agree.
    let [opacity, area] = [RadiusRule::Opacity, RadiusRule::Area].map(|rule| {
        let a = leaf([0.0; 3], DVec3::Z, 1e-4);
        let b = leaf([0.012, 0.0, 0.0], DVec3::Z, 1e-4);
        Node::merged(&[a, b], rule, true, None).covered
    });
    assert!((opacity - area).abs() < 1e-12);
    assert!((area - 1e-4).abs() < 1e-10); // half of 2·10⁻⁴
}

#[test]
fn a_leaf_behind_another_hides_a_part_that_falls_with_distance() {
    let a = leaf([0.0; 3], DVec3::Z, 1e-4);
    let hidden = |d: f32| mean_overlap(&a, &leaf([0.0, 0.0, d], DVec3::Z, 1e-4));
    assert!(hidden(1e-4) > 0.3e-4); // nearly one behind the other: most of A/2
    // Far: A²/(2·π·d²).
    assert!((hidden(1.0) / (1e-8 / (2.0 * PI)) - 1.0).abs() < 1e-3);
}

/// The far law against a Monte Carlo of the definition: discs with random axes, seen from random
/// directions, overlap area by point sampling.
#[test]
fn mean_overlap_agrees_with_sampled_projections() {
    let (a, b) = (
        leaf([0.0; 3], DVec3::new(0.3, 0.5, 0.81).normalize(), 0.01),
        leaf([0.15, 0.1, 0.2], DVec3::new(-0.6, 0.2, 0.77).normalize(), 0.01),
    );
    let mut rng = Pcg32::seed_from_u64(7);
    let mut unit = || loop {
        let v = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
        if (0.01..1.0).contains(&v.length_squared()) {
            break v.normalize();
        }
    };
    // A point of disc a is hidden behind or in front of b from direction v if the line hits b.
    let (n, mut hits) = (4_000_000u32, 0.0);
    for i in 0..n {
        let v = unit();
        let (u, w) = a.axis.any_orthonormal_pair();
        let (r, t) =
            (a.radius * ((f64::from(i) + 0.5) / f64::from(n)).sqrt(), f64::from(i) * 2.399_963);
        let p = a.center + (u * t.cos() + w * t.sin()) * r;
        let s = (b.center - p).dot(b.axis) / v.dot(b.axis);
        if (p + v * s).distance(b.center) < b.radius {
            hits += v.dot(a.axis).abs();
        }
    }
    let sampled = hits / f64::from(n) * 0.01;
    let ours = mean_overlap(&a, &b);
    assert!((ours / sampled - 1.0).abs() < 0.15, "{ours} {sampled}");
}

#[test]
fn isotropic_leaves_become_a_sphere_that_keeps_their_area() {
    let mut rng = Pcg32::seed_from_u64(3);
    let leaves: Vec<Node> = (0..4000)
        .map(|_| {
            let at = std::array::from_fn(|_| rng.random_range(-0.5f32..0.5));
            let axis = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
            leaf(at, axis.normalize(), 1e-5)
        })
        .collect();
    let mut level = leaves;
    while level.len() > 1 {
        level = level.chunks(2).map(|c| Node::merged(c, RadiusRule::Area, true, None)).collect();
    }
    let root = level[0];
    assert!(root.flatness > 110, "{}", root.flatness);
    let opacity = root.opacity(RadiusRule::Area);
    let area = spheroid::mean_projected_area(root.own.radius(), root.flatness, opacity);
    assert!((area / (0.5 * 4000.0 * 1e-5) - 1.0).abs() < 1e-6, "{area}");
    // A uniform unit cube: σ² = ¼, r² = 4/3·σ².
    assert!((root.radius - (1.0f64 / 3.0).sqrt()).abs() < 0.02, "{}", root.radius);
}

#[test]
fn colour_is_weighted_by_covered_area() {
    let big = Surfel {
        position: [0.0; 3],
        axis: [0.0, 1.0, 0.0],
        area: 3e-4,
        rgb: [1.0, 0.0, 0.0],
        opacity: 1.0,
    };
    let faint = Surfel { rgb: [0.0, 1.0, 0.0], opacity: 0.5, area: 2e-4, ..big };
    let nodes = [big, faint].map(|s| Node::of_surfel(&s, RadiusRule::Opacity));
    let rgb = Node::merged(&nodes, RadiusRule::Opacity, true, None).rgb();
    assert!((rgb[0] - 0.75).abs() < 1e-6 && (rgb[1] - 0.25).abs() < 1e-6, "{rgb:?}");
}
