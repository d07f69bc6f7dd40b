//! Render jobs, from a command line or a film file to the outputs.

pub mod aov;
mod checkpoint;
mod execute;
mod films;
mod image;
mod live_views;
mod loading;
mod mix;
mod outputs;
pub mod record;
mod report;
mod saving;
mod stop;

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

pub use self::checkpoint::is_checkpoint;
pub use self::execute::{RunRequest, execute};
pub use self::films::{
    describe, gathered_of, load_existing_film, samples, save, uneven_blur, write_to_stdout,
};
pub use self::image::{OutputImage, header_of_image};
pub use self::live_views::LiveViews;
pub use self::loading::LoadSession;
use self::loading::{LoadedScene, Phases, check_against_full_compile};
pub use self::mix::mixed;
pub use self::outputs::{Outputs, Video, default_image};
pub use self::report::{chosen_exposure, noise_line, rounded_count};
pub use self::saving::Saved;
pub use self::stop::{StopLimits, deadline};
use super::failure::Failure;
use super::output;
use crate::error::{Diagnostic, Severity};
use crate::film::Region;
use crate::formats::film_file::{FilmHeader, Note, PROGRAM, RenderedView};
use crate::integrator::{RenderSetup, Stop};
use crate::render::{OnProgress, Options, RenderState, Session, adaptive};
use crate::world::{Adaptive, Aov, Settings, SourceFiles, World};

/// A scene that is ready to be rendered.
pub struct Job {
    /// The header of its film.
    pub header: FilmHeader,
    /// The render setup.
    pub setup: Arc<RenderSetup>,
    /// The names of entities, if they are needed.
    pub names: HashMap<u32, String>,
    /// The settings in the scene's file.
    authored: Settings,
    /// The probable mistakes in the scene.
    findings: Vec<Diagnostic>,
    /// The time taken so far.
    pub phases: Phases,
    /// The data shared with other moments of the scene.
    reuse: LoadSession,
    /// The index of the moment that `setup` is of, for motion blur.
    moment: u32,
}

impl Job {
    /// Reads a scene and prepares it. `change` applies options to the world.
    pub fn load(
        path: &Path,
        view: RenderedView,
        quiet: bool,
        change: impl Fn(&mut World),
    ) -> Result<Job, Failure> {
        let mut reuse = LoadSession::new(view.moments() > 1);
        Self::load_frame(path, view, quiet, &mut reuse, change)
    }

    /// Reads and prepares one of several frames, as [`Job::load`] does. `reuse` passes data from one frame to the next.
    pub fn load_frame(
        path: &Path,
        view: RenderedView,
        quiet: bool,
        reuse: &mut LoadSession,
        change: impl Fn(&mut World),
    ) -> Result<Job, Failure> {
        // Recorded even if loading fails: fixing it means changing one of these files.
        reuse.sources = SourceFiles::with(reuse.kept.clone());
        let mut tell = |diagnostic: &Diagnostic| {
            if reuse.told.insert(diagnostic.to_string()) {
                let kind = if diagnostic.severity == Severity::Note { "note" } else { "warning" };
                output::note(format_args!("{kind}: {diagnostic}"));
            }
        };
        let tell: Option<&mut dyn FnMut(&Diagnostic)> = if quiet { None } else { Some(&mut tell) };
        let before = reuse.before.as_deref();
        let LoadedScene { compiled, setup, findings, settings, authored, source, names, phases } =
            loading::compiled(path, &view.at(0), before, &reuse.sources, tell, &change)?;
        reuse.kept.forget_unused();
        if reuse.paranoid && reuse.before.is_some() {
            check_against_full_compile(path, &view.at(0), &compiled, &change)?;
            if !quiet {
                output::note("--paranoid: the same as compiled by itself");
            }
        }
        if settings.adaptive != Adaptive::Off && view.moments() > 1 {
            let reason = "adaptive samples need all of the time at once";
            return Err(Failure::command_line(format!("--shutter: {reason}: add --adaptive=off")));
        }
        let setup = Arc::new(setup);
        if reuse.several {
            reuse.before = Some(compiled);
        }
        let header = FilmHeader {
            program: PROGRAM.into(),
            scene: source,
            view,
            region: Region::whole(settings.size),
            unit: setup.unit,
            variance: settings.aov.contains(&Aov::Variance),
            light_groups: setup.light_group_names().to_vec(),
            catches: setup.catches,
            wanted: [0, settings.samples],
            settings,
            samples: Vec::new(),
            most: 0,
            begun: None,
            rays: None,
            allocation: None,
            shard: None,
            film_hash: String::new(),
            moments_hash: None,
            note: Note::default(),
        };
        Ok(Job { header, setup, names, authored, findings, phases, reuse: reuse.clone(), moment: 0 })
    }

