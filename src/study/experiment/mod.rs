//! Studies: jobs from scenes, settings and seeds, and their results as CSV, plots and an HTML page.

mod equal_time;
pub mod fit;
mod job;
mod page;
pub mod plot;
pub mod results;
mod shapes;
pub mod short;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::error::SaveError;
use crate::film::tonemap::{DisplayTransform, srgb_decode};
use crate::formats::picture::{Output, load_linear, save};
use crate::formats::study::{Axis, Experiment, Measurement, Plot, SettingsOverride, StudyFile, StudyScene};
use crate::integrator::Stop;
use crate::math::Rgb;
use crate::world::{SourceFiles, Tonemap};
use equal_time::EqualTime;
use fit::{Estimate, Fit};
pub use job::{CpuSeconds, StudyImage};
use plot::{Curve, Figure};
use results::{Label, Results};

/// The reason why a study fails.
#[derive(Debug)]
pub enum StudyError {
    /// A job failed, or a file is invalid.
    Job(String),
    /// Results could not be written.
    Save(SaveError),
}

impl std::fmt::Display for StudyError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            StudyError::Job(reason) => f.write_str(reason),
            StudyError::Save(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for StudyError {}

impl From<String> for StudyError {
    fn from(reason: String) -> Self {
        StudyError::Job(reason)
    }
}

impl From<SaveError> for StudyError {
    fn from(error: SaveError) -> Self {
        StudyError::Save(error)
    }
}

/// A study with its input and output folders.
pub struct Run<'a> {
    /// The study.
    pub study: &'a StudyFile,
    /// The folder that paths of scenes are relative to.
    pub folder: &'a Path,
    /// The folder for all output; created if it does not exist.
    pub out: &'a Path,
    /// A clock of the process's CPU time.
    pub cpu: CpuSeconds,
    /// Stops the current job; its partial result is discarded.
    pub stop: Stop<'a>,
}

/// One of a study's jobs.
pub struct StudyJob<'a> {
    experiment: &'a Experiment,
    scene: &'a StudyScene,
    series: usize,
    x: u32,
    seed: u32,
    change: SettingsOverride,
    label: Label,
}

impl StudyJob<'_> {
    /// A human-readable name.
    pub fn name(&self) -> String {
        let Label { experiment, scene, series, x, seed, .. } = &self.label;
        format!("{experiment}: {scene}, {series}, {x}, seed {seed}")
    }
}

/// A curve: indices of the scene and of the series within an experiment.
type CurveId = (usize, usize);

