//! The header of a film file.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use xxhash_rust::xxh3::Xxh3;

use crate::error::in_one_line;
use crate::film::{Allocation, Film, FilmScale, GroupKinds, Moments, Region, SampleRanges};
use crate::formats::LoadOptions;
use crate::formats::load_options::as_text;
use crate::world::source_files::FileDigest;
use crate::world::{Settings, SourceFiles};

/// The name and version of this program. Another version may produce different samples.
pub const PROGRAM: &str = concat!("rayfront ", env!("CARGO_PKG_VERSION"));

/// The key of the scene's own file among the files that were read, whatever its name.
const SCENE: &str = ".";

/// The scene and the settings of a film, and the progress of its rendering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilmHeader {
    /// [`PROGRAM`].
    pub program: String,
    /// The scene's files.
    pub scene: Source,
    /// The view of the scene.
    pub view: RenderedView,
    /// The settings, including the changes made on the command line.
    pub settings: Settings,
    /// The rendered region in pixels.
    pub region: Region,
    /// The unit of the sums.
    pub unit: FilmScale,
    /// True if sums of squared samples are stored, too.
    pub variance: bool,
    /// The names of the light groups whose sums the film contains.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub light_groups: Vec<String>,
    /// True if the film contains the sums of shadow catchers.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub catches: bool,
    /// The range of samples that the film is to have; for a shard, a part of [`Settings::samples`].
    pub wanted: [u32; 2],
    /// The samples that all pixels have, as sorted ranges.
    pub samples: Vec<[u32; 2]>,
    /// The largest number of samples of any pixel: under adaptive sampling, more than all pixels have.
    pub most: u32,
    /// The unfinished pass, whose samples only some tiles have.
    pub begun: Option<Begun>,
    /// The number of rays that the first samples of each block took, under adaptive sampling.
    pub rays: Option<Vec<u64>>,
    /// The numbers of samples of the blocks, if decided beforehand. `samples` then refers to the pixels that get them.
    pub allocation: Option<Allocation>,
    /// The index of the shard, and the number of shards.
    pub shard: Option<[u32; 2]>,
    /// [`Film::hash`], in hexadecimal digits.
    pub film_hash: String,
    /// The hash of the squares.
    pub moments_hash: Option<String>,
    /// Metadata that no bit of the image depends on.
    pub note: Note,
}

/// An unfinished pass.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Begun {
    /// Its range of samples.
    pub samples: [u32; 2],
    /// The end of the samples that are to follow for the same blocks, if there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<u32>,
    /// Width and height of its tiles in pixels.
    pub tile: u32,
    /// The numbers of the tiles that have these samples.
    pub tiles: Vec<u32>,
    /// The numbers of the blocks that get these samples; none for all.
    pub blocks: Option<Vec<u32>>,
}

/// Human-readable notes, and the data needed to continue with the same options.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Note {
    /// The command line, without the program's name.
    pub command: Vec<String>,
    /// The paths of the output images.
    #[serde(with = "as_text::several")]
    pub outputs: Vec<PathBuf>,
    /// The machines that rendered it.
    pub hosts: Vec<String>,
    /// The total rendering time of all machines in seconds.
    pub seconds: f64,
    /// The reason why there are fewer samples than wanted.
    pub stopped_by: Option<String>,
    /// The statements by which an image's light groups are mixed: see [`crate::formats::ron::query::mix`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mix: Vec<String>,
}

/// The files that a scene was read from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// The scene's path, as given.
    #[serde(with = "as_text")]
    pub path: PathBuf,
    /// The hash of each file's content, by its path relative to the scene's folder; `.` is the scene file itself.
    pub files: BTreeMap<String, String>,
    /// The hash of `files`.
    pub hash: String,
}

/// The view of a scene that is rendered.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RenderedView {
    /// The camera's name; none for the first.
    pub camera: Option<String>,
    /// The exposure time in seconds from then on, for motion blur.
    pub shutter_s: Option<f32>,
    /// The number of moments within the exposure at which the scene is rendered.
    pub moments: Option<u32>,
    /// The options for reading the scene.
    #[serde(flatten)]
    pub options: LoadOptions,
}

impl RenderedView {
    /// The largest value of [`RenderedView::moments`].
    pub const MOST_MOMENTS: u32 = 4096;
    /// The largest value of [`RenderedView::shutter_s`]: the whole interval between frames a thousand seconds apart.
    pub const LONGEST_SHUTTER_S: f32 = 1001.0;
    /// The largest rotation of a camera in degrees.
    pub const MOST_DEGREES: f64 = 36_000.0;

    /// The number of moments.
    pub fn moments(&self) -> u32 {
        self.shutter_s.and(self.moments).unwrap_or(1).max(1)
    }

