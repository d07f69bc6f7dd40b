//! The job files of each engine, and the commands that submit them.

use serde_json::{Value, json};

use super::arguments::{Engine, PlanArguments};
use super::{JobFile, Jobs, Tasks};
use crate::cli::command_line::{CommandLine, quoted};

impl Jobs<'_> {
    pub(super) fn slurm(&self) -> Vec<JobFile> {
        let (name, last) = (&self.name, self.last());
        let [render_file, merge_file] =
            ["render.sbatch", "merge.sbatch"].map(|file| quoted(&self.path(file)));
        let script = |name: &str, log: &str, more: &str, command: &CommandLine| {
            let (log, resources) = (quoted(&self.path(log)), self.resources.slurm());
            format!(
                "#!/bin/sh\n#SBATCH --job-name={name}\n#SBATCH --output={log}\n{resources}{more}exec {command}\n"
            )
        };
        // The signal goes to the program, which replaces the shell: it saves its film and, when it is requeued,
        // continues it.
        let more = format!("#SBATCH --array=0-{last}\n#SBATCH --signal=B:TERM@30\n#SBATCH --requeue\n");
        let array = script(name, "part-%a.log", &more, &self.render_any());
        if !self.merges() {
            return vec![
                ("render.sbatch", array),
                ("submit.sh", format!("#!/bin/sh\nexec sbatch --parsable {render_file}\n")),
            ];
        }
        let merge = script(&format!("{name}-merge"), "merge.log", "", &self.merge());
        let mut files = vec![("render.sbatch", array), ("merge.sbatch", merge)];
        let (mut before, mut after) = (String::new(), "");
        if self.has_pilot {
            files.push(("pilot.sbatch", script(&format!("{name}-pilot"), "pilot.log", "", &self.pilot())));
            let file = quoted(&self.path("pilot.sbatch"));
            (before, after) =
                (format!("pilot=$(sbatch --parsable {file})\n"), "--dependency=afterany:\"$pilot\" ");
        }
        // The merge runs however the parts end: it reports what is missing.
        let submit = format!(
            "#!/bin/sh\nset -e\n{before}parts=$(sbatch --parsable {after}{render_file})\n\
             sbatch --parsable --dependency=afterany:\"$parts\" {merge_file}\n"
        );
        files.push(("submit.sh", submit));
        files
    }

    pub(super) fn commands(&self) -> Vec<JobFile> {
        let part = |index: u32, count: u32| {
            self.render(&format!("{index}/{count}"), &self.path(&format!("part-{index}.film")))
        };
        let commands: Vec<CommandLine> = match &self.tasks {
            Tasks::Shards(count) => (0..*count).map(|index| part(index, *count)).collect(),
            Tasks::Frames(frames) => {
                frames.numbers().map(|frame| self.render_frames(&format!("{frame}/{frames}"))).collect()
            }
        };
        let mut files = vec![("parts.txt", commands.iter().map(|line| format!("{line}\n")).collect())];
        if self.has_pilot {
            files.push(("pilot.sh", format!("#!/bin/sh\nexec {}\n", self.pilot())));
        }
        if self.merges() {
            files.push(("merge.sh", format!("#!/bin/sh\nexec {}\n", self.merge())));
        }
        files
    }

    pub(super) fn hyperqueue(&self) -> String {
        let (name, last, merge) = (&self.name, self.last(), quoted(&self.merge().to_string()));
        let (render, resources) = (self.render_any(), self.resources.hyperqueue());
        let log = quoted(&self.path("part-%{TASK_ID}.log"));
        let array = format!(
            "hq submit --name {name} --array 0-{last} {resources} --stdout none --stderr {log} --wait -- {render}\n"
        );
        let pilot = match self.has_pilot {
            true => {
                let (pilot, log) = (self.pilot(), quoted(&self.path("pilot.log")));
                format!(
                    "hq submit --name {name}-pilot {resources} --stdout none --stderr {log} --wait -- {pilot}\n"
                )
            }
            false => String::new(),
        };
        match self.merges() {
            false => format!("#!/bin/sh\n{array}"),
            true => format!(
                "#!/bin/sh\n# Waits for the parts; the merge says what is missing, if anything.\n{pilot}{array}\
                 hq submit --name {name}-merge {resources} --wait -- sh -c {merge}\n"
            ),
        }
    }

    /// Returns a template of Open Job Description 2023-09. Paths are parameters of their own, so that farms can map
    /// them; one that may lie anywhere can have no default.
    pub(super) fn openjd(&self) -> String {
        let farm = self.with_parameters();
        // The words that render a task, by its number.
        let (name, range, render) = match &self.tasks {
            Tasks::Shards(count) => {
                let film = farm.path("part-{{Task.Param.Shard}}.film");
                let words = farm.render(&format!("{{{{Task.Param.Shard}}}}/{count}"), &film);
                ("Shard", format!("0-{}", self.last()), words)
            }
            Tasks::Frames(frames) => {
                let words = farm.render_frames(&format!("{{{{Task.Param.Frame}}}}/{frames}"));
                ("Frame", frames.to_string().replace('x', ":"), words)
            }
        };
        let run = |line: &CommandLine| {
            let words = line.words();
            let mut run = json!({ "command": words[0], "args": words[1..] });
            if let Some(seconds) = self.resources.seconds {
                run["timeout"] = json!(seconds);
            }
            run
        };
        let step = |name: &str, run: Value, after: Option<&str>| {
            let mut amounts =
                vec![json!({ "name": "amount.worker.memory", "min": self.resources.mebibytes })];
            amounts.extend(self.resources.cores.map(|n| json!({ "name": "amount.worker.vcpu", "min": n })));
            let mut step = json!({
                "name": name,
                "hostRequirements": { "amounts": amounts },
                "script": { "actions": { "onRun": run } },
            });
            if let Some(after) = after {
                step["dependencies"] = json!([{ "dependsOn": after }]);
            }
            step
        };
        let mut steps = Vec::new();
        if self.has_pilot {
            steps.push(step("Pilot", run(&farm.pilot()), None));
        }
        let mut render = step("Render", run(&render), self.has_pilot.then_some("Pilot"));
        // When cancelled, it saves its film.
        render["script"]["actions"]["onRun"]["cancelation"] =
            json!({ "mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": 30 });
        render["parameterSpace"] =
            json!({ "taskParameterDefinitions": [{ "name": name, "type": "INT", "range": range }] });
        steps.push(render);
        if self.merges() {
            steps.push(step("Merge", run(&farm.merge()), Some("Render")));
        }
        let template = json!({
            "specificationVersion": "jobtemplate-2023-09",
            "name": self.name,
            "parameterDefinitions": self.parameters(),
            "steps": steps,
        });
        serde_json::to_string_pretty(&template).unwrap_or_default() + "\n"
    }

    /// Returns these jobs with parameters of a template in place of paths.
    fn with_parameters(&self) -> Self {
        let parameter = |name: &str| format!("{{{{Param.{name}}}}}");
        let images = self.images.iter().enumerate().map(|(number, _)| parameter(&image_name(number)));
        Jobs {
            program: parameter("Program"),
            scene: parameter("Scene"),
            folder: parameter("Folder").into(),
            images: images.collect(),
            ..self.clone()
        }
    }

    /// Returns the definitions of the parameters.
    fn parameters(&self) -> Vec<Value> {
        let path = |name: &str, kind: &str, flow: &str, description: &str| json!({ "name": name, "type": "PATH", "objectType": kind, "dataFlow": flow, "description": description });
        let mut all = vec![
            json!({ "name": "Program", "type": "STRING", "default": self.program, "description": "What renders" }),
            path("Scene", "FILE", "IN", "What is rendered"),
        ];
        let images = (0..self.images.len()).map(image_name);
        all.extend(images.map(|name| path(&name, "FILE", "OUT", "Where the image goes")));
        if self.merges() {
            let mut folder =
                path("Folder", "DIRECTORY", "INOUT", "Where the parts go: shared by all workers");
            // The template's own folder.
            folder["default"] = json!(".");
            all.push(folder);
        }
        all
    }

    /// Returns the values of parameters without a default, in the form that `openjd` takes.
    fn values(&self) -> String {
        let images = self.images.iter().enumerate().map(|(number, image)| (image_name(number), image));
        let all = std::iter::once(("Scene".to_owned(), &self.scene)).chain(images);
        all.map(|(name, value)| format!(" -p {}", quoted(&format!("{name}={value}")))).collect()
    }

    pub(super) fn kubernetes(&self) -> Vec<JobFile> {
        let Self { name, here, .. } = self;
        let (PlanArguments { image, volume, .. }, count) = (self.plan, self.count());
        let string = |text: &str| Value::from(text).to_string();
        let list = |line: &CommandLine| Value::from(line.words()).to_string();
        let here = string(&here.to_string_lossy());
        let job = |name: &str, array: &str, command: &str| {
            let resources = &self.resources;
            let cores = resources.cores.map_or(String::new(), |cores| format!("cpu: \"{cores}\", "));
            let memory = resources.mebibytes;
            let time = resources.seconds;
            let time =
                time.map_or(String::new(), |seconds| format!("      activeDeadlineSeconds: {seconds}\n"));
            format!(
                "apiVersion: batch/v1\nkind: Job\nmetadata:\n  name: {name}\nspec:\n{array}  template:\n    spec:\n      \
                 restartPolicy: {restart}\n{time}      containers:\n        - name: rayfront\n          image: {image}\n          \
                 command: {command}\n          resources: {{ requests: {{ {cores}memory: {memory}Mi }} }}\n          volumeMounts:\n            - {{ name: files, mountPath: {here} }}\n      volumes:\n        - name: files\n          \
                 persistentVolumeClaim: {{ claimName: {volume} }}\n",
                restart = if array.is_empty() { "OnFailure" } else { "Never" },
                image = string(image),
                volume = string(volume),
            )
        };
        let array = format!(
            "  completionMode: Indexed\n  completions: {count}\n  parallelism: {count}\n  backoffLimitPerIndex: 3\n  maxFailedIndexes: {count}\n"
        );
        let mut files = vec![("render.yaml", job(name, &array, &list(&self.render_any())))];
        if self.has_pilot {
            files.push(("pilot.yaml", job(&format!("{name}-pilot"), "", &list(&self.pilot()))));
        }
        if self.merges() {
            files.push(("merge.yaml", job(&format!("{name}-merge"), "", &list(&self.merge()))));
        }
        files
    }

    /// Returns the commands to type next.
    pub(super) fn what_to_do(&self) -> String {
        let file = |name: &str| quoted(&self.path(name));
        let then = |command: String| if self.merges() { command } else { String::new() };
        let first = |command: String| if self.has_pilot { command } else { String::new() };
        match self.plan.engine {
            Engine::Slurm | Engine::Hyperqueue => format!("to submit: sh {}\n", file("submit.sh")),
            Engine::Openjd => format!(
                "to check: openjd check {template}\nto run here: openjd run {template} --step {step} --run-dependencies{values}\n",
                values = self.values(),
                template = file("template.json"),
                step = if self.merges() { "Merge" } else { "Render" },
            ),
            Engine::Kubernetes => {
                let merge = file("merge.yaml");
                let wait = format!(
                    "then: kubectl wait --for=condition=complete --timeout=-1s job/{} && kubectl apply -f {merge}\n",
                    self.name
                );
                let pilot = format!(
                    "first: kubectl apply -f {} && kubectl wait --for=condition=complete --timeout=-1s job/{}-pilot\n",
                    file("pilot.yaml"),
                    self.name
                );
                format!("{}to submit: kubectl apply -f {}\n{}", first(pilot), file("render.yaml"), then(wait))
            }
            Engine::Commands => format!(
                "{}to run: xargs -P 2 -d '\\n' -I {{}} sh -c {{}} < {}\n{}",
                first(format!("first: sh {}\n", file("pilot.sh"))),
                file("parts.txt"),
                then(format!("then: sh {}\n", file("merge.sh")))
            ),
        }
    }
}

/// Returns the name of an image's parameter in a template.
fn image_name(number: usize) -> String {
    if number == 0 { "Image".to_owned() } else { format!("Image{}", number + 1) }
}