impl<'a> Run<'a> {
    /// Returns all jobs. Repetitions are outermost and series innermost, so that other load on the machine affects all
    /// series alike.
    pub fn jobs(&self) -> Result<Vec<StudyJob<'a>>, StudyError> {
        let mut jobs = Vec::new();
        let mut hashes = HashMap::new();
        for experiment in &self.study.experiments {
            for seed in 0..experiment.seeds {
                for scene in &experiment.scenes {
                    let content = self.content(scene, &mut hashes)?;
                    for x in experiment.x.values() {
                        for series in 0..experiment.series.len() {
                            jobs.extend(job(experiment, scene, content, series, *x, seed));
                        }
                    }
                }
            }
        }
        Ok(jobs)
    }

    /// A hash of a scene's file, so that a changed scene is rendered again.
    fn content(&self, scene: &StudyScene, known: &mut HashMap<PathBuf, u128>) -> Result<u128, String> {
        let StudyScene::File(file) = scene else { return Ok(0) };
        let path = job::path(self.folder, file);
        if let Some(hash) = known.get(&path) {
            return Ok(*hash);
        }
        // Like a scene, a study may read files in its own folder or its project only.
        let sources = SourceFiles::default();
        sources.confine(&self.folder.join("study"));
        let bytes =
            sources.read(&path).map_err(|error| format!("{}: cannot read: {error}", path.display()))?;
        let hash = xxhash_rust::xxh3::xxh3_128(&bytes);
        known.insert(path, hash);
        Ok(hash)
    }

    /// Runs the jobs without a result. Before each job `progress` gets the number of finished jobs and the job's name;
    /// it returns true to continue.
    pub fn run(
        &self,
        jobs: &[StudyJob],
        progress: &mut dyn FnMut(usize, &str) -> bool,
    ) -> Result<(), StudyError> {
        for folder in ["references", "images", "plots"] {
            let path = self.out.join(folder);
            crate::files::links::make_folder(&path)?;
        }
        let mut results = Results::open(&self.out.join("results.csv"))?;
        let mut references: HashMap<PathBuf, StudyImage> = HashMap::new();
        for (number, job) in jobs.iter().enumerate() {
            if results.get(job.label.key).is_some() {
                continue;
            }
            if !progress(number, &job.name()) {
                return Ok(());
            }
            let reference = match &job.experiment.reference {
                Some(change) => {
                    let path = self.reference_path(job);
                    if !references.contains_key(&path) {
                        let reference = match self.reference(job, change, &path) {
                            Err(_) if self.stop.is_set() => return Ok(()),
                            reference => reference?,
                        };
                        references.insert(path.clone(), reference);
                    }
                    references.get(&path)
                }
                None => None,
            };
            let pair = (reference, job.experiment.needs_pairs());
            let done = match self.perform(job, &job.change, job.seed, pair) {
                Err(_) if self.stop.is_set() => return Ok(()),
                done => done?,
            };
            // The page shows images of the first repetition.
            if let Some(image) = done.image.filter(|_| job.seed == 0 && reference.is_some()) {
                self.save(&self.image_path(job), &image)?;
            }
            results.add(&job.label, done.row)?;
        }
        Ok(())
    }

    fn perform(
        &self,
        job: &StudyJob,
        change: &SettingsOverride,
        seed: u32,
        reference: (Option<&StudyImage>, bool),
    ) -> Result<job::Done, String> {
        job::run(job.scene, self.folder, [job.x, seed], change, reference, (self.cpu, &self.stop))
            .map_err(|reason| format!("{}: {reason}", job.name()))
    }

    /// Loads the reference from its file, or renders it.
    fn reference(
        &self,
        job: &StudyJob,
        change: &SettingsOverride,
        path: &Path,
    ) -> Result<StudyImage, StudyError> {
        if let Ok((width, height, pixels)) = load_linear(path) {
            return Ok(StudyImage { width, height, pixels });
        }
        // Edits of the job's scene apply to the reference, too. Its time is not measured, so it uses all threads.
        let SettingsOverride { set, only, hide, .. } = job.change.and(change);
        let change =
            SettingsOverride { set, only, hide, threads: Some(0), ..job.experiment.with.and(change) };
        // A seed of its own, so that it shares random numbers with no job.
        let done = self.perform(job, &change, 1_000_003, (None, false))?;
        let image = done
            .image
            .ok_or_else(|| "a reference has to be rendered: leave rays out of `with`".to_owned())?;
        self.save(path, &image)?;
        Ok(image)
    }

    fn reference_path(&self, job: &StudyJob) -> PathBuf {
        let Experiment { with, reference, .. } = job.experiment;
        let edits = job.change.edits();
        let text = format!("{:?} {:?} {with:?} {reference:?} {edits:?}", job.scene, job.label.scene);
        let hash = xxhash_rust::xxh3::xxh3_64(text.as_bytes());
        self.out.join("references").join(format!("{}_{hash:016x}.exr", job.label.scene))
    }

    fn image_path(&self, job: &StudyJob) -> PathBuf {
        self.out.join("images").join(format!("{:032x}.png", job.label.key))
    }

    fn save(&self, path: &Path, image: &StudyImage) -> Result<(), SaveError> {
        let display = DisplayTransform::new(Tonemap::Clamp, 0.0, &image.pixels);
        save(path, &Output::plain([image.width, image.height], &image.pixels, display))
    }

    /// Writes the plots and the page from all results. Returns the path of the page.
    pub fn report(&self, jobs: &[StudyJob]) -> Result<PathBuf, StudyError> {
        let results = Results::open(&self.out.join("results.csv"))?;
        let mut sections = Vec::new();
        for experiment in &self.study.experiments {
            let own: Vec<&StudyJob> =
                jobs.iter().filter(|job| std::ptr::eq(job.experiment, experiment)).collect();
            let mut plots = Vec::new();
            for plot in &experiment.plots {
                let figure = figure(experiment, plot, &own, &results);
                let name = format!("{}_{:?}", experiment.name, plot.y).to_lowercase();
                let svg = plot::svg(&figure)?;
                self.write(&self.out.join("plots").join(format!("{name}.svg")), svg.as_bytes())?;
                self.save_plot(&self.out.join("plots").join(format!("{name}.png")), &figure)?;
                let equal_time = is_error_by_samples(experiment, plot).then(|| {
                    let time = Plot { y: Measurement::CpuSeconds, ..plot.clone() };
                    EqualTime::of(&figure, &self::figure(experiment, &time, &own, &results))
                });
                plots.push(page::DrawnPlot { figure, svg, equal_time });
            }
            let images = self.images(experiment, &own)?;
            sections.push(page::Section { experiment, plots, images });
        }
        let path = self.out.join("index.html");
        self.write(&path, page::html(self.study, &sections).as_bytes())?;
        Ok(path)
    }

    /// Images of the first repetition, with their references.
    fn images(&self, experiment: &Experiment, jobs: &[&StudyJob]) -> Result<Vec<page::Pictures>, StudyError> {
        let mut all = Vec::new();
        for (scene_number, scene) in experiment.scenes.iter().enumerate() {
            let of_scene = || jobs.iter().filter(move |job| job.scene == scene && job.seed == 0);
            let Some(job) = of_scene().next() else { continue };
            let Ok((width, height, pixels)) = load_linear(&self.reference_path(job)) else { continue };
            let png = self.out.join("references").join(format!("{}_{scene_number}.png", experiment.name));
            self.save(&png, &StudyImage { width, height, pixels })?;
            let reference = self.read(&png)?;
            let mut shown = Vec::new();
            for job in of_scene() {
                let path = self.image_path(job);
                if path.is_file() {
                    shown.push((job.label.series.clone(), job.x, self.read(&path)?));
                }
            }
            all.push(page::Pictures { scene: job.label.scene.clone(), reference, shown });
        }
        Ok(all)
    }

    fn read(&self, path: &Path) -> Result<Vec<u8>, String> {
        crate::files::read(path).map_err(|error| format!("{}: cannot read: {error}", path.display()))
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
        crate::files::replace(path, bytes)
    }

    fn save_plot(&self, path: &Path, figure: &Figure) -> Result<(), StudyError> {
        let bytes = plot::pixels(figure)?;
        let linear = |byte: u8| srgb_decode(f32::from(byte) / 255.0);
        let pixels =
            bytes.chunks_exact(3).map(|p| Rgb::new(linear(p[0]), linear(p[1]), linear(p[2]))).collect();
        let (width, height) = figure.size();
        Ok(self.save(path, &StudyImage { width, height, pixels })?)
    }
}

