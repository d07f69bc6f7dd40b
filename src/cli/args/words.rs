//! Command-line words for given options: the inverse of parsing.
//!
//! Each function destructures its argument field by field, so that a new field cannot be forgotten.

use std::fmt::Display;

use clap::ValueEnum;

use super::names::{QualityName, SamplerName, TransportName};
use crate::formats::{Edits, EnvironmentPreset, LightUnits, LoadOptions, SkyOptions};
use crate::world::{Adaptive, Caustics, DepthLimits, Settings, Sharing};

/// The words of a command line.
#[derive(Default)]
pub struct Words(Vec<String>);

impl Words {
    /// Returns the words for reading a scene with these options.
    pub fn of_loading(options: &LoadOptions) -> Words {
        let LoadOptions {
            time_s,
            variant,
            scene,
            light_units,
            solid_glass,
            double_sided,
            surroundings,
            edits,
            size,
        } = options;
        let mut words = Words::default();
        words.option("--time", time_s.as_ref());
        words.option("--variant", variant.as_ref());
        words.option("--scene", scene.as_ref());
        words.option(
            "--light-units",
            match light_units {
                LightUnits::Auto => None,
                LightUnits::Candela => Some("candela"),
                LightUnits::Watt => Some("watt"),
            },
        );
        words.switch("--solid-glass", *solid_glass);
        words.switch("--double-sided", *double_sided);
        words.surroundings(surroundings.as_ref());
        words.edits(edits);
        words.option("--size", size.map(|[width, height]| format!("{width}x{height}")));
        words
    }

    /// Adds the environment of a scene.
    pub fn surroundings(&mut self, surroundings: Option<&EnvironmentPreset>) {
        self.option("--env", surroundings.map(name_of));
    }

    fn edits(&mut self, edits: &Edits) {
        // The background is one of the statements in `set`.
        let Edits { set, only, hide, look_at, orbit, zoom, ground } = edits;
        let both = |[one, other]: &[f64; 2]| format!("{one},{other}");
        for (name, texts) in [("--set", set), ("--only", only), ("--hide", hide)] {
            texts.iter().for_each(|text| self.option(name, Some(text)));
        }
        if let Some([from, to]) = look_at {
            self.0.extend(["--look-at".to_owned(), from.clone(), to.clone()]);
        }
        self.option("--orbit", orbit.as_ref().map(both));
        self.option("--zoom", zoom.as_ref());
        self.switch("--ground", *ground);
    }

    /// Returns the words that turn a file's settings into `settings`, as far as samples depend on them.
    pub fn of_settings(authored: &Settings, settings: &Settings) -> Words {
        let Settings {
            samples,
            max_depth,
            depth_limits,
            sampler,
            sharing,
            caustics,
            adaptive,
            transport,
            seed,
            build_quality,
            // The size is an option for reading. The rest has no option but --set, which is for reading, too.
            ..
        } = settings;
        let mut words = Words::default();
        words.option("--spp", changed(samples, &authored.samples));
        words.option("--depth", changed(max_depth, &authored.max_depth));
        words.limits(&authored.depth_limits, depth_limits);
        words.name("--transport", TransportName::of(*transport), transport == &authored.transport);
        words.name("--sampler", SamplerName::of(*sampler), sampler == &authored.sampler);
        // Another tree changes the last bits of the hits of grazing rays.
        let quality = QualityName::of(*build_quality);
        words.name("--quality", quality, build_quality == &authored.build_quality);
        let name = match sharing {
            Sharing::Auto => "auto".to_owned(),
            Sharing::Off => "off".to_owned(),
            Sharing::Groups(pixels) => pixels.to_string(),
        };
        words.option("--sharing", Some(name).filter(|_| sharing != &authored.sharing));
        let name = match caustics {
            Caustics::Auto => "auto".to_owned(),
            Caustics::Off => "off".to_owned(),
            Caustics::Photons { photons, radius } => format!("{photons},{radius}"),
        };
        words.option("--caustics", Some(name).filter(|_| caustics != &authored.caustics));
        if adaptive != &authored.adaptive {
            words.0.push(match adaptive {
                Adaptive::Off => "--adaptive=off".to_owned(),
                Adaptive::On => "--adaptive=on".to_owned(),
                Adaptive::Unbiased => "--adaptive=unbiased".to_owned(),
            });
        }
        words.option("--seed", changed(seed, &authored.seed));
        words
    }

