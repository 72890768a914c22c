use super::*;
use crate::bake::lattice::Lattice;
use forest_soup::Bounds;
use proptest::prelude::*;

fn quantiser() -> Quantiser {
    let unit = Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE };
    Lattice::for_extent(2.0).quantiser(unit)
}

fn surfels(positions: &[[f32; 3]]) -> Vec<Surfel> {
    positions
        .iter()
        .map(|&position| Surfel {
            position,
            axis: [0.0, 0.0, 1.0],
            area: 1e-6,
            rgb: [0.5; 3],
            opacity: 1.0,
        })
        .collect()
}

fn tree(surfels: &[Surfel]) -> Tree {
    let leaves = Leaves::Surfels(surfels);
    let rules = ClusterRules {
        leaves,
        radius: RadiusRule::Opacity,
        monotone: true,
        quantiser: quantiser(),
    };
    let mut tree = Tree::with_parents();
    build(&rules, &mut tree);
    tree
}

/// Every surfel once, every cluster with 2 to 4 children, one root, sizes growing to it.
fn check(tree: &Tree, surfels: usize) {
    let parents = tree.parents.as_ref().unwrap();
    let mut children = vec![0; tree.records.len()];
    let mut roots = 0;
    for (i, r) in tree.records.iter().enumerate() {
        let p = parents[i] as usize;
        if p == i {
            roots += 1;
            assert_eq!(r.parent(), SizeCode::INFINITE);
        } else {
            assert!(p > i, "post-order");
            children[p] += 1;
            assert_eq!(r.parent(), tree.records[p].own());
            assert!(r.own() <= r.parent());
        }
    }
    assert_eq!(roots, 1);
    assert_eq!(tree.records.iter().filter(|r| r.is_leaf()).count(), surfels);
    for (r, n) in tree.records.iter().zip(children) {
        assert!(if r.is_leaf() { n == 0 } else { (2..=LEAF_CLUSTER).contains(&n) }, "{n} children");
    }
}

#[test]
fn equal_collinear_and_coplanar_centroids_all_give_whole_trees() {
    let n = 1000;
    let at =
        |f: &dyn Fn(f32) -> [f32; 3]| (0..n).map(|i| f(i as f32 / n as f32)).collect::<Vec<_>>();
    for positions in [
        at(&|_| [0.3, -0.2, 0.1]),
        at(&|t| [t, -t, 0.5 * t]),
        at(&|t| [t, (t * 97.0).sin() * 0.5, 0.0]),
        // One far from all others: the centroid plane cuts off a single point.
        at(&|t| if t == 0.0 { [1.0; 3] } else { [t * 1e-6, 0.0, 0.0] }),
    ] {
        let s = surfels(&positions);
        check(&tree(&s), n);
    }
}

#[test]
fn a_single_surfel_is_its_own_tree() {
    let t = tree(&surfels(&[[0.0; 3]]));
    assert_eq!(t.records.len(), 1);
    check(&t, 1);
}

#[test]
fn splits_follow_the_longest_direction() {
    // Two clumps of four far apart along y: the root's children are the clumps.
    let clump = |y: f32| [[0.0, y, 0.0], [0.01, y, 0.0], [0.0, y, 0.01], [0.01, y, 0.01]];
    let s = surfels(&[clump(-0.5), clump(0.5)].concat());
    let t = tree(&s);
    assert_eq!(t.records.len(), 11); // 8 surfels, 2 clumps, 1 root
    let clumps: Vec<_> = t.records.iter().filter(|r| !r.is_leaf()).collect();
    assert!(clumps[0].position[1] != clumps[1].position[1]);
}

#[test]
fn large_clusters_give_the_same_bytes_on_one_thread_and_on_eight() {
    let positions: Vec<[f32; 3]> = (0..100_000u32)
        .map(|i| {
            std::array::from_fn(|k| {
                (i.wrapping_mul(2_654_435_761u32 >> (8 * k)) % 4096) as f32 / 4096.0
            })
        })
        .collect();
    let s = surfels(&positions);
    let build_on = |threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| tree(&s))
    };
    let (one, eight) = (build_on(1), build_on(8));
    assert_eq!(one.records, eight.records);
    assert_eq!(one.parents, eight.parents);
    check(&one, positions.len());
}

proptest! {
    #[test]
    fn any_cloud_gives_a_whole_tree(
        positions in prop::collection::vec(prop::array::uniform3(-1.0f32..1.0), 1..300),
        stretch in prop::array::uniform3(prop::sample::select(vec![0.0f32, 1e-7, 1.0])),
    ) {
        let positions: Vec<[f32; 3]> =
            positions.iter().map(|p| std::array::from_fn(|k| p[k] * stretch[k])).collect();
        check(&tree(&surfels(&positions)), positions.len());
    }

    #[test]
    fn partition_keeps_every_item_and_the_moments(
        positions in prop::collection::vec(prop::array::uniform3(-1.0f32..1.0), 2..100),
    ) {
        let mut items: Vec<Item> =
            (0..).zip(&positions).map(|(index, &position)| Item { position, index }).collect();
        let before = items.clone();
        let mut scratch = items.clone();
        let all = moments_about([0.0; 3], &items);
        let axis = DVec3::new(0.6, 0.0, 0.8);
        let (at, left) = partition(&mut items, &mut scratch, [0.0; 3], all.mean(), axis);
        let mut sorted = items.clone();
        sorted.sort_by_key(|i| i.index);
        prop_assert_eq!(sorted, before);
        prop_assert_eq!(left, moments_about([0.0; 3], &items[..at]));
    }
}
