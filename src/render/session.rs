//! Render sessions.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use super::adaptive;
use super::options::Options;
use super::passes::at_once;
use super::prepare::{self, Prepared};
use super::render_state::{RenderPass, RenderState};
use crate::film::{Allocation, Film, Moments, Region};
use crate::integrator::{RayStatistics, RenderSetup, Stop, Worker};
use crate::scene::CompiledScene;
use crate::world::{Adaptive, Settings};

/// The number of samples in a pass of [`Session::finish`].
const PASS: u32 = 16;

/// A render in progress. Call [`Session::finish`], or [`Session::advance`] until it is done or there are enough
/// samples.
pub struct Session {
    pub(super) setup: Arc<RenderSetup>,
    /// The preparation of its samples, once computed.
    pub(super) prepared: Option<Arc<Prepared>>,
    pub(super) options: Options,
    pub(super) gathered: RenderState,
    pub(super) statistics: RayStatistics,
    pub(super) workers: Mutex<Vec<Worker>>,
    /// The samples to render.
    pub(super) wanted: Range<u32>,
    /// The total number of samples.
    total: u32,
    /// True for a pilot, which counts the rays of each block.
    pub(super) is_pilot: bool,
}

/// The progress since the last report.
pub struct Progress<'a> {
    /// Samples (of single pixels) that were rendered.
    pub samples: u64,
    /// Rays of all kinds that were traced for them.
    pub rays: u64,
    /// Calls a function with the current state. No tile is added meanwhile, so the function must be quick and must not
    /// use the threads that render.
    pub look: Look<'a>,
    /// If set, no further tile is started: [`Session::advance_until`] returns, and continues the pass when it is called
    /// again.
    pub pause: &'a AtomicBool,
}

/// Calls a function with the current state.
pub type Look<'a> = &'a dyn Fn(&mut dyn FnMut(&RenderState));

/// A function that is called after every tile.
pub type OnProgress<'a> = &'a (dyn Fn(&Progress) + Sync);

impl Session {
    /// Prepares to render a scene. Only the settings of the render count: `size`, `samples`, `seed`, `transport`,
    /// depths, filters and patterns, `sampler`, `sharing`, `adaptive`. They need not be those of the world that was
    /// compiled: its `ambient`, `background` and `copied_triangles` are in the scene, and tone curve
    /// and exposure count only when an image is saved. A size or count outside its range is clamped.
    ///
    /// Workers allocate their buffers when they begin their first tile, and keep them.
    pub fn new(scene: CompiledScene, settings: &Settings, options: Options) -> Self {
        Self::of(Arc::new(prepare::setup(scene, settings)), settings.samples, options)
    }

    /// Creates a session for a render setup that is rendered several times, in several ways.
    #[doc(hidden)]
    pub fn of(setup: Arc<RenderSetup>, samples: u32, options: Options) -> Self {
        let gathered = RenderState::nothing(setup.film(options.region_of(setup.size)), options.variance);
        Self::with(setup, samples, options, gathered)
    }

    /// Creates a session that continues from an earlier state; `None` if the state does not fit the render setup.
    pub(crate) fn going_on(
        setup: Arc<RenderSetup>,
        samples: u32,
        options: Options,
        gathered: RenderState,
    ) -> Option<Self> {
        // The film is as large as everything else: there are never two.
        let nothing = RenderState::nothing(setup.film(Region::whole([0, 0])), options.variance);
        let mut session = Self::with(setup, samples, options, nothing);
        session.resume_from(gathered).then_some(session)
    }

    fn with(setup: Arc<RenderSetup>, samples: u32, options: Options, gathered: RenderState) -> Self {
        let samples = samples.min(Settings::MOST_SAMPLES);
        Self {
            gathered,
            setup,
            prepared: None,
            options,
            statistics: RayStatistics::default(),
            workers: Mutex::new(Vec::new()),
            wanted: 0..samples,
            total: samples,
            is_pilot: false,
        }
    }

    /// Restricts the session to some samples: films of disjoint ranges can be merged.
    #[doc(hidden)]
    pub fn with_samples(self, samples: Range<u32>) -> Self {
        Self { wanted: samples, ..self }
    }

