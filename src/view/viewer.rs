//! The viewer: renders a scene continuously while other threads read snapshots of it.

use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock};
use std::time::{Duration, Instant};

use serde_json::Value;
use tokio::sync::watch;

use super::costs::CostMaps;
use super::request::{NumberedRequest, ViewRequest};
use super::scene::{LiveScene, SceneError};
use super::status::{Described, Pixels, Status, queues};
use super::tev::Tev;
use super::watched::{POLL_INTERVAL, Watched};
use crate::film::{Features, Film, Region};
use crate::integrator::{RenderSetup, Schedule, Stop};
use crate::math::Rgb;
use crate::render::prepare::Prepared;
use crate::render::{DEFAULT_WAVE, Options, Progress, RenderState, Session};
use crate::study::explain::{GivenNames, Recipe};

/// The target duration of a pass: short, so that the image is updated often and requests are carried out soon.
const PASS: Duration = Duration::from_millis(400);
/// The interval between snapshots within a pass.
const PICTURE: Duration = Duration::from_millis(150);
/// The interval between measurements of the wavefront queues, which count the boxes that each ray enters.
const QUEUES: Duration = Duration::from_secs(3);
/// The largest number of pixels of the first image after a change.
const FIRST_PIXELS: u64 = 40_000;
/// The smallest number of pixels of a first image during a movement: with fewer, one sees too little.
const FEWEST_PIXELS: u64 = 10_000;
/// The target duration of a first image during a movement. Together with compiling, tone mapping and drawing, that is
/// about 30 images a second.
const MOVING: Duration = Duration::from_millis(20);
/// The time without a movement after which passes over the whole image begin.
const REST: Duration = Duration::from_millis(150);

/// An immutable snapshot of the rendering: all the data that an image or a response needs.
#[derive(Clone)]
pub struct Snapshot {
    /// The render setup.
    pub setup: Arc<RenderSetup>,
    /// The render state, of the whole image or of a smaller one.
    pub gathered: Arc<RenderState>,
    /// A small version of the image, for pixels that have no sample yet; none once all have.
    pub small: Option<Arc<Film>>,
    /// Width and height of `gathered`.
    pub size: [u32; 2],
    /// The number of samples per pixel to render.
    pub wanted: u32,
    /// The schedule and the wave size.
    pub options: Options,
    /// Names of entities and lights.
    pub names: Arc<GivenNames>,
    /// The names of entities by their numbers.
    pub entities: Arc<HashMap<u32, String>>,
    /// Values that the page shows besides, computed on first use.
    pub aside: Arc<Aside>,
    /// The recipe that reproduces the image on the command line.
    pub recipe: Arc<Recipe>,
    /// The data prepared for its samples, once known.
    pub prepared: Option<Arc<Prepared>>,
    /// The number of restarts up to now.
    pub generation: u64,
}

/// Values of all pixels of an image that do not change with its samples, computed on first use.
#[derive(Debug, Default)]
pub struct Aside {
    /// The features of the first hits.
    pub features: OnceLock<Vec<Features>>,
    /// The backplate, as linear display values; none without one.
    pub plate: OnceLock<Option<Vec<Rgb>>>,
    /// The work of its rays.
    pub costs: CostMaps,
}

impl Snapshot {
    pub(super) fn new(
        scene: &LiveScene,
        setup: Arc<RenderSetup>,
        gathered: RenderState,
        options: Options,
        aside: Arc<Aside>,
    ) -> Snapshot {
        let ((names, entities), wanted) = (scene.names(), scene.settings().samples);
        let region = gathered.film.region();
        let (size, gathered) = ([region.width(), region.height()], Arc::new(gathered));
        let recipe = Arc::new(scene.recipe());
        Snapshot {
            setup,
            gathered,
            small: None,
            size,
            wanted,
            options,
            names,
            entities,
            aside,
            recipe,
            prepared: None,
            generation: 0,
        }
    }
}

/// The state shared between threads.
pub struct Viewer {
    state: Mutex<ViewerState>,
    /// Notified when there is work to do or an outcome to fetch.
    wake: Condvar,
    /// Set when the current pass is no longer needed.
    stop: AtomicBool,
    /// Incremented whenever the status or the image changes.
    news: watch::Sender<u64>,
    /// An external viewer that also shows the image.
    tev: Option<Tev>,
}

struct ViewerState {
    shown: Snapshot,
    status: Status,
    requests: VecDeque<NumberedRequest>,
    /// The outcomes of the last requests, by their numbers.
    answers: HashMap<u64, Result<String, String>>,
    next: u64,
    ends: bool,
}

