//! A volume into the sections of a pack.

use crate::error::VolumeError;
use crate::header::{Coding, LevelHeader, VolumeHeader};
use crate::options::CodebookOptions;
use crate::quantise::{Effort, Quality, quantise};
use crate::validate::validate_header;
use crate::volume::Volume;
use forest_pack::{Codec, PackWriter, SectionId, header, kind};
use forest_vq::{bits_for, pack_bits};
use std::time::{Duration, Instant};

/// What was written.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeReport {
    /// The header.
    pub header: VolumeHeader,
    /// How near the codebooks come; `None` for texels as they are.
    pub quality: Option<Quality>,
    /// How the training of the colour and of the alpha codebook went.
    pub effort: [Effort; 2],
    /// Bytes of all billboards, four a texel.
    pub raw_bytes: u64,
    /// Bytes of what stands for them: numbers of codewords and the atlas, or the texels.
    pub texture_bytes: u64,
    /// Bytes of nodes and camera masks.
    pub node_bytes: u64,
    /// Training and packing.
    pub encode: Duration,
}

/// Adds the sections of the volume representation to `writer`: billboards by codebooks, or texel
/// by texel without.
///
/// # Errors
/// When no codebook is good enough, or the pack cannot be written.
pub fn bake(
    volume: &Volume,
    codebook: Option<&CodebookOptions>,
    writer: &mut PackWriter,
) -> Result<BakeReport, VolumeError> {
    let start = Instant::now();
    let side = volume.options.texels;
    let t2 = (side * side) as usize;
    // Without billboards there is nothing to train.
    let codebook = codebook.filter(|_| volume.billboards() > 0);
    let coded = codebook.map(|options| quantise(&volume.texels(), side, options)).transpose()?;
    let coding = coded.as_ref().map_or(Coding::Texels, |q| q.coding);
    let level = |l: &crate::VolumeLevel| LevelHeader {
        nodes: l.nodes.len() as u32,
        billboards: (l.texels.len() / t2) as u32,
    };
    let header = VolumeHeader {
        corner: volume.lattice.corner.to_array(),
        side: volume.lattice.side,
        bounds: volume.bounds.map(|b| b.to_array()),
        branching: volume.lattice.branching,
        texels: side,
        prune: volume.options.prune,
        cameras: volume.cameras.clone(),
        levels: volume.levels.iter().map(level).collect(),
        coding,
    };
    validate_header(&header).map_err(VolumeError::Options)?;
    let (mut node_bytes, mut texture_bytes, mut first) = (0, 0, 0);
    for (l, level) in (0..).zip(&volume.levels) {
        let mut add = |kind, bytes: &[u8]| -> Result<u64, VolumeError> {
            writer.add(SectionId::new(kind, l), Codec::None, bytes)?;
            Ok(bytes.len() as u64)
        };
        node_bytes += add(kind::VOLUME_NODES, bytemuck::cast_slice(&level.nodes))?;
        node_bytes += add(kind::VOLUME_CAMERAS, bytemuck::cast_slice(&level.masks))?;
        let count = level.texels.len() / t2;
        match (&coded, coding) {
            (Some(q), Coding::Codebook { colors, alphas, .. }) => {
                let numbers = [
                    (kind::VOLUME_COLORS, &q.colors, colors),
                    (kind::VOLUME_ALPHAS, &q.alphas, alphas),
                ];
                for (kind, numbers, words) in numbers {
                    let of_level = &numbers[first..first + count];
                    texture_bytes += add(kind, &pack_bits(of_level, bits_for(words as usize)))?;
                }
            }
            _ => texture_bytes += add(kind::VOLUME_TEXELS, level.texels.as_flattened())?,
        }
        first += count;
    }
    if let Some(q) = &coded {
        writer.add(SectionId::new(kind::VOLUME_ATLAS, 0), Codec::None, &q.atlas)?;
        texture_bytes += q.atlas.len() as u64;
    }
    header::write(writer, SectionId::new(kind::VOLUME_HEADER, 0), &header)?;
    Ok(BakeReport {
        header,
        quality: coded.as_ref().map(|q| q.quality),
        effort: coded.as_ref().map(|q| q.effort).unwrap_or_default(),
        raw_bytes: volume.billboards() * t2 as u64 * 4,
        texture_bytes,
        node_bytes,
        encode: start.elapsed(),
    })
}
