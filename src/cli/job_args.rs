//! Options shared by all commands that render.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::Failure;
use super::args::{ScheduleName, parse_bits, parse_level};
use super::progress::ProgressForm;
use crate::formats::film_file::is_film;
use crate::simd::Isa;

/// The options of execution. No bit of the image depends on them.
#[derive(Args, Debug)]
#[command(next_help_heading = "Work")]
pub struct WorkOptions {
    /// Order in which rays are traced; the image is the same
    #[arg(long, value_enum, default_value_t = ScheduleName::Wavefront)]
    pub schedule: ScheduleName,
    /// Paths in a wave of the wavefront schedule; the image is the same
    #[arg(long, value_name = "N", default_value_t = crate::render::DEFAULT_WAVE as u32,
          value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub wave: u32,
    /// Threads; 0 means one for each core
    #[arg(short, long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Instruction set [default: the widest available]; the image is the same
    #[arg(long, value_name = "LEVEL", value_parser = parse_level)]
    pub simd: Option<Isa>,
    /// Show neither progress (a bar on a terminal, else a line every 30 seconds) nor a summary
    #[arg(short, long)]
    pub quiet: bool,
    /// Print statistics as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// The options of live views and of progress messages.
#[derive(Args, Debug)]
pub struct LookOptions {
    /// Print progress for other programs on standard error, at most once a second and only if it has changed: lines
    /// (such as "Progress: 42%"), json (objects) or openjd [default: a bar on a terminal, else a line every 30 seconds]
    #[arg(
        long,
        value_name = "FORM",
        value_enum,
        conflicts_with = "quiet",
        help_heading = "Work",
        hide_possible_values = true
    )]
    pub progress: Option<ProgressForm>,
    /// Show the image, as floats, while it renders, in tev or HDRView listening at this address, usually
    /// 127.0.0.1:14158
    #[arg(long, value_name = "HOST:PORT")]
    pub tev: Option<String>,
    /// Show the image while it renders, in the terminal under the progress bar
    #[arg(long)]
    pub preview: bool,
}

/// The options of outputs.
#[derive(Args, Debug)]
#[command(next_help_heading = "Output")]
pub struct OutputOptions {
    /// Output files: images (.png, .exr, .hdr), a film to continue later (.film), or - for standard output (a film;
    /// with --frames a video, as YUV4MPEG2); may be given several times [default: the scene's name with .png, in the
    /// current folder]
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Replace a .film that holds something else
    #[arg(long)]
    pub overwrite: bool,
    /// Also write a denoised version of each image, as NAME.denoised with the same extension
    #[arg(long)]
    pub denoise: bool,
    /// Bits per channel of PNG files
    #[arg(long, value_name = "8|16", default_value_t = 8, value_parser = parse_bits)]
    pub bits: u8,
}

/// The rules for stopping, and the interval between checkpoints.
#[derive(Args, Debug)]
#[command(next_help_heading = "Stopping")]
pub struct StopOptions {
    /// Stop once the noise is below this part of the image's brightness, such as noise=1%
    #[arg(long, value_name = "noise=PERCENT", value_parser = parse_until)]
    pub until: Option<f64>,
    /// Stop after this time, such as 90s, 10m or 2h
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    pub max_time: Option<Duration>,
    /// Save the film at this interval, such as 30s, so that rendering can be continued after any interruption; off:
    /// never [default: 1m, to the .film of -o, else to NAME.checkpoint.film, which is removed at the end]
    #[arg(long, value_name = "TIME|off", value_parser = parse_checkpoint)]
    pub checkpoint: Option<CheckpointEvery>,
}

/// The values of `--checkpoint`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckpointEvery {
    /// Never.
    Off,
    /// At this interval.
    Time(Duration),
}

/// The files to be written, by kind.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// The images.
    pub images: Vec<PathBuf>,
    /// A film that can be continued.
    pub film: Option<PathBuf>,
    /// True if a film goes to standard output.
    pub to_stdout: bool,
    /// The video that goes to standard output instead.
    pub video: Option<Video>,
}