    /// Sets the number of samples of each block, decided elsewhere; with `None` it is decided here, if at all.
    pub(crate) fn with_allocation(mut self, allocation: Option<Allocation>) -> Self {
        self.gathered.allocation = allocation;
        self
    }

    /// Continues from an earlier state of the same region. Returns false, and changes nothing, if the state does not
    /// fit the render setup.
    #[doc(hidden)]
    pub fn resume_from(&mut self, gathered: RenderState) -> bool {
        let new = &gathered;
        let tiles = |pass: &RenderPass| tiles(new.film.region(), pass.tile.max(1)).len() == pass.done.len();
        let count = adaptive::blocks(new.film.region()).len();
        let blocks = |pass: &RenderPass| pass.blocks.as_ref().is_none_or(|blocks| blocks.len() == count);
        let region = self.options.region_of(self.setup.size);
        let alike = (region, self.setup.unit, self.options.variance)
            == (new.film.region(), new.film.unit(), new.moments.is_some());
        let rays = new.rays.as_ref().is_none_or(|rays| rays.len() == count);
        let allocation = new.allocation.as_ref().is_none_or(|given| given.samples().len() == count);
        let fits =
            alike && rays && allocation && new.pass.as_ref().is_none_or(|pass| tiles(pass) && blocks(pass));
        if fits {
            self.gathered = gathered;
        }
        fits
    }

    /// Returns the first sample that not every pixel has.
    pub(crate) fn next_sample(&self) -> Option<u32> {
        let missing = self.gathered.samples.missing(self.wanted());
        missing.iter().next().map(|range| range.start)
    }

    /// Replaces the render setup by that of the scene at another moment, with the same settings.
    pub(crate) fn replace_setup(&mut self, setup: Arc<RenderSetup>) {
        // The workers' buffers fit the old setup.
        self.free_workers();
        self.prepared = None;
        self.setup = setup;
    }

    /// Frees the buffers of all workers; new ones are made when rendering continues.
    pub(crate) fn free_workers(&mut self) {
        lock(&self.workers).clear();
    }

    /// Computes the preparation of samples unless it exists. Returns false if stopped.
    pub(crate) fn prepare(&mut self, stop: &Stop) -> bool {
        if self.prepared.is_none() {
            self.prepared = Prepared::new(&self.setup, stop).map(Arc::new);
        }
        self.prepared.is_some()
    }

    /// Returns the preparation of samples; computes it unless it exists.
    pub(crate) fn prepared(&self) -> Arc<Prepared> {
        self.prepared.clone().unwrap_or_else(|| Arc::new(Prepared::now(&self.setup)))
    }

    /// True if photons are left out because they would show as single dots.
    #[cfg(feature = "cli")]
    pub(crate) fn leaves_photons_out(&self) -> bool {
        use crate::integrator::setup::NoPhotons;
        let plan = self.prepared.as_ref().map(|prepared| prepared.plan.as_ref());
        matches!(plan, Some(Err(NoPhotons::Dots)))
    }

    /// True if every sample has been rendered.
    pub fn is_done(&self) -> bool {
        self.gathered.pass.is_none() && !self.needs_allocation() && self.next_pass(1).is_none()
    }

    /// The samples to render, some of which may be for some blocks only.
    fn wanted(&self) -> Range<u32> {
        match &self.gathered.allocation {
            Some(allocation) if self.wanted == (0..self.total) => 0..allocation.most(),
            _ => self.wanted.clone(),
        }
    }

    /// True if the number of samples of each block is still to be decided.
    fn needs_allocation(&self) -> bool {
        let is_enough = self.total >= 2 * adaptive::PILOT;
        let is_wanted = self.setup.adaptive == Adaptive::Unbiased && is_enough && !self.is_pilot;
        is_wanted && self.gathered.allocation.is_none()
    }

