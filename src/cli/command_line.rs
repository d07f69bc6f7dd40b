//! Command lines: taken apart by clap, changed, and printed to be typed next.

use std::ffi::{OsStr, OsString};
use std::fmt::Display;
use std::iter::{Peekable, once};
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::builder::ValueParser;
use clap::parser::ValueSource;
use clap::{Arg, Args, Command};

use super::args::{
    ADAPTIVE, GROUNDS, LIGHT_UNITS, ProcessLimits, Render, SAMPLERS, TONEMAPS, TRANSPORTS, UP_AXES, name_of,
    parse_place,
};
use crate::formats::film_file::FilmHeader;
use crate::formats::{Edits, EnvironmentPreset, LightUnits, LoadOptions, SkyOptions, UpAxis};
use crate::study::explain::Recipe;
use crate::view::picture;
use crate::world::{Caustics, DepthLimits, Settings, Sharing};

/// The options that only one run has: its part of the samples, its end, its outputs, its views.
const OF_ONE_RUN: &str =
    "until max-time checkpoint samples shard output tev spp frames turntable watch paranoid preview";
/// The options that change nothing in an image, or whose values its header holds.
const WITHOUT_TRACE: &str = "schedule wave threads simd checkpoint output max-time until shard samples bits spp \
    frames fps tev progress memory quiet json overwrite denoise preview allow-outside";

/// Normalises words: `--samples` with a plain number becomes `--spp`, the samples per pixel of other programs, and two
/// points in one word become two words.
pub fn normalize_args(words: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let is_kind = |word: &str| !word.starts_with('-') && !word.contains(['.', '/', '\\']);
    let is_number = |word: &OsStr| !word.is_empty() && word.as_encoded_bytes().iter().all(u8::is_ascii_digit);
    let mut words = words.into_iter().peekable();
    let mut meant = Vec::new();
    while let Some(word) = words.next() {
        if word == "--look-at" {
            meant.push(word);
            meant.extend(places(&mut words));
            continue;
        }
        // A scene may follow the option; another word is the kind of floor, if perhaps not one that there is.
        if word == "--ground"
            && let Some(kind) = words.next_if(|next| next.to_str().is_some_and(is_kind))
        {
            meant.push(format!("--ground={}", kind.to_string_lossy()).into());
            continue;
        }
        let attached = word.to_str().and_then(|word| word.strip_prefix("--samples="));
        meant.push(match attached.filter(|number| is_number(OsStr::new(number))) {
            Some(number) => format!("--spp={number}").into(),
            None if word == "--samples" && words.peek().is_some_and(|next| is_number(next)) => "--spp".into(),
            None => word,
        });
    }
    meant
}

/// Returns the words of two points, which are typed as one word or two. A missing second point becomes an empty word,
/// so that the error is about it, not about the words that follow.
fn places(words: &mut Peekable<impl Iterator<Item = OsString>>) -> Vec<OsString> {
    let Some(first) = words.next() else { return Vec::new() };
    let parts: Vec<&str> = first.to_str().unwrap_or_default().split_whitespace().collect();
    if let [from, to] = parts[..] {
        return vec![from.into(), to.into()];
    }
    let is_place = |word: &OsString| word.to_str().is_some_and(|word| parse_place(word).is_ok());
    vec![first, words.next_if(is_place).unwrap_or_default()]
}

/// A command line: its options by their main names, each with its values, and its other words.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CommandLine(Vec<Vec<String>>);

impl CommandLine {
    /// Creates a command line that begins with these words.
    pub fn of<const N: usize>(words: [&str; N]) -> CommandLine {
        CommandLine(words.iter().map(|word| vec![(*word).to_owned()]).collect())
    }

