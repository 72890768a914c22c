//! Time on the device.

use crate::device::Gpu;
use crate::error::GpuError;
use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, CommandEncoder, Features, MapMode, QuerySet,
    QuerySetDescriptor, QueryType,
};

/// Two timestamps of the device's clock about a picture.
#[derive(Debug)]
pub struct Timer {
    queries: QuerySet,
    resolved: Buffer,
    read: Buffer,
    /// Nanoseconds of a tick.
    period: f64,
}

impl Timer {
    /// `None` where the device has no clock.
    pub fn new(gpu: &Gpu) -> Option<Self> {
        let needed = Features::TIMESTAMP_QUERY | Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        if !gpu.has(needed) {
            return None;
        }
        let buffer = |usage| {
            let label = Some("timestamps");
            let descriptor = BufferDescriptor { label, size: 16, usage, mapped_at_creation: false };
            gpu.device.create_buffer(&descriptor)
        };
        Some(Self {
            queries: gpu.device.create_query_set(&QuerySetDescriptor {
                label: Some("timestamps"),
                ty: QueryType::Timestamp,
                count: 2,
            }),
            resolved: buffer(BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            read: buffer(BufferUsages::COPY_DST | BufferUsages::MAP_READ),
            period: f64::from(gpu.queue.get_timestamp_period()),
        })
    }

    pub(crate) fn begin(&self, encoder: &mut CommandEncoder) {
        encoder.write_timestamp(&self.queries, 0);
    }

    pub(crate) fn end(&self, encoder: &mut CommandEncoder) {
        encoder.write_timestamp(&self.queries, 1);
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.read, 0, 16);
    }

    /// Milliseconds of the last picture; waits for it.
    ///
    /// # Errors
    /// When the device failed.
    pub fn milliseconds(&self, gpu: &Gpu) -> Result<f64, GpuError> {
        let ticks = read(gpu, &self.read)?;
        let at = |i: usize| u64::from_le_bytes(ticks[8 * i..][..8].try_into().unwrap_or_default());
        Ok(at(1).saturating_sub(at(0)) as f64 * self.period * 1e-6)
    }
}

/// The bytes of a buffer that can be mapped; waits for all work on it.
pub(crate) fn read(gpu: &Gpu, buffer: &Buffer) -> Result<Vec<u8>, GpuError> {
    buffer.map_async(MapMode::Read, .., |_| {});
    gpu.finish()?;
    let bytes = match buffer.get_mapped_range(..) {
        Ok(view) => view.to_vec(),
        Err(e) => return Err(GpuError::Device(e.to_string())),
    };
    buffer.unmap();
    Ok(bytes)
}
