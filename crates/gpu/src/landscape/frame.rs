//! What a frame of a landscape is: uniforms, bands of tiles, and what was drawn.

use crate::frame::FrameUniform;
use crate::landscape::MOST_BANDS;
use bytemuck::{Pod, Zeroable};
use forest_foliage::Wind;
use forest_points::PixelArea;
use forest_scene::{HEIGHT_STEPS, OpacityMap, Sky, Tile, is_beside};
use forest_soup::Camera;
use glam::{DVec3, Vec3};

/// How finely a landscape is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandscapeDetail {
    /// s_m: points smaller than this give way to their parent.
    pub finest: PixelArea,
    /// s_M: points larger than this give way to triangles.
    pub largest: PixelArea,
    /// Power by which thresholds grow where other trees or the tree itself hide most: at 2/3, what is
    /// seen an eighth of is drawn in points of four times the area. 0 for none.
    pub hidden: f64,
    /// What is estimated to be seen less of than this, for all the trees before it, is left out; at 0
    /// only what is surely covered is.
    pub least_seen: f64,
    /// How many times as large as an impostor is as fine as points it may be; 0 for none.
    pub impostors: f64,
    /// Pixels that the ground may be off.
    pub ground: f64,
}

impl Default for LandscapeDetail {
    /// Points of about two pixels by two, triangles above sixteen times that, ground within half a pixel.
    fn default() -> Self {
        let finest = PixelArea(4.0);
        Self {
            finest,
            largest: PixelArea(64.0),
            hidden: 2.0 / 3.0,
            least_seen: 1.0 / 64.0,
            impostors: 1.0,
            ground: 0.5,
        }
    }
}

/// What a frame of a landscape took. Counted by the device: known once it is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LandscapeDrawn {
    /// Trees of tiles before the camera: those that were looked at.
    pub looked_at: u64,
    /// Trees that were drawn.
    pub trees: u64,
    /// Those of them that were drawn by views.
    pub impostors: u64,
    /// Points that were looked at.
    pub points: u64,
    /// Triangles of trees.
    pub triangles: u64,
    /// Triangles of the ground.
    pub ground: u64,
    /// What found no room: 0, or the picture lacks something.
    pub left_out: u64,
    /// Trees and cells whose pruned packs have nothing as fine as was asked for.
    pub beyond: u64,
}

impl LandscapeDrawn {
    /// Points, triangles and quads.
    pub fn primitives(&self) -> u64 {
        self.points + self.triangles + self.impostors + self.ground
    }
}

/// `LightMap` of light.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct LightMapUniform {
    light: [f32; 3],
    texel: f32,
    corner: [f32; 2],
    size: [u32; 2],
    low: f32,
    steps: f32,
    zero: [u32; 2],
}

impl LightMapUniform {
    pub(crate) fn new(map: &OpacityMap) -> Self {
        let [low, high] = map.heights;
        Self {
            light: map.to_light.as_vec3().to_array(),
            texel: map.texel as f32,
            corner: map.corner.map(|v| v as f32),
            size: map.size,
            low: low as f32,
            steps: (HEIGHT_STEPS / (high - low)) as f32,
            zero: [0; 2],
        }
    }
}

/// `Land` of light.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct LandUniform {
    sun: LightMapUniform,
    sky: LightMapUniform,
    eye: [f32; 3],
    finest: f32,
    eye_rest: [f32; 3],
    largest: f32,
    horizon: [f32; 3],
    few: u32,
    zenith: [f32; 3],
    hidden: f32,
    pixel: f32,
    impostors: f32,
    least_seen: f32,
    zero: f32,
    wind: [f32; 4],
}

/// Points of a far tree that the culling shader draws itself.
const FEW: u32 = 12;

impl LandUniform {
    /// `samples` is the number of samples along a side of a pixel: areas are in pixels.
    pub(crate) fn new(
        maps: [LightMapUniform; 2],
        camera: &Camera,
        detail: &LandscapeDetail,
        sky: &Sky,
        samples: u32,
    ) -> Self {
        let eye = camera.eye.as_vec3();
        let rest = (camera.eye - eye.as_dvec3()).as_vec3();
        let area = |a: PixelArea| (a.0 * f64::from(samples * samples)) as f32;
        Self {
            sun: maps[0],
            sky: maps[1],
            eye: eye.to_array(),
            finest: area(detail.finest),
            eye_rest: rest.to_array(),
            largest: area(detail.largest),
            horizon: sky.horizon,
            few: FEW,
            zenith: sky.zenith,
            hidden: detail.hidden as f32,
            pixel: samples as f32,
            impostors: detail.impostors as f32,
            least_seen: detail.least_seen as f32,
            zero: 0.0,
            wind: [0.0; 4],
        }
    }

    pub(crate) fn with_wind(self, wind: &Wind) -> Self {
        let [x, _, z] = (wind.direction * wind.strength).to_array();
        Self { wind: [x, z, wind.time, wind.frequency], ..self }
    }
}

