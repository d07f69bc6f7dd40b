//! `rayfront plan SCENE`: writes job files for existing engines, which render a scene in parts and merge them, or
//! render the frames of an animation.

mod arguments;
mod engines;
mod resources;

use std::path::{Component, Path, PathBuf};
use std::process::ExitCode;

pub use self::arguments::PlanArguments;
use self::arguments::{Engine, TaskArguments};
use self::resources::Resources;

use super::render::frames;
use crate::cli::args::{Frames, PROGRESS_FORMS, Render, name_of};
use crate::cli::job::{Outputs, default_image};
use crate::cli::{command_line::CommandLine, failure::Failure, output, progress::ProgressForm};
use crate::files::links;
use crate::film::SampleRanges;
use crate::formats::picture::supported;
use crate::formats::{EnvironmentPreset, film_file};
use crate::world::Adaptive;

/// The tasks of a plan.
#[derive(Clone)]
enum Tasks {
    /// Parts of the samples, to be merged.
    Shards(u32),
    /// Frames, each by itself.
    Frames(Frames),
}

impl Tasks {
    fn of(shards: Option<u32>, frames: Option<Frames>) -> Result<Tasks, Failure> {
        match (shards, frames) {
            (Some(shards), None) => Ok(Tasks::Shards(shards)),
            (None, Some(frames)) => Ok(Tasks::Frames(frames)),
            (Some(_), Some(_)) => {
                Err(Failure::command_line("--shards: frames are tasks already, one each: leave it out"))
            }
            (None, None) => Err(Failure::command_line("say how many tasks: --shards N, or -- --frames LIST")),
        }
    }
}

/// The jobs, in a form for all engines.
#[derive(Clone)]
struct Jobs<'a> {
    plan: &'a PlanArguments,
    tasks: Tasks,
    /// The options of the render, except the frames.
    options: CommandLine,
    /// The resources of a task.
    resources: Resources,
    /// True if the options select the form of progress reports, or none.
    options_say_progress: bool,
    /// The options of the merge.
    of_merge: CommandLine,
    /// True if a pilot first decides the number of samples of each block.
    has_pilot: bool,
    program: String,
    scene: String,
    folder: PathBuf,
    images: Vec<String>,
    /// The current folder.
    here: PathBuf,
    /// The name of the job, in characters that all engines accept.
    name: String,
}

/// A file's name and content.
type JobFile = (&'static str, String);

pub fn run(plan: &PlanArguments) -> Result<ExitCode, Failure> {
    let jobs = Jobs::new(plan)?;
    let files = match plan.engine {
        Engine::Slurm => jobs.slurm(),
        Engine::Openjd => vec![("template.json", jobs.openjd())],
        Engine::Hyperqueue => vec![("submit.sh", jobs.hyperqueue())],
        Engine::Kubernetes => jobs.kubernetes(),
        Engine::Commands => jobs.commands(),
    };
    links::make_folder(&jobs.folder)?;
    // The check includes the files that the tasks write: parts, the pilot.
    let inside = std::fs::read_dir(&jobs.folder).into_iter().flatten().flatten();
    inside.map(|file| file.path()).try_for_each(|path| links::check(&path))?;
    for (name, content) in &files {
        crate::files::replace(&jobs.folder.join(name), content.as_bytes())?;
    }
    output::print(&jobs.what_to_do())?;
    Ok(ExitCode::SUCCESS)
}

impl PlanArguments {
    /// Returns the current folder, the folder of the jobs, and the images, which are checked to be writable.
    fn places(&self, scene: &Path, tasks: &Tasks) -> Result<(PathBuf, PathBuf, Vec<String>), Failure> {
        let image = default_image(scene);
        let jobs = image.with_extension("jobs");
        let image = match tasks {
            Tasks::Shards(_) => image,
            Tasks::Frames(_) => image.with_extension("####.png"),
        };
        let images = if self.output.is_empty() { vec![image] } else { self.output.clone() };
        let images = images.iter().map(|image| absolute(image)).collect::<Result<Vec<_>, _>>()?;
        check_outputs(&images, tasks)?;
        let (here, folder) = (absolute(Path::new("."))?, absolute(self.folder.as_ref().unwrap_or(&jobs))?);
        let leads_up = |file: &Path| file.components().any(|part| part == Component::ParentDir);
        let lies_here = |file: &Path| file.starts_with(&here) && !leads_up(file);
        let is_here = lies_here(scene) && lies_here(&folder) && images.iter().all(|image| lies_here(image));
        if self.engine == Engine::Kubernetes && !is_here {
            let here = here.display();
            return Err(Failure::command_line(format!(
                "for kubernetes scene, parts and image must lie in {here}, which the volume holds"
            )));
        }
        let images = images.iter().map(|image| image.to_string_lossy().into_owned()).collect();
        Ok((here, folder, images))
    }
}

fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    std::path::absolute(path).map_err(|error| Failure::command_line(format!("{}: {error}", path.display())))
}

