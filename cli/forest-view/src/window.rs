//! The window: events in, pictures out. What is drawn, and how, is what a headless run draws.

use crate::args::Args;
use crate::hud::{Figures, Hud};
use crate::keys::{self, Command};
use crate::orbit::Orbit;
use crate::output;
use crate::session::Session;
use crate::settings::{Settings, check};
use crate::surface::Screen;
use crate::truth_worker::{Request, TruthWorker};
use anyhow::{Context as _, Result};
use forest_gpu::{
    Candidate, Costs, Drawn, Fader, Frame, Gpu, GpuError, Look, Options, Presenter, Renderer,
    Target, What, candidates, read_picture,
};
use forest_raster::Picture;
use forest_soup::Camera;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::PhysicalKey;
use winit::window::{Window, WindowId};

/// Seconds that a change of level fades.
const FADE: f32 = 0.3;

/// How long to wait where nothing can be shown.
const IDLE: Duration = Duration::from_millis(50);

/// Frames before `--screenshot` is taken: the panel has found its size, the source is drawn.
const SETTLED: u32 = 8;

/// Opens a window on a pack and stays until it is closed.
pub(crate) fn run(args: &Args, path: &Path, angles: [f64; 2]) -> Result<()> {
    let event_loop = EventLoop::new().context("no window system: --headless draws without one")?;
    event_loop.set_control_flow(ControlFlow::Poll);
    let mut app = App { args, path, angles, shown: None, failed: None };
    event_loop.run_app(&mut app).context("the window system failed")?;
    app.failed.map_or(Ok(()), Err)
}

struct App<'a> {
    args: &'a Args,
    path: &'a Path,
    angles: [f64; 2],
    shown: Option<Viewer>,
    failed: Option<anyhow::Error>,
}

