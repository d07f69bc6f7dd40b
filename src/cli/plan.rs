//! `rayfront plan SCENE`: job files for engines that there are, which render a scene in parts and put these
//! together.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Parser, ValueEnum};
use serde_json::{Value, json};

use super::args::Arguments;
use super::command_line::quoted;
use super::{Failure, output};
use crate::film::SampleRanges;

/// `rayfront plan`.
#[derive(Args, Debug)]
pub struct Plan {
    /// The scene
    pub scene: PathBuf,
    /// How many parts
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub shards: u32,
    /// For which engine
    #[arg(long = "for", value_name = "ENGINE", value_enum)]
    pub engine: Engine,
    /// Where the image goes, may be given several times [default: the scene's name with .png, here]
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Where the job files and the parts go [default: the scene's name with .jobs, here]
    #[arg(long, value_name = "FOLDER")]
    pub folder: Option<PathBuf>,
    /// What the engine is to start [default: this program; for kubernetes: rayfront]
    #[arg(long, value_name = "FILE")]
    pub program: Option<String>,
    /// For kubernetes: the container's image
    #[arg(long, value_name = "NAME", default_value = concat!("rayfront:", env!("CARGO_PKG_VERSION")))]
    pub image: String,
    /// For kubernetes: the claim of the volume that holds this folder, with scene, parts and image in it
    #[arg(long, value_name = "NAME", default_value = "rayfront")]
    pub volume: String,
    /// Options of the rendering, behind --, such as -- --spp 1024
    #[arg(last = true, value_name = "OPTIONS")]
    pub options: Vec<String>,
}

/// What runs the jobs.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// An array and a merge that waits for its end
    Slurm,
    /// A template of Open Job Description, which render farms take, such as AWS Deadline Cloud
    Openjd,
    /// An array of HyperQueue
    Hyperqueue,
    /// An indexed job and a merge
    Kubernetes,
    /// One command a line, for xargs, GNU parallel, hq submit --each-line or cuecmd
    Commands,
}

/// What all engines are told.
struct Jobs<'a> {
    plan: &'a Plan,
    program: String,
    scene: String,
    folder: PathBuf,
    images: Vec<String>,
    /// Where all that is.
    here: PathBuf,
    /// The scene's name, in letters that all engines take for a job's.
    name: String,
}

