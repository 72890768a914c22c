//! Reading the volume of a pack.

use crate::atlas::Codewords;
use crate::header::{Coding, NodeRecord, VolumeHeader};
use crate::lattice::Lattice;
use crate::validate::{StoredLevel, validate, validate_header};
use forest_pack::measures::{ErrorKind, Light, Need};
use forest_pack::{Codec, Pack, PackError, SectionId, header, kind};
use forest_soup::Camera;
use forest_vq::{bits_for, read_bits};
use glam::DVec3;

/// The volume representation of a pack; billboards stay in the memory map until they are decoded.
#[derive(Clone, Debug)]
pub struct VolumeBlock<'a> {
    /// The header.
    pub header: VolumeHeader,
    /// Nodes of each level, from the root down.
    pub nodes: Vec<&'a [NodeRecord]>,
    /// Camera masks of each level: [`VolumeHeader::mask_words`] a node.
    pub masks: Vec<&'a [u32]>,
    lattice: Lattice,
    pack: &'a Pack,
}

impl<'a> VolumeBlock<'a> {
    /// Whether a pack has a volume.
    pub fn is_in(pack: &Pack) -> bool {
        pack.contains(SectionId::new(kind::VOLUME_HEADER, 0))
    }

    /// Opens and checks the volume of a pack, but for the numbers of codewords.
    ///
    /// # Errors
    /// When a section is missing or damaged, or breaks a rule of SPEC.md, section 7.
    pub fn open(pack: &'a Pack) -> Result<Self, PackError> {
        let id = SectionId::new(kind::VOLUME_HEADER, 0);
        let header: VolumeHeader = header::decode(pack, id)?;
        validate_header(&header).map_err(|problem| PackError::invalid(pack.path(), id, problem))?;
        let levels = 0..header.levels.len() as u32;
        let section = |kind| move |level| SectionId::new(kind, level);
        let nodes: Vec<&[NodeRecord]> = levels
            .clone()
            .map(section(kind::VOLUME_NODES))
            .map(|id| pack.records(id))
            .collect::<Result<_, _>>()?;
        let masks: Vec<&[u32]> = levels
            .map(section(kind::VOLUME_CAMERAS))
            .map(|id| pack.records(id))
            .collect::<Result<_, _>>()?;
        let stored: Vec<StoredLevel> =
            nodes.iter().zip(&masks).map(|(nodes, masks)| StoredLevel { nodes, masks }).collect();
        let invalid = |kind, level, problem| {
            PackError::invalid(pack.path(), SectionId::new(kind, level), problem)
        };
        validate(&header, &stored)
            .map_err(|(kind, level, problem)| invalid(kind, level, problem))?;
        let block = Self { lattice: header.lattice(), header, nodes, masks, pack };
        block.check_lengths()?;
        Ok(block)
    }

    /// The lattice of the cells.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// The billboard of a node for a camera, an index into its level's; `None` if it has none.
    #[inline]
    pub fn billboard(&self, level: usize, node: u32, camera: u32) -> Option<u32> {
        let words = self.header.mask_words();
        let mask = &self.masks[level][node as usize * words..][..words];
        let (word, bit) = (camera as usize / 32, camera % 32);
        if mask[word] >> bit & 1 == 0 {
            return None;
        }
        let before: u32 = mask[..word].iter().map(|m| m.count_ones()).sum();
        let here = (mask[word] & ((1 << bit) - 1)).count_ones();
        Some(self.nodes[level][node as usize].first_billboard + before + here)
    }

    /// What a pack's measured table is to be asked for this volume before `camera`.
    pub fn need(&self, camera: &Camera, error: ErrorKind) -> Need {
        let (height, elevation) = camera.sees(self.header.bounds.map(DVec3::from_array));
        Need {
            representation: kind::VOLUME_HEADER,
            pixel_height: height as f32,
            elevation: Some(elevation as f32),
            light: Light::Albedo,
            error,
        }
    }

    /// Stored bytes of one billboard, without its share of the atlas.
    pub fn billboard_bytes(&self) -> f64 {
        f64::from(self.header.coding.billboard_bits(self.header.billboard_texels())) / 8.0
    }

    /// Decodes the billboards of all levels: sRGB and alpha, `texels²` a billboard.
    ///
    /// # Errors
    /// When a section is damaged, or a number of a codeword is too large.
    pub fn texels(&self) -> Result<Vec<Vec<[u8; 4]>>, PackError> {
        let coding = self.header.coding;
        let levels = self.header.levels.iter().zip(0..);
        let Coding::Codebook { colors, alphas, .. } = coding else {
            return levels
                .map(|(_, l)| {
                    let stored = self.stored(kind::VOLUME_TEXELS, l)?;
                    Ok(stored.as_chunks::<4>().0.to_vec())
                })
                .collect();
        };
        let atlas = self.stored(kind::VOLUME_ATLAS, 0)?;
        let words = Codewords::decode(atlas, coding, self.header.texels);
        let t2 = self.header.billboard_texels();
        levels
            .map(|(level, l)| {
                let colors = self.numbers(kind::VOLUME_COLORS, l, level.billboards, colors)?;
                let alphas = self.numbers(kind::VOLUME_ALPHAS, l, level.billboards, alphas)?;
                let billboard = |(color, alpha): (&usize, &usize)| {
                    let colors = &words.colors[color * t2..][..t2];
                    let alphas = &words.alphas[alpha * t2..][..t2];
                    colors.iter().zip(alphas).map(|(&[r, g, b], &a)| [r, g, b, a])
                };
                Ok(colors.iter().zip(&alphas).flat_map(billboard).collect())
            })
            .collect()
    }