/// The scheduling of the work, which does not affect any bit of the image.
#[derive(Clone, Copy, Debug)]
pub struct RenderWork {
    /// The order of the work.
    pub schedule: Schedule,
    /// The number of paths per wave.
    pub wave: usize,
}

impl Default for RenderWork {
    fn default() -> Self {
        Self { schedule: Schedule::Wavefront, wave: DEFAULT_WAVE }
    }
}

impl RenderWork {
    fn options(self) -> Options {
        Options { schedule: self.schedule, wave: self.wave, ..Options::default() }
    }
}

impl Viewer {
    /// Creates the viewer of a scene; nothing is rendered before [`Viewer::run`].
    pub fn new(scene: &LiveScene, work: RenderWork) -> Viewer {
        let setup = scene.setup();
        let nothing = RenderState::nothing(setup.film(Region::whole(setup.size)), false);
        let shown = Snapshot::new(scene, setup, nothing, work.options(), Arc::default());
        let status = Status::of(scene, work);
        let state = ViewerState {
            shown,
            status,
            requests: VecDeque::new(),
            answers: HashMap::new(),
            next: 0,
            ends: false,
        };
        let (news, _) = watch::channel(0);
        Viewer {
            state: Mutex::new(state),
            wake: Condvar::new(),
            stop: AtomicBool::new(false),
            news,
            tev: None,
        }
    }

    /// Also shows the image in an external viewer.
    pub fn with_tev(self, tev: Option<Tev>) -> Viewer {
        Viewer { tev, ..self }
    }

    /// The current snapshot.
    pub fn shown(&self) -> Snapshot {
        self.lock().shown.clone()
    }

    /// The current status.
    pub fn status(&self) -> Value {
        self.lock().status.json()
    }

    /// The serial number of the current image; 0 before the first.
    pub fn serial(&self) -> u64 {
        self.lock().status.serial
    }

    /// Returns a receiver that is notified of every change.
    pub fn news(&self) -> watch::Receiver<u64> {
        self.news.subscribe()
    }

    /// Carries out a request and waits for its outcome, or the reason why it is impossible. All requests in the queue
    /// are carried out before the next pass.
    pub fn command(&self, request: ViewRequest) -> Result<String, String> {
        let mut state = self.lock();
        let number = state.next;
        state.next += 1;
        state.requests.push_back(NumberedRequest { number, request });
        self.stop.store(true, Ordering::Release);
        self.wake.notify_all();
        loop {
            if let Some(answer) = state.answers.remove(&number) {
                return answer;
            }
            if state.ends {
                return Err("the program ends".into());
            }
            state = self.wake.wait(state).unwrap_or_else(|poisoned| poisoned.into_inner());
        }
    }

    /// Ends [`Viewer::run`].
    pub fn end(&self) {
        self.lock().ends = true;
        self.stop.store(true, Ordering::Release);
        self.wake.notify_all();
    }

    /// Renders until [`Viewer::end`] is called.
    pub fn run(&self, scene: LiveScene, work: RenderWork) {
        let (files, changed) = (scene.files(), AtomicBool::new(false));
        std::thread::scope(|scope| {
            // Without this thread, edits show only after requests that read the files again.
            let _ = std::thread::Builder::new().spawn_scoped(scope, || self.watch(&files, &changed));
            self.render(scene, work, &changed);
        });
    }

