//! The panel over the picture: controls, figures, help.

use crate::args::Representation;
use crate::output;
use crate::settings::Settings;
use egui::emath::Numeric;
use egui::{Color32, Context, Grid, Pos2, Rect, Sense, Slider, SliderClamping, Stroke, Ui, Vec2};
use forest_foliage::wind::MOST_STRENGTH;
use forest_gpu::{Candidate, Drawn, Goal, Model, What};
use forest_raster::{Light, Sun};
use forest_views::Lookup;
use forest_volume::Blending;
use std::collections::VecDeque;

/// Frames in the graph.
const FRAMES: usize = 120;

/// What the panel shows beside the settings.
#[derive(Debug, Default)]
pub(crate) struct Hud {
    pub(crate) hidden: bool,
    pub(crate) help: bool,
    /// Milliseconds of the last frames: from one picture to the next.
    times: VecDeque<f32>,
    /// A message until the next one.
    pub(crate) message: String,
}

/// Figures of the frame.
#[derive(Debug)]
pub(crate) struct Figures<'a> {
    pub(crate) adapter: &'a str,
    pub(crate) pack: String,
    pub(crate) shown: Option<What>,
    pub(crate) drawn: Drawn,
    /// What the table promises of the level that is shown.
    pub(crate) promise: Option<Candidate>,
    pub(crate) pixel_height: f64,
    pub(crate) has_truth: bool,
}

impl Hud {
    pub(crate) fn add_time(&mut self, milliseconds: f32) {
        self.times.truncate(FRAMES - 1);
        self.times.push_front(milliseconds);
    }

    /// Shows the panel; `truth` is whether the source is shown beside the level.
    pub(crate) fn show(
        &mut self,
        context: &Context,
        settings: &mut Settings,
        truth: &mut bool,
        model: &Model,
        figures: &Figures,
    ) {
        if !self.hidden {
            egui::Window::new("forest-view").default_pos([8.0, 8.0]).show(context, |ui| {
                ui.label(&figures.pack);
                controls(ui, settings, model);
                if figures.has_truth {
                    ui.checkbox(truth, "Source on the left (T)");
                }
                ui.separator();
                self.figures(ui, figures);
                ui.checkbox(&mut self.help, "Help (H)");
            });
        }
        if self.help {
            egui::Window::new("Help").default_pos([400.0, 60.0]).show(context, help);
        }
    }

    fn figures(&self, ui: &mut Ui, figures: &Figures) {
        let mean = self.times.iter().sum::<f32>() / self.times.len().max(1) as f32;
        ui.label(format!("{mean:.1} ms a frame, {:.0} frames a second", 1e3 / mean.max(1e-3)));
        self.graph(ui);
        let d = &figures.drawn;
        if let Some(what) = &figures.shown {
            ui.label(output::level(what));
        }
        Grid::new("figures").show(ui, |ui| {
            let rows = [
                ("points looked at", d.points),
                ("triangles", d.triangles),
                ("views", d.views),
                ("cells", d.cells),
                ("bytes", d.bytes),
                ("draw calls", d.calls),
            ];
            for (name, value) in rows.iter().filter(|r| r.1 > 0) {
                ui.label(*name);
                ui.label(value.to_string());
                ui.end_row();
            }
            ui.label("tree's height");
            ui.label(format!("{:.0} px", figures.pixel_height));
            ui.end_row();
            if let Some(c) = &figures.promise {
                ui.label("measured FLIP, worst view");
                let beyond = if c.choice.beyond { " (nearest measured height)" } else { "" };
                ui.label(format!("{:.3}{beyond}", c.choice.error));
                ui.end_row();
            }
        });
        ui.label(figures.adapter);
        if !self.message.is_empty() {
            ui.colored_label(Color32::from_rgb(230, 160, 60), &self.message);
        }
    }

    /// Bars of the last frames, up to 50 ms, with a line at 1/60 s.
    fn graph(&self, ui: &mut Ui) {
        let (response, painter) = ui.allocate_painter(Vec2::new(240.0, 40.0), Sense::hover());
        let area = response.rect;
        painter.rect_filled(area, 2.0, Color32::from_gray(24));
        let step = area.width() / FRAMES as f32;
        let height = |ms: f32| area.height() * (ms / 50.0).min(1.0);
        for (i, ms) in self.times.iter().enumerate() {
            let x = area.right() - (i + 1) as f32 * step;
            let top = Pos2::new(x, area.bottom() - height(*ms));
            let bar = Rect::from_min_max(top, Pos2::new(x + step, area.bottom()));
            painter.rect_filled(bar, 0.0, Color32::from_rgb(110, 170, 110));
        }
        let y = area.bottom() - height(1e3 / 60.0);
        let ends = [Pos2::new(area.left(), y), Pos2::new(area.right(), y)];
        painter.line_segment(ends, Stroke::new(1.0, Color32::from_gray(140)));
    }
}

