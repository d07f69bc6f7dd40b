//! `rayfront plan SCENE`: writes job files for existing engines, which render a scene in parts and merge them, or
//! render the frames of an animation.

mod engines;
mod resources;

use std::path::{Component, Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Parser, ValueEnum};

use super::args::{Arguments, Render, Words};
use super::command_line::{self, shell_line};
use super::frames::{self, Frames};
use super::job::Job;
use super::job_args::{Outputs, parse_duration};
use super::progress::ProgressForm;
use super::{Failure, output};
use crate::error::in_one_line;
use crate::files::links;
use crate::film::SampleRanges;
use crate::formats::picture::supported;
use crate::formats::{EnvironmentPreset, film_file};
use crate::world::Adaptive;
use resources::Resources;

/// `rayfront plan`.
#[derive(Args, Debug)]
pub struct PlanArguments {
    /// The scene
    pub scene: PathBuf,
    /// Number of parts of the samples; with -- --frames there is one task per frame instead
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub shards: Option<u32>,
    /// Engine that runs the jobs
    #[arg(long = "for", value_name = "ENGINE", value_enum)]
    pub engine: Engine,
    /// File for the image; may be given several times [default: the scene's name with .png, in the current folder; for
    /// frames with .####.png]
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Folder for the job files and the parts [default: the scene's name with .jobs, in the current folder]
    #[arg(long, value_name = "FOLDER")]
    pub folder: Option<PathBuf>,
    /// Program that the engine starts [default: this program; for kubernetes: rayfront]
    #[arg(long, value_name = "FILE")]
    pub program: Option<String>,
    /// Cores of each task [default: --threads after --; else, for slurm, hyperqueue and kubernetes, those of this
    /// machine, but at most 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub cores: Option<u32>,
    /// Longest time of each task, such as 2h, after which the engine ends it
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    pub time_limit: Option<Duration>,
    /// For kubernetes: the container's image
    #[arg(long, value_name = "NAME", default_value = concat!("rayfront:", env!("CARGO_PKG_VERSION")))]
    pub image: String,
    /// For kubernetes: the claim of the volume that holds the current folder, including scene, parts and image
    #[arg(long, value_name = "NAME", default_value = "rayfront")]
    pub volume: String,
    /// Options of the render, after --, such as -- --spp 1024
    #[arg(last = true, value_name = "OPTIONS")]
    pub options: Vec<String>,
}

/// The engine that runs the jobs.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// An array, and a merge that waits for its end
    Slurm,
    /// A template of Open Job Description, for render farms such as AWS Deadline Cloud
    Openjd,
    /// An array of HyperQueue
    Hyperqueue,
    /// An indexed job and a merge
    Kubernetes,
    /// One command per line, for xargs, GNU parallel, hq submit --each-line or cuecmd
    Commands,
}

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
    options: Vec<String>,
    /// The resources of a task.
    resources: Resources,
    /// True if the options select the form of progress reports, or none.
    options_say_progress: bool,
    /// The options of the merge.
    of_merge: Vec<String>,
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