    /// Checks files for changes until the viewer ends.
    fn watch(&self, files: &Mutex<Watched>, changed: &AtomicBool) {
        while !self.lock().ends {
            let mut files = files.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            if files.have_changed() {
                changed.store(true, Ordering::Release);
                self.stop.store(true, Ordering::Release);
                self.wake.notify_all();
            }
            drop(files);
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    fn render(&self, mut scene: LiveScene, work: RenderWork, changed: &AtomicBool) {
        let mut rendering = Rendering {
            work,
            session: None,
            small: None,
            spent: Duration::ZERO,
            paused: false,
            looked: None,
            aside: Arc::default(),
            moved: None,
            first_pixels: FIRST_PIXELS,
        };
        loop {
            let requests = self.wait(&rendering, changed);
            let Some(requests) = requests else { return };
            for command in requests {
                let moves = command.request.is_movement();
                let answer =
                    command.request.carry_out(&mut scene, &mut rendering.work, &mut rendering.paused);
                let changed = answer.as_ref().is_ok_and(|done| done.changes);
                if changed {
                    rendering.begin_anew();
                    rendering.moved = moves.then(Instant::now);
                    self.lock().status.begin();
                }
                self.tell(command.number, &scene, &rendering, answer.map(|done| done.said));
            }
            if changed.swap(false, Ordering::AcqRel) {
                let outcome = scene.reload();
                let mut state = self.lock();
                state.status.error = outcome.as_ref().err().map(SceneError::to_string);
                drop(state);
                if outcome.is_ok() {
                    rendering.begin_anew();
                    self.lock().status.begin();
                }
                let described = Described::new(&scene, &rendering.work);
                self.publish(|state| {
                    state.status.describe(described);
                    state.status.is_paused = rendering.paused;
                });
            }
            if !rendering.paused {
                rendering.go_on(self, &scene);
            }
        }
    }

    /// Waits for work; none if the viewer is to end.
    fn wait(&self, rendering: &Rendering, changed: &AtomicBool) -> Option<Vec<NumberedRequest>> {
        let mut state = self.lock();
        let is_done = rendering.session.as_ref().is_some_and(Session::is_done);
        let pause = match rendering.until_rest().filter(|_| rendering.small.is_some()) {
            None if rendering.paused || is_done => Some(POLL_INTERVAL),
            until_rest => until_rest,
        };
        let is_idle = state.requests.is_empty() && !state.ends && !changed.load(Ordering::Acquire);
        if let Some(pause) = pause.filter(|_| is_idle) {
            let waited = self.wake.wait_timeout(state, pause);
            state = waited.unwrap_or_else(|poisoned| poisoned.into_inner()).0;
        }
        // Still under the lock: later requests stop the work that follows.
        self.stop.store(false, Ordering::Release);
        (!state.ends).then(|| state.requests.drain(..).collect())
    }

    fn tell(
        &self,
        number: u64,
        scene: &LiveScene,
        rendering: &Rendering,
        answer: Result<String, SceneError>,
    ) {
        let described = Described::new(scene, &rendering.work);
        self.publish(|state| {
            state.status.describe(described);
            state.status.is_paused = rendering.paused;
            state.answers.insert(number, answer.map_err(|error| error.to_string()));
        });
        self.wake.notify_all();
    }

    /// Changes the state and notifies of it. The change must be quick: other threads wait for the lock.
    fn publish<T>(&self, change: impl FnOnce(&mut ViewerState) -> T) -> T {
        let outcome = change(&mut self.lock());
        self.news.send_modify(|serial| *serial += 1);
        outcome
    }

    /// Replaces the current snapshot.
    fn show(&self, shown: Snapshot, elapsed: Duration, described: Option<Described>) {
        let pixels = Pixels::of(&shown);
        let before = self.publish(|state| {
            described.into_iter().for_each(|described| state.status.describe(described));
            state.status.pixels(pixels, elapsed);
            let generation = state.status.generation;
            std::mem::replace(&mut state.shown, Snapshot { generation, ..shown })
        });
        // Freed outside the lock: that takes time for many pixels.
        drop(before);
    }

    /// Nothing panics while it holds the lock.
    fn lock(&self) -> MutexGuard<'_, ViewerState> {
        self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// A rendering, from its first small image to its last sample.
struct Rendering {
    work: RenderWork,
    /// The session; none before the first small image.
    session: Option<Session>,
    /// The first small image; none until it is complete.
    small: Option<Arc<Film>>,
    /// The time of all passes.
    spent: Duration,
    paused: bool,
    /// The time of the last queue measurement.
    looked: Option<Instant>,
    /// See [`Snapshot::aside`].
    aside: Arc<Aside>,
    /// The time of the last movement; none once the first image for its end is due.
    moved: Option<Instant>,
    /// The number of pixels of the first images during a movement, as many as their duration allows.
    first_pixels: u64,
}

impl Rendering {
    fn begin_anew(&mut self) {
        (self.session, self.small, self.spent) = (None, None, Duration::ZERO);
        (self.paused, self.looked, self.aside) = (false, None, Arc::default());
        self.moved = None;
    }

    /// The time until the movement counts as ended; none if there is none.
    fn until_rest(&self) -> Option<Duration> {
        REST.checked_sub(self.moved?.elapsed()).filter(|left| !left.is_zero())
    }

    /// Renders the next small image or pass.
    fn go_on(&mut self, viewer: &Viewer, scene: &LiveScene) {
        let Some(small) = self.small.clone() else { return self.first_picture(viewer, scene) };
        if self.until_rest().is_some() {
            return;
        }
        if self.moved.take().is_some() && self.first_pixels < FIRST_PIXELS {
            return self.first_picture(viewer, scene);
        }
        let options = self.work.options();
        let session =
            self.session.get_or_insert_with(|| Session::of(scene.setup(), scene.settings().samples, options));
        if session.is_done() {
            return;
        }
        let start = Instant::now();
        if !session.prepare(&Stop::at(&viewer.stop)) {
            return;
        }
        let count = next_count(session, self.spent);
        let prepared = Some(session.prepared());
        let aside = self.aside.clone();
        let setup = session.setup().clone();
        // Some tiles of a pass are ready long before others.
        let small = (session.samples_done().0 == 0).then_some(small);
        let shown = Snapshot {
            small,
            prepared,
            ..Snapshot::new(scene, setup, session.state().clone(), options, aside)
        };
        let (begun, spent, last) = (Instant::now(), self.spent, Mutex::new(Instant::now()));
        let elapsed = || spent + begun.elapsed();
        let show = |gathered: RenderState| {
            let gathered = Arc::new(gathered);
            viewer.show(Snapshot { gathered: gathered.clone(), ..shown.clone() }, elapsed(), None);
            if let Some(tev) = &viewer.tev {
                tev.show(&gathered.film);
                tev.warning().into_iter().for_each(|warning| eprintln!("warning: {warning}"));
            }
        };
        let watch = |progress: &Progress| {
            // One thread at a time takes a snapshot; the others go on rendering.
            let Ok(mut last) = last.try_lock() else { return };
            if last.elapsed() >= PICTURE && !viewer.stop.load(Ordering::Acquire) {
                *last = Instant::now();
                let mut gathered = None;
                (progress.look)(&mut |all| gathered = Some(all.clone()));
                gathered.into_iter().for_each(&show);
            }
        };
        session.advance_until(count, &Stop::at(&viewer.stop), &watch);
        self.spent += start.elapsed();
        if viewer.stop.load(Ordering::Acquire) && !session.is_done() {
            return;
        }
        show(session.state().clone());
        let (rays, done) = (session.statistics().rays.total(), session.is_done());
        let setup = session.setup().clone();
        viewer.publish(|state| state.status.passed(rays, elapsed(), done));
        let enough = done || session.samples_done().0 >= 4;
        if enough && self.looked.is_none_or(|looked| looked.elapsed() >= QUEUES) {
            self.looked = Some(Instant::now());
            let is_wave = options.schedule == Schedule::Wavefront;
            let flows = is_wave.then(|| queues(&setup, options));
            viewer.publish(|state| state.status.queues = flows);
        }
    }

    /// Renders a small image of one sample per pixel, which is visible immediately. During a movement, further requests
    /// do not stop it: they come faster than images, and none would ever be complete.
    fn first_picture(&mut self, viewer: &Viewer, scene: &LiveScene) {
        let whole = scene.setup();
        let pixels = |by: u32| whole.size.iter().map(|side| u64::from(side.div_ceil(by))).product::<u64>();
        // At most half as wide, even for images so small that they would not need this step.
        let most = if self.moved.is_some() { self.first_pixels } else { FIRST_PIXELS };
        let by = (2..).find(|by| pixels(*by) <= most).unwrap_or(2);
        let size = whole.size.map(|side: u32| side.div_ceil(by));
        let options = self.work.options();
        let small = Arc::new(RenderSetup { size, sharing: None, ..(*whole).clone() });
        let mut session = Session::of(small, 1, options);
        let start = Instant::now();
        let stop = if self.moved.is_some() { Stop::NEVER } else { Stop::at(&viewer.stop) };
        session.advance_until(1, &stop, &|_| ());
        if !session.is_done() {
            return;
        }
        let possible = pixels(by) as f64 * MOVING.as_secs_f64() / start.elapsed().as_secs_f64().max(1e-6);
        self.first_pixels = (possible as u64).clamp(FEWEST_PIXELS, FIRST_PIXELS);
        let shown = Snapshot::new(scene, whole, session.state().clone(), options, self.aside.clone());
        self.small = Some(Arc::new(session.into_film()));
        let described = Described::new(scene, &self.work);
        viewer.show(shown, Duration::ZERO, Some(described));
    }
}

/// The number of samples of the next pass: as many as fit into its duration, given the time of those before.
fn next_count(session: &Session, spent: Duration) -> u32 {
    let (done, _) = session.samples_done();
    if done == 0 {
        return 1;
    }
    let each = spent.as_secs_f64() / f64::from(done);
    ((PASS.as_secs_f64() / each.max(1e-9)) as u32).clamp(1, done.next_power_of_two())
}
