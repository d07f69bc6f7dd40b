//! How far a rendering is: a bar on a terminal, elsewhere a line now and then, or lines for the programs that run it.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use clap::ValueEnum;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use serde_json::json;

use super::output::note;
use crate::render::{Progress, Session};

/// How often a line is printed if there is no terminal.
const LINES: Duration = Duration::from_secs(30);
/// How often a line for programs is printed at most.
const LINES_FOR_PROGRAMS: Duration = Duration::from_secs(1);
/// How often the bar's text is made anew.
const TEXTS: Duration = Duration::from_millis(200);
/// Least width of the bar in columns, including the blank after it.
const BAR: usize = 11;

/// The forms of lines for programs.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProgressForm {
    /// Progress: 42%, and more behind it
    Lines,
    /// An object
    Json,
    /// openjd_progress: 42
    Openjd,
}

impl ProgressForm {
    /// Its name on a command line.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// How the progress of a rendering is reported.
#[derive(Clone, Copy, Debug)]
pub struct Manner {
    /// Nothing is.
    pub quiet: bool,
    /// In lines for programs.
    pub form: Option<ProgressForm>,
    /// Which of several renderings this is, and of how many: 100 % are all of them.
    pub turn: [u64; 2],
}

/// Tells how far a rendering is.
pub struct Meter {
    /// Hidden where there is no terminal.
    bar: ProgressBar,
    manner: Manner,
    /// The percentage that a program was told last; none yet: the largest number.
    told: AtomicU64,
    begun: Instant,
    /// When something was said last.
    last: Mutex<Instant>,
    pixels: u64,
    /// Samples of single pixels: at the beginning, now, wanted.
    before: u64,
    done: AtomicU64,
    wanted: u64,
    rays: AtomicU64,
    /// In ten thousandths of the brightness; none is known yet: 0.
    noise: AtomicU64,
}

impl Meter {
    /// For the rest of a rendering.
    pub fn new(session: &Session, manner: Manner, terminal: &MultiProgress) -> Meter {
        let ((done, wanted), pixels) = (session.samples_done(), session.film().region().area() as u64);
        let (done, wanted) = (pixels * u64::from(done), pixels * u64::from(wanted));
        let bar = match manner.quiet || manner.form.is_some() {
            true => ProgressBar::hidden(),
            false => terminal.add(ProgressBar::new(wanted).with_position(done)),
        };
        if let Ok(style) = ProgressStyle::with_template("{wide_bar} {msg}") {
            bar.set_style(style.progress_chars("█▉▊▋▌▍▎▏ "));
        }
        if !bar.is_hidden() {
            bar.enable_steady_tick(TEXTS);
        }
        let now = Instant::now();
        Meter {
            bar,
            manner,
            told: AtomicU64::new(u64::MAX),
            begun: now,
            last: Mutex::new(now),
            pixels,
            before: done,
            done: AtomicU64::new(done),
            wanted,
            rays: AtomicU64::new(0),
            noise: AtomicU64::new(0),
        }
    }

    /// Something more has been rendered.
    pub fn tick(&self, progress: &Progress) {
        self.rays.fetch_add(progress.rays, Ordering::Relaxed);
        self.done.fetch_add(progress.samples, Ordering::Relaxed);
        self.bar.inc(progress.samples);
        // Another worker is saying it.
        let Ok(mut last) = self.last.try_lock() else { return };
        let every = match self.manner.form {
            Some(_) => LINES_FOR_PROGRAMS,
            None if self.bar.is_hidden() => LINES,
            None => TEXTS,
        };
        if self.manner.quiet || last.elapsed() < every {
            return;
        }
        *last = Instant::now();
        let facts = self.facts();
        if let Some(form) = self.manner.form {
            self.tell_program(form, &facts);
        } else if self.bar.is_hidden() {
            note(format_args!("rendering: {}", facts.line()));
        } else {
            let columns = usize::from(console::Term::stderr().size().1);
            self.bar.set_message(facts.fitting(columns));
        }
    }

    /// The noise is known, as a part of the brightness.
    pub fn set_noise(&self, noise: f64) {
        self.noise.store((noise * 1e4) as u64, Ordering::Relaxed);
    }

    /// There is nothing more to tell.
    pub fn end(&self) {
        self.bar.finish_and_clear();
        if let Some(form) = self.manner.form.filter(|_| !self.manner.quiet) {
            self.tell_program(form, &self.facts());
        }
    }

    /// Prints a line for programs, unless it would say the same as the last one.
    fn tell_program(&self, form: ProgressForm, facts: &Facts) {
        let percent = facts.percent_of_all(self.manner.turn);
        if self.told.swap(percent, Ordering::Relaxed) != percent {
            note(facts.for_programs(form, percent));
        }
    }

    fn facts(&self) -> Facts {
        let done = self.done.load(Ordering::Relaxed).min(self.wanted);
        let seconds = self.begun.elapsed().as_secs_f64().max(1e-3);
        let speed = (done - self.before.min(done)) as f64 / seconds;
        let noise = self.noise.load(Ordering::Relaxed);
        Facts {
            percent: 100 * done / self.wanted.max(1),
            samples: [done, self.wanted].map(|samples| samples as f64 / self.pixels.max(1) as f64),
            mrays: self.rays.load(Ordering::Relaxed) as f64 / seconds / 1e6,
            left: (speed > 0.0).then(|| (self.wanted - done) as f64 / speed),
            noise: (noise > 0).then(|| noise as f64 / 100.0),
        }
    }
}

/// What there is to tell.
struct Facts {
    percent: u64,
    /// A pixel, done and wanted.
    samples: [f64; 2],
    /// Million rays a second.
    mrays: f64,
    /// Seconds, where there is a guess.
    left: Option<f64>,
    /// Percent of the brightness.
    noise: Option<f64>,
}

impl Facts {
    /// The percentage of several renderings, of which this is one.
    fn percent_of_all(&self, [turn, count]: [u64; 2]) -> u64 {
        (100 * turn + self.percent) / count.max(1)
    }

