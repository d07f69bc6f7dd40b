//! Where a rendering is shown meanwhile: the progress bar, a picture in the terminal, a viewer of floats.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use console::Term;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::job_args::LookOptions;
use super::progress::{Manner, Meter, ProgressForm};
use super::{Failure, output};
use crate::film::Film;
use crate::film::exposure::exposure_ev;
use crate::film::tonemap::DisplayTransform;
use crate::render::{Look, Progress, Session};
use crate::view::terminal::{half_blocks, thinned};
use crate::view::tev::Tev;
use crate::world::Settings;

/// The shortest time between two looks at the image.
const EVERY: Duration = Duration::from_millis(200);
/// Looking takes at most one in so many parts of the time: the means of a large image take longer than a moment.
const SHARE: u32 = 20;
/// How often a terminal with a picture is drawn anew, a second: a picture is as long as a page of text.
const DRAWN_HZ: u8 = 5;

/// The onlookers, for one rendering after another.
pub struct LiveViews {
    tev: Option<Tev>,
    preview: bool,
    form: Option<ProgressForm>,
    /// Which of several renderings it is, and of how many.
    turn: [AtomicU64; 2],
}

impl LiveViews {
    /// As they were asked for. A viewer that cannot be reached is told of before anything is rendered.
    pub fn new(options: &LookOptions, scene: &Path) -> Result<LiveViews, Failure> {
        let name = scene.file_name().unwrap_or_default().to_string_lossy();
        let tev = options.tev.as_ref().map(|address| Tev::connect(address, &name)).transpose()?;
        let is_seen = !ProgressDrawTarget::stderr().is_hidden();
        if options.preview && !is_seen {
            output::note(format_args!("warning: --preview shows nothing: standard error is not a terminal"));
        }
        let (preview, form) = (options.preview && is_seen, options.progress);
        Ok(LiveViews { tev, preview, form, turn: [AtomicU64::new(0), AtomicU64::new(1)] })
    }

    /// The next rendering is one of several: its number from 0, and how many there are.
    pub fn set_turn(&self, number: usize, count: usize) {
        self.turn[0].store(number as u64, Ordering::Relaxed);
        self.turn[1].store(count as u64, Ordering::Relaxed);
    }

    /// The most pictures that there are for it at a time.
    pub fn pictures(&self) -> usize {
        // What tev was sent, what is sent now, its packets, and what comes next.
        usize::from(self.preview) + if self.tev.is_some() { 4 } else { 0 }
    }

    /// A rendering begins.
    pub fn attach<'a>(&'a self, session: &Session, settings: &Settings, quiet: bool) -> AttachedViews<'a> {
        let target = match (quiet, self.preview) {
            (_, true) => ProgressDrawTarget::stderr_with_hz(DRAWN_HZ),
            (false, false) => ProgressDrawTarget::stderr(),
            (true, false) => ProgressDrawTarget::hidden(),
        };
        let terminal = MultiProgress::with_draw_target(target);
        let manner =
            Manner { quiet, form: self.form, turn: [0, 1].map(|at| self.turn[at].load(Ordering::Relaxed)) };
        let meter = Meter::new(session, manner, &terminal);
        let picture = self.preview.then(|| picture_bar(&terminal));
        let next = Mutex::new(Instant::now() + EVERY);
        AttachedViews { tev: self.tev.as_ref(), terminal, meter, picture, settings: settings.clone(), next }
    }
}

/// Onlookers of one rendering.
pub struct AttachedViews<'a> {
    tev: Option<&'a Tev>,
    terminal: MultiProgress,
    meter: Meter,
    /// None where no picture is wanted.
    picture: Option<ProgressBar>,
    settings: Settings,
    /// When the image may be looked at again.
    next: Mutex<Instant>,
}

impl AttachedViews<'_> {
    /// A tile is done.
    pub fn progress(&self, progress: &Progress) {
        self.meter.tick(progress);
        self.look_if_it_is_time(progress.look);
    }

    /// A pass is done.
    pub fn passed(&self, session: &Session) {
        if let Some(noise) = session.film().relative_noise() {
            self.meter.set_noise(noise);
        }
        // The last picture comes at the end.
        if !session.is_done() {
            self.look_if_it_is_time(&|look| look(session.gathered()));
        }
    }

    /// Rendering has ended. The last picture stays.
    pub fn finish(self, session: &Session) {
        if self.is_wanted() {
            self.look(session.film());
        }
        if let Some(tev) = self.tev {
            tev.flush();
            self.pass_on_warning(tev);
        }
        self.meter.end();
        if let Some(picture) = self.picture {
            picture.finish();
        }
    }

    /// Whether the image is shown anywhere.
    fn is_wanted(&self) -> bool {
        self.tev.is_some() || self.picture.is_some()
    }

    fn look_if_it_is_time(&self, gathered: Look) {
        if !self.is_wanted() {
            return;
        }
        // One thread at a time looks; the others go on.
        let Ok(mut next) = self.next.try_lock() else { return };
        let start = Instant::now();
        if start >= *next {
            gathered(&mut |gathered| self.look(&gathered.film));
            *next = Instant::now() + EVERY.max(SHARE * start.elapsed());
        }
    }

    /// What is shown is made of the film itself: a copy of it would take as much memory again.
    fn look(&self, film: &Film) {
        if let Some(picture) = &self.picture {
            picture.set_message(picture_of(film, &self.settings));
        }
        if let Some(tev) = self.tev {
            tev.show(film);
            self.pass_on_warning(tev);
        }
    }

    fn pass_on_warning(&self, tev: &Tev) {
        let Some(warning) = tev.warning() else { return };
        let line = format!("warning: {warning}");
        if self.terminal.is_hidden() {
            output::note(format_args!("{line}"));
        } else {
            // Above the bar. If it cannot be written, nobody is there to read it.
            let _ = self.terminal.println(line);
        }
    }
}

/// The image in as much of the terminal as it has columns, and half of its rows.
fn picture_of(film: &Film, settings: &Settings) -> String {
    let (rows, columns) = Term::stderr().size();
    let room = [u32::from(columns).max(1), u32::from(rows / 2).max(1)];
    let (region, radiance) = (film.region(), film.radiance());
    let (few, size) = thinned(&radiance, [region.width(), region.height()], room);
    let exposure_ev = exposure_ev(settings, &few);
    let display = DisplayTransform::new(settings.tonemap, exposure_ev, &radiance);
    let pixels: Vec<_> = few.iter().map(|pixel| display.apply_8_bit(*pixel)).collect();
    half_blocks(&pixels, size, room)
}

/// A bar that consists only of its message: lines that are redrawn in place.
fn picture_bar(terminal: &MultiProgress) -> ProgressBar {
    let bar = terminal.add(ProgressBar::no_length());
    if let Ok(style) = ProgressStyle::with_template("{msg}") {
        bar.set_style(style);
    }
    bar
}