    /// Loads the scene of a film, which must be unchanged.
    pub fn load_again(
        header: &FilmHeader,
        scene_file: Option<&Path>,
        film_path: &Path,
        quiet: bool,
    ) -> Result<Job, Failure> {
        let scene = record::scene_of(header, film_path, scene_file)?;
        // The options come from a film or an image, not from the command line.
        let mut job =
            Job::load(&scene, header.view.clone(), quiet, |world| world.settings = header.settings.clone())
                .map_err(Failure::of_file)?;
        job.header.region = header.region;
        job.header.variance = header.variance;
        job.header.allocation.clone_from(&header.allocation);
        job.header.note.command.clone_from(&header.note.command);
        match header.difference(&job.header) {
            Some(what) => Err(Failure::file(format!("{} is {what}", film_path.display()))),
            None => Ok(job),
        }
    }

    /// Renders as [`Session::advance_until`] does, with the scene at the moment of the next samples.
    pub fn advance(
        &mut self,
        session: &mut Session,
        count: u32,
        stop: &Stop,
        progress: OnProgress,
    ) -> Result<(), Failure> {
        let (view, samples) = (&self.header.view, self.header.settings.samples);
        let pass = session.state().pass.as_ref().map(|pass| pass.samples.start);
        let next = pass.or_else(|| session.next_sample()).unwrap_or(0);
        let (moment, end) = view.moment_of(next, samples);
        let count = count.min(end.saturating_sub(next)).max(1);
        self.move_to(moment)?;
        if !Arc::ptr_eq(&self.setup, session.setup()) {
            session.replace_setup(self.setup.clone());
        }
        session.advance_until(count, stop, progress);
        Ok(())
    }

    /// Prepares the scene at a moment.
    fn move_to(&mut self, moment: u32) -> Result<(), Failure> {
        if moment == self.moment {
            return Ok(());
        }
        let FilmHeader { scene, view, settings, .. } = &self.header;
        let sources = SourceFiles::with(self.reuse.kept.clone());
        let before = self.reuse.before.as_deref();
        let found = loading::compiled(&scene.path, &view.at(moment), before, &sources, None, |world| {
            world.settings = settings.clone()
        })?;
        self.reuse.kept.forget_unused();
        if let Some(what) = found.source.difference(scene) {
            return Err(Failure::file(format!("{}: it has changed meanwhile: {what}", scene.path.display())));
        }
        if found.setup.light_group_names() != self.header.light_groups {
            let reason = "its lights are of other groups at another moment: give each that shines a group";
            return Err(Failure::file(format!("{}: {reason}", scene.path.display())));
        }
        // A film has only one unit.
        let setup = RenderSetup { unit: self.setup.unit, ..found.setup };
        (self.setup, self.moment) = (Arc::new(setup), moment);
        self.reuse.before = Some(found.compiled);
        self.phases.load += found.phases.load;
        self.phases.compile += found.phases.compile;
        Ok(())
    }

    /// Restricts rendering to a region of the image.
    pub fn crop(&mut self, crop: Option<Region>) -> Result<(), Failure> {
        let [width, height] = self.header.settings.size;
        let region = crop.unwrap_or(self.header.region);
        let Region { x1, y1, .. } = region;
        if x1 > width || y1 > height {
            let image = format!("beyond the image of {width}x{height}");
            return Err(Failure::command_line(format!("--crop ends at {x1},{y1}, {image}")));
        }
        self.header.region = region;
        Ok(())
    }

    /// Returns a session that continues a render; `None` if `gathered` cannot be the state of this job.
    pub fn going_on(&self, work: &Options, gathered: RenderState) -> Option<Session> {
        let FilmHeader { wanted: [start, end], region, settings, .. } = &self.header;
        let options = self.options(work, *region);
        let session = Session::going_on(self.setup.clone(), settings.samples, options, gathered);
        session.map(|session| session.with_samples(*start..*end))
    }

    fn options(&self, work: &Options, region: Region) -> Options {
        Options { region: Some(region), variance: self.header.variance, ..*work }
    }

    /// Returns a session in which nothing is rendered yet.
    pub fn session(&self, work: &Options) -> Session {
        self.session_of(work, self.header.region)
    }

    /// Returns a session for a part of the image, in which nothing is rendered yet.
    pub fn session_of(&self, work: &Options, region: Region) -> Session {
        let options = self.options(work, region);
        let FilmHeader { wanted: [start, end], allocation, region: whole, settings, .. } = &self.header;
        let allocation = allocation
            .as_ref()
            .and_then(|allocation| adaptive::allocation_of_part(allocation, *whole, region));
        Session::of(self.setup.clone(), settings.samples, options)
            .with_samples(*start..*end)
            .with_allocation(allocation)
    }
}