/// Returns the name of a job, made of the scene's name in characters that all engines accept.
fn job_name(scene: &Path) -> String {
    let stem = scene.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().to_lowercase());
    let letter = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
    let name: String = stem.chars().map(letter).take(40).collect();
    format!("rayfront-{}", name.trim_matches('-'))
}

impl<'a> Jobs<'a> {
    /// Prepares the jobs. Refuses whatever would keep the parts from being rendered.
    fn new(plan: &'a PlanArguments) -> Result<Self, Failure> {
        let scene = absolute(&plan.scene)?;
        plan.check_names()?;
        let arguments = plan.arguments()?;
        // The limits of the tasks apply to planning, too.
        arguments.limits.set();
        let tasks = Tasks::of(plan.shards, arguments.render.frames_of_scene()?)?;
        let tasks_merge = matches!(tasks, Tasks::Shards(_));
        let (here, folder, images) = plan.places(&scene, &tasks)?;
        let first = match &tasks {
            Tasks::Shards(_) => None,
            Tasks::Frames(frames) => frames.numbers().next(),
        };
        let (job, resources) = Resources::of(plan, &scene, first, &arguments.render)?;
        let settings = &job.header.settings;
        let samples = settings.samples;
        if let Tasks::Shards(shards) = tasks
            && (0..shards).any(|index| SampleRanges::shard(samples, index, shards).is_empty())
        {
            return Err(Failure::command_line(format!(
                "--shards {shards}: there are {samples} samples: see --spp"
            )));
        }
        let has_pilot = match (settings.adaptive, &tasks) {
            (Adaptive::On, Tasks::Shards(_)) => {
                let reason = "adaptive samples that are chosen in rounds are in one film";
                return Err(Failure::command_line(format!(
                    "--shards: {reason}: add --adaptive=unbiased or --adaptive=off behind --"
                )));
            }
            (adaptive, Tasks::Shards(_)) => adaptive == Adaptive::Unbiased,
            (_, Tasks::Frames(_)) => false,
        };
        let (work, look) = (&arguments.render.run.work, &arguments.render.run.look);
        Ok(Self {
            plan,
            tasks,
            options: of_tasks(plan, &arguments.render, &resources, tasks_merge),
            resources,
            options_say_progress: work.quiet || look.progress.is_some(),
            of_merge: if tasks_merge { of_merge(&arguments, &resources) } else { CommandLine::default() },
            has_pilot,
            program: plan.program(),
            scene: scene.to_string_lossy().into_owned(),
            folder,
            here,
            images,
            name: job_name(&scene),
        })
    }

    fn path(&self, name: &str) -> String {
        self.folder.join(name).to_string_lossy().into_owned()
    }