    /// Takes apart the words of a render, as typed or as recorded in a film. Values are not checked: another machine may
    /// have accepted them. Words of another version that has more options stay as they are.
    pub fn parse(words: &[String]) -> CommandLine {
        let words = words.strip_prefix(&["render".to_owned()]).unwrap_or(words);
        let takes_values = |arg: &Arg| arg.get_action().takes_values();
        let unchecked =
            |arg: Arg| if takes_values(&arg) { arg.value_parser(ValueParser::string()) } else { arg };
        let program = ProcessLimits::augment_args(Render::augment_args(Command::new("rayfront")));
        let mut program = program.mut_args(unchecked).mut_arg("scene", |scene| scene.required(false));
        let typed = once("rayfront").chain(words.iter().map(String::as_str));
        let Ok(found) = program.try_get_matches_from_mut(typed) else {
            return CommandLine(words.iter().map(|word| vec![word.clone()]).collect());
        };
        let mut given = Vec::new();
        for arg in program.get_arguments() {
            let id = arg.get_id().as_str();
            if found.value_source(id) != Some(ValueSource::CommandLine) {
                continue;
            }
            let mut places = found.indices_of(id).into_iter().flatten();
            let occurrences: Vec<Vec<&String>> = match takes_values(arg) {
                true => found.get_occurrences(id).into_iter().flatten().map(Iterator::collect).collect(),
                false => vec![Vec::new()],
            };
            for values in occurrences {
                let place = places.by_ref().take(values.len().max(1)).min();
                given.push((place, words_of(arg, &values)));
            }
        }
        given.sort();
        CommandLine(given.into_iter().map(|(_, words)| words).collect())
    }

    /// Returns the words.
    pub fn words(&self) -> Vec<String> {
        self.0.concat()
    }

    /// Returns the command line as recorded in images.
    pub fn of_images(self) -> CommandLine {
        self.without(WITHOUT_TRACE)
    }

    /// Removes some options, whose names are separated by blanks.
    pub fn without(mut self, names: &str) -> CommandLine {
        self.0.retain(|words| !names.split(' ').any(|removed| removed == name(words)));
        self
    }

    /// Adds words.
    pub fn push<const N: usize>(&mut self, words: [&str; N]) {
        self.0.push(words.map(str::to_owned).to_vec());
    }

    /// Adds all of another command line.
    pub fn extend(&mut self, other: &CommandLine) {
        self.0.extend_from_slice(&other.0);
    }

    /// Adds an option, if it has a value.
    pub fn option(&mut self, name: &str, value: Option<impl Display>) {
        self.0.extend(value.map(|value| option(name, &value.to_string())));
    }

    /// Adds a switch, if it is on.
    pub fn switch(&mut self, name: &str, is_on: bool) {
        self.0.extend(is_on.then(|| vec![format!("--{name}")]));
    }

    /// Adds an output file.
    pub fn output(&mut self, path: &Path) {
        self.push(["-o", &not_an_option(path)]);
    }

    /// Adds the environment of a scene.
    pub fn surroundings(&mut self, surroundings: Option<&EnvironmentPreset>) {
        self.option("env", surroundings.map(name_of_surroundings));
    }

    /// Adds the options for reading a scene. Each field is named, so that a new one cannot be forgotten.
    pub fn loading(&mut self, options: &LoadOptions) {
        let LoadOptions {
            var,
            time_s,
            variant,
            scene,
            animation,
            light_units,
            solid_glass,
            double_sided,
            up,
            surroundings,
            edits,
            size,
        } = options;
        let Edits {
            set,
            only,
            hide,
            look_at,
            orbit,
            zoom,
            fov_degrees,
            focal_length_mm,
            f_stop,
            focus,
            background,
            env_turn_degrees,
            env_strength,
            ground,
        } = edits;
        var.iter().for_each(|(name, value)| self.option("var", Some(format!("{name}={value}"))));
        self.option("time", time_s.as_ref());
        self.option("variant", variant.as_ref());
        self.option("scene", scene.as_ref());
        self.option("animation", animation.as_ref());
        self.option(
            "light-units",
            changed(light_units, &LightUnits::Auto).map(|units| name_of(LIGHT_UNITS, units)),
        );
        self.switch("solid-glass", *solid_glass);
        self.switch("double-sided", *double_sided);
        self.option("up", changed(up, &UpAxis::Y).map(|up| name_of(UP_AXES, up)));
        self.surroundings(surroundings.as_ref());
        self.option("env-turn", env_turn_degrees.as_ref());
        self.option("env-strength", env_strength.as_ref());
        for (name, texts) in [("set", set), ("only", only), ("hide", hide)] {
            texts.iter().for_each(|text| self.option(name, Some(text)));
        }
        if let Some([from, to]) = look_at {
            self.push(["--look-at", from, to]);
        }
        self.option("orbit", orbit.map(|[right, up]| format!("{right},{up}")));
        self.option("zoom", zoom.as_ref());
        self.option("fov", fov_degrees.as_ref());
        self.option("focal-length", focal_length_mm.as_ref());
        self.option("f-stop", f_stop.as_ref());
        self.option("focus", focus.as_ref());
        if let Some(ground) = ground {
            self.switch(&format!("ground={}", name_of(GROUNDS, ground)), true);
        }
        self.option("background", background.as_ref());
        self.option("size", size.map(|[width, height]| format!("{width}x{height}")));
    }

