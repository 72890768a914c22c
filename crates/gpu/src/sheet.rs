//! Pictures of all sizes in one array of textures: software adapters bind no arrays of textures.

use crate::device::Gpu;
use crate::error::GpuError;
use etagere::{AllocatorOptions, AtlasAllocator, size2};
use wgpu::{Texture, TextureFormat};

/// Where a picture lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) corner: [u32; 2],
    pub(crate) layer: u32,
}

/// The places of pictures in an array of textures.
#[derive(Debug)]
pub(crate) struct Sheet {
    layer: [u32; 2],
    layers: u32,
    pub(crate) places: Vec<Place>,
}

impl Sheet {
    /// Room for pictures of these sizes; layers are as large as the largest asks for. Corners are
    /// multiples of 4.
    pub(crate) fn new(gpu: &Gpu, sizes: &[[u32; 2]]) -> Result<Self, GpuError> {
        let limit = gpu.device.limits().max_texture_dimension_2d;
        let longest = |k: usize| sizes.iter().map(|s| s[k]).max().unwrap_or(4).max(4);
        let layer = [longest(0), longest(1)].map(|n| n.next_multiple_of(4));
        let side = layer[0].max(layer[1]).into();
        gpu.within("a texture", side, "texels a side", limit.into())?;
        let places = places(sizes, layer);
        let layers = places.iter().map(|p| p.layer + 1).max().unwrap_or(1);
        Ok(Self { layer, layers, places })
    }

    /// An array with these places.
    pub(crate) fn texture(
        &self,
        gpu: &Gpu,
        what: &str,
        format: TextureFormat,
    ) -> Result<Texture, GpuError> {
        gpu.texture_array(what, self.layer, self.layers, format)
    }
}

/// Places for pictures of at most the size of a layer, the largest first.
fn places(sizes: &[[u32; 2]], layer: [u32; 2]) -> Vec<Place> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse((sizes[i][1], sizes[i][0])));
    let mut places = vec![Place { corner: [0; 2], layer: 0 }; sizes.len()];
    let size = |[w, h]: [u32; 2]| size2(w as i32, h as i32);
    // Blocks of compressed texels are four by four.
    let options = AllocatorOptions { alignment: size2(4, 4), ..Default::default() };
    let mut layers: Vec<AtlasAllocator> = Vec::new();
    for i in order {
        let found =
            layers.iter_mut().zip(0..).find_map(|(l, n)| Some((l.allocate(size(sizes[i]))?, n)));
        let (place, n) = found.unwrap_or_else(|| {
            let mut fresh = AtlasAllocator::with_options(size(layer), &options);
            let place = fresh.allocate(size(sizes[i])).expect("no larger than a layer");
            layers.push(fresh);
            (place, layers.len() as u32 - 1)
        });
        let corner = [place.rectangle.min.x as u32, place.rectangle.min.y as u32];
        places[i] = Place { corner, layer: n };
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_do_not_overlap_and_share_layers() {
        let sizes = [[64, 64], [256, 128], [128, 256], [1, 1], [64, 64], [100, 50]];
        let places = places(&sizes, [256, 256]);
        for (i, (a, pa)) in sizes.iter().zip(&places).enumerate() {
            assert!((0..2).all(|k| pa.corner[k] + a[k] <= 256), "{pa:?}");
            for (b, pb) in sizes.iter().zip(&places).skip(i + 1) {
                let apart = (0..2).any(|k| {
                    pa.corner[k] + a[k] <= pb.corner[k] || pb.corner[k] + b[k] <= pa.corner[k]
                });
                assert!(pa.layer != pb.layer || apart, "{pa:?} {pb:?}");
            }
        }
        assert_eq!(places.iter().map(|p| p.layer).max(), Some(1));
    }
}
