//! The manifest: which assets there are, and how each is baked.

use crate::error::BatchError;
use crate::settings::Settings;
use glob::Pattern;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The version of manifests that is read.
pub(crate) const VERSION: u32 = 1;

/// A manifest as it is written (TOML); paths are relative to its folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Manifest {
    /// 1.
    pub version: u32,
    /// The pack of an asset; `{name}` stands for the asset's name.
    #[serde(default = "packs")]
    pub output: String,
    /// The folder of an asset's exports.
    #[serde(default = "exports")]
    pub exports: String,
    /// A folder of finished bakes by what they were made of, which several machines may share.
    pub cache: Option<PathBuf>,
    /// How all assets are baked.
    #[serde(default)]
    pub bake: Settings,
    /// The assets.
    #[serde(default)]
    pub asset: Vec<Entry>,
    /// How some of them are baked otherwise; of several that match the last counts.
    #[serde(default, rename = "override")]
    pub overrides: Vec<Override>,
}

/// Assets: every file that matches, or one block of several trees.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Entry {
    /// Patterns of files, as `trees/**/*.glb`: each file is an asset, named as the file.
    #[serde(default)]
    pub files: Vec<String>,
    /// Patterns of files that are left out.
    #[serde(default)]
    pub except: Vec<String>,
    /// One block of trees, as `forest-bake all` takes them: `oak.glb@3,0,4:yaw=30`.
    #[serde(default)]
    pub trees: Vec<String>,
    /// The name of a block, or of the one file that matches.
    pub name: Option<String>,
    /// How they are baked.
    #[serde(default)]
    pub bake: Settings,
}

/// How the assets are baked whose name matches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Override {
    /// A pattern of names, as `oak-*`.
    #[serde(rename = "match")]
    pub pattern: String,
    /// How they are baked.
    pub bake: Settings,
}

fn packs() -> String {
    "packs/{name}.fpack".into()
}

fn exports() -> String {
    "exports/{name}".into()
}

/// One thing to bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Asset {
    /// Unique in its manifest.
    pub name: String,
    /// Trees, as `forest-bake all` takes them.
    pub trees: Vec<String>,
    /// The pack.
    pub output: PathBuf,
    /// The folder of exports.
    pub exports: PathBuf,
    /// How it is baked.
    pub settings: Settings,
}

impl Manifest {
    /// Reads a manifest, whose paths are relative to `folder`.
    ///
    /// # Errors
    /// When it is not TOML of this form and version; `file` is named.
    pub fn parse(text: &str, file: &Path) -> Result<Self, BatchError> {
        let invalid = |element: &str, problem: String| BatchError::invalid(file, element, problem);
        let manifest: Self = toml::from_str(text)
            .map_err(|e| invalid("manifest", e.to_string().trim_end().into()))?;
        if manifest.version != VERSION {
            let problem = format!("{}; this build reads version {VERSION}", manifest.version);
            return Err(invalid("version", problem));
        }
        if !manifest.output.contains("{name}") || !manifest.output.ends_with(".fpack") {
            let problem = format!("{:?}; it must hold {{name}} and end in .fpack", manifest.output);
            return Err(invalid("output", problem));
        }
        if !manifest.exports.contains("{name}") {
            return Err(invalid(
                "exports",
                format!("{:?}; it must hold {{name}}", manifest.exports),
            ));
        }
        Ok(manifest)
    }

    /// All assets, in the order of their names. `file` is the manifest's, in whose folder files are looked for.
    ///
    /// # Errors
    /// When an entry or pattern makes no sense, an entry matches nothing, or two assets have one name.
    pub fn assets(&self, file: &Path) -> Result<Vec<Asset>, BatchError> {
        let folder = folder_of(file);
        let mut all: BTreeMap<String, (Vec<String>, &Settings)> = BTreeMap::new();
        for (i, entry) in self.asset.iter().enumerate() {
            let element = format!("asset {i}");
            for (name, trees) in entry.named(&folder, file, &element)? {
                if let Some((other, _)) = all.insert(name.clone(), (trees.clone(), &entry.bake)) {
                    let problem = format!(
                        "{} and {} are both named {name:?}",
                        other.join(" "),
                        trees.join(" ")
                    );
                    return Err(BatchError::invalid(file, element, problem));
                }
            }
        }
        let mut overrides = Vec::new();
        for (i, o) in self.overrides.iter().enumerate() {
            overrides.push((pattern(&o.pattern, file, &format!("override {i}"))?, &o.bake));
        }
        let asset = |(name, (trees, own)): (String, (Vec<String>, &Settings))| {
            let mut settings = own.within(&self.bake);
            for (_, bake) in overrides.iter().filter(|o| o.0.matches(&name)) {
                settings = bake.within(&settings);
            }
            let at = |text: &str| folder.join(text.replace("{name}", &name));
            Asset { trees, output: at(&self.output), exports: at(&self.exports), settings, name }
        };
        Ok(all.into_iter().map(asset).collect())
    }
}

