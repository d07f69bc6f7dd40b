//! `rayfront ab SCENE --set …`: compares a scene with an edited version of it, using the same random numbers.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use super::{load, save_plain};
use crate::cli::args::{ModelOptions, PictureOptions};
use crate::cli::job::default_image;
use crate::cli::{failure::Failure, output};
use crate::film::exposure::exposure_ev;
use crate::film::metrics::colormap;
use crate::film::tonemap::DisplayTransform;
use crate::film::{Film, Region};
use crate::formats::picture::supported;
use crate::formats::{Edits, LoadOptions};
use crate::math::Rgb;
use crate::memory;
use crate::render::{MemoryEstimate, Options, Session, on_threads};
use crate::world::{Settings, SourceFiles, Tonemap};

/// The error for too few samples to measure a difference.
const FEW_SAMPLES: &str = "a difference needs two samples of each pixel: --spp 2 or more";

/// `rayfront ab`.
#[derive(Args, Debug)]
pub struct Ab {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj, .stl)
    pub scene: PathBuf,
    /// Base name of the images, NAME.a.png and NAME.b.png, and of their difference, NAME.diff.png [default: the scene's
    /// name, in the current folder]
    #[arg(short, long, value_name = "NAME")]
    pub output: Option<PathBuf>,
    /// Threads; 0 means one for each core
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// The options for reading the scene. Only B gets --set, --only and --hide.
    #[command(flatten)]
    pub model: ModelOptions,
    /// The options of both images.
    #[command(flatten)]
    pub picture: PictureOptions,
}

/// One of the two renders, and its inputs.
struct ComparedSide {
    film: Film,
    settings: Settings,
    /// The files that were read for it.
    sources: SourceFiles,
}