    /// Adds the options that turn a file's settings into `settings`, as far as samples depend on them.
    fn settings(&mut self, authored: &Settings, settings: &Settings) {
        let Settings {
            samples,
            max_depth,
            depth_limits: DepthLimits { diffuse, glossy, transmission },
            sampler,
            sharing,
            filter_glossy,
            caustics,
            adaptive,
            light_groups,
            light_by_bounce,
            transparent,
            transport,
            seed,
            // The size is an option for reading. The rest has no option but --set, which is for reading, too.
            ..
        } = settings;
        let before = &authored.depth_limits;
        self.option("spp", changed(samples, &authored.samples));
        self.option("depth", changed(max_depth, &authored.max_depth));
        for (name, limit, before) in [
            ("diffuse", diffuse, before.diffuse),
            ("glossy", glossy, before.glossy),
            ("transmission", transmission, before.transmission),
        ] {
            match limit {
                Some(_) => self.option(&format!("{name}-depth"), limit.filter(|_| *limit != before)),
                None => self.option("set", before.map(|_| format!("settings.{name}_depth = None"))),
            }
        }
        let transport = changed(transport, &authored.transport);
        self.option("transport", transport.map(|transport| name_of(TRANSPORTS, &Some(*transport))));
        let sampler = changed(sampler, &authored.sampler);
        self.option("sampler", sampler.map(|sampler| name_of(SAMPLERS, sampler)));
        let sharing = changed(sharing, &authored.sharing).map(|sharing| match sharing {
            Sharing::Auto => "auto".to_owned(),
            Sharing::Off => "off".to_owned(),
            Sharing::Groups(pixels) => pixels.to_string(),
        });
        self.option("sharing", sharing);
        let caustics = changed(caustics, &authored.caustics).map(|caustics| match caustics {
            Caustics::Auto => "auto".to_owned(),
            Caustics::Off => "off".to_owned(),
            Caustics::Photons { photons, radius } => format!("{photons},{radius}"),
        });
        self.option("caustics", caustics);
        self.option("filter-glossy", changed(filter_glossy, &authored.filter_glossy));
        let adaptive = changed(adaptive, &authored.adaptive);
        self.0.extend(adaptive.map(|it| vec![format!("--adaptive={}", name_of(ADAPTIVE, it))]));
        self.switch("light-groups", *light_groups && !authored.light_groups);
        self.switch("light-by-bounce", *light_by_bounce && !authored.light_by_bounce);
        self.switch("transparent", *transparent && !authored.transparent);
        self.option("seed", changed(seed, &authored.seed));
    }
}

impl Display for CommandLine {
    /// Writes a line for a shell.
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let words: Vec<_> = self.0.iter().flatten().map(|word| quoted(word)).collect();
        f.write_str(&words.join(" "))
    }
}

/// Returns the words of an option. A value that begins with a minus would be taken for another option.
fn option(name: &str, value: &str) -> Vec<String> {
    match value.starts_with('-') {
        true => vec![format!("--{name}={value}")],
        false => vec![format!("--{name}"), value.to_owned()],
    }
}

/// Returns the name of the option that these words are.
fn name(words: &[String]) -> &str {
    let option = words.first().and_then(|word| word.strip_prefix("--")).unwrap_or_default();
    option.split('=').next().unwrap_or_default()
}