    /// The raw texels of a level, sRGB and alpha, where they lie; empty if there are codes instead.
    ///
    /// # Errors
    /// When the section is damaged.
    pub fn stored_texels(&self, level: u32) -> Result<&'a [u8], PackError> {
        match self.header.coding {
            Coding::Texels => self.stored(kind::VOLUME_TEXELS, level),
            Coding::Codebook { .. } => Ok(&[]),
        }
    }

    /// The packed colour and alpha codes of a level where they lie ([`forest_vq::read_bits`]), each
    /// checked to be of a codeword; empty if there are raw texels instead.
    ///
    /// # Errors
    /// When a section is damaged, or a number of a codeword is too large.
    pub fn stored_codes(&self, level: u32) -> Result<[&'a [u8]; 2], PackError> {
        let Coding::Codebook { colors, alphas, .. } = self.header.coding else {
            return Ok([&[], &[]]);
        };
        let count = self.header.levels[level as usize].billboards;
        self.numbers(kind::VOLUME_COLORS, level, count, colors)?;
        self.numbers(kind::VOLUME_ALPHAS, level, count, alphas)?;
        Ok([self.stored(kind::VOLUME_COLORS, level)?, self.stored(kind::VOLUME_ALPHAS, level)?])
    }

    /// The atlas of codewords where it lies; empty without one.
    ///
    /// # Errors
    /// When the section is damaged.
    pub fn stored_atlas(&self) -> Result<&'a [u8], PackError> {
        match self.header.coding {
            Coding::Texels => Ok(&[]),
            Coding::Codebook { .. } => self.stored(kind::VOLUME_ATLAS, 0),
        }
    }

    /// Numbers of codewords of a level, each below `words`.
    fn numbers(
        &self,
        kind: u16,
        level: u32,
        count: u32,
        words: u32,
    ) -> Result<Vec<usize>, PackError> {
        let stored = self.stored(kind, level)?;
        let bits = bits_for(words as usize);
        (0..count as usize)
            .map(|i| match read_bits(stored, bits, i) {
                n if n < words => Ok(n as usize),
                n => {
                    let problem = format!("billboard {i} has codeword {n} of {words}");
                    Err(PackError::invalid(self.pack.path(), SectionId::new(kind, level), problem))
                }
            })
            .collect()
    }

    fn stored(&self, kind: u16, level: u32) -> Result<&'a [u8], PackError> {
        self.pack.records::<u8>(SectionId::new(kind, level))
    }

    /// Sections must be there, as they are read, exactly where the coding asks for them.
    fn check_lengths(&self) -> Result<(), PackError> {
        let found = |id: SectionId| self.pack.sections().find(|(s, _)| *s == id).map(|(_, s)| s);
        let coding = self.header.coding;
        let check = |id: SectionId, want: Option<u64>| {
            let section = found(id);
            let invalid = |problem: String| PackError::invalid(self.pack.path(), id, problem);
            if section.is_some_and(|s| s.codec != Codec::None) {
                return Err(invalid("is compressed; billboards must not be".into()));
            }
            let length = section.map(|s| s.length);
            if length != want {
                let text = |n: Option<u64>| n.map_or("no section".into(), |n| format!("{n} bytes"));
                let problem = format!("{}; the header asks for {}", text(length), text(want));
                return Err(invalid(problem));
            }
            Ok(())
        };
        for (l, level) in (0..).zip(&self.header.levels) {
            let n = u64::from(level.billboards);
            let packed = |words: u32| (n * u64::from(bits_for(words as usize))).div_ceil(32) * 4;
            let wants = match coding {
                Coding::Texels => [Some(n * self.header.billboard_texels() as u64 * 4), None, None],
                Coding::Codebook { colors, alphas, .. } => {
                    [None, Some(packed(colors)), Some(packed(alphas))]
                }
            };
            let kinds = [kind::VOLUME_TEXELS, kind::VOLUME_COLORS, kind::VOLUME_ALPHAS];
            for (kind, want) in kinds.into_iter().zip(wants) {
                check(SectionId::new(kind, l), want)?;
            }
        }
        let atlas = matches!(coding, Coding::Codebook { .. });
        let want = atlas.then(|| coding.atlas_bytes(self.header.texels));
        check(SectionId::new(kind::VOLUME_ATLAS, 0), want)
    }
}