fn controls(ui: &mut Ui, settings: &mut Settings, model: &Model) {
    ui.horizontal(|ui| {
        let there = [
            (Representation::Auto, "Auto", model.is_measured()),
            (Representation::Points, "Points", model.points().is_some()),
            (Representation::Views, "Views", model.views().is_some()),
            (Representation::Volume, "Volume", model.volume().is_some()),
            (Representation::Foliage, "Foliage", model.foliage().is_some()),
        ];
        for (what, name, _) in there.into_iter().filter(|t| t.2) {
            ui.radio_value(&mut settings.representation, what, name);
        }
    });
    match settings.representation {
        Representation::Auto => goal(ui, &mut settings.goal),
        Representation::Points => {
            let areas = 0.01..=4096.0;
            ui.add(slider(&mut settings.finest, areas).logarithmic(true).text("s_m, px²"));
            let ratios = 1.0..=256.0;
            ui.add(slider(&mut settings.ratio, ratios).logarithmic(true).text("s_M / s_m"));
            let most = settings.finest;
            ui.add(slider(&mut settings.bias, 0.0..=most).text("k, px²"));
        }
        Representation::Views => {
            ui.horizontal(|ui| {
                for lookup in Lookup::ALL {
                    ui.radio_value(&mut settings.lookup, lookup, lookup.name());
                }
            });
            texel(ui, &mut settings.texel);
        }
        Representation::Foliage => {
            let coarsest = model.foliage().map_or(0, |f| f.header.levels.len() as u32 - 1);
            level(ui, settings, coarsest, 0);
        }
        Representation::Volume => {
            let finest = model.volume().map_or(0, |v| v.header.levels.len() as u32 - 1);
            level(ui, settings, finest, finest);
            let mut over = settings.blending == Blending::Over;
            ui.checkbox(&mut over, "One camera over the other");
            settings.blending = if over { Blending::Over } else { Blending::Shares };
        }
    }
    if model.foliage().is_some() {
        ui.add(slider(&mut settings.wind.strength, 0.0..=MOST_STRENGTH).text("wind"));
    }
    light(ui, &mut settings.light);
    ui.add(slider(&mut settings.side, 1..=4).text("samples a side of a pixel"));
}

/// A level, `usual` at first, or the width of texels that chooses one.
fn level(ui: &mut Ui, settings: &mut Settings, last: u32, usual: u32) {
    let mut by_texel = settings.level.is_none();
    ui.checkbox(&mut by_texel, "Levels by the width of texels");
    settings.level = match (by_texel, settings.level) {
        (true, _) => None,
        (false, level) => Some(level.unwrap_or(usual).min(last)),
    };
    match &mut settings.level {
        Some(level) => _ = ui.add(slider(level, 0..=last).text("level")),
        None => texel(ui, &mut settings.texel),
    }
}

/// A slider that leaves a value beyond its range as it is, until it is moved.
fn slider<N: Numeric>(value: &mut N, range: std::ops::RangeInclusive<N>) -> Slider<'_> {
    Slider::new(value, range).clamping(SliderClamping::Edits)
}

fn texel(ui: &mut Ui, texel: &mut f64) {
    ui.add(slider(texel, 0.25..=64.0).logarithmic(true).text("texel, px"));
}

fn goal(ui: &mut Ui, goal: &mut Goal) {
    match goal {
        Goal::Error(error) => {
            ui.add(slider(error, 0.005..=0.5).logarithmic(true).text("FLIP at most"));
            if ui.button("By frame rate").clicked() {
                *goal = Goal::Rate(60.0);
            }
        }
        Goal::Rate(rate) => {
            ui.add(slider(rate, 1.0..=240.0).text("frames a second"));
            if ui.button("By error").clicked() {
                *goal = Goal::Error(forest_gpu::JUST_NOTICEABLE);
            }
        }
    }
}

fn light(ui: &mut Ui, light: &mut Light) {
    let mut lit = matches!(light, Light::Sun(_));
    if ui.checkbox(&mut lit, "Sun (L)").changed() {
        *light = if lit { Light::MORNING } else { Light::Albedo };
    }
    if let Light::Sun(Sun { darkest, .. }) = light {
        ui.add(slider(darkest, 0.0..=1.0).text("self-shadow L_m"));
    }
}

fn help(ui: &mut Ui) {
    let keys = [
        ("drag", "go around the tree"),
        ("right drag", "move the picture"),
        ("wheel", "nearer, farther"),
        ("W A S D, Q E", "fly"),
        ("F", "show all of the tree"),
        ("0 1 2 3 4", "auto, points, views, volume, foliage"),
        ("[ ]", "coarser, finer"),
        ("space", "triangles, as in the source"),
        ("V", "next look-up of views"),
        ("L", "sun or base colours"),
        ("T", "the source on the left"),
        ("P", "save a picture beside the pack"),
        ("G", "hide or show the panel"),
        ("H", "this help"),
        ("Esc", "quit"),
        ("drop a pack", "open it; a pack that is baked anew is shown at once"),
    ];
    Grid::new("keys").show(ui, |ui| {
        for (key, what) in keys {
            ui.strong(key);
            ui.label(what);
            ui.end_row();
        }
    });
}