/// Returns the words of an argument.
fn words_of(arg: &Arg, values: &[&String]) -> Vec<String> {
    let joined = values.iter().map(|value| value.as_str()).collect::<Vec<_>>().join(",");
    let takes_minus = arg.is_allow_hyphen_values_set() || arg.is_allow_negative_numbers_set();
    match (arg.get_long(), values) {
        (None, _) => vec![not_an_option(Path::new(&joined))],
        (Some(long), _) if arg.is_require_equals_set() => vec![format!("--{long}={joined}")],
        (Some(long), []) => vec![format!("--{long}")],
        (Some(long), _) if takes_minus => {
            once(&format!("--{long}")).chain(values.iter().copied()).cloned().collect()
        }
        (Some(long), _) => option(long, &joined),
    }
}

/// Returns the command that renders another part, next to the one at `path`.
pub fn of_shard(header: &FilmHeader, path: &Path, [index, count]: [u32; 2]) -> CommandLine {
    let own = header.shard.map_or(0, |[index, _]| index);
    let name = path.to_string_lossy();
    let file = other_number(&name, own, index).unwrap_or_else(|| format!("part-{index}-of-{count}.film"));
    of_part(header, ["--shard", &format!("{index}/{count}")], Path::new(&file))
}

/// Returns the command that renders some samples, next to the film at `path`.
pub fn of_samples(header: &FilmHeader, path: &Path, Range { start, end }: Range<u32>) -> CommandLine {
    let file = path.with_file_name(format!("samples-{start}-{end}.film"));
    of_part(header, ["--samples", &format!("{start}..{end}")], &file)
}

/// Returns the command that renders another part of the samples.
fn of_part(header: &FilmHeader, part: [&str; 2], file: &Path) -> CommandLine {
    let mut line = of_whole(header);
    line.push(part);
    line.output(file);
    line
}

/// Returns the command that renders a film again, without its part of the samples, rules for stopping, and outputs.
pub fn of_whole(header: &FilmHeader) -> CommandLine {
    let FilmHeader { settings, view, note, .. } = header;
    let typed = CommandLine::parse(&note.command);
    let is_frame = typed.0.iter().any(|words| ["frames", "turntable"].contains(&name(words)));
    let is_turned = typed.0.iter().any(|words| name(words) == "turntable");
    let mut line = CommandLine::of(["rayfront"]);
    line.extend(&typed.without(OF_ONE_RUN));
    // A film that was continued may have more samples than its command.
    line.option("spp", Some(settings.samples));
    if is_frame {
        // The frames have one exposure in common.
        line = line.without("time");
        line.option("time", view.options.time_s);
        if is_turned {
            line = line.without("orbit");
            line.option("orbit", view.options.edits.orbit.map(|[right, up]| format!("{right},{up}")));
        }
        if !settings.auto_exposure {
            line = line.without("exposure");
            line.option("exposure", Some(settings.exposure_ev));
        }
    }
    line
}

/// The note behind a command that cannot place the camera.
const NOT_MOVED: &str = "  # but that the camera is where its file says";

/// Returns the command that explains a sample of a render.
pub fn of_explain(recipe: &Recipe, [x, y]: [u32; 2], sample: u32) -> String {
    let Recipe { path, options, camera, authored, settings, is_moved } = recipe;
    let mut line = CommandLine::of(["rayfront", "explain", &not_an_option(path), &format!("{x},{y}")]);
    line.option("sample", Some(sample));
    line.settings(authored, settings);
    line.loading(options);
    line.option("camera", camera.as_ref());
    line.switch("allow-outside", crate::files::outside_is_allowed());
    let note = if *is_moved { NOT_MOVED } else { "" };
    format!("{line}{note}")
}

