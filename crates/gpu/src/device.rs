//! Adapters and devices.

use crate::error::GpuError;
use std::sync::{Arc, Mutex};
use wgpu::{
    Adapter, Backends, Buffer, BufferUsages, Device, DeviceType, DownlevelFlags, Features,
    Instance, InstanceDescriptor, Limits, Queue, Surface,
};

/// Features that are used where an adapter has them.
const WELCOME: Features = Features::TIMESTAMP_QUERY
    .union(Features::TIMESTAMP_QUERY_INSIDE_ENCODERS)
    .union(Features::SHADER_INT64)
    .union(Features::SHADER_INT64_ATOMIC_MIN_MAX)
    .union(Features::TEXTURE_COMPRESSION_BC);

/// What passes cannot do without.
const NEEDED: DownlevelFlags = DownlevelFlags::COMPUTE_SHADERS
    .union(DownlevelFlags::VERTEX_STORAGE)
    .union(DownlevelFlags::INDIRECT_EXECUTION);

/// Bytes of the largest record: arrays in shaders have at least one.
const LEAST_BUFFER: u64 = 64;

/// A device and its queue.
#[derive(Debug)]
pub struct Gpu {
    /// The adapter it is of.
    pub adapter: Adapter,
    /// The device.
    pub device: Device,
    /// Its queue.
    pub queue: Queue,
    failed: Arc<Mutex<Option<String>>>,
}

/// A handle of the display that windows are on.
pub type Display = Box<dyn wgpu::wgt::WgpuHasDisplayHandle>;

/// Where adapters are looked for: Vulkan, and OpenGL too where there is no Vulkan adapter or `all` are
/// wanted. Variable `WGPU_BACKEND` names others.
pub fn instance(all: bool, display: Option<Display>) -> Instance {
    let of = |backends, display| {
        let none = InstanceDescriptor::new_without_display_handle();
        Instance::new(InstanceDescriptor { backends, display, ..none })
    };
    let chosen = Backends::from_env().unwrap_or_else(|| {
        // OpenGL's libraries are noisy where there is no display.
        match all || adapters(&of(Backends::VULKAN, None)).is_empty() {
            true => Backends::VULKAN | Backends::GL,
            false => Backends::VULKAN,
        }
    });
    of(chosen, display)
}

/// The adapters of this machine, the best first: graphics cards before software, Vulkan before
/// OpenGL.
pub fn adapters(instance: &Instance) -> Vec<Adapter> {
    let mut all = pollster::block_on(instance.enumerate_adapters(Backends::all()));
    all.sort_by_key(|a| {
        let info = a.get_info();
        let kind = match info.device_type {
            DeviceType::DiscreteGpu => 0,
            DeviceType::IntegratedGpu => 1,
            DeviceType::VirtualGpu => 2,
            DeviceType::Other => 3,
            DeviceType::Cpu => 4,
        };
        (kind, info.backend != wgpu::Backend::Vulkan)
    });
    all
}

/// An adapter in words: name, driver, backend and kind.
pub fn describe(adapter: &Adapter) -> String {
    let info = adapter.get_info();
    let driver = if info.driver_info.is_empty() { info.driver } else { info.driver_info };
    format!("{} ({driver}; {:?}, {:?})", info.name, info.backend, info.device_type)
}

impl Gpu {
    /// Opens the best adapter whose description contains `wanted` (whatever the case), and that can
    /// show pictures on `surface` if there is one.
    ///
    /// # Errors
    /// When there is none, or it cannot do what the passes need.
    pub fn open(
        instance: &Instance,
        wanted: Option<&str>,
        surface: Option<&Surface>,
    ) -> Result<Self, GpuError> {
        let all = adapters(instance);
        let fits = |a: &&Adapter| {
            let name = describe(a).to_lowercase();
            wanted.is_none_or(|w| name.contains(&w.to_lowercase()))
                && surface.is_none_or(|s| a.is_surface_supported(s))
        };
        // The next one, where the best does not open.
        let mut refused = None;
        for adapter in all.iter().filter(fits) {
            match Self::of(adapter.clone()) {
                Ok(gpu) => return Ok(gpu),
                Err(e) => refused = refused.or(Some(e)),
            }
        }
        Err(refused.unwrap_or_else(|| {
            let names: Vec<String> = all.iter().map(describe).collect();
            let name = wanted.map_or(String::new(), |w| format!(" named {w:?}"));
            let place = if surface.is_some() { " for this window" } else { "" };
            GpuError::NoAdapter {
                wanted: format!("{name}{place}"),
                found: match names.len() {
                    0 => String::new(),
                    _ => format!(". There is: {}", names.join("; ")),
                },
            }
        }))
    }

