//! Live views of a render: the progress bar, an image in the terminal, an external viewer of floats.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use console::Term;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::progress::{Manner, Meter, ProgressForm};
use crate::cli::{failure::Failure, output};
use crate::film::Film;
use crate::film::exposure::exposure_ev;
use crate::film::tonemap::{DisplayTransform, encode_8_bit};
use crate::formats::picture::{ImagePixels, backplate};
use crate::math::Rgb;
use crate::render::{Look, Progress, Session};
use crate::view::terminal::{half_blocks, thinned};
use crate::view::tev::Tev;
use crate::world::Settings;

/// The shortest time between two updates of the image.
const EVERY: Duration = Duration::from_millis(200);
/// The inverse of the largest fraction of the time that updates take: the means of a large image take longer than a
/// moment.
const SHARE: u32 = 20;
/// The number of times a second that a terminal with an image is redrawn: the image is as long as a page of text.
const DRAWN_HZ: u8 = 5;

/// The live views of one render after another.
pub struct LiveViews {
    tev: Option<Tev>,
    preview: bool,
    form: Option<ProgressForm>,
    /// The index of the render, and the number of renders.
    turn: [AtomicU64; 2],
}

impl LiveViews {
    /// Creates the requested views. A viewer that cannot be reached is reported before anything is rendered.
    pub fn new(
        scene: &Path,
        tev: Option<&str>,
        preview: bool,
        form: Option<ProgressForm>,
    ) -> Result<LiveViews, Failure> {
        let name = scene.file_name().unwrap_or_default().to_string_lossy();
        let tev = tev.map(|address| Tev::connect(address, &name)).transpose()?;
        let is_seen = !ProgressDrawTarget::stderr().is_hidden();
        if preview && !is_seen {
            output::note(format_args!("warning: --preview shows nothing: standard error is not a terminal"));
        }
        Ok(LiveViews { tev, preview: preview && is_seen, form, turn: [AtomicU64::new(0), AtomicU64::new(1)] })
    }

    /// Sets the index of the next render, from 0, and the number of renders.
    pub fn set_turn(&self, number: usize, count: usize) {
        self.turn[0].store(number as u64, Ordering::Relaxed);
        self.turn[1].store(count as u64, Ordering::Relaxed);
    }

    /// Returns the largest number of copies of the image that the views hold at a time.
    pub fn pictures(&self) -> usize {
        // For tev: the image sent before, the one being sent, its packets, and the next one.
        usize::from(self.preview) + if self.tev.is_some() { 4 } else { 0 }
    }

    /// Attaches the views to a render that begins.
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
        // A file that can no longer be read ends the render when the image is saved.
        let region = session.film().region();
        let plate = if self.preview { backplate(settings, region).ok().flatten() } else { None };
        let (tev, settings) = (self.tev.as_ref(), settings.clone());
        AttachedViews { tev, terminal, meter, picture, settings, plate, next }
    }
}

/// The live views of one render.
pub struct AttachedViews<'a> {
    tev: Option<&'a Tev>,
    terminal: MultiProgress,
    meter: Meter,
    /// The bar that shows the image, if --preview is given.
    picture: Option<ProgressBar>,
    settings: Settings,
    /// The backplate's pixels, if the image is shown.
    plate: Option<Vec<Rgb>>,
    /// The earliest time of the next update.
    next: Mutex<Instant>,
}

impl AttachedViews<'_> {
    /// Updates the views after a tile.
    pub fn progress(&self, progress: &Progress) {
        self.meter.tick(progress);
        self.look_if_it_is_time(progress.look);
    }

    /// Updates the views after a pass.
    pub fn passed(&self, session: &Session) {
        if let Some(noise) = session.film().relative_noise() {
            self.meter.set_noise(noise);
        }
        // The final image is shown at the end.
        if !session.is_done() {
            self.look_if_it_is_time(&|look| look(session.state()));
        }
    }

    /// Ends the views. The final image stays.
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

    /// True if the image is shown anywhere.
    fn is_wanted(&self) -> bool {
        self.tev.is_some() || self.picture.is_some()
    }

    fn look_if_it_is_time(&self, gathered: Look) {
        if !self.is_wanted() {
            return;
        }
        // One thread at a time updates the views; the others go on.
        let Ok(mut next) = self.next.try_lock() else { return };
        let start = Instant::now();
        if start >= *next {
            gathered(&mut |gathered| self.look(&gathered.film));
            *next = Instant::now() + EVERY.max(SHARE * start.elapsed());
        }
    }

    /// Shows the film itself: a copy of it would take as much memory again.
    fn look(&self, film: &Film) {
        if let Some(picture) = &self.picture {
            picture.set_message(picture_of(film, &self.settings, self.plate.as_deref()));
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
            // Above the bar. If the line cannot be written, it has no reader.
            let _ = self.terminal.println(line);
        }
    }
}

/// Returns the image as text that fits the terminal's columns and half of its rows.
fn picture_of(film: &Film, settings: &Settings, plate: Option<&[Rgb]>) -> String {
    let (rows, columns) = Term::stderr().size();
    let room = [u32::from(columns).max(1), u32::from(rows / 2).max(1)];
    let (region, image) = (film.region(), ImagePixels::new(film, plate, None));
    let (whole, colors) = ([region.width(), region.height()], image.own_colors());
    let display = DisplayTransform::new(settings.tonemap, exposure_ev(settings, film), &colors);
    let (few, size) = thinned(&colors, whole, room);
    let pixels: Vec<_> = match (image.alpha, image.behind) {
        (Some(alpha), Some(behind)) => {
            let (alpha, behind) = (thinned(&alpha, whole, room).0, thinned(&behind, whole, room).0);
            let over = |((light, alpha), behind): ((&Rgb, &f32), &Rgb)| {
                encode_8_bit(display.apply_over(*light, *alpha, *behind))
            };
            few.iter().zip(&alpha).zip(&behind).map(over).collect()
        }
        _ => few.iter().map(|pixel| display.apply_8_bit(*pixel)).collect(),
    };
    half_blocks(&pixels, size, room)
}

/// Returns a bar that consists only of its message: lines that are redrawn in place.
fn picture_bar(terminal: &MultiProgress) -> ProgressBar {
    let bar = terminal.add(ProgressBar::no_length());
    if let Ok(style) = ProgressStyle::with_template("{msg}") {
        bar.set_style(style);
    }
    bar
}