/// Returns the command that renders what a page shows, perhaps without its noise. If statements mix its light groups, it
/// renders a film, and a second command mixes that.
pub fn of_picture(recipe: &Recipe, display: picture::Display, mix: &[String], is_denoised: bool) -> String {
    let Recipe { path, options, camera, authored, settings, is_moved } = recipe;
    let mut line = CommandLine::of(["rayfront", &not_an_option(path)]);
    line.settings(authored, settings);
    line.loading(options);
    line.option("camera", camera.as_ref());
    let tonemap = changed(&display.tonemap, &authored.tonemap);
    line.option("tonemap", tonemap.map(|tonemap| name_of(TONEMAPS, tonemap)));
    match display.exposure_ev {
        None if authored.auto_exposure => {}
        None => line.option("exposure", Some("auto")),
        Some(stops) if !authored.auto_exposure && stops == authored.exposure_ev => {}
        Some(stops) => line.option("exposure", Some(stops)),
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let [film, image] = ["film", "png"].map(|ending| PathBuf::from(format!("{name}.{ending}")));
    let outside = crate::files::outside_is_allowed();
    let note = if *is_moved { NOT_MOVED } else { "" };
    if mix.is_empty() {
        line.switch("denoise", is_denoised);
        line.switch("allow-outside", outside);
        line.output(&image);
        return format!("{line}{note}");
    }
    line.switch("allow-outside", outside);
    line.output(&film);
    let mut mixing = CommandLine::of(["rayfront", "mix", &not_an_option(&film)]);
    mix.iter().for_each(|statement| mixing.option("set", Some(statement)));
    mixing.switch("denoise", is_denoised);
    mixing.switch("allow-outside", is_denoised && outside);
    mixing.output(&image);
    format!("{line} && {mixing}{note}")
}

/// Returns a word, quoted for a shell.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// Returns a path as an argument: one that begins with a minus would be taken for an option.
pub fn not_an_option(path: &Path) -> String {
    let path = path.to_string_lossy();
    if path.starts_with('-') { format!("./{path}") } else { path.into_owned() }
}

/// Returns a path with the old number in the file's name replaced by a new one.
fn other_number(name: &str, old: u32, new: u32) -> Option<String> {
    let start = name.rfind(['/', '\\']).map_or(0, |at| at + 1);
    let old = old.to_string();
    let is_digit = |at: usize| name.as_bytes().get(at).is_some_and(u8::is_ascii_digit);
    let longer = |at: &usize| *at > start && is_digit(at - 1) || is_digit(at + old.len());
    // In "3-of-64", the part comes before the number of parts.
    let mut found = name[start..].match_indices(&old).map(|(at, _)| start + at).filter(|at| !longer(at));
    let at = found.next()?;
    Some(format!("{}{new}{}", &name[..at], &name[at + old.len()..]))
}

/// Returns the value if it differs from the one before.
fn changed<'a, T: PartialEq>(value: &'a T, before: &T) -> Option<&'a T> {
    Some(value).filter(|value| *value != before)
}

