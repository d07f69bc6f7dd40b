//! `rayfront compare IMAGE REFERENCE`: measures the error of an image.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde_json::{Value, json};

use super::save_plain;
use crate::cli::args::parse_exposure;
use crate::cli::failure::{Failure, Fault};
use crate::cli::job::header_of_image;
use crate::cli::output;
use crate::files::are_same;
use crate::film::metrics::{self, BLOCKS, Metrics, colormap};
use crate::film::tonemap::DisplayTransform;
use crate::formats::picture::{LinearCrop, load_linear_crop, supported};
use crate::math::Rgb;
use crate::world::Tonemap;

/// `rayfront compare`.
#[derive(Args, Debug)]
#[command(after_help = "Exit codes: 0 within all limits, 5 beyond one, 1 the images cannot be compared.")]
pub struct Compare {
    /// The image (.png, .exr, .hdr and others)
    pub image: PathBuf,
    /// The reference image, of the same size; of a crop and a whole image, what overlaps is compared
    pub reference: PathBuf,
    /// File for an image of FLIP's error: dark where the images look the same, bright where they differ
    #[arg(long, value_name = "FILE")]
    pub heatmap: Option<PathBuf>,
    /// Exposure in stops, applied before PSNR, SSIM and FLIP, such as -1.5
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, default_value = "0", value_parser = parse_exposure)]
    pub exposure: f32,
    /// Exit with 5 if the root mean square error is larger
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_rmse: Option<f64>,
    /// Exit with 5 if the relative mean squared error is larger
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_relmse: Option<f64>,
    /// Exit with 5 if the peak signal-to-noise ratio is smaller
    #[arg(long, value_name = "DB", allow_negative_numbers = true, value_parser = limit)]
    pub min_psnr: Option<f64>,
    /// Exit with 5 if the structural similarity is smaller
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = limit)]
    pub min_ssim: Option<f64>,
    /// Exit with 5 if the mean of FLIP's error is larger
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max_flip: Option<f64>,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
}

fn limit(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| "expected a finite number".into())
}

pub fn run(arguments: &Compare) -> Result<ExitCode, Failure> {
    arguments.heatmap.as_deref().map(supported).transpose()?;
    if let Some(path) = &arguments.heatmap
        && [&arguments.image, &arguments.reference].into_iter().any(|image| are_same(image, path))
    {
        return Err(Failure::command_line(format!("{} is compared: name another --heatmap", path.display())));
    }
    let image = LoadedImage::load(&arguments.image)?;
    let reference = LoadedImage::load(&arguments.reference)?;
    if image.whole != reference.whole {
        let text = |[w, h]: [u32; 2]| format!("{w}x{h}");
        return Err(Failure::file(format!(
            "{} has {} pixels and {} has {}: render both in one size",
            arguments.image.display(),
            text(image.whole),
            arguments.reference.display(),
            text(reference.whole)
        )));
    }
    let (image, reference) = overlap(arguments, image, reference)?;
    let is_linear = |path: &Path| {
        let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
        extension.is_some_and(|extension| extension == "exr" || extension == "hdr")
    };
    let [one, other] = [&arguments.image, &arguments.reference];
    if is_linear(one) != is_linear(other) {
        let (toned, linear) = if is_linear(other) { (one, other) } else { (other, one) };
        output::note(format_args!(
            "note: {} holds what a screen shows, and {} radiance: two files of one kind compare better",
            toned.display(),
            linear.display()
        ));
    }
    let gain = libm::exp2f(arguments.exposure);
    let width = image.size[0] as usize;
    let _claim = metrics::claim(image.size)?;
    let comparison = metrics::compare(width, &image.pixels, &reference.pixels, gain);
    if let Some(path) = &arguments.heatmap {
        let colors: Vec<Rgb> = comparison.flip.iter().map(|error| colormap::color(*error)).collect();
        save_plain(path, image.size, &colors, DisplayTransform::new(Tonemap::Clamp, 0.0, &colors))?;
    }
    let metrics = comparison.metrics;
    let limits = limits(arguments, &metrics);
    let text = match arguments.json {
        true => format!("{}\n", json(arguments, image.size, &metrics, &limits)),
        false => text(&metrics, &limits),
    };
    output::print(&text)?;
    let within = limits.iter().all(|limit| limit.within);
    Ok(if within { ExitCode::SUCCESS } else { Fault::Difference.code() })
}

/// An image, or a part of one.
struct LoadedImage {
    /// The column and row of the first pixel.
    at: [i64; 2],
    /// The size of the part.
    size: [u32; 2],
    /// The size of the whole image.
    whole: [u32; 2],
    pixels: Vec<Rgb>,
}

impl LoadedImage {
    fn load(path: &Path) -> Result<LoadedImage, Failure> {
        let LinearCrop { at, size, whole, pixels } = load_linear_crop(path)?;
        let width = size[0] as usize;
        if let Some(at) = pixels.iter().position(|pixel| !pixel.is_finite()) {
            let (x, y) = (at % width, at / width);
            return Err(Failure::file(format!(
                "{}: the pixel in column {x} and row {y} is not finite: there is no distance to it",
                path.display()
            )));
        }
        let image = LoadedImage { at, size, whole, pixels };
        // Formats without windows have the place in their record.
        let record = (size == whole).then(|| header_of_image(path).ok()).flatten();
        let recorded = record.map(|header| (header.region, header.settings.size));
        Ok(match recorded.filter(|(region, _)| [region.width(), region.height()] == size) {
            Some((region, whole)) => {
                LoadedImage { at: [region.x0, region.y0].map(i64::from), whole, ..image }
            }
            None => image,
        })
    }