/// Returns a job, or none if its series ends before x or the processor lacks its lanes.
fn job<'a>(
    experiment: &'a Experiment,
    scene: &'a StudyScene,
    content: u128,
    series: usize,
    x: u32,
    seed: u32,
) -> Option<StudyJob<'a>> {
    let line = &experiment.series[series];
    if line.most.is_some_and(|most| x > most) {
        return None;
    }
    let change = job::at(&experiment.with.and(&line.with), &experiment.x, x);
    if !job::has_lanes(&change) {
        return None;
    }
    let scene_name = match scene {
        StudyScene::File(file) => file.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        StudyScene::Ball => "ball".into(),
        StudyScene::Cloud => "cloud".into(),
    };
    // Threads and the like leave the image unchanged, but not what is measured.
    let text = format!(
        "{} {:?} {content:x} {change:?} {x} {seed} {:?} {:?} {}",
        env!("CARGO_PKG_VERSION"),
        scene,
        experiment.reference,
        experiment.with,
        experiment.needs_pairs()
    );
    let label = Label {
        key: xxhash_rust::xxh3::xxh3_128(format!("{} {} {text}", experiment.name, line.label).as_bytes()),
        experiment: experiment.name.clone(),
        scene: scene_name,
        series: line.label.clone(),
        x,
        seed,
    };
    Some(StudyJob { experiment, scene, series, x, seed, change, label })
}

/// True if a plot shows an error over numbers of samples.
fn is_error_by_samples(experiment: &Experiment, plot: &Plot) -> bool {
    matches!(plot.y, Measurement::Mse | Measurement::RelativeMse | Measurement::Flip)
        && matches!(experiment.x, Axis::Samples(_) | Axis::LightSamples(_) | Axis::LensSamples(_))
}

/// Returns a curve for each scene and series.
fn figure(experiment: &Experiment, plot: &Plot, jobs: &[&StudyJob], results: &Results) -> Figure {
    let mut curves = Vec::new();
    let several = experiment.scenes.len() > 1;
    for (scene_number, scene) in experiment.scenes.iter().enumerate() {
        for (series_number, series) in experiment.series.iter().enumerate() {
            let place: CurveId = (scene_number, series_number);
            let own = || {
                jobs.iter()
                    .filter(move |job| job.scene == &experiment.scenes[place.0] && job.series == place.1)
            };
            let value = |job: &&&StudyJob| {
                results.get(job.label.key).and_then(|row| row.get(plot.y)).map(|value| plot.y.in_unit(value))
            };
            let all: Vec<(f64, f64)> =
                own().filter_map(|job| Some((f64::from(job.x), value(&job)?))).collect();
            let points: Vec<(f64, Estimate)> = experiment
                .x
                .values()
                .iter()
                .filter_map(|x| {
                    let at: Vec<f64> =
                        all.iter().filter(|(ax, _)| *ax == f64::from(*x)).map(|p| p.1).collect();
                    Some((f64::from(*x), Estimate::of(&at)?))
                })
                .collect();
            if points.is_empty() {
                continue;
            }
            let name = own().next().map_or_else(|| format!("{scene:?}"), |job| job.label.scene.clone());
            let label = if several { format!("{name}, {}", series.label) } else { series.label.clone() };
            let fit = plot.fit.then(|| Fit::of(&all)).flatten();
            curves.push(Curve { label, scene: place.0, points, fit });
        }
    }
    let title = if experiment.title.is_empty() { &experiment.name } else { &experiment.title };
    Figure {
        title: title.clone(),
        x_label: experiment.x.label().into(),
        y: plot.y.into(),
        log: [plot.log_x, plot.log_y],
        curves,
    }
}