/// A video, as a stream of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Video {
    /// The frames per second as a fraction.
    pub rate: [u32; 2],
    /// True if no frame has been written yet.
    pub begins: bool,
}

impl Outputs {
    /// True if standard output carries a film or a video, not text.
    pub fn takes_stdout(&self) -> bool {
        self.to_stdout || self.video.is_some()
    }

    /// Sorts the given files by kind.
    pub fn of(given: &[PathBuf]) -> Result<Outputs, Failure> {
        let mut outputs = Outputs::default();
        for path in given {
            match path {
                _ if path.as_os_str() == "-" => outputs.to_stdout = true,
                _ if is_film(path) => {
                    if let Some(first) = outputs.film.replace(path.clone()) {
                        let (first, second) = (first.display(), path.display());
                        return Err(Failure::command_line(format!(
                            "two films were asked for, {first} and {second}: one is enough"
                        )));
                    }
                }
                _ => outputs.images.push(path.clone()),
            }
        }
        Ok(outputs)
    }
}

pub(super) fn parse_duration(text: &str) -> Result<Duration, String> {
    let text = text.trim();
    let unit = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(unit);
    let seconds = match unit {
        "ms" => Some(0.001),
        "s" => Some(1.0),
        "m" | "min" => Some(60.0),
        "h" => Some(3600.0),
        "d" => Some(86_400.0),
        _ => None,
    };
    let number = number.trim().parse().ok().filter(|number: &f64| number.is_finite() && *number > 0.0);
    let time = number.zip(seconds).and_then(|(number, unit)| Duration::try_from_secs_f64(number * unit).ok());
    time.filter(|time| *time >= Duration::from_millis(1))
        .ok_or_else(|| "expected a time with its unit, such as 500ms, 30s, 10m, 2h or 1d".into())
}

fn parse_checkpoint(text: &str) -> Result<CheckpointEvery, String> {
    match text {
        "off" => Ok(CheckpointEvery::Off),
        _ => parse_duration(text).map(CheckpointEvery::Time).map_err(|reason| format!("{reason}, or off")),
    }
}

fn parse_until(text: &str) -> Result<f64, String> {
    let number = text.strip_prefix("noise=").map(|rest| match rest.strip_suffix('%') {
        Some(percent) => percent.trim().parse().map(|percent: f64| percent / 100.0),
        None => rest.trim().parse(),
    });
    let number = number.and_then(Result::ok).filter(|noise| *noise > 0.0 && *noise < 1.0);
    number.ok_or_else(|| "expected noise= and a percentage above 0 and below 100, such as noise=1%".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_need_units() {
        assert_eq!(parse_duration("90s"), Ok(Duration::from_secs(90)));
        assert_eq!(parse_duration("1.5h"), Ok(Duration::from_secs(5400)));
        assert_eq!(parse_duration("250 ms"), Ok(Duration::from_millis(250)));
        for wrong in ["", "5", "s", "-1s", "nan s", "1y", "1e999d", "0s", "0.1ms"] {
            assert!(parse_duration(wrong).is_err(), "{wrong}");
        }
        assert_eq!(parse_checkpoint("off"), Ok(CheckpointEvery::Off));
        assert!(parse_checkpoint("never").is_err_and(|reason| reason.ends_with("or off")));
    }

    #[test]
    fn noise_limits_are_percentages_or_fractions() {
        assert_eq!(parse_until("noise=1%"), Ok(0.01));
        assert_eq!(parse_until("noise=0.25"), Ok(0.25));
        for wrong in ["1%", "noise=", "noise=0", "noise=100%", "noise=nan%", "time=3s"] {
            assert!(parse_until(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn outputs_are_sorted_by_kind() {
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        let outputs = Outputs::of(&paths(&["a.png", "b.FILM", "-", "c.exr"])).ok();
        let expected = Outputs {
            images: paths(&["a.png", "c.exr"]),
            film: Some("b.FILM".into()),
            to_stdout: true,
            video: None,
        };
        assert_eq!(outputs, Some(expected));
        assert!(Outputs::of(&paths(&["a.film", "b.film"])).is_err());
    }
}