/// All that a window shows.
struct Viewer {
    window: Arc<Window>,
    gpu: Gpu,
    adapter: String,
    screen: Screen,
    renderer: Renderer,
    presenter: Presenter,
    target: Target,
    session: Session,
    settings: Settings,
    orbit: Orbit,
    costs: Costs,
    fader: Option<Fader>,
    hud: Hud,
    truth: Option<TruthWorker>,
    /// The source is shown on the left.
    split: bool,
    /// The source's picture that was uploaded last, and what it is of.
    truth_picture: Option<(Request, Picture)>,
    pointer: [f64; 2],
    dragging: Option<MouseButton>,
    held: keys::Held,
    last: Instant,
    drawn: Drawn,
    frames: u32,
    screenshot: Option<PathBuf>,
}

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.shown.is_some() {
            return;
        }
        match Viewer::open(self.args, self.path, self.angles, event_loop) {
            Ok(viewer) => self.shown = Some(viewer),
            Err(e) => self.fail(event_loop, e),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(viewer) = &mut self.shown else { return };
        match viewer.event(event_loop, event) {
            Ok(()) => {}
            Err(e) => self.fail(event_loop, e),
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

impl Viewer {
    fn open(
        args: &Args,
        path: &Path,
        angles: [f64; 2],
        event_loop: &ActiveEventLoop,
    ) -> Result<Self> {
        let [width, height] = args.size;
        let attributes = Window::default_attributes()
            .with_title(format!("{} – forest-view", path.display()))
            .with_inner_size(winit::dpi::PhysicalSize::new(width, height));
        let window = Arc::new(event_loop.create_window(attributes).context("no window")?);
        let instance = forest_gpu::instance(
            args.adapter.is_some(),
            Some(Box::new(event_loop.owned_display_handle())),
        );
        let surface = instance.create_surface(Arc::clone(&window)).context("no surface")?;
        let gpu = Gpu::open(&instance, args.adapter.as_deref(), Some(&surface))?;
        let screen = Screen::new(&gpu, &window, surface)?;
        let renderer = Renderer::new(&gpu, &Options::default())?;
        let session = Session::open(&gpu, &renderer, path)?;
        let settings = Settings::new(args, session.model());
        check(&settings, session.model())?;
        let target = renderer.target(&gpu, screen.size(), settings.side)?;
        let presenter = Presenter::new(&gpu, screen.format())?;
        let orbit = Orbit::new(session.model().bounds(), angles, args.distance, screen.size());
        let shadows = session.model().crown().is_some();
        let truth = args
            .truth
            .as_deref()
            .map(|path| TruthWorker::start(path, args.max_triangles, shadows))
            .transpose()?;
        let mut viewer = Self {
            window,
            adapter: gpu.name(),
            gpu,
            screen,
            renderer,
            presenter,
            target,
            session,
            settings,
            orbit,
            costs: Costs::default(),
            fader: None,
            hud: Hud::default(),
            split: truth.is_some(),
            truth,
            truth_picture: None,
            pointer: [0.0; 2],
            dragging: None,
            held: keys::Held::default(),
            last: Instant::now(),
            drawn: Drawn::default(),
            frames: 0,
            screenshot: args.screenshot.clone(),
        };
        viewer.measure_costs()?;
        Ok(viewer)
    }

    /// What levels cost here, if a table asks for it.
    fn measure_costs(&mut self) -> Result<()> {
        if !self.session.model().is_measured() {
            return Ok(());
        }
        let camera = self.orbit.camera(self.target.size());
        let Self { gpu, renderer, target, .. } = self;
        self.costs =
            self.session.with_model(|m| Costs::measure(gpu, renderer, m, target, &camera))?;
        Ok(())
    }

    fn event(&mut self, event_loop: &ActiveEventLoop, event: WindowEvent) -> Result<()> {
        let taken = self.screen.on_event(&self.window, &event);
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => {
                self.screen.resize(&self.gpu, [size.width, size.height]);
                self.fit_target()?;
            }
            WindowEvent::DroppedFile(path) => self.open_pack(&path),
            WindowEvent::RedrawRequested => self.frame(event_loop)?,
            WindowEvent::KeyboardInput { event, is_synthetic, .. } => {
                let PhysicalKey::Code(code) = event.physical_key else { return Ok(()) };
                // What was pressed may be let go anywhere.
                let pressed = event.state == ElementState::Pressed && !taken && !is_synthetic;
                self.held.set(code, pressed);
                if pressed && !event.repeat {
                    self.command(keys::command(code), event_loop);
                }
            }
            WindowEvent::Focused(false) => {
                self.held = keys::Held::default();
                self.dragging = None;
            }
            WindowEvent::CursorMoved { position, .. } => {
                let moved = [position.x - self.pointer[0], position.y - self.pointer[1]];
                self.pointer = [position.x, position.y];
                match self.dragging {
                    Some(MouseButton::Left) => self.orbit.turn(moved),
                    Some(_) => self.orbit.pan(moved, self.target.size()[1]),
                    None => {}
                }
            }
            WindowEvent::MouseInput { state, button, .. } => match state {
                ElementState::Pressed if !taken => self.dragging = Some(button),
                ElementState::Released if self.dragging == Some(button) => self.dragging = None,
                _ => {}
            },
            WindowEvent::MouseWheel { delta, .. } if !taken => self.orbit.zoom(match delta {
                MouseScrollDelta::LineDelta(_, y) => f64::from(y),
                MouseScrollDelta::PixelDelta(p) => p.y / 50.0,
            }),
            _ => {}
        }
        Ok(())
    }

    fn command(&mut self, command: Option<Command>, event_loop: &ActiveEventLoop) {
        match command {
            Some(Command::Quit) => event_loop.exit(),
            Some(Command::Fit) => self.orbit.fit(self.screen.size()),
            Some(Command::Panel) => self.hud.hidden = !self.hud.hidden,
            Some(Command::Help) => self.hud.help = !self.hud.help,
            Some(Command::Truth) => self.split = !self.split && self.truth.is_some(),
            Some(Command::Picture) => self.hud.message = self.save_picture(),
            Some(Command::Change(change)) => {
                keys::apply(change, &mut self.settings, self.session.model());
            }
            None => {}
        }
    }

    /// Shows another pack, or the same baked anew; a broken one leaves what is shown.
    fn open_pack(&mut self, path: &Path) {
        match Session::open(&self.gpu, &self.renderer, path) {
            Ok(session) => {
                self.session = session;
                self.orbit.set_bounds(self.session.model().bounds(), self.screen.size());
                if check(&self.settings, self.session.model()).is_err() {
                    self.settings.representation = crate::settings::usual(self.session.model());
                    self.settings.level = None;
                }
                self.fader = None;
                self.window.set_title(&format!("{} – forest-view", path.display()));
                let measured = self.measure_costs().err().map(|e| format!("{e:#}"));
                self.hud.message = measured.unwrap_or_else(|| format!("{} opened", path.display()));
            }
            Err(e) => self.hud.message = format!("{e:#}"),
        }
    }

    /// A target as large as the window, with as many samples as are asked for.
    /// Fewer, where the device does not take so many.
    fn fit_target(&mut self) -> Result<()> {
        let size = self.screen.size();
        while self.target.size() != size || self.target.side() != self.settings.side {
            match self.renderer.target(&self.gpu, size, self.settings.side) {
                Ok(target) => self.target = target,
                Err(e @ GpuError::TooLarge { .. }) if self.settings.side > 1 => {
                    self.hud.message = e.to_string();
                    self.settings.side -= 1;
                }
                Err(e) => return Err(e.into()),
            }
        }
        Ok(())
    }

    fn frame(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let size = self.window.inner_size();
        if size.width == 0 || size.height == 0 {
            // Minimised: nothing to draw, and nothing to hurry for.
            std::thread::sleep(IDLE);
            return Ok(());
        }
        let passed = self.last.elapsed().as_secs_f32();
        self.last = Instant::now();
        self.hud.add_time(passed * 1e3);
        if self.session.has_changed() {
            let path = self.session.path().to_path_buf();
            self.open_pack(&path);
        }
        self.settings.wind.time += passed;
        self.orbit.fly(self.held.step(f64::from(passed.min(0.1))));
        self.fit_target()?;
        let camera = self.orbit.camera(self.target.size());
        let all = candidates(self.session.model(), &camera, &self.costs);
        let shown = self.draw_tree(&camera, &all, passed)?;
        let split = self.update_truth(&camera)?;
        self.show(&camera, shown, &all, split)?;
        self.frames += 1;
        let waits = self.split && split == 0.0;
        if self.frames >= SETTLED && !waits && self.screenshot.is_some() {
            self.take_screenshot(event_loop)?;
        }
        Ok(())
    }

    /// Draws the tree into the target; what is shown of it, or faded to.
    fn draw_tree(
        &mut self,
        camera: &Camera,
        all: &[Candidate],
        passed: f32,
    ) -> Result<Option<What>> {
        let now = self.fader.as_ref().map(Fader::now);
        let Some(wanted) = self.settings.what(self.session.model(), camera, all, now) else {
            return Ok(None);
        };
        let fader = self.fader.get_or_insert(Fader::new(wanted, FADE));
        fader.advance(wanted, passed);
        let (layers, count) = fader.layers();
        let frame = Frame {
            camera: *camera,
            light: self.settings.light,
            wind: self.settings.wind,
            layers: &layers[..count],
        };
        let Self { gpu, renderer, target, .. } = self;
        self.drawn = self.session.with_model(|m| renderer.render(gpu, m, target, &frame, None))?;
        Ok(Some(wanted))
    }

    /// Asks for the source's picture, and takes it when it is there: pixels that it is shown on.
    fn update_truth(&mut self, camera: &Camera) -> Result<f32> {
        let Some(worker) = self.truth.as_mut().filter(|_| self.split) else { return Ok(0.0) };
        let request = (*camera, self.settings.light, self.settings.side);
        worker.ask(request);
        if let Some((of, picture)) = worker.take()? {
            let size = [picture.width, picture.height];
            self.presenter.compare_with(&self.gpu, size, &picture.pixels)?;
            self.truth_picture = Some((of, picture));
        }
        let fits = self.truth_picture.as_ref().is_some_and(|(of, _)| *of == request);
        Ok(if fits { (camera.width / 2) as f32 } else { 0.0 })
    }

    /// Puts the picture and the panel on the screen.
    fn show(
        &mut self,
        camera: &Camera,
        shown: Option<What>,
        all: &[Candidate],
        split: f32,
    ) -> Result<()> {
        let model = self.session.model();
        let [min, max] = model.bounds();
        let distance = ((min + max) * 0.5 - camera.eye).dot(camera.forward);
        let figures = Figures {
            adapter: &self.adapter,
            pack: self.session.path().display().to_string(),
            shown,
            drawn: self.drawn,
            promise: all.iter().find(|c| Some(c.what) == shown).copied(),
            pixel_height: (max - min).max_element() * camera.pixels_per_unit(distance),
            has_truth: self.truth.is_some(),
        };
        let (hud, settings, truth) = (&mut self.hud, &mut self.settings, &mut self.split);
        let look = Look { split, ..Look::default() };
        let binding = self.presenter.bind(&self.gpu, &self.target);
        let is_shown = self.screen.show(
            &self.gpu,
            &self.window,
            |encoder, view| self.presenter.present(&self.gpu, encoder, &binding, view, &look),
            |context| hud.show(context, settings, truth, model, &figures),
        )?;
        if !is_shown {
            self.gpu.finish()?;
            std::thread::sleep(IDLE);
        }
        Ok(self.gpu.check()?)
    }

    /// The picture without the panel, beside the pack.
    fn save_picture(&self) -> String {
        let path = (1..)
            .map(|n| self.session.path().with_extension(format!("{n}.png")))
            .find(|p| !p.exists())
            .unwrap_or_default();
        match self.write_picture(&path) {
            Ok(()) => format!("{} written", path.display()),
            Err(e) => format!("{e:#}"),
        }
    }

    fn write_picture(&self, path: &Path) -> Result<()> {
        let size = self.target.size();
        // As the window shows it: only the source's picture of what is shown.
        let now = (self.orbit.camera(size), self.settings.light, self.settings.side);
        let other = self.truth_picture.as_ref().filter(|(of, _)| self.split && *of == now);
        let split = other.map_or(0.0, |_| (size[0] / 2) as f32);
        let look = Look { split, ..Look::default() };
        let other = other.map(|(_, p)| ([p.width, p.height], &p.pixels[..]));
        let pixels = read_picture(&self.gpu, &self.target, &look, other)?;
        output::write_png(path, size, &pixels, false)
    }

    fn take_screenshot(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        if let Some(path) = self.screenshot.take() {
            self.write_picture(&path)?;
        }
        event_loop.exit();
        Ok(())
    }
}