    /// A line for programs.
    fn for_programs(&self, form: ProgressForm, percent: u64) -> String {
        let [done, wanted] = self.samples;
        match form {
            ProgressForm::Lines => {
                let left = self.left.filter(|_| done < wanted);
                let left = left.map_or(String::new(), |left| format!(", {} left", time(left)));
                format!("Progress: {percent}%, {} of {wanted} samples a pixel{left}", part(done, wanted))
            }
            ProgressForm::Json => json!({
                "percent": percent, "samples": done, "samples_asked": wanted, "mrays_per_s": self.mrays,
                "seconds_left": self.left, "noise_relative": self.noise.map(|percent| percent / 100.0),
            })
            .to_string(),
            ProgressForm::Openjd => format!("openjd_progress: {percent}"),
        }
    }

    /// All of it.
    fn line(&self) -> String {
        let Facts { percent, samples: [done, wanted], mrays, .. } = self;
        let left = self.left.map_or(String::new(), |left| format!(", {} left", time(left)));
        let noise = self.noise.map_or(String::new(), |noise| format!(", noise {noise:.1} %"));
        format!(
            "{percent} %, {} of {wanted} samples a pixel, {mrays:.1} million rays a second{left}{noise}",
            part(*done, *wanted)
        )
    }

    /// As much of it as fits beside a bar.
    fn fitting(&self, columns: usize) -> String {
        let Facts { percent, samples: [done, wanted], mrays, .. } = self;
        let done = part(*done, *wanted);
        let left = self.left.map_or(String::new(), |left| format!("  {} left", time(left)));
        let noise = self.noise.map_or(String::new(), |noise| format!("  noise {noise:.1} %"));
        let long =
            format!("{percent:>3} %  {done} of {wanted} samples a pixel  {mrays:.1} M rays a second{left}");
        let short = format!("{percent:>3} %  {done}/{wanted} spp  {mrays:.1} M rays/s{left}");
        let ways = [
            format!("{long}{noise}"),
            format!("{short}{noise}"),
            short,
            format!("{percent:>3} %  {done}/{wanted} spp{left}"),
            format!("{percent:>3} %{left}"),
        ];
        let fits = |way: &String| way.chars().count() + BAR <= columns;
        ways.into_iter().find(fits).unwrap_or_else(|| format!("{percent:>3} %"))
    }
}

/// How many of the samples: whole ones where there are many.
fn part(done: f64, wanted: f64) -> String {
    if wanted < 100.0 { format!("{done:.1}") } else { format!("{done:.0}") }
}

/// Time for people: two units.
fn time(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    match (seconds / 86_400, seconds / 3600 % 24, seconds / 60 % 60, seconds % 60) {
        (0, 0, 0, s) => format!("{s} s"),
        (0, 0, m, s) => format!("{m} min {s} s"),
        (0, h, m, _) => format!("{h} h {m} min"),
        (d, h, _, _) => format!("{d} d {h} h"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_two_units() {
        let times = [0.4, 59.6, 200.0, 3700.0, 90_000.0].map(time);
        assert_eq!(times, ["0 s", "1 min 0 s", "3 min 20 s", "1 h 1 min", "1 d 1 h"]);
    }

    #[test]
    fn programs_are_told_in_their_forms() {
        let facts =
            |percent, samples| Facts { percent, samples, mrays: 2.5, left: Some(200.0), noise: Some(3.0) };
        let half = facts(50, [32.0, 64.0]);
        assert_eq!(
            half.for_programs(ProgressForm::Lines, 50),
            "Progress: 50%, 32.0 of 64 samples a pixel, 3 min 20 s left"
        );
        assert_eq!(half.for_programs(ProgressForm::Openjd, 50), "openjd_progress: 50");
        let object: serde_json::Value =
            serde_json::from_str(&half.for_programs(ProgressForm::Json, 50)).unwrap();
        assert_eq!((object["percent"].as_u64(), object["noise_relative"].as_f64()), (Some(50), Some(0.03)));
        // The second and the last of four frames.
        assert_eq!([[1, 4], [3, 4]].map(|turn| half.percent_of_all(turn)), [37, 87]);
        assert_eq!(facts(100, [64.0, 64.0]).percent_of_all([3, 4]), 100);
    }

    #[test]
    fn the_bar_fits_and_says_what_matters_most() {
        let facts =
            |samples| Facts { percent: 42, samples, mrays: 12.34, left: Some(200.0), noise: Some(3.21654) };
        let line =
            "42 %, 26.9 of 64 samples a pixel, 12.3 million rays a second, 3 min 20 s left, noise 3.2 %";
        assert_eq!(facts([26.9, 64.0]).line(), line);
        for samples in [[26.9, 64.0], [1234.0, 4_194_304.0]] {
            for columns in 20..200 {
                let text = facts(samples).fitting(columns);
                assert!(text.chars().count() + BAR <= columns, "{columns}: {text}");
            }
            let text = facts(samples).fitting(80);
            assert!(text.contains("spp") && text.contains("M rays/s") && text.contains("left"), "{text}");
        }
        assert!(
            facts([26.9, 64.0]).fitting(120).contains("26.9 of 64 samples a pixel  12.3 M rays a second")
        );
    }
}
