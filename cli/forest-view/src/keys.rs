//! What keys do.

use crate::args::Representation;
use crate::settings::Settings;
use forest_gpu::Model;
use forest_raster::Light;
use forest_views::Lookup;
use winit::keyboard::KeyCode;

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Command {
    Quit,
    Fit,
    Panel,
    Help,
    Truth,
    Picture,
    Change(Change),
}

/// A change of the settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    Show(Representation),
    Coarser,
    Finer,
    /// Triangles only, or back.
    Source,
    Lookup,
    Light,
}

/// What a key that goes down asks for.
pub(crate) fn command(code: KeyCode) -> Option<Command> {
    let show = |what| Some(Command::Change(Change::Show(what)));
    match code {
        KeyCode::Escape => Some(Command::Quit),
        KeyCode::KeyF => Some(Command::Fit),
        KeyCode::KeyG => Some(Command::Panel),
        KeyCode::KeyH => Some(Command::Help),
        KeyCode::KeyT => Some(Command::Truth),
        KeyCode::KeyP => Some(Command::Picture),
        KeyCode::Digit0 => show(Representation::Auto),
        KeyCode::Digit1 => show(Representation::Points),
        KeyCode::Digit2 => show(Representation::Views),
        KeyCode::Digit3 => show(Representation::Volume),
        KeyCode::Digit4 => show(Representation::Foliage),
        KeyCode::BracketLeft => Some(Command::Change(Change::Coarser)),
        KeyCode::BracketRight => Some(Command::Change(Change::Finer)),
        KeyCode::Space => Some(Command::Change(Change::Source)),
        KeyCode::KeyV => Some(Command::Change(Change::Lookup)),
        KeyCode::KeyL => Some(Command::Change(Change::Light)),
        _ => None,
    }
}

/// Changes the settings, as far as the pack has what is asked for.
pub(crate) fn apply(change: Change, settings: &mut Settings, model: &Model) {
    match change {
        Change::Show(what) => {
            let there = match what {
                Representation::Auto => model.is_measured(),
                Representation::Points => model.points().is_some(),
                Representation::Views => model.views().is_some(),
                Representation::Volume => model.volume().is_some(),
                Representation::Foliage => model.foliage().is_some(),
            };
            if there {
                settings.representation = what;
            }
        }
        Change::Coarser => step(settings, model, 2.0),
        Change::Finer => step(settings, model, 0.5),
        Change::Source if model.points().is_some_and(|p| !p.triangles.is_empty()) => {
            settings.representation = Representation::Points;
            settings.triangles = !settings.triangles;
        }
        Change::Source => {}
        Change::Lookup => {
            let now = Lookup::ALL.iter().position(|l| *l == settings.lookup).unwrap_or(0);
            settings.lookup = Lookup::ALL[(now + 1) % Lookup::ALL.len()];
        }
        Change::Light => {
            settings.light = match settings.light {
                Light::Albedo => Light::MORNING,
                Light::Sun(_) => Light::Albedo,
            };
        }
    }
}

/// A level up or down: of what is shown, pixels twice or half as wide.
fn step(settings: &mut Settings, model: &Model, factor: f64) {
    match (settings.representation, &mut settings.level, model.volume()) {
        (Representation::Auto, ..) => {}
        (Representation::Points, ..) => {
            settings.finest = (settings.finest * factor * factor).clamp(0.01, 4096.0);
        }
        (Representation::Volume, Some(level), Some(volume)) => {
            let finest = volume.header.levels.len() as u32 - 1;
            *level = if factor > 1.0 { level.saturating_sub(1) } else { (*level + 1).min(finest) };
        }
        (Representation::Foliage, Some(level), _) => {
            let coarsest = model.foliage().map_or(0, |f| f.header.levels.len() as u32 - 1);
            *level =
                if factor > 1.0 { (*level + 1).min(coarsest) } else { level.saturating_sub(1) };
        }
        _ => settings.texel = (settings.texel * factor).clamp(0.25, 64.0),
    }
}

/// The keys that fly, as they are held.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Held {
    keys: [bool; 6],
}

/// Right, left, up, down, forward, back.
const FLY: [KeyCode; 6] =
    [KeyCode::KeyD, KeyCode::KeyA, KeyCode::KeyE, KeyCode::KeyQ, KeyCode::KeyW, KeyCode::KeyS];

/// Radii of the tree in a second.
const SPEED: f64 = 1.0;

impl Held {
    pub(crate) fn set(&mut self, code: KeyCode, pressed: bool) {
        if let Some(i) = FLY.iter().position(|k| *k == code) {
            self.keys[i] = pressed;
        }
    }

    /// How far to fly in `seconds`: right, up, forward, in radii.
    pub(crate) fn step(&self, seconds: f64) -> [f64; 3] {
        let held = |i: usize| f64::from(u8::from(self.keys[i]));
        [0, 2, 4].map(|i| (held(i) - held(i + 1)) * SPEED * seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn held_keys_fly_and_opposite_ones_cancel() {
        let mut held = Held::default();
        held.set(KeyCode::KeyW, true);
        held.set(KeyCode::KeyD, true);
        held.set(KeyCode::KeyA, true);
        assert_eq!(held.step(0.5), [0.0, 0.0, 0.5]);
        held.set(KeyCode::KeyW, false);
        assert_eq!(held.step(0.5), [0.0; 3]);
    }
}