    /// Returns the moment of a sample, out of `samples`, and the first later sample that belongs to another moment.
    ///
    /// The samples are divided as evenly as possible, in two rounds through all moments; the first has a quarter of the
    /// samples. Each round visits the moments in the order of the radical inverse in base 3 (Halton, 1960). So a
    /// rendering that is stopped early also has samples from the whole exposure, although the samples of each moment
    /// are consecutive: every sixteenth point of a Sobol sequence, for example, would cover only a sixteenth of the
    /// pixel.
    pub fn moment_of(&self, sample: u32, samples: u32) -> (u32, u32) {
        let (place, end) = self.place_of(sample, samples);
        (in_radical_inverse_order(place, self.moments()), end)
    }

    /// Like [`RenderedView::moment_of`], but returns the position in the order of visit instead of the moment.
    fn place_of(&self, sample: u32, samples: u32) -> (u32, u32) {
        let moments = u64::from(self.moments());
        let quarter = if u64::from(samples / 4) >= moments { samples / 4 } else { 0 };
        let (start, end) = if sample < quarter { (0, quarter) } else { (quarter, samples.max(quarter + 1)) };
        let count = u64::from(end - start);
        let place = (u64::from(sample - start) * moments / count).min(moments - 1);
        let end = start + ((place + 1) * count).div_ceil(moments) as u32;
        (place as u32, end)
    }

    /// The number of moments to which the samples in `ranges`, out of `samples`, belong.
    pub fn moments_among(&self, ranges: &[[u32; 2]], samples: u32) -> u32 {
        let mut moments = vec![false; self.moments() as usize];
        for [start, end] in ranges {
            let mut sample = *start;
            while sample < *end {
                let (place, next) = self.place_of(sample, samples);
                moments[place as usize] = true;
                sample = next.max(sample + 1);
            }
        }
        moments.into_iter().filter(|exists| *exists).count() as u32
    }

    /// The view at a single moment, in the middle of its part of the exposure.
    pub fn at(&self, moment: u32) -> RenderedView {
        let part = (moment as f32 + 0.5) / self.moments() as f32;
        let mut view = RenderedView { shutter_s: None, moments: None, ..self.clone() };
        if let Some(shutter) = self.shutter_s {
            view.options.time_s = Some(self.options.time_s.unwrap_or(0.0) + shutter * part);
        }
        view
    }
}

/// Returns the number at a position of 0, 1, … `count` − 1 sorted by their reversed digits in base 3. Not in base 2, in
/// which pixels are sampled: moving objects would meet the same positions of a pixel at the same times.
fn in_radical_inverse_order(place: u32, count: u32) -> u32 {
    let digits = (0..).find(|digits| 3u32.pow(*digits) >= count).unwrap_or(0);
    let inverse = |number: u32| {
        (0..digits).fold((number, 0), |(left, inverse), _| (left / 3, 3 * inverse + left % 3)).1
    };
    (0..3u32.pow(digits)).map(inverse).filter(|number| *number < count).nth(place as usize).unwrap_or(0)
}

impl Source {
    /// Hashes a scene's path and all the files that were read for it.
    pub fn new(path: &Path, files: &SourceFiles) -> Source {
        let folder = path.parent().unwrap_or(Path::new(""));
        let name = |file: &Path| match file.strip_prefix(folder) {
            _ if file == path => SCENE.to_owned(),
            Ok(inside) => inside.to_string_lossy().replace('\\', "/"),
            Err(_) => file.to_string_lossy().into_owned(),
        };
        let files = files.all();
        let files: BTreeMap<String, String> =
            files.iter().map(|(file, content)| (name(file), format!("{:032x}", content.hash))).collect();
        let mut hasher = Xxh3::new();
        for (name, hash) in &files {
            hasher.update(name.as_bytes());
            hasher.update(&[0]);
            hasher.update(hash.as_bytes());
        }
        Source { path: path.to_owned(), files, hash: format!("{:032x}", hasher.digest128()) }
    }

    /// The paths of these files.
    pub fn paths(&self) -> impl Iterator<Item = PathBuf> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        self.files.keys().map(move |name| match &name[..] {
            SCENE => self.path.clone(),
            _ => folder.join(name),
        })
    }

    /// Returns the first of these files that has changed since, among those that a scene at that path may refer to.
    pub fn changed(&self, scene: &Path) -> Option<PathBuf> {
        let sources = SourceFiles::default();
        sources.allow(scene);
        sources.confine(scene);
        let here = Source { path: scene.to_owned(), ..self.clone() };
        here.paths().zip(here.files.values()).find_map(|(path, hash)| {
            let bytes = sources.read(&path).ok()?;
            (format!("{:032x}", FileDigest::of(&bytes).hash) != *hash).then_some(path)
        })
    }

    /// A short description of how another source differs; none if it does not.
    pub fn difference(&self, other: &Source) -> Option<String> {
        if self.hash == other.hash {
            return None;
        }
        let name = |file: &String| match &file[..] {
            SCENE => in_one_line(&self.path.to_string_lossy()),
            _ => in_one_line(file),
        };
        for (file, hash) in &self.files {
            match other.files.get(file) {
                Some(same) if same == hash => {}
                Some(_) => return Some(format!("{} differs", name(file))),
                None => return Some(format!("{} is not read", name(file))),
            }
        }
        let more = other.files.keys().find(|file| !self.files.contains_key(*file));
        Some(more.map_or("its files differ".into(), |file| format!("{} is read, too", name(file))))
    }
}