impl Entry {
    /// Names and trees of its assets.
    fn named(
        &self,
        folder: &Path,
        file: &Path,
        element: &str,
    ) -> Result<Vec<(String, Vec<String>)>, BatchError> {
        let invalid = |problem: String| BatchError::invalid(file, element, problem);
        if self.files.is_empty() == self.trees.is_empty() {
            return Err(invalid("either files or trees must be given".into()));
        }
        if let Some(name) = self.name.as_ref().filter(|n| !is_name(n)) {
            return Err(invalid(format!(
                "name {name:?}; letters, digits, '-', '_', '.' and spaces"
            )));
        }
        if !self.trees.is_empty() {
            let name = self.name.clone().ok_or_else(|| invalid("trees need a name".into()))?;
            let whole = |t: &String| folder.join(t).to_string_lossy().into_owned();
            return Ok(vec![(name, self.trees.iter().map(whole).collect())]);
        }
        let except: Vec<Pattern> =
            self.except.iter().map(|e| pattern(e, file, element)).collect::<Result<_, _>>()?;
        let mut found = Vec::new();
        for text in &self.files {
            pattern(text, file, element)?;
            let whole = Path::new(&Pattern::escape(&folder.to_string_lossy())).join(text);
            let before = found.len();
            let paths = glob::glob(&whole.to_string_lossy()).map_err(|e| invalid(e.to_string()))?;
            for path in paths {
                let path = path
                    .map_err(|e| BatchError::io(e.path())(std::io::Error::other(e.to_string())))?;
                let inner = path.strip_prefix(folder).unwrap_or(&path);
                if path.is_file() && !except.iter().any(|e| e.matches_path(inner)) {
                    found.push(path);
                }
            }
            if found.len() == before {
                return Err(invalid(format!(
                    "files {text:?} matches nothing in {}",
                    folder.display()
                )));
            }
        }
        found.sort();
        found.dedup();
        if let (Some(name), [one]) = (&self.name, &found[..]) {
            return Ok(vec![(name.clone(), vec![one.to_string_lossy().into_owned()])]);
        }
        if let Some(name) = &self.name {
            return Err(invalid(format!("name {name:?} is given to {} files", found.len())));
        }
        let named = |p: PathBuf| {
            let stem = p.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            match is_name(&stem) {
                true => Ok((stem, vec![p.to_string_lossy().into_owned()])),
                false => Err(invalid(format!("{}: no name for a pack; give one", p.display()))),
            }
        };
        found.into_iter().map(named).collect()
    }
}

fn pattern(text: &str, file: &Path, element: &str) -> Result<Pattern, BatchError> {
    Pattern::new(text).map_err(|e| BatchError::invalid(file, element, format!("{text:?}: {e}")))
}

/// Names become file names: nothing in them may lead elsewhere.
fn is_name(text: &str) -> bool {
    let fits = |c: char| c.is_alphanumeric() || "-_. ".contains(c);
    !text.is_empty() && !text.starts_with('.') && text.chars().all(fits)
}

pub(crate) fn folder_of(file: &Path) -> PathBuf {
    file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assets(text: &str, files: &[&str]) -> Result<Vec<Asset>, String> {
        let folder = tempfile::tempdir().unwrap();
        for name in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        let file = folder.path().join("forest.toml");
        let manifest = Manifest::parse(text, &file).map_err(|e| e.to_string())?;
        manifest.assets(&file).map_err(|e| e.to_string())
    }

    #[test]
    fn every_file_that_matches_is_an_asset_and_overrides_count_last() {
        let text = r#"
            version = 1
            output = "out/{name}.fpack"
            bake.preset = "game"
            bake.views.texels = 128
            [[asset]]
            files = ["trees/**/*.glb", "*.obj"]
            except = ["trees/old/*"]
            [[asset]]
            name = "grove"
            trees = ["trees/oak.glb@0,0,0", "shrub.obj@2,0,1:yaw=30"]
            [[override]]
            match = "oak*"
            bake = { preset = "film" }
        "#;
        let files = ["trees/oak.glb", "trees/a/ash.glb", "trees/old/elm.glb", "shrub.obj"];
        let all = assets(text, &files).unwrap();
        let names: Vec<&str> = all.iter().map(|a| &*a.name).collect();
        assert_eq!(names, ["ash", "grove", "oak", "shrub"]);
        assert!(
            all[0].output.ends_with("out/ash.fpack") && all[0].exports.ends_with("exports/ash")
        );
        assert_eq!(all[0].settings.arguments(), ["--preset=game", "--set=views.texels=128"]);
        assert_eq!(all[2].settings.arguments(), ["--preset=film", "--set=views.texels=128"]);
        assert!(all[1].trees[1].ends_with("shrub.obj@2,0,1:yaw=30"));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        let cases = [
            ("version = 2", "version: 2; this build reads version 1"),
            ("version = 1\noutput = \"x.fpack\"", "must hold {name}"),
            ("version = 1\ncolour = 3", "unknown field"),
            ("version = 1\n[[asset]]", "either files or trees"),
            ("version = 1\n[[asset]]\nfiles = [\"*.glb\"]", "matches nothing"),
            ("version = 1\n[[asset]]\nfiles = [\"***\"]", "asset 0"),
            ("version = 1\n[[asset]]\ntrees = [\"a.obj\"]", "need a name"),
            ("version = 1\n[[asset]]\ntrees = [\"a.obj\"]\nname = \"../up\"", "name \"../up\""),
            ("version = 1\n[[asset]]\nfiles = [\"a.obj\", \"b/a.obj\"]", "both named \"a\""),
            ("version = 1\n[[asset]]\nfiles = [\"a.obj\"]\nbake.prset = \"x\"", "unknown field"),
        ];
        for (text, want) in cases {
            let told = assets(text, &["a.obj", "b/a.obj"]).unwrap_err();
            assert!(told.contains(want) && told.contains("forest.toml"), "{text}: {told}");
        }
    }
}
