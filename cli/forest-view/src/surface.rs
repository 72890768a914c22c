//! A window's surface with the panel on it.

use anyhow::{Context as _, Result, bail};
use egui_wgpu::{RendererOptions, ScreenDescriptor};
use forest_gpu::Gpu;
use wgpu::{
    CommandEncoder, CurrentSurfaceTexture, LoadOp, Operations, PresentMode,
    RenderPassColorAttachment, RenderPassDescriptor, StoreOp, Surface, SurfaceConfiguration,
    TextureFormat, TextureView, TextureViewDescriptor,
};
use winit::event::WindowEvent;
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::Window;

/// What pictures and panels are shown on.
pub(crate) struct Screen {
    surface: Surface<'static>,
    configuration: SurfaceConfiguration,
    /// The tree is encoded by the device, so it is shown through an sRGB format.
    format: TextureFormat,
    context: egui::Context,
    input: egui_winit::State,
    panels: egui_wgpu::Renderer,
}

impl Screen {
    pub(crate) fn new(gpu: &Gpu, window: &Window, surface: Surface<'static>) -> Result<Self> {
        let size = window.inner_size();
        let mut configuration = surface
            .get_default_config(&gpu.adapter, size.width.max(1), size.height.max(1))
            .context("the adapter cannot show pictures in this window")?;
        let formats = surface.get_capabilities(&gpu.adapter).formats;
        let format = formats.iter().copied().find(TextureFormat::is_srgb);
        let format = format.context("the window has no sRGB format")?;
        configuration.format = format;
        configuration.present_mode = PresentMode::Fifo;
        surface.configure(&gpu.device, &configuration);
        let context = egui::Context::default();
        context.set_theme(egui::Theme::Dark);
        let side = gpu.device.limits().max_texture_dimension_2d as usize;
        let input = egui_winit::State::new(
            context.clone(),
            egui::ViewportId::ROOT,
            window,
            Some(window.scale_factor() as f32),
            None,
            Some(side),
        );
        let panels = egui_wgpu::Renderer::new(&gpu.device, format, RendererOptions::default());
        Ok(Self { surface, configuration, format, context, input, panels })
    }

    pub(crate) fn format(&self) -> TextureFormat {
        self.format
    }

    pub(crate) fn size(&self) -> [u32; 2] {
        [self.configuration.width, self.configuration.height]
    }

    pub(crate) fn resize(&mut self, gpu: &Gpu, [width, height]: [u32; 2]) {
        self.configuration.width = width.max(1);
        self.configuration.height = height.max(1);
        self.surface.configure(&gpu.device, &self.configuration);
    }

    /// Whether the panel takes an event.
    pub(crate) fn on_event(&mut self, window: &Window, event: &WindowEvent) -> bool {
        // Tab would give the panel the keyboard, and take it from the camera.
        if let WindowEvent::KeyboardInput { event, .. } = event
            && event.physical_key == PhysicalKey::Code(KeyCode::Tab)
        {
            return true;
        }
        self.input.on_window_event(window, event).consumed
    }

    /// Shows what `present` draws and, over it, what `panel` builds; false where the window cannot be
    /// drawn into now.
    pub(crate) fn show(
        &mut self,
        gpu: &Gpu,
        window: &Window,
        present: impl FnOnce(&mut CommandEncoder, &TextureView),
        mut panel: impl FnMut(&egui::Context),
    ) -> Result<bool> {
        let input = self.input.take_egui_input(window);
        let mut output = self.context.run_pass(input, |context| panel(context));
        self.input.handle_platform_output(window, output.platform_output);
        let mut textures = std::mem::take(&mut output.textures_delta);
        for (id, deltas) in &textures.set {
            for delta in deltas {
                self.panels.update_texture(&gpu.device, &gpu.queue, *id, delta);
            }
        }
        let shapes = self.context.tessellate(output.shapes, output.pixels_per_point);
        let frame = match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(frame) => Some(frame),
            // Good enough: a size that no longer fits is told by an event.
            CurrentSurfaceTexture::Suboptimal(frame) => Some(frame),
            CurrentSurfaceTexture::Outdated | CurrentSurfaceTexture::Lost => {
                self.surface.configure(&gpu.device, &self.configuration);
                None
            }
            CurrentSurfaceTexture::Timeout | CurrentSurfaceTexture::Occluded => None,
            CurrentSurfaceTexture::Validation => bail!("the window's surface is not valid"),
        };
        let is_shown = frame.is_some();
        if let Some(frame) = frame {
            let view = frame.texture.create_view(&TextureViewDescriptor::default());
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            present(&mut encoder, &view);
            let screen = ScreenDescriptor {
                size_in_pixels: self.size(),
                pixels_per_point: output.pixels_per_point,
            };
            let mut work =
                self.panels.update_buffers(&gpu.device, &gpu.queue, &mut encoder, &shapes, &screen);
            {
                let pass = encoder.begin_render_pass(&RenderPassDescriptor {
                    label: Some("panel"),
                    color_attachments: &[Some(RenderPassColorAttachment {
                        view: &view,
                        depth_slice: None,
                        resolve_target: None,
                        ops: Operations { load: LoadOp::Load, store: StoreOp::Store },
                    })],
                    ..Default::default()
                });
                self.panels.render(&mut pass.forget_lifetime(), &shapes, &screen);
            }
            work.push(encoder.finish());
            gpu.queue.submit(work);
            window.pre_present_notify();
            gpu.queue.present(frame);
        }
        for id in &textures.free {
            self.panels.free_texture(id);
        }
        // Applied, all of them.
        textures.clear();
        Ok(is_shown)
    }
}
