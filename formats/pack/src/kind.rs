//! The registry of section kinds. Numbers are for ever; a new layout gets a new number.

/// What was baked from what: [`crate::header::Meta`].
pub const META: u16 = 1;
/// Measured errors and costs of all representations: [`crate::measures::Measures`].
pub const MEASURES: u16 = 2;
/// Header of the points representation (owner: `forest-points`).
pub const POINTS_HEADER: u16 = 16;
/// Cell table, 64 bytes a cell.
pub const POINTS_CELLS: u16 = 17;
/// Point records, 16 bytes a point.
pub const POINTS: u16 = 18;
/// Triangle records, 40 bytes a triangle.
pub const POINTS_TRIANGLES: u16 = 19;
/// Vertex colours of those triangles, 12 bytes a triangle.
pub const POINTS_TRIANGLE_COLORS: u16 = 20;
/// Factors on the areas of points by size: 53 single-precision numbers.
pub const POINTS_CALIBRATION: u16 = 21;
/// What a pruned pack leaves out.
pub const POINTS_PRUNED: u16 = 22;
/// Materials and the list of textures: [`crate::header::Materials`].
pub const MATERIALS: u16 = 32;
/// Texels of one texture, RGBA, 8 bits each; the index is the texture's number.
pub const TEXTURE: u16 = 33;

/// Header of the views representation (owner: `forest-views`).
pub const VIEWS_HEADER: u16 = 48;
/// Tile table of a level, 16 bytes a view; the index is the level's number.
pub const VIEWS_TILES: u16 = 49;
/// Colour and coverage of a level's pages.
pub const VIEWS_COLOR: u16 = 50;
/// Normals of a level's pages.
pub const VIEWS_NORMAL: u16 = 51;
/// Depth of a level's pages.
pub const VIEWS_DEPTH: u16 = 52;
/// Share of the sky that is seen, of a level's pages.
pub const VIEWS_SKY: u16 = 53;

/// Header of the volume representation (owner: `forest-volume`).
pub const VOLUME_HEADER: u16 = 64;
/// Nodes of a level, 20 bytes each; the index is the level's number.
pub const VOLUME_NODES: u16 = 65;
/// Of each node of a level, the cameras for which it has billboards.
pub const VOLUME_CAMERAS: u16 = 66;
/// Texels of a level's billboards, if there are no codebooks.
pub const VOLUME_TEXELS: u16 = 67;
/// Numbers of the colour codewords of a level's billboards.
pub const VOLUME_COLORS: u16 = 68;
/// Numbers of the alpha codewords of a level's billboards.
pub const VOLUME_ALPHAS: u16 = 69;
/// The atlas of codewords.
pub const VOLUME_ATLAS: u16 = 70;

/// Header of the foliage representation (owner: `forest-foliage`).
pub const FOLIAGE_HEADER: u16 = 80;
/// Vertices of a level, 40 bytes each; the index is the level's number.
pub const FOLIAGE_VERTICES: u16 = 81;
/// Triangles of a level, 12 bytes each.
pub const FOLIAGE_INDICES: u16 = 82;
/// The texture dictionary; the index is the resolution's number.
pub const FOLIAGE_ATLAS: u16 = 83;
/// Branches as wind moves them, 64 bytes each.
pub const WIND_BRANCHES: u16 = 96;
/// What moves each point, 4 bytes each.
pub const WIND_POINTS: u16 = 97;
/// What moves each corner of the points' triangles, 12 bytes a triangle.
pub const WIND_TRIANGLES: u16 = 98;

/// What a crown shows of sun and sky, for representations without shadow maps.
pub const LIGHT_CROWN: u16 = 112;

/// Name of a kind for people; unknown kinds are named by number.
pub fn name(kind: u16) -> String {
    match kind {
        META => "meta".into(),
        MEASURES => "measures".into(),
        POINTS_HEADER => "points.header".into(),
        POINTS_CELLS => "points.cells".into(),
        POINTS => "points".into(),
        POINTS_TRIANGLES => "points.triangles".into(),
        POINTS_TRIANGLE_COLORS => "points.triangle-colors".into(),
        POINTS_CALIBRATION => "points.calibration".into(),
        POINTS_PRUNED => "points.pruned".into(),
        MATERIALS => "materials".into(),
        TEXTURE => "texture".into(),
        VIEWS_HEADER => "views.header".into(),
        VIEWS_TILES => "views.tiles".into(),
        VIEWS_COLOR => "views.color".into(),
        VIEWS_NORMAL => "views.normal".into(),
        VIEWS_DEPTH => "views.depth".into(),
        VIEWS_SKY => "views.sky".into(),
        VOLUME_HEADER => "volume.header".into(),
        VOLUME_NODES => "volume.nodes".into(),
        VOLUME_CAMERAS => "volume.cameras".into(),
        VOLUME_TEXELS => "volume.texels".into(),
        VOLUME_COLORS => "volume.colors".into(),
        VOLUME_ALPHAS => "volume.alphas".into(),
        VOLUME_ATLAS => "volume.atlas".into(),
        FOLIAGE_HEADER => "foliage.header".into(),
        FOLIAGE_VERTICES => "foliage.vertices".into(),
        FOLIAGE_INDICES => "foliage.indices".into(),
        FOLIAGE_ATLAS => "foliage.atlas".into(),
        WIND_BRANCHES => "wind.branches".into(),
        WIND_POINTS => "wind.points".into(),
        WIND_TRIANGLES => "wind.triangles".into(),
        LIGHT_CROWN => "light.crown".into(),
        other => format!("kind-{other}"),
    }
}

/// Names one section: its kind, and which of that kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SectionId {
    /// One of this module's constants.
    pub kind: u16,
    /// Number within the kind; 0 where there is only one.
    pub index: u32,
}

impl SectionId {
    /// Section `index` of `kind`.
    pub const fn new(kind: u16, index: u32) -> Self {
        Self { kind, index }
    }
}

impl std::fmt::Display for SectionId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}[{}]", name(self.kind), self.index)
    }
}