/// A file and what is in it.
type JobFile = (&'static str, String);

pub(super) fn run(plan: &Plan) -> Result<ExitCode, Failure> {
    let jobs = Jobs::new(plan)?;
    let files = match plan.engine {
        Engine::Slurm => jobs.slurm(),
        Engine::Openjd => vec![("template.json", jobs.openjd())],
        Engine::Hyperqueue => vec![("submit.sh", jobs.hyperqueue())],
        Engine::Kubernetes => jobs.kubernetes(),
        Engine::Commands => jobs.commands(),
    };
    let folder = jobs.folder.display();
    let failed = |error: std::io::Error| Failure(format!("{folder}: cannot write: {error}"));
    std::fs::create_dir_all(&jobs.folder).map_err(failed)?;
    for (name, content) in &files {
        std::fs::write(jobs.folder.join(name), content).map_err(failed)?;
    }
    print!("{}", jobs.what_to_do());
    Ok(ExitCode::SUCCESS)
}

impl<'a> Jobs<'a> {
    /// Refuses what no part could be rendered by.
    fn new(plan: &'a Plan) -> Result<Self, Failure> {
        let absolute = |path: &Path| {
            std::path::absolute(path).map_err(|error| Failure(format!("{}: {error}", path.display())))
        };
        let scene = absolute(&plan.scene)?;
        // What is wrong with the options shows now, not in every part.
        let command = ["rayfront".into(), plan.scene.to_string_lossy().into_owned()];
        let arguments = Arguments::try_parse_from(command.iter().chain(&plan.options)).map_err(|error| {
            Failure(error.to_string().trim_start_matches("error: ").trim_end().to_owned())
        })?;
        if arguments.command.is_some() || !arguments.render.output.output.is_empty() {
            return Err(Failure("where things go is said with --output and --folder, before --".into()));
        }
        let mut world = crate::formats::load_with(&scene, &(&arguments.render.model).into())?;
        arguments.render.apply(&mut world.settings);
        let samples = world.settings.samples;
        if (0..plan.shards).any(|index| SampleRanges::shard(samples, index, plan.shards).is_empty()) {
            return Err(Failure(format!("--shards {}: there are {samples} samples: see --spp", plan.shards)));
        }
        let program = match &plan.program {
            Some(program) => program.clone(),
            None if plan.engine == Engine::Kubernetes => "rayfront".into(),
            None => {
                std::env::current_exe().map_or("rayfront".into(), |path| path.to_string_lossy().into_owned())
            }
        };
        let stem = scene.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().to_lowercase());
        let letter = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
        let name: String = stem.chars().map(letter).take(40).collect();
        let folder =
            plan.folder.clone().unwrap_or_else(|| output::default_image(&scene).with_extension("jobs"));
        let images =
            if plan.output.is_empty() { vec![output::default_image(&scene)] } else { plan.output.clone() };
        let here = absolute(Path::new("."))?;
        let files = [scene.clone(), absolute(&folder)?];
        if plan.engine == Engine::Kubernetes && files.iter().any(|file| !file.starts_with(&here)) {
            let here = here.display();
            return Err(Failure(format!(
                "for kubernetes scene and parts must lie in {here}, which the volume holds"
            )));
        }
        let images: Result<Vec<_>, _> = images.iter().map(|image| absolute(image)).collect();
        let images = images?.iter().map(|image| image.to_string_lossy().into_owned()).collect();
        Ok(Self {
            plan,
            program,
            scene: scene.to_string_lossy().into_owned(),
            folder: absolute(&folder)?,
            here,
            images,
            name: format!("rayfront-{}", name.trim_matches('-')),
        })
    }

    fn path(&self, name: &str) -> String {
        self.folder.join(name).to_string_lossy().into_owned()
    }

    /// The words that render a part.
    fn render(&self, shard: &str, film: &str) -> Vec<String> {
        let mut words = vec![self.program.clone(), self.scene.clone()];
        words.extend(self.plan.options.iter().cloned());
        words.extend(["--shard", shard, "--quiet", "-o", film].map(String::from));
        words
    }

    /// The same for any part of an array.
    fn render_any(&self) -> Vec<String> {
        self.render(&format!("auto/{}", self.plan.shards), &self.path("part-{shard}.film"))
    }

    /// What puts the parts together, as a shell takes it: all that are there, so that it says what is missing.
    fn merge(&self) -> String {
        let folder = quoted(&self.folder.to_string_lossy());
        let images = self.images.iter().map(|image| format!(" -o {}", quoted(image)));
        format!("{} merge {folder}/part-*.film{}", quoted(&self.program), images.collect::<String>())
    }

    fn last(&self) -> u32 {
        self.plan.shards - 1
    }

    fn slurm(&self) -> Vec<JobFile> {
        let (name, last, merge) = (&self.name, self.last(), self.merge());
        let [log, merge_log] = ["part-%a.log", "merge.log"].map(|log| quoted(&self.path(log)));
        let [render_file, merge_file] =
            ["render.sbatch", "merge.sbatch"].map(|file| quoted(&self.path(file)));
        let render = line(&self.render_any());
        // The signal goes to the program, which takes the shell's place: it saves what it has and, queued again,
        // goes on with it.
        let array = format!(
            "#!/bin/sh\n#SBATCH --job-name={name}\n#SBATCH --array=0-{last}\n#SBATCH --output={log}\n\
             #SBATCH --signal=B:TERM@30\n#SBATCH --requeue\nexec {render}\n"
        );
        let merge = format!(
            "#!/bin/sh\n#SBATCH --job-name={name}-merge\n#SBATCH --output={merge_log}\nexec {merge}\n"
        );
        // After any end of the parts: the merge itself says what is missing.
        let submit = format!(
            "#!/bin/sh\nset -e\nparts=$(sbatch --parsable {render_file})\n\
             sbatch --parsable --dependency=afterany:\"$parts\" {merge_file}\n"
        );
        vec![("render.sbatch", array), ("merge.sbatch", merge), ("submit.sh", submit)]
    }

    fn commands(&self) -> Vec<JobFile> {
        let parts = (0..self.plan.shards).map(|index| {
            let shard = format!("{index}/{}", self.plan.shards);
            line(&self.render(&shard, &self.path(&format!("part-{index}.film")))) + "\n"
        });
        vec![("parts.txt", parts.collect()), ("merge.sh", format!("#!/bin/sh\nexec {}\n", self.merge()))]
    }

    fn hyperqueue(&self) -> String {
        let (name, last, merge) = (&self.name, self.last(), quoted(&self.merge()));
        let render = line(&self.render_any());
        let log = quoted(&self.path("part-%{TASK_ID}.log"));
        format!(
            "#!/bin/sh\n# Waits for the parts; the merge says what is missing, if anything.\n\
             hq submit --name {name} --array 0-{last} --stdout none --stderr {log} --wait -- {render}\n\
             hq submit --name {name}-merge --wait -- sh -c {merge}\n"
        )
    }

    /// (Open Job Description 2023-09.)
    fn openjd(&self) -> String {
        let parameter = |name: &str, value: &str, description: &str| json!({ "name": name, "type": "STRING", "default": value, "description": description });
        let words = self.render(
            &format!("{{{{Task.Param.Shard}}}}/{}", self.plan.shards),
            "{{Param.Folder}}/part-{{Task.Param.Shard}}.film",
        );
        let mut render: Vec<Value> = words[2..].iter().map(|word| json!(word)).collect();
        render.insert(0, json!("{{Param.Scene}}"));
        let images = self.images.iter().map(|image| format!(" -o {}", quoted(image)));
        let merge = format!(
            "\"{{{{Param.Program}}}}\" merge \"{{{{Param.Folder}}}}\"/part-*.film{}",
            images.collect::<String>()
        );
        let template = json!({
            "specificationVersion": "jobtemplate-2023-09",
            "name": self.name,
            "parameterDefinitions": [
                parameter("Program", &self.program, "What renders"),
                parameter("Scene", &self.scene, "What is rendered"),
                parameter("Folder", &self.folder.to_string_lossy(), "Where the parts go: shared by all workers"),
            ],
            "steps": [
                {
                    "name": "Render",
                    "parameterSpace": { "taskParameterDefinitions": [
                        { "name": "Shard", "type": "INT", "range": format!("0-{}", self.last()) },
                    ]},
                    "script": { "actions": { "onRun": {
                        "command": "{{Param.Program}}", "args": render,
                        // Told to end, it saves what it has.
                        "cancelation": { "mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": 30 },
                    }}},
                },
                {
                    "name": "Merge",
                    "dependencies": [{ "dependsOn": "Render" }],
                    "script": { "actions": { "onRun": { "command": "sh", "args": ["-c", merge] } } },
                },
            ],
        });
        serde_json::to_string_pretty(&template).unwrap_or_default() + "\n"
    }

    fn kubernetes(&self) -> Vec<JobFile> {
        let Self { name, here, .. } = self;
        let Plan { image, volume, shards, .. } = self.plan;
        let string = |text: &str| Value::from(text).to_string();
        let list = |words: &[String]| Value::from(words.to_vec()).to_string();
        let here = string(&here.to_string_lossy());
        let job = |name: &str, array: &str, command: &str| {
            format!(
                "apiVersion: batch/v1\nkind: Job\nmetadata:\n  name: {name}\nspec:\n{array}  template:\n    spec:\n      \
                 restartPolicy: {restart}\n      containers:\n        - name: rayfront\n          image: {image}\n          \
                 command: {command}\n          volumeMounts:\n            - {{ name: files, mountPath: {here} }}\n      volumes:\n        - name: files\n          \
                 persistentVolumeClaim: {{ claimName: {volume} }}\n",
                restart = if array.is_empty() { "OnFailure" } else { "Never" },
                image = string(image),
                volume = string(volume),
            )
        };
        let array = format!(
            "  completionMode: Indexed\n  completions: {shards}\n  parallelism: {shards}\n  backoffLimitPerIndex: 3\n  maxFailedIndexes: {shards}\n"
        );
        let merge = ["sh".to_owned(), "-c".to_owned(), self.merge()];
        vec![
            ("render.yaml", job(name, &array, &list(&self.render_any()))),
            ("merge.yaml", job(&format!("{name}-merge"), "", &list(&merge))),
        ]
    }

    /// What to type next.
    fn what_to_do(&self) -> String {
        let file = |name: &str| quoted(&self.path(name));
        match self.plan.engine {
            Engine::Slurm | Engine::Hyperqueue => format!("to submit: sh {}\n", file("submit.sh")),
            Engine::Openjd => format!(
                "to check: openjd check {template}\nto run here: openjd run {template} --step Merge --run-dependencies\n",
                template = file("template.json")
            ),
            Engine::Kubernetes => format!(
                "to submit: kubectl apply -f {render}\nthen: kubectl wait --for=condition=complete --timeout=-1s job/{name} && kubectl apply -f {merge}\n",
                render = file("render.yaml"),
                name = self.name,
                merge = file("merge.yaml"),
            ),
            Engine::Commands => format!(
                "to run: xargs -P 2 -d '\\n' -I {{}} sh -c {{}} < {}\nthen: sh {}\n",
                file("parts.txt"),
                file("merge.sh")
            ),
        }
    }
}

fn line(words: &[String]) -> String {
    let words: Vec<_> = words.iter().map(|word| quoted(word)).collect();
    words.join(" ")
}
