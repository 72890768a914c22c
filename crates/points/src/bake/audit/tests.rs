use super::*;
use crate::options::{RadiusRule, SurfelSize};
use crate::select::tests::leaves;

fn levels(radius: RadiusRule, order: Order) -> Vec<CutAudit> {
    let options =
        BakeOptions { radius, order, surfel_size: SurfelSize::Triangle, ..BakeOptions::default() };
    audit(&leaves(5000, 11), &options, 16.0).unwrap()
}

#[test]
fn exact_cuts_represent_every_surfel_once_under_every_rule() {
    for radius in [RadiusRule::Opacity, RadiusRule::Area, RadiusRule::Paper] {
        for level in levels(radius, Order::Exact) {
            assert_eq!(
                (level.missing, level.doubled, level.under_ancestor),
                (0.0, 0.0, 0),
                "{level:?}"
            );
        }
    }
}

#[test]
fn the_area_rule_keeps_all_of_it_and_the_papers_loses_most() {
    for level in levels(RadiusRule::Area, Order::Exact) {
        assert!((level.area_kept - 1.0).abs() < 0.01, "{level:?}");
    }
    let paper = levels(RadiusRule::Paper, Order::Exact);
    assert!(paper.last().unwrap().area_kept < 0.2, "{paper:?}");
}

#[test]
fn the_papers_order_doubles_points_and_leaves_holes() {
    let rows = levels(RadiusRule::Paper, Order::Paper);
    assert!(rows.iter().any(|r| r.under_ancestor > 100), "{rows:?}");
    assert!(rows.iter().any(|r| r.missing > 0.01 && r.points > 100), "{rows:?}");
}