    /// Decides the number of samples of each block, if that has to be done before rendering and is not done yet.
    /// Returns false if stopped.
    pub(crate) fn allocate(&mut self, stop: &Stop, progress: OnProgress) -> bool {
        if !self.needs_allocation() {
            return true;
        }
        let (first, count) = (adaptive::FIRST_OF_PILOT, adaptive::pilot_samples(self.total));
        let region = self.gathered.film.region();
        let options = Options { variance: false, region: Some(region), ..self.options };
        let mut pilot = Session {
            is_pilot: true,
            prepared: self.prepared.clone(),
            workers: Mutex::new(std::mem::take(&mut *lock(&self.workers))),
            ..Session::of(self.setup.clone(), 0, options).with_samples(first..first + count)
        };
        // A pilot cannot be continued: it is short, and is not paused.
        let (nothing, unheard) =
            (|look: &mut dyn FnMut(&RenderState)| look(&self.gathered), AtomicBool::new(false));
        let watch =
            |rendered: &Progress| progress(&Progress { look: &nothing, pause: &unheard, ..*rendered });
        pilot.advance_until(count, stop, &watch);
        self.statistics.add(&pilot.statistics);
        if !pilot.is_done() {
            return false;
        }
        let rays = pilot.gathered.rays.as_deref().unwrap_or_default();
        self.gathered.allocation = adaptive::allocation(pilot.film(), rays, self.total);
        self.workers = pilot.workers;
        self.gathered.allocation.is_some()
    }

    /// Returns the next pass: `count` samples if all pixels get them.
    fn next_pass(&self, count: u32) -> Option<RenderPass> {
        let (region, size) = (self.gathered.film.region(), self.tile_size());
        if let Some(allocation) = &self.gathered.allocation {
            let next = self.gathered.samples.missing(self.wanted()).iter().next()?;
            // As many together as possible: a few samples of a few blocks would not fill a wave.
            let samples = allocation.first_round(next);
            let samples = samples.start..samples.end.min(samples.start.saturating_add(self.at_once()));
            let blocks = Some(allocation.blocks(samples.start)).filter(|blocks| blocks.contains(&false));
            return Some(RenderPass { blocks, ..RenderPass::new(samples, size, region) });
        }
        let of_all = match self.rounds() {
            Some(_) => self.wanted.start..self.wanted.end.min(adaptive::PILOT),
            None => self.wanted.clone(),
        };
        if let Some(next) = self.gathered.samples.missing(of_all).iter().next() {
            let end = next.start.saturating_add(count.min(self.at_once())).min(next.end);
            return Some(RenderPass::new(next.start..end, size, region));
        }
        let rays = self.gathered.rays.as_deref().unwrap_or_default();
        let round = adaptive::next_round(&self.gathered.film, rays, self.rounds()?)?;
        let pass = RenderPass { blocks: Some(round.blocks), ..RenderPass::new(round.samples, size, region) };
        Some(pass.begin(self.at_once()))
    }

    /// The largest number of samples that are rendered together.
    pub(super) fn at_once(&self) -> u32 {
        at_once(self.prepared.as_deref())
    }

    /// The mean number of samples per pixel, if they are rendered in adaptive rounds.
    pub(super) fn rounds(&self) -> Option<u32> {
        let is_whole = self.total >= 2 * adaptive::PILOT && self.wanted == (0..self.total);
        (self.setup.adaptive == Adaptive::On && is_whole).then_some(self.total)
    }

    /// Renders the next `count` samples of every pixel, or as many as are left; or finishes the pass that was under
    /// way. With adaptive sampling, once blocks get different numbers, it renders the next round instead. Uses all
    /// threads of the rayon pool that it is called from: see [`on_threads`](super::on_threads).
    pub fn advance(&mut self, count: u32) {
        self.advance_until(count, &Stop::NEVER, &|_| ());
    }

    /// Renders all remaining samples. Calls `progress` after each tile, from any thread, with the fraction that is
    /// done, from 0 to 1.
    ///
    /// ```no_run
    /// # fn show(session: &mut rayfront::render::Session) {
    /// session.finish(|part| eprint!("\r{:3.0} %", 100.0 * part));
    /// # }
    /// ```
    pub fn finish(&mut self, progress: impl Fn(f32) + Sync) {
        self.finish_while(&Stop::NEVER, progress, |_| true);
    }

    /// [`Session::finish`] that ends soon after `stop` is set; returns true if no samples are left. The film then holds
    /// all that was rendered until then; some pixels may have more samples than others: up to 16, or with adaptive
    /// sampling up to a round.
    pub fn finish_until(&mut self, stop: &AtomicBool, progress: impl Fn(f32) + Sync) -> bool {
        self.finish_while(&Stop::at(stop), progress, |_| true)
    }