/// Nearest distance that is drawn, in metres.
const NEAR: f64 = 0.05;

impl FrameUniform {
    /// That of a landscape: for a perspective camera with the size of the samples.
    pub(crate) fn of_land(camera: &Camera, light: &forest_raster::Light) -> Self {
        let stage = crate::frame::Stage { middle: camera.eye, half_diagonal: 1.0 };
        Self::new(camera, light, &stage).with_near(NEAR)
    }
}

/// The tiles of a frame, from near to far: first tree and number of trees.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bands {
    /// Distances of the nearest and farthest place of tiles before the camera, and their numbers.
    order: Vec<([f32; 2], u32)>,
    /// First tile, number of tiles, and where trees begin and end to belong to each band.
    pub(crate) firsts: [[u32; 4]; MOST_BANDS],
    /// Of all bands, one after the other: tiles that lie in several are in the list several times.
    pub(crate) tiles: Vec<[u32; 2]>,
    pub(crate) trees: u64,
}

/// Each band ends so many times as far away as the one before it.
const BAND_GROWTH: f32 = 1.6;

/// The first band ends at so many times the radius about the foot of the largest tree.
const FIRST_BAND: f32 = 1.5;

impl Bands {
    /// Puts the tiles before the camera into `count` bands by distance at most, the nearest first; `reach`
    /// is the radius about a tree's foot that holds the largest tree of each species. The last band begins
    /// no later than at `last`.
    pub(crate) fn fill(
        &mut self,
        tiles: &[Tile],
        reach: &[f64],
        camera: &Camera,
        count: usize,
        last: f64,
    ) {
        self.order.clear();
        self.tiles.clear();
        self.trees = 0;
        let eye = camera.eye;
        for (i, tile) in (0..).zip(tiles) {
            let r = DVec3::splat(reach[tile.species]);
            let min = Vec3::from_array(tile.min).as_dvec3() - r;
            let max = Vec3::from_array(tile.max).as_dvec3() + r;
            if !is_beside(camera, min, max) {
                let nearest = eye.clamp(min, max).distance(eye);
                let farthest = (eye - min).abs().max((eye - max).abs()).length();
                self.order.push(([nearest as f32, farthest as f32], i));
                self.trees += u64::from(tile.count);
            }
        }
        self.order.sort_unstable_by(|a, b| a.0[0].total_cmp(&b.0[0]).then(a.1.cmp(&b.1)));
        self.firsts = [[0; 4]; MOST_BANDS];
        let mut begin = 0.0f32;
        let mut end = FIRST_BAND * reach.iter().copied().fold(1.0, f64::max) as f32;
        for (b, band) in self.firsts.iter_mut().enumerate().take(count) {
            if b + 1 == count || f64::from(begin) >= last {
                end = f32::MAX;
            }
            let first = self.tiles.len();
            for ([_, farthest], i) in self.order.iter().take_while(|t| t.0[0] < end) {
                if *farthest >= begin {
                    let tile = &tiles[*i as usize];
                    self.tiles.push([tile.first, tile.count]);
                }
            }
            let many = self.tiles.len() - first;
            *band = [first as u32, many as u32, begin.to_bits(), end.to_bits()];
            if end == f32::MAX {
                break;
            }
            (begin, end) = (end, end * BAND_GROWTH);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use forest_soup::Projection;

    #[test]
    fn bands_are_all_tiles_before_the_camera_from_near_to_far() {
        let tile = |i: u32| {
            let z = -30.0 * i as f32;
            let min = [-5.0, 0.0, z];
            Tile { species: 0, first: i * 10, count: 10, min, max: [5.0, 0.0, z] }
        };
        let tiles: Vec<Tile> = (0..40).rev().map(tile).collect();
        let projection = Projection::Perspective { fov_y: 1.0 };
        let eye = DVec3::new(0.0, 2.0, -300.0);
        let camera = Camera::new(eye, -DVec3::Z, projection, [64, 64]);
        let mut bands = Bands::default();
        bands.fill(&tiles, &[5.0], &camera, 4, f64::INFINITY);
        // Those behind are left out, but for the one that the eye stands in.
        assert_eq!(bands.trees, 300);
        assert_eq!(bands.tiles[0], [100, 10]);
        let ends: Vec<f32> = bands.firsts.iter().map(|b| f32::from_bits(b[3])).collect();
        assert_eq!(ends[..4], [7.5, 12.0, 19.2, f32::MAX]);
        // The first tile, 13 m to its far corner, lies in three bands; the second begins at 25 m.
        let counts: Vec<u32> = bands.firsts.iter().map(|b| b[1]).collect();
        assert_eq!(counts[..4], [1, 1, 1, 29]);
        assert_eq!(bands.firsts[3][0], 3);
        // From 10 m on nothing hides: one band for all that is farther.
        bands.fill(&tiles, &[5.0], &camera, 4, 10.0);
        let counts: Vec<u32> = bands.firsts.iter().map(|b| b[1]).collect();
        assert_eq!(counts[..4], [1, 1, 30, 0]);
    }
}
