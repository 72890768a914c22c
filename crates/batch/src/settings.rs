//! How an asset is to be baked, in the words of `forest-bake all`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How assets are baked. What is not said is left to what is said more widely, and last to the preset.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Settings {
    /// draft, game or film.
    pub preset: Option<String>,
    /// Representations: points, views, volume, foliage. Default: those of the preset.
    #[serde(rename = "with")]
    pub representations: Option<Vec<String>>,
    /// Options of `forest-bake points`, by their long names.
    #[serde(default)]
    pub points: Options,
    /// Options of `forest-bake views`.
    #[serde(default)]
    pub views: Options,
    /// Options of `forest-bake volume`.
    #[serde(default)]
    pub volume: Options,
    /// Options of `forest-bake foliage`.
    #[serde(default)]
    pub foliage: Options,
    /// Judge every representation against the source, and write the table into the pack.
    pub judge: Option<bool>,
    /// Keep only what is drawn from this distance on, as `3m`.
    pub nearest: Option<String>,
    /// What to export beside the pack: png, exr, ktx2, ply, glb, pivots, unreal, godot, three.
    pub exports: Option<Vec<String>>,
    /// Refuse blocks of more triangles.
    pub max_triangles: Option<u64>,
    /// Read files outside the folder of the file that names them.
    pub allow_outside: Option<bool>,
}

/// Options of a command by their long names without the dashes.
pub type Options = BTreeMap<String, OptionValue>;

/// The value of an option.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum OptionValue {
    /// A switch: given or not.
    Switch(bool),
    /// A whole number.
    Whole(i64),
    /// A number.
    Number(f64),
    /// A word.
    Text(String),
    /// Several words.
    List(Vec<String>),
}

impl OptionValue {
    /// The value as the command line has it.
    fn text(&self) -> String {
        match self {
            Self::Switch(on) => on.to_string(),
            Self::Whole(n) => n.to_string(),
            Self::Number(x) => x.to_string(),
            Self::Text(t) => t.clone(),
            Self::List(all) => all.join(","),
        }
    }
}

impl Settings {
    /// These where they say something, else `wider`.
    pub fn within(&self, wider: &Self) -> Self {
        let merged = |own: &Options, wider: &Options| {
            let mut all = wider.clone();
            all.extend(own.clone());
            all
        };
        Self {
            preset: self.preset.clone().or_else(|| wider.preset.clone()),
            representations: self.representations.clone().or_else(|| wider.representations.clone()),
            points: merged(&self.points, &wider.points),
            views: merged(&self.views, &wider.views),
            volume: merged(&self.volume, &wider.volume),
            foliage: merged(&self.foliage, &wider.foliage),
            judge: self.judge.or(wider.judge),
            nearest: self.nearest.clone().or_else(|| wider.nearest.clone()),
            exports: self.exports.clone().or_else(|| wider.exports.clone()),
            max_triangles: self.max_triangles.or(wider.max_triangles),
            allow_outside: self.allow_outside.or(wider.allow_outside),
        }
    }

    /// The arguments of `forest-bake all`; the same settings give the same ones.
    pub fn arguments(&self) -> Vec<String> {
        let mut out = Vec::new();
        let mut one = |name: &str, value: Option<String>| {
            out.extend(value.map(|v| format!("--{name}={v}")));
        };
        one("preset", self.preset.clone());
        one("with", self.representations.as_ref().map(|r| r.join(",")));
        let tables = [
            ("points", &self.points),
            ("views", &self.views),
            ("volume", &self.volume),
            ("foliage", &self.foliage),
        ];
        for (representation, options) in tables {
            for (name, value) in options {
                one("set", Some(format!("{representation}.{name}={}", value.text())));
            }
        }
        one("nearest", self.nearest.clone());
        one("export", self.exports.as_ref().filter(|e| !e.is_empty()).map(|e| e.join(",")));
        one("max-triangles", self.max_triangles.map(|n| n.to_string()));
        let mut switch = |name: &str, on: Option<bool>| {
            out.extend((on == Some(true)).then(|| format!("--{name}")));
        };
        switch("judge", self.judge);
        switch("allow-outside", self.allow_outside);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_one_asset_counts_for_it_option_by_option() {
        let wide: Settings = toml::from_str(
            "preset = \"game\"\njudge = true\n[views]\ntexels = 128\nlayout = \"rings:3x8\"\n[points]\npoints-only = true",
        )
        .unwrap();
        let own: Settings = toml::from_str(
            "preset = \"film\"\njudge = false\nexports = [\"glb\", \"three\"]\n[views]\ntexels = 512",
        )
        .unwrap();
        assert_eq!(
            own.within(&wide).arguments(),
            [
                "--preset=film",
                "--set=points.points-only=true",
                "--set=views.layout=rings:3x8",
                "--set=views.texels=512",
                "--export=glb,three"
            ]
        );
        assert!(toml::from_str::<Settings>("presets = \"film\"").is_err(), "misspelt");
    }
}