    /// Returns the command line that every task begins with.
    fn command(&self) -> CommandLine {
        let mut line = CommandLine::of([&self.program, &self.scene]);
        line.extend(&self.options);
        if !self.options_say_progress {
            let form = match self.plan.engine {
                Engine::Openjd => ProgressForm::Openjd,
                _ => ProgressForm::Lines,
            };
            line.option("progress", Some(name_of(PROGRESS_FORMS, &form)));
        }
        line.option("pilot", self.has_pilot.then(|| self.path("pilot.film")));
        line
    }

    /// Returns the command that renders the pilot; if it fails, every part renders one for itself.
    fn pilot(&self) -> CommandLine {
        let mut line = self.command();
        line.switch("pilot-only", true);
        line
    }

    /// Returns the command that renders a part.
    fn render(&self, shard: &str, film: &str) -> CommandLine {
        let mut line = self.command();
        line.push(["--shard", shard, "-o", film]);
        line
    }

    /// Returns the command that renders frames.
    fn render_frames(&self, frames: &str) -> CommandLine {
        let mut line = self.command();
        line.push(["--frames", frames]);
        self.images.iter().for_each(|image| line.push(["-o", image]));
        line
    }

    /// Returns the command of any task of an array, which takes its number from the scheduler.
    fn render_any(&self) -> CommandLine {
        match &self.tasks {
            Tasks::Shards(count) => self.render(&format!("auto/{count}"), &self.path("part-{shard}.film")),
            Tasks::Frames(frames) => self.render_frames(&format!("auto/{frames}")),
        }
    }

    /// The number of tasks.
    fn count(&self) -> u32 {
        match &self.tasks {
            Tasks::Shards(count) => *count,
            Tasks::Frames(frames) => frames.numbers().count() as u32,
        }
    }

    fn merges(&self) -> bool {
        matches!(self.tasks, Tasks::Shards(_))
    }

    /// Returns the command that merges all parts that exist, so that the merge can report what is missing. It refuses
    /// parts from before the scene was changed.
    fn merge(&self) -> CommandLine {
        let folder = self.folder.to_string_lossy();
        let mut line = CommandLine::of([&self.program, "merge", &folder, "--current"]);
        line.push(["--scene-file", &self.scene]);
        self.images.iter().for_each(|image| line.push(["-o", image]));
        line.extend(&self.of_merge);
        line
    }

    fn last(&self) -> u32 {
        self.count().saturating_sub(1)
    }
}

/// Refuses images that cannot be written.
fn check_outputs(images: &[PathBuf], tasks: &Tasks) -> Result<(), Failure> {
    let mut outputs = Outputs::of(images)?;
    if let Tasks::Frames(frames) = tasks {
        let first = frames.numbers().next().unwrap_or_default();
        outputs = frames::named(&outputs, first, frames.numbers().count() > 1)?;
    }
    outputs.images.iter().try_for_each(|image| supported(image))?;
    Ok(outputs.film.iter().try_for_each(|film| film_file::writable(film))?)
}

/// Returns the options of a task, without those that every task gets anyway and those for the whole image.
fn of_tasks(plan: &PlanArguments, render: &Render, resources: &Resources, merges: bool) -> CommandLine {
    let mut line = CommandLine::parse(&plan.options).without("frames env threads");
    if merges {
        line = line.without("bits denoise");
    }
    // The path of an environment image is absolute, so that tasks find it wherever they run.
    line.surroundings(render.model.env.as_ref());
    line.option("threads", resources.cores);
    line
}

/// Returns the options of the merge, which apply to the image of all parts.
fn of_merge(TaskArguments { render, limits }: &TaskArguments, resources: &Resources) -> CommandLine {
    let mut line = CommandLine::default();
    line.switch("denoise", render.output.denoise);
    line.option("bits", Some(render.output.bits).filter(|bits| *bits != 8));
    line.option("threads", resources.cores);
    // The merge reads the scene again: it gets the access to files and the memory limit of the tasks.
    let picture = matches!(render.model.env, Some(EnvironmentPreset::Picture(_)));
    line.switch("allow-outside", limits.allow_outside || picture);
    line.option("memory", limits.memory);
    line
}
