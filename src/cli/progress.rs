//! The progress of a render: a bar on a terminal, elsewhere a line now and then, or lines for other programs.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use serde_json::json;

use super::output::note;
use crate::render::{Progress, Session};

/// The time between lines if there is no terminal.
const LINES: Duration = Duration::from_secs(30);
/// The shortest time between lines for programs.
const LINES_FOR_PROGRAMS: Duration = Duration::from_secs(1);
/// The time between updates of the bar's text.
const TEXTS: Duration = Duration::from_millis(200);
/// The smallest width of the bar in columns, including the blank after it.
const BAR: usize = 11;

/// The forms of lines for programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProgressForm {
    /// Percentages with details.
    Lines,
    /// JSON objects.
    Json,
    /// The percentages of Open Job Description.
    Openjd,
}

/// Returns a bar in the form of a template.
pub fn styled(bar: ProgressBar, template: &str) -> ProgressBar {
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style.progress_chars("█▉▊▋▌▍▎▏ ")),
        Err(_) => bar,
    }
}

/// The manner in which the progress of a render is reported.
#[derive(Clone, Copy, Debug)]
pub struct Manner {
    /// True if nothing is reported.
    pub quiet: bool,
    /// The form of lines for programs, if those are wanted.
    pub form: Option<ProgressForm>,
    /// The index of the render, and the number of renders: 100 % are all of them.
    pub turn: [u64; 2],
}

/// Reports the progress of a render.
pub struct Meter {
    /// The bar; hidden if there is no terminal.
    bar: ProgressBar,
    manner: Manner,
    /// The percentage in the last line for programs; the largest number if there is none yet.
    told: AtomicU64,
    begun: Instant,
    /// The time of the last report.
    last: Mutex<Instant>,
    pixels: u64,
    /// The number of samples, summed over all pixels, at the beginning; `done` is the current number, and `wanted` the
    /// final one.
    before: u64,
    done: AtomicU64,
    wanted: u64,
    rays: AtomicU64,
    /// The noise in ten-thousandths of the brightness; 0 if it is not known yet.
    noise: AtomicU64,
}

impl Meter {
    /// Creates a meter for the rest of a render.
    pub fn new(session: &Session, manner: Manner, terminal: &MultiProgress) -> Meter {
        let ((done, wanted), pixels) = (session.samples_done(), session.film().region().area() as u64);
        let (done, wanted) = (pixels * u64::from(done), pixels * u64::from(wanted));
        let bar = match manner.quiet || manner.form.is_some() {
            true => ProgressBar::hidden(),
            false => terminal.add(ProgressBar::new(wanted).with_position(done)),
        };
        let bar = styled(bar, "{wide_bar} {msg}");
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

    /// Adds rendered samples, and reports the progress if it is time.
    pub fn tick(&self, progress: &Progress) {
        self.rays.fetch_add(progress.rays, Ordering::Relaxed);
        self.done.fetch_add(progress.samples, Ordering::Relaxed);
        self.bar.inc(progress.samples);
        // Another worker is reporting.
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

    /// Sets the noise, as a fraction of the brightness.
    pub fn set_noise(&self, noise: f64) {
        self.noise.store((noise * 1e4) as u64, Ordering::Relaxed);
    }

    /// Removes the bar, and prints the last line for programs.
    pub fn end(&self) {
        self.bar.finish_and_clear();
        if let Some(form) = self.manner.form.filter(|_| !self.manner.quiet) {
            self.tell_program(form, &self.facts());
        }
    }

    /// Prints a line for programs, unless its percentage is that of the last one.
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

/// The facts to report.
struct Facts {
    percent: u64,
    /// The samples per pixel, done and wanted.
    samples: [f64; 2],
    /// The millions of rays per second.
    mrays: f64,
    /// The estimated number of seconds left, if there is an estimate.
    left: Option<f64>,
    /// The noise in percent of the brightness, if known.
    noise: Option<f64>,
}

impl Facts {
    /// Returns the percentage of several renders, of which this is one.
    fn percent_of_all(&self, [turn, count]: [u64; 2]) -> u64 {
        (100 * turn + self.percent) / count.max(1)
    }

    /// Returns the time left, if there is an estimate, after a separator.
    fn left(&self, separator: &str) -> String {
        self.left.map_or(String::new(), |left| format!("{separator}{} left", time(left)))
    }

    /// Returns the noise, if it is known, after a separator.
    fn noise(&self, separator: &str) -> String {
        self.noise.map_or(String::new(), |noise| format!("{separator}noise {noise:.1} %"))
    }

    /// Returns a line for programs.
    fn for_programs(&self, form: ProgressForm, percent: u64) -> String {
        let [done, wanted] = self.samples;
        match form {
            ProgressForm::Lines => {
                let left = if done < wanted { self.left(", ") } else { String::new() };
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

    /// Returns a line with all facts.
    fn line(&self) -> String {
        let Facts { percent, samples: [done, wanted], mrays, .. } = self;
        let (left, noise) = (self.left(", "), self.noise(", "));
        format!(
            "{percent} %, {} of {wanted} samples a pixel, {mrays:.1} million rays a second{left}{noise}",
            part(*done, *wanted)
        )
    }

    /// Returns as many facts as fit beside a bar.
    fn fitting(&self, columns: usize) -> String {
        let Facts { percent, samples: [done, wanted], mrays, .. } = self;
        let done = part(*done, *wanted);
        let (left, noise) = (self.left("  "), self.noise("  "));
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

/// Formats a number of samples, as a whole number if many are wanted.
fn part(done: f64, wanted: f64) -> String {
    if wanted < 100.0 { format!("{done:.1}") } else { format!("{done:.0}") }
}

/// Formats a time in two units.
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
    fn times_print_with_two_units() {
        let times = [0.4, 59.6, 200.0, 3700.0, 90_000.0].map(time);
        assert_eq!(times, ["0 s", "1 min 0 s", "3 min 20 s", "1 h 1 min", "1 d 1 h"]);
    }

    #[test]
    fn progress_lines_have_the_requested_form() {
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
    fn bar_text_fits_any_width_with_the_main_facts() {
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
