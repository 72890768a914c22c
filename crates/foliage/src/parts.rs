//! Wood or leaf: what each triangle belongs to.
//!
//! A material is decided as a whole where something speaks for it, most certain first: what the
//! user says, a texture that is mostly transparent (a card), words in its name, a texture that is
//! transparent here and there. Else each connected piece of it is decided by its shape: tubes are
//! wood, cards and blobs are leaves.

use crate::error::FoliageError;
use crate::tensor::NormalTensor;
use crate::weld::Welded;
use forest_soup::{AlphaMode, Material, ShadedTexture, TriangleSoup};
use glam::DVec3;

/// What a triangle belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// Trunk, branches, twigs.
    Wood,
    /// Leaves, needles, blossoms, fruits.
    Leaf,
}

/// Why a material is thought to be what it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The user says so.
    Told,
    /// Its texture covers less than it.
    Alpha,
    /// Words in its name.
    Name,
    /// The shape of its connected pieces, one by one.
    Shape,
}

impl Reason {
    /// A word for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Told => "told",
            Self::Alpha => "alpha",
            Self::Name => "name",
            Self::Shape => "shape",
        }
    }
}

/// What was decided of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialParts {
    /// Its name in the source.
    pub name: String,
    /// Triangles with finite corners.
    pub triangles: usize,
    /// Of them, leaves.
    pub leaf_triangles: usize,
    /// Share of its triangles that its texture covers.
    pub coverage: f64,
    /// Why.
    pub reason: Reason,
}

/// What every triangle of a soup belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// One a triangle; `None` for corners that are not finite.
    pub of: Vec<Option<Part>>,
    /// What was decided, by material.
    pub materials: Vec<MaterialParts>,
}

/// Names of materials that the user knows; a name matches if it contains one, in any case.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PartsOptions {
    /// Leaves.
    pub leaf: Vec<String>,
    /// Wood.
    pub wood: Vec<String>,
}

/// Textures that cover less than this are cut out: leaves on cards, whatever their name.
const CUT_OUT: f64 = 0.9;

/// Textures that cover less are transparent here and there.
const PIERCED: f64 = 0.995;

/// Beginnings of words that name leaves and wood.
const LEAF_WORDS: [&str; 14] = [
    "leaf", "leav", "foliage", "needle", "frond", "petal", "flower", "blossom", "bloom", "berr",
    "fruit", "blatt", "blätt", "feuill",
];
/// "Twig" is not one of them: it often names sprays of leaves.
const WOOD_WORDS: [&str; 10] =
    ["bark", "trunk", "branch", "wood", "stem", "log", "root", "rinde", "stamm", "ecorce"];

impl Parts {
    /// Decides for every triangle of `soup`.
    ///
    /// # Errors
    /// When a given name fits no material, or there are no leaves.
    pub fn of(soup: &TriangleSoup, options: &PartsOptions) -> Result<Self, FoliageError> {
        let names = || soup.materials.iter().map(|m| m.name.clone()).collect::<Vec<_>>();
        for pattern in options.leaf.iter().chain(&options.wood) {
            if !soup.materials.iter().any(|m| fits(&m.name, pattern)) {
                let pattern = pattern.clone();
                return Err(FoliageError::NoSuchMaterial { pattern, materials: names() });
            }
        }
        let bounds = soup.bounds();
        if bounds.is_empty() {
            return Err(FoliageError::NothingToSee);
        }
        let size = bounds.size().max_element();
        let finite = |i: &u32| soup.corners(*i as usize).iter().all(|p| p.is_finite());
        let mut out = Self { of: vec![None; soup.triangles.len()], materials: Vec::new() };
        for (m, material) in (0u16..).zip(&soup.materials) {
            let of_material = (0..soup.triangles.len() as u32)
                .filter(|i| soup.triangle_materials[*i as usize] == m);
            let triangles: Vec<u32> = of_material.filter(finite).collect();
            let coverage = coverage(soup, material, &triangles);
            let told = told(&material.name, options);
            let decided =
                told.map(|part| (part, Reason::Told)).or_else(|| seen(material, coverage));
            let count = triangles.len();
            match decided {
                Some((part, _)) => triangles.iter().for_each(|&i| out.of[i as usize] = Some(part)),
                None => by_shape(soup, triangles, size, &mut out.of),
            }
            let own = out.of.iter().zip(&soup.triangle_materials).filter(|(_, x)| **x == m);
            out.materials.push(MaterialParts {
                name: material.name.clone(),
                triangles: count,
                leaf_triangles: own.filter(|(p, _)| **p == Some(Part::Leaf)).count(),
                coverage,
                reason: decided.map_or(Reason::Shape, |d| d.1),
            });
        }
        if !out.of.contains(&Some(Part::Leaf)) {
            let triangles = soup.triangles.len();
            return Err(FoliageError::NoLeaves { triangles, materials: names() });
        }
        Ok(out)
    }