/// Settings that no sample depends on: they affect only the images made from the film.
const OF_THE_PICTURE: [&str; 4] = ["tonemap", "exposure_ev", "auto_exposure", "aov"];

impl FilmHeader {
    /// The groups whose sums the film contains.
    pub fn groups(&self) -> GroupKinds {
        GroupKinds {
            lights: self.light_groups.len(),
            has_transparency: self.settings.counts_opacity(),
            has_catcher: self.catches,
        }
    }

    /// The samples that all pixels have; none if the ranges are invalid.
    pub fn ranges(&self) -> Option<SampleRanges> {
        let total = self.total();
        let ranges = SampleRanges::disjoint(self.samples.iter().map(|[start, end]| *start..*end))?;
        let fits = ranges.iter().all(|range| range.end <= total);
        fits.then_some(ranges)
    }

    /// The total number of samples: one past the number of the last one.
    pub fn total(&self) -> u32 {
        self.allocation.as_ref().map_or(self.settings.samples, Allocation::most)
    }

    /// The samples of a shard.
    pub fn part(&self, index: u32, count: u32) -> Range<u32> {
        match &self.allocation {
            Some(allocation) => allocation.shard(index, count),
            None => SampleRanges::shard(self.settings.samples, index, count),
        }
    }

    /// Stores the samples that all pixels have.
    pub fn set_ranges(&mut self, ranges: &SampleRanges) {
        self.samples = ranges.iter().map(|range| [range.start, range.end]).collect();
    }

    /// Stores the description of a film's contents.
    pub fn set_film(&mut self, film: &Film, moments: Option<&Moments>) {
        (self.region, self.unit) = (film.region(), film.unit());
        self.variance = moments.is_some();
        self.most = film.pixels().iter().map(|p| p.count[0] + p.count[1]).max().unwrap_or(0);
        self.film_hash = format!("{:032x}", film.hash());
        self.moments_hash = moments.map(|moments| format!("{:032x}", moments.hash()));
    }

    /// A short reason why another film's samples cannot be combined with this one's; none if they can.
    pub fn difference(&self, other: &FilmHeader) -> Option<String> {
        if self.program != other.program {
            return Some(format!("rendered by {}, not {}", self.program, other.program));
        }
        if let Some(what) = self.scene.difference(&other.scene) {
            return Some(format!("of another scene: {what}"));
        }
        let parts = |header: &FilmHeader| {
            // The settings contain the size, wherever it came from.
            let mut view = header.view.clone();
            view.options.size = None;
            let view = serde_json::to_value(&view).unwrap_or_default();
            let settings = serde_json::to_value(&header.settings).unwrap_or_default();
            let rest = serde_json::json!({
                "region": header.region, "variance": header.variance, "unit": header.unit,
                "light_groups": header.light_groups, "catches": header.catches,
            });
            [view, settings, rest]
        };
        if let (Some(own), Some(other)) = (&self.allocation, &other.allocation)
            && own != other
        {
            return Some("of blocks that get other numbers of samples".into());
        }
        let pairs = parts(self).into_iter().zip(parts(other));
        let of_samples = |name: &str| !OF_THE_PICTURE.contains(&name);
        let differs = pairs.flat_map(|(own, other)| differing(&own, &other, of_samples)).next()?;
        Some(format!("of other settings: {differs}"))
    }

    /// The first difference between the image settings of two films; none if there is none.
    pub fn difference_of_picture(&self, other: &FilmHeader) -> Option<String> {
        let [own, other] =
            [self, other].map(|header| serde_json::to_value(&header.settings).unwrap_or_default());
        differing(&own, &other, |name| OF_THE_PICTURE.contains(&name)).into_iter().next()
    }

    /// Like [`FilmHeader::difference`], but the wanted samples must also be the same.
    pub fn difference_of_job(&self, other: &FilmHeader) -> Option<String> {
        let ([start, end], [from, to]) = (self.wanted, other.wanted);
        let samples =
            || (self.wanted != other.wanted).then(|| format!("of samples {start}..{end}, not {from}..{to}"));
        self.difference(other).or_else(samples)
    }
}

/// The differences between two objects in the fields that count, such as `seed is 7, not 3`.
fn differing(own: &Value, other: &Value, counts: impl Fn(&str) -> bool) -> Vec<String> {
    let (Some(own), Some(other)) = (own.as_object(), other.as_object()) else { return Vec::new() };
    let differing = own.keys().filter(|name| counts(name) && other.get(*name) != own.get(*name));
    differing
        .map(|name| {
            let [own, other] = [own, other].map(|object| object.get(name).unwrap_or(&Value::Null));
            format!("{name} is {own}, not {other}")
        })
        .collect()
}
