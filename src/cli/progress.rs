//! How far a rendering is: a bar on a terminal, elsewhere a line now and then.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use super::output::tell;
use crate::render::{Progress, Session};

/// How often a line is printed if there is no terminal.
const LINES: Duration = Duration::from_secs(30);
/// How often the bar's text is made anew.
const TEXTS: Duration = Duration::from_millis(200);
/// Least width of the bar in columns, including the blank after it.
const BAR: usize = 11;

/// Tells how far a rendering is.
pub struct Meter {
    /// Hidden where there is no terminal.
    bar: ProgressBar,
    quiet: bool,
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
    /// For the rest of a rendering; stays silent if `quiet`.
    pub fn new(session: &Session, quiet: bool, terminal: &MultiProgress) -> Meter {
        let ((done, wanted), pixels) = (session.samples_done(), session.film().region().area() as u64);
        let (done, wanted) = (pixels * u64::from(done), pixels * u64::from(wanted));
        let bar = match quiet {
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
            quiet,
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
        let every = if self.bar.is_hidden() { LINES } else { TEXTS };
        if self.quiet || last.elapsed() < every {
            return;
        }
        *last = Instant::now();
        let facts = self.facts();
        if self.bar.is_hidden() {
            tell(format_args!("rendering: {}", facts.line()));
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