    /// Numbers of the triangles of a part.
    pub(crate) fn triangles(&self, part: Part) -> Vec<u32> {
        (0..).zip(&self.of).filter(|(_, p)| **p == Some(part)).map(|(i, _)| i).collect()
    }
}

fn fits(name: &str, pattern: &str) -> bool {
    name.to_lowercase().contains(&pattern.to_lowercase())
}

fn told(name: &str, options: &PartsOptions) -> Option<Part> {
    let any = |patterns: &[String]| patterns.iter().any(|p| fits(name, p));
    match (any(&options.leaf), any(&options.wood)) {
        (true, _) => Some(Part::Leaf),
        (false, true) => Some(Part::Wood),
        (false, false) => None,
    }
}

/// What texture and name say.
fn seen(material: &Material, coverage: f64) -> Option<(Part, Reason)> {
    if coverage < CUT_OUT {
        return Some((Part::Leaf, Reason::Alpha));
    }
    if let Some(part) = named(&material.name) {
        return Some((part, Reason::Name));
    }
    (coverage < PIERCED).then_some((Part::Leaf, Reason::Alpha))
}

/// What the words of a name say, if they agree.
fn named(name: &str) -> Option<Part> {
    let mut words = String::new();
    let mut before = ' ';
    for c in name.chars() {
        // A capital after a small letter begins a word.
        if c.is_uppercase() && before.is_lowercase() {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
        before = c;
    }
    let words: Vec<&str> = words.split(|c: char| !c.is_alphabetic()).collect();
    let any = |list: &[&str]| words.iter().any(|w| list.iter().any(|l| w.starts_with(l)));
    match (any(&LEAF_WORDS), any(&WOOD_WORDS)) {
        (true, false) => Some(Part::Leaf),
        (false, true) => Some(Part::Wood),
        _ => None,
    }
}

/// Triangles of a material at whose texture is looked.
const LOOKED_AT: usize = 4096;

/// Share of a material's triangles that its texture covers, under its alpha rule.
fn coverage(soup: &TriangleSoup, material: &Material, triangles: &[u32]) -> f64 {
    let Some(texture) = material.texture else { return 1.0 };
    if material.alpha_mode == AlphaMode::Opaque || soup.uvs.is_empty() {
        return 1.0;
    }
    let shaded = ShadedTexture::new(&soup.textures[texture as usize], material);
    let (mut covered, mut area) = (0.0, 0.0);
    for &i in triangles.iter().step_by(triangles.len().div_ceil(LOOKED_AT).max(1)) {
        let [a, b, c] = soup.corners(i as usize).map(|p| p.as_dvec3());
        let own = (b - a).cross(c - a).length();
        let uv = soup.triangles[i as usize].map(|v| soup.uvs[v as usize]);
        covered += own * f64::from(shaded.integrate(uv, 4)[3]);
        area += own;
    }
    if area > 0.0 { covered / area } else { 1.0 }
}

/// From this share of the area that faces one way, a piece is a card.
const CARD: f64 = 0.66;

/// Blobs face all ways: not less than this share faces along any axis. Those smaller than this share
/// of the tree are fruits, larger ones burls and stumps.
const BLOB: f64 = 0.18;
const FRUIT: f64 = 0.05;

fn by_shape(soup: &TriangleSoup, triangles: Vec<u32>, size: f64, of: &mut [Option<Part>]) {
    let welded = Welded::new(soup, triangles, size);
    for piece in welded.components() {
        let mut tensor = NormalTensor::default();
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &i in &piece {
            let [a, b, c] =
                welded.triangles[i as usize].map(|v| welded.positions[v as usize].as_dvec3());
            tensor.add((b - a).cross(c - a));
            (min, max) = (min.min(a).min(b).min(c), max.max(a).max(b).max(c));
        }
        let (shares, _) = tensor.axes();
        let fruit = shares[2] > BLOB && (max - min).max_element() < FRUIT * size;
        let part = if shares[0] > CARD || fruit { Part::Leaf } else { Part::Wood };
        piece.iter().for_each(|&i| of[welded.sources[i as usize] as usize] = Some(part));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_names_decide_if_they_agree() {
        for (name, want) in [
            ("Leaves_Mat", Some(Part::Leaf)),
            ("oakLeaf02", Some(Part::Leaf)),
            ("bark", Some(Part::Wood)),
            ("TreeTrunk", Some(Part::Wood)),
            ("Material.001", None),
            ("leaf_bark", None),
            ("catalog", None),
        ] {
            assert_eq!(named(name), want, "{name}");
        }
    }
}