/// Returns the environment as a value of `--env`. (No option sets the haze, so no option changes it.)
fn name_of_surroundings(surroundings: &EnvironmentPreset) -> String {
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
    use crate::cli::args::{ModelOptions, SampleOptions};
    use crate::world::World;

    #[test]
    fn words_are_quoted_for_a_shell() {
        assert_eq!(quoted("part-3.film"), "part-3.film");
        assert_eq!(quoted("it's a $cene"), "'it'\\''s a $cene'");
        assert_eq!(quoted(""), "''");
    }

    #[test]
    fn aliases_become_main_names() {
        let understood = |words: &[&str]| normalize_args(words.iter().map(OsString::from));
        assert_eq!(understood(&["a.ron", "--samples", "64"]), ["a.ron", "--spp", "64"]);
        assert_eq!(understood(&["--samples=64"]), ["--spp=64"]);
        assert_eq!(
            understood(&["--samples", "0..64", "--samples=1..2"]),
            ["--samples", "0..64", "--samples=1..2"]
        );
        assert_eq!(understood(&["--samples"]), ["--samples"]);
    }

    fn parsed(line: &str) -> CommandLine {
        CommandLine::parse(&line.split(' ').map(String::from).collect::<Vec<_>>())
    }

    #[test]
    fn recorded_words_have_main_names_in_the_order_typed() {
        for (typed, plain) in [
            ("render a.ron -s 4 -t2 -q", "a.ron --spp 4 --threads 2 --quiet"),
            ("--samples-per-pixel=8 a.ron --size=4x4", "--spp 8 a.ron --size 4x4"),
            ("a.ron --set a --look-at -1,2,3 4,5,6 --set b", "a.ron --set a --look-at -1,2,3 4,5,6 --set b"),
            (
                "a.ron --adaptive --aov depth,all -opart.film",
                "a.ron --adaptive=on --aov depth,all --output part.film",
            ),
            ("a.ron --exposure=-2 -o -", "a.ron --exposure -2 --output=-"),
            // A value of another machine, and an option of another version.
            ("a.ron --simd=mmx --memory 4G", "a.ron --simd mmx --memory 4G"),
            ("a.ron --newer 3 --simd=mmx", "a.ron --newer 3 --simd=mmx"),
        ] {
            assert_eq!(parsed(typed).to_string(), plain);
            assert_eq!(parsed(plain), parsed(typed));
        }
    }

    #[test]
    fn options_are_removed_with_their_values() {
        let line = parsed("a.ron --shard 3/4 -o x.film --spp=8 --output=y.png -oz.png");
        assert_eq!(line.without("shard output").to_string(), "a.ron --spp 8");
        assert_eq!(parsed("a.ron --preview --seed 3 --tev=x").of_images().to_string(), "a.ron --seed 3");
    }

    #[test]
    fn other_number_replaces_whole_numbers_in_file_names() {
        assert_eq!(other_number("out3/part-3.film", 3, 12), Some("out3/part-12.film".into()));
        assert_eq!(other_number("scene.3-of-33.film", 3, 4), Some("scene.4-of-33.film".into()));
        assert_eq!(other_number("part-13.film", 3, 4), None);
    }

    /// The options that a printed command has.
    #[derive(Parser)]
    struct Printed {
        #[command(flatten)]
        sampling: SampleOptions,
        #[command(flatten)]
        model: ModelOptions,
    }

    /// Returns the loading options and the settings of these words.
    fn understood(words: impl IntoIterator<Item = String>) -> (LoadOptions, Settings) {
        let words = once("rayfront".to_owned()).chain(words);
        let Printed { sampling, model } =
            Printed::try_parse_from(words).unwrap_or_else(|error| panic!("{error}"));
        let mut world = World::default();
        sampling.apply(&mut world);
        (model.of_size(sampling.size), world.settings)
    }

    #[test]
    fn words_parse_back_to_the_same_options() {
        let options = [
            "--time=-1.25 --variant=-1 --scene 2 --animation walk --light-units watt --solid-glass --double-sided",
            "--light-units candela --time 0.1 --var height=-1.2 --var paint=(0.8,0.1,0.1)",
            "--env none --set a --set b=c --only d --hide e --hide f --ground --background #fff",
            "--ground=shadow --background #fff",
            "--env sky:-3.5,90 --orbit=-30,10.1 --zoom 0.3 --size 7x9 --fov 30.5 --f-stop 2.8 --focus a",
            "--focal-length 85 --focus 3,4",
            "--env sky:45,220 --look-at -1,2,3 4,5,-6 --background 1,0.5,0",
            "--up z --env studio --env-turn=-90.5 --env-strength 0.25",
            "--env studio --depth 3 --diffuse-depth 2 --glossy-depth 0 --transmission-depth 500",
            "--env /a/sky.hdr --sampler jittered --sharing 16 --adaptive=unbiased --seed 18446744073709551615",
            "--caustics 0.25,3.5 --sharing off --filter-glossy 0.3",
            "--caustics off",
            "--sharing off --adaptive --light-groups --transparent --spp 3 --transport path --sampler independent",
        ];
        for line in options {
            let (options, settings) = understood(line.split(' ').map(String::from));
            let mut words = CommandLine::default();
            words.loading(&options);
            words.settings(&Settings::default(), &settings);
            assert_eq!(understood(words.words()), (options, settings), "{line}: {words}");
        }
        let mut nothing = CommandLine::default();
        nothing.loading(&LoadOptions::default());
        nothing.settings(&Settings::default(), &Settings::default());
        assert_eq!(nothing, CommandLine::default());
    }
}
