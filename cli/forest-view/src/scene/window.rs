//! A window on a landscape.

use crate::args::Args;
use crate::keys::Held;
use crate::output;
use crate::scene::walk::Walk;
use crate::scene::{Goal, describe};
use crate::surface::Screen;
use anyhow::{Context as _, Result};
use forest_foliage::Wind;
use forest_gpu::{
    Gpu, Landscape, LandscapeDrawn, LandscapeRenderer, LandscapeTarget, Look, Options, Presenter,
    read_picture,
};
use forest_scene::Scene;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{Window, WindowId};

/// How long to wait where nothing can be shown.
const IDLE: Duration = Duration::from_millis(50);

/// Frames before `--screenshot` is taken.
const SETTLED: u32 = 4;

/// Opens a window on a scene and stays until it is closed.
pub(crate) fn run(args: &Args, scene: &Scene) -> Result<()> {
    let walk = Walk::new(super::sight(args, scene)?);
    let event_loop = EventLoop::new().context("no window system: --headless draws without one")?;
    event_loop.set_control_flow(ControlFlow::Poll);
    let goal = Goal::new(args, scene)?;
    let mut app = App { args, scene, walk, goal, shown: None, failed: None };
    event_loop.run_app(&mut app).context("the window system failed")?;
    app.failed.map_or(Ok(()), Err)
}

struct App<'a> {
    args: &'a Args,
    scene: &'a Scene,
    walk: Walk,
    goal: Goal,
    shown: Option<Viewer<'a>>,
    failed: Option<anyhow::Error>,
}

struct Viewer<'a> {
    window: Arc<Window>,
    gpu: Gpu,
    screen: Screen,
    renderer: LandscapeRenderer,
    presenter: Presenter,
    target: LandscapeTarget,
    landscape: Landscape<'a>,
    held: Held,
    wind: Wind,
    panel: bool,
    pointer: [f64; 2],
    dragging: bool,
    last: Instant,
    milliseconds: f64,
    drawn: LandscapeDrawn,
    message: String,
    frames: u32,
    screenshot: Option<PathBuf>,
}

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.shown.is_some() {
            return;
        }
        match Viewer::open(self.args, self.scene, event_loop) {
            Ok(viewer) => self.shown = Some(viewer),
            Err(e) => self.fail(event_loop, e),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(viewer) = &mut self.shown else { return };
        let done = viewer.event(event_loop, event, &mut self.walk, &mut self.goal);
        if let Err(e) = done {
            self.fail(event_loop, e);
        }
    }

    fn about_to_wait(&mut self, _: &ActiveEventLoop) {
        if let Some(viewer) = &self.shown {
            viewer.window.request_redraw();
        }
    }
}

impl App<'_> {
    fn fail(&mut self, event_loop: &ActiveEventLoop, error: anyhow::Error) {
        self.failed.get_or_insert(error);
        event_loop.exit();
    }
}

impl<'a> Viewer<'a> {
    fn open(args: &Args, scene: &'a Scene, event_loop: &ActiveEventLoop) -> Result<Self> {
        let [width, height] = args.size;
        let attributes = Window::default_attributes()
            .with_title(format!("{} – forest-view", scene.path.display()))
            .with_inner_size(winit::dpi::PhysicalSize::new(width, height));
        let window = Arc::new(event_loop.create_window(attributes).context("no window")?);
        let display = Box::new(event_loop.owned_display_handle());
        let instance = forest_gpu::instance(args.adapter.is_some(), Some(display));
        let surface = instance.create_surface(Arc::clone(&window)).context("no surface")?;
        let gpu = Gpu::open(&instance, args.adapter.as_deref(), Some(&surface))?;
        let screen = Screen::new(&gpu, &window, surface)?;
        let renderer = LandscapeRenderer::new(&gpu, &Options::default())?;
        let landscape = Landscape::load(&gpu, &renderer, scene)?;
        let target = LandscapeTarget::new(&gpu, &renderer, screen.size(), args.samples)?;
        let presenter = Presenter::new(&gpu, screen.format())?;
        Ok(Self {
            window,
            gpu,
            screen,
            renderer,
            presenter,
            target,
            landscape,
            held: Held::default(),
            wind: args.wind.unwrap_or_default(),
            panel: true,
            pointer: [0.0; 2],
            dragging: false,
            last: Instant::now(),
            milliseconds: 0.0,
            drawn: LandscapeDrawn::default(),
            message: String::new(),
            frames: 0,
            screenshot: args.screenshot.clone(),
        })
    }

