//! Parameters of the species, in the terms of Weber and Penn's appendix.

/// A kind of tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Species {
    /// A conical tree with needle sprays.
    Conifer,
    /// A round-crowned tree with clusters of broad leaves on each card.
    Broadleaf,
    /// A many-stemmed bush with single leaves.
    Shrub,
}

/// Share of the full length that a branch has, by its place `t` on the trunk (0 at the crown's
/// top, 1 at its base): `ShapeRatio` of the paper.
#[derive(Clone, Copy)]
pub(crate) enum Shape {
    Conical,
    Spherical,
    Hemispherical,
}

impl Shape {
    pub(crate) fn ratio(self, t: f32) -> f32 {
        match self {
            Shape::Conical => 0.2 + 0.8 * t,
            Shape::Spherical => 0.2 + 0.8 * (std::f32::consts::PI * t).sin(),
            Shape::Hemispherical => 0.2 + 0.8 * (0.5 * std::f32::consts::PI * t).sin(),
        }
    }
}

/// One level of stems. Angles in degrees; `v` fields are the range of a uniform variation.
#[derive(Clone, Copy)]
pub(crate) struct Level {
    /// Stems on each parent (of the trunk: trunks).
    pub(crate) branches: u32,
    /// Angle between parent and stem.
    pub(crate) down_angle: f32,
    pub(crate) down_angle_v: f32,
    /// Turn about the parent from one stem to the next.
    pub(crate) rotate: f32,
    /// Length, as a share of the parent's.
    pub(crate) length: f32,
    pub(crate) length_v: f32,
    /// Total bend along the stem, upwards if positive.
    pub(crate) curve: f32,
    pub(crate) curve_v: f32,
    /// Segments along the stem and around it.
    pub(crate) segments: u32,
    pub(crate) sides: u32,
    /// Share of the parent's length without stems, at its base.
    pub(crate) bare: f32,
}

pub(crate) struct Parameters {
    pub(crate) height: f32,
    /// Trunk radius over its length.
    pub(crate) ratio: f32,
    /// Exponent of a child's radius over its parent's by their lengths.
    pub(crate) ratio_power: f32,
    pub(crate) shape: Shape,
    pub(crate) levels: &'static [Level],
    /// Edge of a card when there are `cards` of them, and its width over its length.
    pub(crate) leaf_size: f32,
    pub(crate) leaf_cards: f32,
    pub(crate) leaf_aspect: f32,
    /// Leaves drawn on a card, along and across.
    pub(crate) leaves_on_card: u32,
    pub(crate) needle: bool,
    pub(crate) leaf_color: [f32; 3],
    pub(crate) bark_color: [f32; 3],
}

impl Species {
    pub(crate) fn parameters(self) -> Parameters {
        match self {
            Species::Conifer => Parameters {
                height: 9.0,
                ratio: 0.016,
                ratio_power: 1.4,
                shape: Shape::Conical,
                levels: &[
                    Level {
                        branches: 1,
                        down_angle: 0.0,
                        down_angle_v: 0.0,
                        rotate: 0.0,
                        length: 1.0,
                        length_v: 0.0,
                        curve: 0.0,
                        curve_v: 4.0,
                        segments: 12,
                        sides: 8,
                        bare: 0.0,
                    },
                    Level {
                        branches: 90,
                        down_angle: 78.0,
                        down_angle_v: 14.0,
                        rotate: 140.0,
                        length: 0.32,
                        length_v: 0.04,
                        curve: 25.0,
                        curve_v: 20.0,
                        segments: 5,
                        sides: 4,
                        bare: 0.08,
                    },
                    Level {
                        branches: 12,
                        down_angle: 50.0,
                        down_angle_v: 15.0,
                        rotate: 180.0,
                        length: 0.4,
                        length_v: 0.1,
                        curve: 10.0,
                        curve_v: 20.0,
                        segments: 2,
                        sides: 3,
                        bare: 0.15,
                    },
                ],
                leaf_size: 0.42,
                leaf_cards: 4_000.0,
                leaf_aspect: 0.55,
                leaves_on_card: 22,
                needle: true,
                leaf_color: [0.07, 0.16, 0.05],
                bark_color: [0.16, 0.10, 0.07],
            },
            Species::Broadleaf => Parameters {
                height: 8.0,
                ratio: 0.022,
                ratio_power: 1.3,
                shape: Shape::Spherical,
                levels: &[
                    Level {
                        branches: 1,
                        down_angle: 0.0,
                        down_angle_v: 0.0,
                        rotate: 0.0,
                        length: 1.0,
                        length_v: 0.0,
                        curve: 0.0,
                        curve_v: 12.0,
                        segments: 14,
                        sides: 10,
                        bare: 0.0,
                    },
                    Level {
                        branches: 28,
                        down_angle: 55.0,
                        down_angle_v: 15.0,
                        rotate: 137.5,
                        length: 0.48,
                        length_v: 0.06,
                        curve: 30.0,
                        curve_v: 40.0,
                        segments: 7,
                        sides: 5,
                        bare: 0.25,
                    },
                    Level {
                        branches: 12,
                        down_angle: 45.0,
                        down_angle_v: 15.0,
                        rotate: 137.5,
                        length: 0.42,
                        length_v: 0.08,
                        curve: 10.0,
                        curve_v: 40.0,
                        segments: 3,
                        sides: 4,
                        bare: 0.15,
                    },
                    Level {
                        branches: 5,
                        down_angle: 45.0,
                        down_angle_v: 20.0,
                        rotate: 137.5,
                        length: 0.4,
                        length_v: 0.1,
                        curve: 0.0,
                        curve_v: 30.0,
                        segments: 2,
                        sides: 3,
                        bare: 0.2,
                    },
                ],
                leaf_size: 0.17,
                leaf_cards: 20_000.0,
                leaf_aspect: 0.8,
                leaves_on_card: 7,
                needle: false,
                leaf_color: [0.13, 0.28, 0.05],
                bark_color: [0.20, 0.15, 0.11],
            },
            Species::Shrub => Parameters {
                height: 1.6,
                ratio: 0.012,
                ratio_power: 1.2,
                shape: Shape::Hemispherical,
                levels: &[
                    Level {
                        branches: 9,
                        down_angle: 24.0,
                        down_angle_v: 14.0,
                        rotate: 137.5,
                        length: 0.9,
                        length_v: 0.1,
                        curve: -20.0,
                        curve_v: 40.0,
                        segments: 6,
                        sides: 5,
                        bare: 0.0,
                    },
                    Level {
                        branches: 12,
                        down_angle: 48.0,
                        down_angle_v: 12.0,
                        rotate: 137.5,
                        length: 0.45,
                        length_v: 0.1,
                        curve: 20.0,
                        curve_v: 50.0,
                        segments: 3,
                        sides: 3,
                        bare: 0.1,
                    },
                ],
                leaf_size: 0.085,
                leaf_cards: 1_400.0,
                leaf_aspect: 0.6,
                leaves_on_card: 1,
                needle: false,
                leaf_color: [0.20, 0.30, 0.09],
                bark_color: [0.22, 0.14, 0.10],
            },
        }
    }
}