pub(super) fn run(plan: &PlanArguments) -> Result<ExitCode, Failure> {
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
    /// Refuses names with control characters, which would end lines of job files.
    fn check_names(&self) -> Result<(), Failure> {
        let is_odd = |path: &&PathBuf| path.to_string_lossy().chars().any(char::is_control);
        let mut names = [&self.scene].into_iter().chain(&self.folder).chain(&self.output);
        names.find(is_odd).map_or(Ok(()), |path| {
            let path = in_one_line(&path.to_string_lossy());
            Err(Failure::command_line(format!("{path}: job files cannot hold such a name: rename it")))
        })
    }

    /// Parses the options of the tasks. Errors in them appear now, not in every part.
    fn arguments(&self) -> Result<Arguments, Failure> {
        let command = ["rayfront".into(), self.scene.to_string_lossy().into_owned()];
        let arguments = Arguments::try_parse_from(command.iter().chain(&self.options)).map_err(|error| {
            Failure::command_line(error.to_string().trim_start_matches("error: ").trim_end().to_owned())
        })?;
        if arguments.command.is_some() || !arguments.render.output.output.is_empty() {
            return Err(Failure::command_line(
                "where things go is said with --output and --folder, before --",
            ));
        }
        let part = &arguments.render.part;
        if part.shard.is_some() || part.samples.is_some() || part.pilot.is_some() {
            return Err(Failure::command_line(
                "--shard, --samples and --pilot are what every task gets: leave them out behind --",
            ));
        }
        Ok(arguments)
    }

    /// Returns the program that the engine starts.
    fn program(&self) -> String {
        match &self.program {
            Some(program) => program.clone(),
            None if self.engine == Engine::Kubernetes => "rayfront".into(),
            None => {
                std::env::current_exe().map_or("rayfront".into(), |path| path.to_string_lossy().into_owned())
            }
        }
    }

    /// Returns the current folder, the folder of the jobs, and the images, which are checked to be writable.
    fn places(&self, scene: &Path, tasks: &Tasks) -> Result<(PathBuf, PathBuf, Vec<String>), Failure> {
        let image = output::default_image(scene);
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
        let tasks = Tasks::of(plan.shards, arguments.render.frames.frames.clone())?;
        let tasks_merge = matches!(tasks, Tasks::Shards(_));
        let (here, folder, images) = plan.places(&scene, &tasks)?;
        let time_s = match &tasks {
            Tasks::Shards(_) => arguments.render.model.time,
            Tasks::Frames(frames) => {
                frames.numbers().next().map(|frame| frame as f32 / arguments.render.frames.fps)
            }
        };
        let (job, resources) = Resources::of(plan, &scene, time_s, &arguments.render)?;
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
        let Render { work, look, .. } = &arguments.render;
        Ok(Self {
            plan,
            tasks,
            options: of_tasks(plan, &arguments.render, &resources, tasks_merge),
            resources,
            options_say_progress: work.quiet || look.progress.is_some(),
            of_merge: if tasks_merge { of_merge(&arguments, &resources) } else { Vec::new() },
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

    /// Returns the words that every task begins with.
    fn command(&self) -> Vec<String> {
        let mut words = vec![self.program.clone(), self.scene.clone()];
        words.extend(self.options.iter().cloned());
        if !self.options_say_progress {
            let form = match self.plan.engine {
                Engine::Openjd => ProgressForm::Openjd,
                _ => ProgressForm::Lines,
            };
            words.extend(["--progress".to_owned(), form.name()]);
        }
        if self.has_pilot {
            words.extend(["--pilot".to_owned(), self.path("pilot.film")]);
        }
        words
    }

    /// Returns the words that render the pilot; if it fails, every part renders one for itself.
    fn pilot(&self) -> Vec<String> {
        let mut words = self.command();
        words.push("--pilot-only".to_owned());
        words
    }

    /// Returns the words that render a part.
    fn render(&self, shard: &str, film: &str) -> Vec<String> {
        let mut words = self.command();
        words.extend(["--shard", shard, "-o", film].map(String::from));
        words
    }

    /// Returns the words that render frames.
    fn render_frames(&self, frames: &str) -> Vec<String> {
        let mut words = self.command();
        words.extend(["--frames", frames].map(String::from));
        words.extend(self.images.iter().flat_map(|image| ["-o".to_owned(), image.clone()]));
        words
    }

    /// Returns the words of any task of an array, which takes its number from the scheduler.
    fn render_any(&self) -> Vec<String> {
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

    /// Returns the words that merge all parts that exist, so that the merge can report what is missing. It refuses
    /// parts from before the scene was changed.
    fn merge_words(&self) -> Vec<String> {
        let folder = self.folder.to_string_lossy().into_owned();
        let mut words = vec![self.program.clone(), "merge".into(), folder, "--current".into()];
        words.extend(["--scene-file".to_owned(), self.scene.clone()]);
        words.extend(self.images.iter().flat_map(|image| ["-o".to_owned(), image.clone()]));
        words.extend(self.of_merge.iter().cloned());
        words
    }

    /// Returns the command of the merge for a shell.
    fn merge(&self) -> String {
        shell_line(&self.merge_words())
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
fn of_tasks(plan: &PlanArguments, render: &Render, resources: &Resources, merges: bool) -> Vec<String> {
    let mut options = command_line::recorded(plan.options.clone());
    options.retain(|word| !merges || word != "--denoise");
    let others = ["--frames", "--env", "--threads", "--bits"];
    options = command_line::without(&options, &others[..if merges { 4 } else { 3 }]);
    let mut more = Words::default();
    // The path of an environment image is absolute, so that tasks find it wherever they run.
    more.surroundings(render.model.env.as_ref());
    more.option("--threads", resources.cores);
    options.extend(more);
    options
}

/// Returns the options of the merge, which apply to the image of all parts.
fn of_merge(arguments: &Arguments, resources: &Resources) -> Vec<String> {
    let output = &arguments.render.output;
    let mut words = Vec::new();
    if output.denoise {
        words.push("--denoise".to_owned());
    }
    if output.bits != 8 {
        words.extend(["--bits".to_owned(), output.bits.to_string()]);
    }
    if let Some(cores) = resources.cores {
        words.extend(["--threads".to_owned(), cores.to_string()]);
    }
    // The merge reads the scene again: it gets the access to files and the memory limit of the tasks.
    let picture = matches!(arguments.render.model.env, Some(EnvironmentPreset::Picture(_)));
    if arguments.limits.allow_outside || picture {
        words.push("--allow-outside".to_owned());
    }
    if let Some(bytes) = arguments.limits.memory {
        words.extend(["--memory".to_owned(), bytes.to_string()]);
    }
    words
}