    /// The columns and rows of the whole image that this part has: the first and one past the last of each.
    fn extent(&self) -> [[i64; 2]; 2] {
        [0, 1].map(|axis| {
            let end = self.at[axis] + i64::from(self.size[axis]);
            [self.at[axis].max(0), end.min(i64::from(self.whole[axis]))]
        })
    }

    /// Returns the part of it in these columns and rows, which it has.
    fn part(self, [[left, right], [top, bottom]]: [[i64; 2]; 2]) -> LoadedImage {
        let size = [(right - left) as u32, (bottom - top) as u32];
        if size == self.size {
            return self;
        }
        let width = self.size[0] as usize;
        let place = |value: i64, axis: usize| (value - self.at[axis]) as usize;
        let columns = place(left, 0)..place(right, 0);
        let rows = self.pixels.chunks(width).take(place(bottom, 1)).skip(place(top, 1));
        let pixels = rows.flat_map(|row| &row[columns.clone()]).copied().collect();
        LoadedImage { at: [left, top], size, whole: self.whole, pixels }
    }
}

/// Reduces two images of one size to the pixels that both have.
fn overlap(
    arguments: &Compare,
    image: LoadedImage,
    reference: LoadedImage,
) -> Result<(LoadedImage, LoadedImage), Failure> {
    let (one, other) = (image.extent(), reference.extent());
    let both = [0, 1].map(|axis: usize| [one[axis][0].max(other[axis][0]), one[axis][1].min(other[axis][1])]);
    let [[left, right], [top, bottom]] = both;
    if left >= right || top >= bottom {
        return Err(Failure::file(format!(
            "{} and {} are crops that do not overlap: render what both show",
            arguments.image.display(),
            arguments.reference.display()
        )));
    }
    if one != other {
        let [width, height] = image.whole;
        output::note(format_args!(
            "note: compared is what overlaps: {left},{top},{right},{bottom} of {width}x{height} pixels"
        ));
    }
    Ok((image.part(both), reference.part(both)))
}

/// A limit on a metric.
struct Limit {
    flag: &'static str,
    value: f64,
    limit: f64,
    within: bool,
}

fn limits(arguments: &Compare, metrics: &Metrics) -> Vec<Limit> {
    let most = |flag, value: f64, limit: Option<f64>| {
        limit.map(|limit| Limit { flag, value, limit, within: value <= limit })
    };
    let least = |flag, value: f64, limit: Option<f64>| {
        limit.map(|limit| Limit { flag, value, limit, within: value >= limit })
    };
    let all = [
        most("--max-rmse", metrics.rmse, arguments.max_rmse),
        most("--max-relmse", metrics.relative_mse, arguments.max_relmse),
        least("--min-psnr", metrics.psnr_db, arguments.min_psnr),
        least("--min-ssim", metrics.ssim, arguments.min_ssim),
        most("--max-flip", metrics.flip, arguments.max_flip),
    ];
    all.into_iter().flatten().collect()
}

/// Returns the human-readable report.
fn text(metrics: &Metrics, limits: &[Limit]) -> String {
    let [r, g, b] = metrics.mean_ratio;
    let psnr = if metrics.psnr_db.is_finite() { format!("{:.2} dB", metrics.psnr_db) } else { "∞".into() };
    let blocks: Vec<String> = BLOCKS
        .iter()
        .zip(&metrics.relative_mse_of_blocks)
        .map(|(side, error)| format!("{error:.6e} ({side}x{side})"))
        .collect();
    let mut lines = vec![
        format!("mse        {:.6e}", metrics.mse),
        format!("rmse       {:.6e}", metrics.rmse),
        format!("relmse     {:.6e}", metrics.relative_mse),
        format!("of blocks  {}", blocks.join(", ")),
        format!("psnr       {psnr}"),
        format!("ssim       {:.6}", metrics.ssim),
        format!("flip       {:.6}", metrics.flip),
        format!("means      {r:.6} {g:.6} {b:.6} (image / reference: red, green, blue)"),
    ];
    if metrics.identical {
        lines.push("identical  every pixel is equal".into());
    }
    for limit in limits.iter().filter(|limit| !limit.within) {
        lines.push(format!("beyond     {} {}: it is {:.6e}", limit.flag, limit.limit, limit.value));
    }
    lines.join("\n") + "\n"
}

/// Returns the report as a JSON object. Infinity and NaN become null.
fn json(arguments: &Compare, size: [u32; 2], metrics: &Metrics, limits: &[Limit]) -> Value {
    json!({
        "image": output::path_json(&arguments.image),
        "reference": output::path_json(&arguments.reference),
        "size": size,
        "exposure_ev": arguments.exposure,
        "mse": metrics.mse,
        "rmse": metrics.rmse,
        "relmse": metrics.relative_mse,
        "relmse_of_blocks": metrics.relative_mse_of_blocks,
        "psnr_db": metrics.psnr_db,
        "ssim": metrics.ssim,
        "flip": metrics.flip,
        "mean_ratio": metrics.mean_ratio,
        "identical": metrics.identical,
        "within": limits.iter().all(|limit| limit.within),
        "beyond": limits.iter().filter(|limit| !limit.within).map(|limit| limit.flag).collect::<Vec<_>>(),
    })
}
