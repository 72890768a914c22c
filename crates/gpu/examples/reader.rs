//! The reader of docs/READER.md: the standard library, a memory map and wgpu, and none of our crates.
//! Usage: reader PACK PNG [SIZE CODE].

use std::error::Error;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

const PAGE: &str = include_str!("../../../docs/READER.md");
const SIDE: u32 = 512;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [pack, png, rest @ ..] = &args[..] else {
        return Err("usage: reader PACK PNG [CODE]".into());
    };
    let fine: u32 = rest.first().map_or(Ok(2500), |code| code.parse())?;
    let file = std::fs::File::open(pack)?;
    // SAFETY: packs are replaced by renaming, never written in place.
    #[expect(unsafe_code, reason = "memory maps have no safe constructor")]
    let map = unsafe { memmap2::Mmap::map(&file)? };
    let pixels = draw(&map, fine)?;
    image::RgbaImage::from_raw(SIDE, SIDE, pixels).ok_or("a picture")?.save(png)?;
    Ok(())
}

/// A number of `N` bytes at an offset.
fn at<const N: usize>(map: &[u8], offset: usize) -> Result<[u8; N], Box<dyn Error>> {
    Ok(map.get(offset..offset + N).ok_or("the file is too short")?.try_into()?)
}

/// Steps 1 and 2: the stored bytes of a section.
fn section(map: &[u8], kind: u16) -> Result<&[u8], Box<dyn Error>> {
    if !map.starts_with(b"FPACK\r\n\x1a") || u32::from_le_bytes(at(map, 8)?) != 1 {
        return Err("not a pack of version 1".into());
    }
    let count = u32::from_le_bytes(at(map, 12)?) as usize;
    let table = u64::from_le_bytes(at(map, 24)?) as usize;
    for row in (0..count).map(|n| table + 64 * n) {
        if u16::from_le_bytes(at(map, row)?) == kind && u16::from_le_bytes(at(map, row + 2)?) == 0 {
            let [offset, length] = [row + 8, row + 16].map(|o| at(map, o).map(u64::from_le_bytes));
            let (offset, length) = (offset? as usize, length? as usize);
            return Ok(map.get(offset..offset + length).ok_or("a section ends beyond the file")?);
        }
    }
    Err(format!("no section of kind {kind}").into())
}

/// Steps 4 and 5: the block from the front, by a parallel camera that sees the unit ball.
fn draw(map: &[u8], fine: u32) -> Result<Vec<u8>, Box<dyn Error>> {
    let (points, cells) = (section(map, 18)?, section(map, 17)?);
    // Step 3: the exponent of a position step.
    let step = 2f32.powi(i32::from_le_bytes(at(section(map, 16)?, 28)?));
    // Columns of the matrix: x and y as they are, z from the ball's front (0) to its back (1).
    let clip =
        [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -0.5, 0.0], [0.0, 0.0, 0.5, 1.0]];
    let mut view: Vec<u8> = Vec::new();
    let mut put = |v: [f32; 3], last: [u8; 4]| {
        v.iter().for_each(|v| view.extend(v.to_le_bytes()));
        view.extend(last);
    };
    clip.iter().for_each(|c: &[f32; 4]| put([c[0], c[1], c[2]], c[3].to_le_bytes()));
    put([0.0, 0.0, 1.0], step.to_le_bytes());
    put([1.0, 0.0, 0.0], fine.to_le_bytes());
    put([0.0, 1.0, 0.0], (cells.len() as u32 / 64).to_le_bytes());

    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let wanted = wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&wanted))?;
    let shader =
        PAGE.split("```wgsl").nth(1).and_then(|t| t.split("```").next()).ok_or("a shader")?;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(shader.into()),
    });
    let buffer = |contents, usage| {
        device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
    };
    let buffers = [
        buffer(&view, wgpu::BufferUsages::UNIFORM),
        buffer(points, wgpu::BufferUsages::STORAGE),
        buffer(cells, wgpu::BufferUsages::STORAGE),
    ];
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(wgpu::TextureFormat::Rgba8UnormSrgb.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let entries: Vec<wgpu::BindGroupEntry> = (0..)
        .zip(&buffers)
        .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
        .collect();
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let size = wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 };
    let texture = |format, usage| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        })
    };
    let color = texture(wgpu::TextureFormat::Rgba8UnormSrgb, wgpu::TextureUsages::COPY_SRC);
    let depth = texture(wgpu::TextureFormat::Depth32Float, wgpu::TextureUsages::empty());
    let (color_view, depth_view) =
        (color.create_view(&Default::default()), depth.create_view(&Default::default()));
    let mut encoder = device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &color_view,
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth_view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..4, 0..points.len() as u32 / 16);
    }
    let read = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(SIDE * SIDE * 4),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(SIDE * 4),
        rows_per_image: None,
    };
    let to = wgpu::TexelCopyBufferInfo { buffer: &read, layout };
    encoder.copy_texture_to_buffer(color.as_image_copy(), to, size);
    queue.submit([encoder.finish()]);
    read.map_async(wgpu::MapMode::Read, .., |_| {});
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let pixels = read.get_mapped_range(..)?.to_vec();
    Ok(pixels)
}