    fn limits(&mut self, authored: &DepthLimits, limits: &DepthLimits) {
        let DepthLimits { diffuse, glossy, transmission } = limits;
        for (name, limit, before) in [
            ("diffuse", diffuse, authored.diffuse),
            ("glossy", glossy, authored.glossy),
            ("transmission", transmission, authored.transmission),
        ] {
            match limit {
                Some(limit) if before != Some(*limit) => self.option(&format!("--{name}-depth"), Some(limit)),
                None if before.is_some() => {
                    self.option("--set", Some(format!("settings.{name}_depth = None")))
                }
                _ => {}
            }
        }
    }

    /// Adds an option, if it has a value.
    pub fn option(&mut self, name: &str, value: Option<impl Display>) {
        let Some(value) = value.map(|value| value.to_string()) else { return };
        // A value that begins with a minus would be taken for another option.
        match value.starts_with('-') {
            true => self.0.push(format!("{name}={value}")),
            false => self.0.extend([name.to_owned(), value]),
        }
    }

    fn name(&mut self, option: &str, name: impl ValueEnum, is_authored: bool) {
        let value = name.to_possible_value().filter(|_| !is_authored);
        self.option(option, value.as_ref().map(|value| value.get_name()));
    }

    fn switch(&mut self, name: &str, is_on: bool) {
        self.0.extend(is_on.then(|| name.to_owned()));
    }
}

impl IntoIterator for Words {
    type Item = String;
    type IntoIter = std::vec::IntoIter<String>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

/// Returns the value if it differs from the one before.
fn changed<'a, T: PartialEq>(value: &'a T, before: &T) -> Option<&'a T> {
    Some(value).filter(|value| *value != before)
}

/// Returns the environment as a value of `--env`. (No option sets the haze, so no option changes it.)
fn name_of(surroundings: &EnvironmentPreset) -> String {
    match surroundings {
        EnvironmentPreset::None => "none".to_owned(),
        EnvironmentPreset::Studio => "studio".to_owned(),
        EnvironmentPreset::Sky(sky) if *sky == SkyOptions::default() => "sky".to_owned(),
        EnvironmentPreset::Sky(SkyOptions { elevation_degrees, azimuth_degrees, haze: _ }) => {
            format!("sky:{elevation_degrees},{azimuth_degrees}")
        }
        EnvironmentPreset::Picture(path) => path.to_string_lossy().into_owned(),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::args::{Arguments, Command};
    use crate::world::World;

    /// Returns the loading options and the settings of an `explain` command with these words.
    fn understood(words: impl IntoIterator<Item = String>) -> (LoadOptions, Settings) {
        let words = ["rayfront", "explain", "a.ron", "0,0"].map(String::from).into_iter().chain(words);
        let arguments = Arguments::try_parse_from(words).unwrap_or_else(|error| panic!("{error}"));
        let Some(Command::Explain(explain)) = arguments.command else { panic!("another command") };
        let mut world = World::default();
        explain.light.apply(&mut world);
        world.settings.samples = explain.spp.unwrap_or(world.settings.samples);
        world.settings.seed = explain.seed.unwrap_or(world.settings.seed);
        world.settings.build_quality = explain.quality.map_or(world.settings.build_quality, Into::into);
        (explain.model.of_size(explain.size), world.settings)
    }

    #[test]
    fn words_parse_back_to_the_same_options() {
        let options = [
            "--time=-1.25 --variant=-1 --scene 2 --light-units watt --solid-glass --double-sided",
            "--light-units candela --time 0.1",
            "--env none --set a --set b=c --only d --hide e --hide f --ground --background #fff",
            "--env sky:-3.5,90 --orbit=-30,10.1 --zoom 0.3 --size 7x9",
            "--env sky:45,220 --look-at -1,2,3 4,5,-6",
            "--env studio --depth 3 --diffuse-depth 2 --glossy-depth 0 --transmission-depth 1000",
            "--env /a/sky.hdr --sampler jittered --sharing 16 --adaptive=unbiased --seed 18446744073709551615",
            "--caustics 0.25,3.5 --sharing off",
            "--caustics off",
            "--sharing off --adaptive --spp 3 --transport path --sampler independent --quality high",
        ];
        for line in options {
            let (options, settings) = understood(line.split(' ').map(String::from));
            let words = Words::of_loading(&options).into_iter();
            let words: Vec<_> = words.chain(Words::of_settings(&Settings::default(), &settings)).collect();
            assert_eq!(understood(words.clone()), (options, settings), "{line}: {words:?}");
        }
        let nothing = Words::of_loading(&LoadOptions::default()).into_iter();
        let mut nothing = nothing.chain(Words::of_settings(&Settings::default(), &Settings::default()));
        assert_eq!(nothing.next(), None);
    }
}