    /// [`Session::finish_until`] that continues after a pass only while `wants_more` returns true.
    pub(crate) fn finish_while(
        &mut self,
        stop: &Stop,
        progress: impl Fn(f32) + Sync,
        wants_more: impl Fn(&Session) -> bool,
    ) -> bool {
        let area = self.film().region().area() as f32;
        let before = self.film().samples_per_pixel();
        let all = (area * (self.total as f32 - before as f32)).max(1.0);
        let done = AtomicU64::new(0);
        while !self.is_done() && !stop.is_set() {
            self.advance_until(PASS, stop, &|tile| {
                let samples = done.fetch_add(tile.samples, Ordering::Relaxed) + tile.samples;
                progress((samples as f32 / all).min(1.0));
            });
            if !wants_more(self) {
                break;
            }
        }
        self.is_done()
    }

    /// [`Session::advance`] that ends soon after `stop` is set: tiles under way are dropped. Once [`Progress::pause`]
    /// is set, no further tile is started. Some pixels of the film then have more samples than others, as
    /// [`RenderState::pass`] records.
    #[doc(hidden)]
    pub fn advance_until(&mut self, count: u32, stop: &Stop, progress: OnProgress) {
        if !self.prepare(stop) || !self.allocate(stop, progress) {
            return;
        }
        let (mut left, pause) = (count, AtomicBool::new(false));
        while let Some(pass) = self.gathered.pass.take().or_else(|| self.next_pass(left)) {
            let is_round = pass.blocks.is_some();
            let samples = self.advance_pass(pass, stop, &pause, progress);
            left = left.saturating_sub(samples);
            let goes_on = if is_round { self.gathered.pass.is_some() } else { left > 0 };
            if samples == 0 || !goes_on {
                return;
            }
        }
    }

    /// The sums of squared samples, if [`Options::variance`] is set.
    #[doc(hidden)]
    pub fn moments(&self) -> Option<&Moments> {
        self.gathered.moments.as_ref()
    }

    /// The current state.
    #[doc(hidden)]
    pub fn state(&self) -> &RenderState {
        &self.gathered
    }

    /// Returns the state and drops the rest.
    pub(crate) fn into_gathered(self) -> RenderState {
        self.gathered
    }

    pub(super) fn tiles(&self) -> Vec<Region> {
        tiles(self.gathered.film.region(), self.tile_size())
    }

    fn tile_size(&self) -> u32 {
        let tile = self.options.tile.max(1);
        // Tiles do not cut blocks whose pixels reuse paths.
        self.setup.sharing.map_or(tile, |grouping| tile.next_multiple_of(grouping.edge()))
    }

    /// The film so far; its region is the one that is rendered.
    pub fn film(&self) -> &Film {
        &self.gathered.film
    }

    /// Returns the film and drops the rest.
    pub(crate) fn into_film(self) -> Film {
        self.gathered.film
    }

    /// The statistics so far.
    #[doc(hidden)]
    pub fn statistics(&self) -> &RayStatistics {
        &self.statistics
    }

    /// The render setup.
    #[doc(hidden)]
    pub fn setup(&self) -> &Arc<RenderSetup> {
        &self.setup
    }

    /// The render options.
    pub(crate) fn options(&self) -> &Options {
        &self.options
    }

    /// The compiled scene.
    pub(crate) fn scene(&self) -> &CompiledScene {
        &self.setup.scene
    }

    /// Returns the number of samples that every pixel has, and the number that it is to have.
    pub fn samples_done(&self) -> (u32, u32) {
        let wanted = self.wanted();
        let count = wanted.len() as u32;
        (count - self.gathered.samples.missing(wanted).count(), count)
    }
}

/// Locks a mutex, poisoned or not: nothing that holds these locks can panic halfway through a change.
pub(super) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Cuts a region into squares of the whole image, row by row.
pub fn tiles(region: Region, size: u32) -> Vec<Region> {
    let cuts = |from: u32, to: u32| {
        let first = from / size * size;
        let starts = (first..to).step_by(size as usize);
        starts.map(move |start| (start.max(from), (start + size).min(to)))
    };
    let row = |(y0, y1)| cuts(region.x0, region.x1).map(move |(x0, x1)| Region { x0, y0, x1, y1 });
    cuts(region.y0, region.y1).flat_map(row).collect()
}
