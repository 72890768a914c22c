//! Presets: what is baked, and with which options of the representations' own commands.

use std::fmt::{Display, Formatter};
use std::str::FromStr;

/// What is baked, and how finely.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Preset {
    /// To look at, in seconds: points and few small views.
    Draft,
    /// What real-time engines need: points, views and foliage.
    Game,
    /// All representations, finely, with measured errors.
    Film,
}

/// A representation, by the name of its command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Representation {
    Points,
    Views,
    Volume,
    Foliage,
}

use Representation::{Foliage, Points, Views, Volume};

impl Representation {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Points => "points",
            Views => "views",
            Volume => "volume",
            Foliage => "foliage",
        }
    }
}

impl Preset {
    pub(crate) const ALL: [Self; 3] = [Self::Draft, Self::Game, Self::Film];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Game => "game",
            Self::Film => "film",
        }
    }

    /// In the order in which they are baked.
    pub(crate) fn representations(self) -> &'static [Representation] {
        match self {
            Self::Draft => &[Points, Views],
            Self::Game => &[Points, Views, Foliage],
            Self::Film => &[Points, Views, Volume, Foliage],
        }
    }

    /// Options that differ from the defaults of the representation's command.
    fn options(self, representation: Representation) -> &'static [(&'static str, &'static str)] {
        match (self, representation) {
            (Self::Draft, Views) => &[
                ("views", "64"),
                ("texels", "64"),
                ("samples", "2"),
                ("channels", "color,normal,depth"),
            ],
            (Self::Draft, Volume) => &[("levels", "5"), ("cameras", "8"), ("codebook", "128")],
            (Self::Draft, Foliage) => &[("levels", "3")],
            (Self::Draft, Points) | (Self::Game, Volume | Foliage) => &[],
            (Self::Game, Points) => &[("measure", "true")],
            (Self::Game, Views) => &[("views", "144")],
            (Self::Film, Points) => &[("measure", "true"), ("alpha-tolerance", "0.05")],
            (Self::Film, Views) => &[("texels", "512")],
            (Self::Film, Volume) => &[("levels", "8"), ("cameras", "24"), ("codebook", "1024")],
            (Self::Film, Foliage) => &[("levels", "5")],
        }
    }

    /// What it bakes, line by line.
    pub(crate) fn text(self) -> String {
        let line = |r: &Representation| {
            let options = options(self, *r, std::iter::empty());
            format!("  forest-bake {} {}", r.name(), options.join(" ")).trim_end().to_string()
                + "\n"
        };
        let lines: String = self.representations().iter().map(line).collect();
        format!("{}:\n{lines}", self.name())
    }
}

/// An option of a representation's command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Setting {
    pub(crate) representation: Representation,
    pub(crate) option: String,
    value: String,
}

impl FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = || format!("{text:?}: REPRESENTATION.OPTION=VALUE, as views.texels=512");
        let (name, value) = text.split_once('=').ok_or_else(form)?;
        let (representation, option) = name.split_once('.').ok_or_else(form)?;
        let known = [Points, Views, Volume, Foliage].into_iter();
        let known = known.into_iter().find(|r| r.name() == representation).ok_or_else(form)?;
        // What `all` itself says.
        if ["output", "force", "json", "preview"].contains(&option) || option.is_empty() {
            return Err(format!("{text:?}: not an option for `all`"));
        }
        Ok(Self { representation: known, option: option.into(), value: value.into() })
    }
}

impl Display for Setting {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}={}", self.representation.name(), self.option, self.value)
    }
}

/// The options of a representation's command line: the preset's, but for those that are set otherwise.
pub(crate) fn options<'a>(
    preset: Preset,
    representation: Representation,
    own: impl Iterator<Item = &'a Setting>,
) -> Vec<String> {
    let own: Vec<&Setting> = own.collect();
    let usual = preset.options(representation).iter();
    let kept = usual.filter(|(name, _)| own.iter().all(|s| s.option != *name));
    let kept = kept.map(|(name, value)| (*name, *value));
    let own = own.iter().map(|s| (&*s.option, &*s.value));
    let argument = |(name, value): (&str, &str)| match value {
        "true" => Some(format!("--{name}")),
        "false" => None,
        value => Some(format!("--{name}={value}")),
    };
    kept.chain(own).filter_map(argument).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_set_counts_before_the_preset() {
        let of = |text: &[&str]| {
            let all: Vec<Setting> = text.iter().map(|t| t.parse().unwrap()).collect();
            let own = |r| all.iter().filter(move |s| s.representation == r);
            [Points, Views].map(|r| options(Preset::Game, r, own(r)).join(" "))
        };
        assert_eq!(of(&[]), ["--measure", "--views=144"]);
        let set = ["views.views=36", "views.layout=rings:3x8", "points.measure=false"];
        assert_eq!(of(&set), ["", "--views=36 --layout=rings:3x8"]);
        for wrong in ["views", "views.texels", "trees.n=3", "views.output=x", "views.=3"] {
            assert!(wrong.parse::<Setting>().is_err(), "{wrong}");
        }
    }
}