    /// Opens an adapter.
    ///
    /// # Errors
    /// When it cannot do what the passes need.
    pub fn of(adapter: Adapter) -> Result<Self, GpuError> {
        let missing = NEEDED - adapter.get_downlevel_capabilities().flags;
        let unsuited = |missing| GpuError::Unsuited { adapter: describe(&adapter), missing };
        if !missing.is_empty() {
            return Err(unsuited(format!("lacks {missing:?}")));
        }
        let limits: Limits = adapter.limits();
        if limits.max_storage_buffers_per_shader_stage < 6 {
            let n = limits.max_storage_buffers_per_shader_stage;
            return Err(unsuited(format!("{n} storage buffers a stage; 6 are needed")));
        }
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("forest"),
            required_features: adapter.features() & WELCOME,
            required_limits: limits,
            ..Default::default()
        }))
        .map_err(|e| unsuited(format!("gives no device: {e}")))?;
        let failed = Arc::new(Mutex::new(None));
        // Said by the next call of `check`, instead of a panic.
        let (on_error, on_loss) = (Arc::clone(&failed), Arc::clone(&failed));
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| note(&on_error, e.to_string())));
        device.set_device_lost_callback(move |reason, text| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                note(&on_loss, format!("lost: {text}"));
            }
        });
        Ok(Self { adapter, device, queue, failed })
    }

    /// The adapter in words.
    pub fn name(&self) -> String {
        describe(&self.adapter)
    }

    /// Whether the device has `feature`.
    pub fn has(&self, feature: Features) -> bool {
        self.device.features().contains(feature)
    }

    /// Whether compressed textures are given to the device as they are: where it reads blocks, and has
    /// circuits for that. Software adapters decode a block for every texel that they load.
    pub(crate) fn takes_blocks(&self) -> bool {
        let software = self.adapter.get_info().device_type == DeviceType::Cpu;
        self.has(Features::TEXTURE_COMPRESSION_BC) && !software
    }

    /// Waits until the device has done all that it was given, and says whether something failed since the
    /// last time.
    ///
    /// # Errors
    /// What failed first.
    pub fn finish(&self) -> Result<(), GpuError> {
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        waited.map(drop).map_err(|e| GpuError::Device(e.to_string()))
    }

    /// Whether something failed since the last time.
    ///
    /// # Errors
    /// What failed first.
    pub fn check(&self) -> Result<(), GpuError> {
        let failed = self.failed.lock().unwrap_or_else(|e| e.into_inner()).take();
        failed.map_or(Ok(()), |text| Err(GpuError::Device(text)))
    }

    /// A buffer of `size` bytes, or of one record for nothing.
    ///
    /// # Errors
    /// When it is larger than the device binds.
    pub(crate) fn buffer(
        &self,
        what: &str,
        size: u64,
        usage: BufferUsages,
    ) -> Result<Buffer, GpuError> {
        let limits = self.device.limits();
        let storage = usage.contains(BufferUsages::STORAGE);
        let bound = if storage { limits.max_storage_buffer_binding_size } else { u64::MAX };
        let limit = limits.max_buffer_size.min(bound);
        self.within(what, size, "bytes", limit)?;
        Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(what),
            size: size.next_multiple_of(16).max(LEAST_BUFFER),
            usage: usage | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        }))
    }

    /// A storage buffer that holds `parts`, one after the other: straight from the memory map.
    ///
    /// # Errors
    /// When it is larger than the device binds.
    pub(crate) fn storage(&self, what: &str, parts: &[&[u8]]) -> Result<Buffer, GpuError> {
        let size: u64 = parts.iter().map(|p| p.len() as u64).sum();
        let buffer = self.buffer(what, size, BufferUsages::STORAGE)?;
        let mut at = 0;
        for part in parts {
            // Writes must be of whole words.
            let whole = part.len() & !3;
            self.queue.write_buffer(&buffer, at, &part[..whole]);
            if whole < part.len() {
                let mut last = [0; 4];
                last[..part.len() - whole].copy_from_slice(&part[whole..]);
                self.queue.write_buffer(&buffer, at + whole as u64, &last);
            }
            at += part.len() as u64;
        }
        Ok(buffer)
    }

    /// # Errors
    /// When `size` is above `limit`.
    pub(crate) fn within(
        &self,
        what: &str,
        size: u64,
        unit: &'static str,
        limit: u64,
    ) -> Result<(), GpuError> {
        if size <= limit {
            return Ok(());
        }
        Err(GpuError::TooLarge { what: what.into(), size, unit, limit, adapter: self.name() })
    }
}

fn note(failed: &Mutex<Option<String>>, text: String) {
    failed.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(text);
}
