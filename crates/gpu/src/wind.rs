//! Branches on a device, and what hangs on them.

use crate::bind::{self, Kind};
use crate::device::Gpu;
use crate::error::GpuError;
use forest_foliage::{BranchPose, BranchRecord, FoliageBlock, Hung, Posed};
use wgpu::{BindGroup, BindGroupLayout, Buffer, BufferUsages, ShaderStages};

/// The branches of a pack's foliage, and how they stand in this frame.
#[derive(Debug)]
pub(crate) struct WindModel {
    pub(crate) branches: Buffer,
    pub(crate) poses: Buffer,
}

impl WindModel {
    pub(crate) fn load(gpu: &Gpu, block: &FoliageBlock) -> Result<Self, GpuError> {
        let branches = gpu.storage("branches", &[bytemuck::cast_slice(block.branches)])?;
        let bytes = (block.branches.len() * size_of::<BranchPose>()) as u64;
        let poses = gpu.buffer("poses of branches", bytes, BufferUsages::STORAGE)?;
        Ok(Self { branches, poses })
    }

    /// Uploads how the branches stand.
    pub(crate) fn prepare(&self, gpu: &Gpu, posed: &Posed) {
        gpu.queue.write_buffer(&self.poses, 0, bytemuck::cast_slice(&posed.pose().branches));
    }
}

/// The group of bend.wgsl.
pub(crate) fn layout(gpu: &Gpu, stages: ShaderStages) -> BindGroupLayout {
    bind::layout(&gpu.device, "wind", stages, &[Kind::Read; 3])
}

/// What moves the things that `hung` has an entry for; without branches nothing does.
pub(crate) fn group(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    tied: Option<(&WindModel, &[Hung])>,
) -> Result<BindGroup, GpuError> {
    let none = gpu.storage("no wind", &[&[0; size_of::<BranchRecord>()]])?;
    let (branches, poses, hung) = match tied {
        Some((wind, hung)) => {
            let hung = gpu.storage("what hangs on branches", &[bytemuck::cast_slice(hung)])?;
            (wind.branches.clone(), wind.poses.clone(), hung)
        }
        None => (none.clone(), none.clone(), none),
    };
    let all = [&branches, &poses, &hung].map(Buffer::as_entire_binding);
    Ok(bind::group(&gpu.device, "wind", layout, &all))
}