    fn event(
        &mut self,
        event_loop: &ActiveEventLoop,
        event: WindowEvent,
        walk: &mut Walk,
        goal: &mut Goal,
    ) -> Result<()> {
        let taken = self.screen.on_event(&self.window, &event);
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => {
                self.screen.resize(&self.gpu, [size.width, size.height]);
                let (side, size) = (self.target.samples().side(), self.screen.size());
                self.target = LandscapeTarget::new(&self.gpu, &self.renderer, size, side)?;
            }
            WindowEvent::RedrawRequested => self.frame(event_loop, walk, goal)?,
            WindowEvent::KeyboardInput { event, is_synthetic, .. } => {
                let PhysicalKey::Code(code) = event.physical_key else { return Ok(()) };
                let pressed = event.state == ElementState::Pressed && !taken && !is_synthetic;
                self.held.set(code, pressed);
                if pressed && !event.repeat {
                    self.command(event_loop, code, goal);
                }
            }
            WindowEvent::Focused(false) => {
                self.held = Held::default();
                self.dragging = false;
            }
            WindowEvent::CursorMoved { position, .. } => {
                let moved = [position.x - self.pointer[0], position.y - self.pointer[1]];
                self.pointer = [position.x, position.y];
                if self.dragging {
                    walk.turn(moved, self.screen.size()[1]);
                }
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => {
                self.dragging = state == ElementState::Pressed && !taken;
            }
            WindowEvent::MouseWheel { delta, .. } if !taken => walk.zoom(match delta {
                MouseScrollDelta::LineDelta(_, y) => f64::from(y),
                MouseScrollDelta::PixelDelta(p) => p.y / 50.0,
            }),
            _ => {}
        }
        Ok(())
    }

    fn command(&mut self, event_loop: &ActiveEventLoop, code: KeyCode, goal: &mut Goal) {
        match code {
            KeyCode::Escape => event_loop.exit(),
            KeyCode::KeyG => self.panel = !self.panel,
            KeyCode::KeyP => {
                let path = Path::new("forest-view.png");
                let saved = self
                    .picture()
                    .and_then(|p| output::write_png(path, self.target.samples().size(), &p, false));
                self.message = match saved {
                    Ok(()) => format!("{} written", path.display()),
                    Err(e) => format!("{e:#}"),
                };
            }
            KeyCode::BracketLeft => goal.scale(2.0),
            KeyCode::BracketRight => goal.scale(0.5),
            _ => {}
        }
    }

    fn picture(&self) -> Result<Vec<[u8; 4]>> {
        Ok(read_picture(&self.gpu, self.target.samples(), &Look::default(), None)?)
    }

    fn frame(
        &mut self,
        event_loop: &ActiveEventLoop,
        walk: &mut Walk,
        goal: &mut Goal,
    ) -> Result<()> {
        let size = self.window.inner_size();
        if size.width == 0 || size.height == 0 {
            std::thread::sleep(IDLE);
            return Ok(());
        }
        let passed = self.last.elapsed().as_secs_f64().min(0.25);
        self.last = Instant::now();
        let land = &self.landscape.scene().land;
        walk.fly(self.held.step(passed), land);
        let camera = walk.camera(land, self.target.samples().size());
        let start = Instant::now();
        self.wind.time += passed as f32;
        let Self { gpu, renderer, landscape, target, .. } = self;
        landscape.set_wind(self.wind);
        renderer.render(gpu, landscape, target, &camera, &goal.detail(), None);
        self.drawn = landscape.drawn(gpu)?;
        self.milliseconds = start.elapsed().as_secs_f64() * 1e3;
        goal.took(self.milliseconds);
        self.show(goal)?;
        self.frames += 1;
        if self.frames >= SETTLED
            && let Some(path) = &self.screenshot
        {
            output::write_png(path, self.target.samples().size(), &self.picture()?, false)?;
            event_loop.exit();
        }
        Ok(())
    }

    fn show(&mut self, goal: &Goal) -> Result<()> {
        let shown = self.presenter.bind(&self.gpu, self.target.samples());
        let text = format!(
            "{:.1} ms, points of {:.2} px²\n{}\nW A S D, Q, E fly; drag turns; [ ] coarser, finer; \
             P picture; G panel\n{}",
            self.milliseconds,
            goal.detail().finest.0,
            describe(&self.drawn),
            self.message
        );
        let panel = self.panel;
        let (gpu, presenter) = (&self.gpu, &self.presenter);
        self.screen.show(
            gpu,
            &self.window,
            |encoder, view| presenter.present(gpu, encoder, &shown, view, &Look::default()),
            |context| {
                if panel {
                    egui::Window::new("landscape")
                        .title_bar(false)
                        .resizable(false)
                        .anchor(egui::Align2::LEFT_TOP, [8.0, 8.0])
                        .show(context, |ui| ui.label(&text));
                }
            },
        )?;
        Ok(())
    }
}