pub fn run(arguments: &Ab) -> Result<ExitCode, Failure> {
    let options: LoadOptions = arguments.model.of_size(arguments.picture.sampling.size);
    let Edits { look_at, orbit, zoom, ground, .. } = options.edits.clone();
    // Edits of the view and the ground apply to both.
    let common = Edits { look_at, orbit, zoom, ground, ..Edits::default() };
    if options.edits == common {
        let what = "there is nothing to compare: say what B has, with --set, --only or --hide";
        return Err(Failure::command_line(what));
    }
    if arguments.picture.sampling.spp == Some(1) {
        return Err(Failure::command_line(FEW_SAMPLES));
    }
    let base = arguments.output.clone().unwrap_or_else(|| default_image(&arguments.scene));
    let is_image = base.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
    let base = if is_image { base.with_extension("") } else { base };
    let path = |end: &str| {
        let mut name = base.clone().into_os_string();
        name.push(format!(".{end}.png"));
        PathBuf::from(name)
    };
    ["a", "b", "diff"].map(&path).iter().try_for_each(|path| supported(path))?;
    let plain = LoadOptions { edits: common, ..options.clone() };
    let [a, b] =
        on_threads(arguments.threads, || [&plain, &options].map(|options| render(arguments, options)))?;
    let (a, b) = (a?, b?);
    if a.settings.size != b.settings.size {
        return Err(Failure::command_line("A and B have other sizes: give both one, with --size"));
    }
    let [width, height] = a.settings.size;
    let bytes = u64::from(width) * u64::from(height) * BYTES;
    let _claim = memory::reserve(format_args!("the difference of images of {width}x{height}"), bytes)?;
    let difference =
        ImageDifference::new(&a.film, &b.film).ok_or_else(|| Failure::command_line(FEW_SAMPLES))?;
    for output in ["a", "b", "diff"].map(&path) {
        for side in [&a, &b] {
            super::check_is_not_read(&output, &side.sources, "-o")?;
        }
    }
    let radiances = [&a, &b].map(|side| side.film.radiance());
    // Both get A's exposure, so that only real differences show.
    let exposure_ev = exposure_ev(&a.settings, &a.film);
    for (end, radiance) in ["a", "b"].iter().zip(&radiances) {
        let display = DisplayTransform::new(a.settings.tonemap, exposure_ev, radiance);
        save_plain(&path(end), a.settings.size, radiance, display)?;
    }
    let shown = difference.picture();
    save_plain(&path("diff"), a.settings.size, &shown, DisplayTransform::new(Tonemap::Clamp, 0.0, &shown))?;
    let ImageDifference { mean, error, significant, .. } = difference;
    if arguments.json {
        let files = ["a", "b", "diff"].map(|end| output::path_json(&path(end)));
        let facts =
            json!({"images": files, "mean": mean, "standard_error": error, "significant": significant});
        output::print(&format!("{facts}\n"))?;
    } else {
        let before = radiances[0].iter().map(|light| f64::from(light.luminance())).sum::<f64>();
        let part = 100.0 * mean / (before / radiances[0].len().max(1) as f64).max(1e-30);
        output::print(&format!(
            "images      {}, {}, {}\nB - A       {mean:+.6} in the mean, {part:+.2} % of A, standard error {error:.6}\n\
                 significant {:.1} % of the image differ by more than three standard errors\n",
            path("a").display(),
            path("b").display(),
            path("diff").display(),
            100.0 * significant
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn render(arguments: &Ab, options: &LoadOptions) -> Result<ComparedSide, Failure> {
    let Ab { scene, picture, .. } = arguments;
    let (world, setup) =
        load(scene, options, picture.sampling.camera.as_deref(), |world| picture.apply(world))?;
    let settings = world.settings.clone();
    MemoryEstimate::usual(Region::whole(settings.size)).check(&setup, &settings)?;
    let mut session = Session::of(setup.into(), settings.samples, Options::default());
    while !session.is_done() {
        session.advance(16);
    }
    Ok(ComparedSide { film: session.into_film(), settings, sources: world.assets.files.clone() })
}

/// The difference B − A. Both use the same random numbers, so most of their noise cancels; the difference between even
/// and odd samples is an estimate of the rest.
struct ImageDifference {
    /// The luminance of each pixel's difference in standard errors, summed over its neighbours.
    scores: Vec<f64>,
    /// The mean difference.
    mean: f64,
    /// The standard error of the mean.
    error: f64,
    /// The fraction of the pixels whose score exceeds three in magnitude.
    significant: f64,
}

/// The memory for the comparison in bytes per pixel, besides the films: two images, the differences, the scores and
/// their image.
const BYTES: u64 = 64;

/// The number of neighbours on each side that count for a pixel's score: a single pixel is a poor estimate of its own
/// noise.
const BESIDE: usize = 2;

impl ImageDifference {
    /// Compares two films; `None` unless every pixel has even and odd samples.
    fn new(a: &Film, b: &Film) -> Option<ImageDifference> {
        let (a_halves, b_halves) = a.halves().zip(b.halves())?;
        let pixel = |(a, b): ([Rgb; 2], [Rgb; 2])| {
            let [even, odd] =
                [0, 1].map(|i: usize| f64::from(b[i].luminance()) - f64::from(a[i].luminance()));
            // The mean of two halves has a quarter of the variance of their difference.
            (0.5 * (even + odd), 0.25 * (even - odd) * (even - odd))
        };
        let pixels: Vec<(f64, f64)> = a_halves.zip(b_halves).map(pixel).collect();
        Some(Self::of(&pixels, a.region().width() as usize))
    }

    /// Evaluates differences with their variances, row by row.
    fn of(pixels: &[(f64, f64)], width: usize) -> ImageDifference {
        let count = pixels.len().max(1) as f64;
        let mean = pixels.iter().map(|(difference, _)| difference).sum::<f64>() / count;
        let error = pixels.iter().map(|(_, variance)| variance).sum::<f64>().sqrt() / count;
        let rows: Vec<&[(f64, f64)]> = pixels.chunks(width.max(1)).collect();
        let mut scores = Vec::with_capacity(pixels.len());
        for y in 0..rows.len() {
            for x in 0..rows[y].len() {
                let near = rows[y.saturating_sub(BESIDE)..(y + BESIDE + 1).min(rows.len())].iter();
                let near =
                    near.flat_map(|row| &row[x.saturating_sub(BESIDE)..(x + BESIDE + 1).min(row.len())]);
                let (sum, variance) = near.fold((0.0, 0.0), |(sum, all), (difference, variance)| {
                    (sum + difference, all + variance)
                });
                // Without noise, any difference is significant.
                let score = if sum == 0.0 { 0.0 } else { sum / variance.sqrt().max(1e-12 * sum.abs()) };
                scores.push(score);
            }
        }
        let significant = scores.iter().filter(|score| score.abs() > 3.0).count() as f64 / count;
        ImageDifference { scores, mean, error, significant }
    }

    /// Returns the scores as colours: black for no difference, brighter up to ten standard errors.
    fn picture(&self) -> Vec<Rgb> {
        self.scores.iter().map(|score| colormap::color(score.abs() / 10.0)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_beyond_the_noise_are_significant() {
        // Noise of variance 1 on the left, a difference of 3 with the same noise on the right.
        let noise = |i: usize| [1.0, -1.0, 0.5, -0.5][i % 4];
        let pixel = |i: usize| (noise(i) + if i % 20 >= 10 { 3.0 } else { 0.0 }, 1.0);
        let pixels: Vec<_> = (0..400).map(pixel).collect();
        let ImageDifference { scores, mean, significant, error, .. } = ImageDifference::of(&pixels, 20);
        assert!((mean - 1.5).abs() < 1e-9 && (error - 0.05).abs() < 1e-9);
        assert!((0.4..0.65).contains(&significant), "{significant}");
        assert!(scores[0].abs() < 3.0 && scores[19] > 3.0);
        let same = ImageDifference::of(&[(0.0, 0.0); 9], 3);
        assert_eq!((same.significant, same.mean), (0.0, 0.0));
    }
}
