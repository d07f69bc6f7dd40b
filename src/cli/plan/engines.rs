//! The job files of each engine, and what to type to submit them.

use std::path::Path;

use serde_json::{Value, json};

use super::super::command_line::quoted;
use super::{Engine, JobFile, Jobs, Plan, Tasks, line};

impl Jobs<'_> {
    pub(super) fn slurm(&self) -> Vec<JobFile> {
        let (name, last, merge) = (&self.name, self.last(), self.merge());
        let [log, merge_log] = ["part-%a.log", "merge.log"].map(|log| quoted(&self.path(log)));
        let [render_file, merge_file] =
            ["render.sbatch", "merge.sbatch"].map(|file| quoted(&self.path(file)));
        let render = line(&self.render_any());
        // The signal goes to the program, which replaces the shell: it saves what it has and, when it is requeued,
        // continues with it.
        let array = format!(
            "#!/bin/sh\n#SBATCH --job-name={name}\n#SBATCH --array=0-{last}\n#SBATCH --output={log}\n\
             #SBATCH --signal=B:TERM@30\n#SBATCH --requeue\nexec {render}\n"
        );
        let merge = format!(
            "#!/bin/sh\n#SBATCH --job-name={name}-merge\n#SBATCH --output={merge_log}\nexec {merge}\n"
        );
        if !self.merges() {
            return vec![
                ("render.sbatch", array),
                ("submit.sh", format!("#!/bin/sh\nexec sbatch --parsable {render_file}\n")),
            ];
        }
        let mut files = vec![("render.sbatch", array), ("merge.sbatch", merge)];
        let (mut before, mut after) = (String::new(), "");
        if self.has_pilot {
            let [file, log] = ["pilot.sbatch", "pilot.log"].map(|name| quoted(&self.path(name)));
            let pilot = line(&self.pilot(&self.folder));
            let pilot =
                format!("#!/bin/sh\n#SBATCH --job-name={name}-pilot\n#SBATCH --output={log}\nexec {pilot}\n");
            files.push(("pilot.sbatch", pilot));
            (before, after) =
                (format!("pilot=$(sbatch --parsable {file})\n"), "--dependency=afterany:\"$pilot\" ");
        }
        // However the parts end: the merge itself says what is missing.
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
        let commands: Vec<Vec<String>> = match &self.tasks {
            Tasks::Shards(count) => (0..*count).map(|index| part(index, *count)).collect(),
            Tasks::Frames(frames) => {
                frames.numbers().map(|frame| self.render_frames(&frame.to_string())).collect()
            }
        };
        let mut files = vec![("parts.txt", commands.iter().map(|words| line(words) + "\n").collect())];
        if self.has_pilot {
            files.push(("pilot.sh", format!("#!/bin/sh\nexec {}\n", line(&self.pilot(&self.folder)))));
        }
        if self.merges() {
            files.push(("merge.sh", format!("#!/bin/sh\nexec {}\n", self.merge())));
        }
        files
    }

    pub(super) fn hyperqueue(&self) -> String {
        let (name, last, merge) = (&self.name, self.last(), quoted(&self.merge()));
        let render = line(&self.render_any());
        let log = quoted(&self.path("part-%{TASK_ID}.log"));
        let array = format!(
            "hq submit --name {name} --array 0-{last} --stdout none --stderr {log} --wait -- {render}\n"
        );
        let pilot = match self.has_pilot {
            true => {
                let pilot = line(&self.pilot(&self.folder));
                format!("hq submit --name {name}-pilot --stdout none --wait -- {pilot}\n")
            }
            false => String::new(),
        };
        match self.merges() {
            false => format!("#!/bin/sh\n{array}"),
            true => format!(
                "#!/bin/sh\n# Waits for the parts; the merge says what is missing, if anything.\n{pilot}{array}\
                 hq submit --name {name}-merge --wait -- sh -c {merge}\n"
            ),
        }
    }

    /// (Open Job Description 2023-09.)
    pub(super) fn openjd(&self) -> String {
        let parameter = |name: &str, value: &str, description: &str| json!({ "name": name, "type": "STRING", "default": value, "description": description });
        // What a task renders, by its number.
        let (name, range, words) = match &self.tasks {
            Tasks::Shards(count) => {
                let film = "{{Param.Folder}}/part-{{Task.Param.Shard}}.film";
                let words = self.render(&format!("{{{{Task.Param.Shard}}}}/{count}"), film);
                ("Shard", format!("0-{}", self.last()), words)
            }
            Tasks::Frames(frames) => {
                ("Frame", frames.to_string().replace('x', ":"), self.render_frames("{{Task.Param.Frame}}"))
            }
        };
        let mut render: Vec<Value> = words[2..].iter().map(|word| json!(word)).collect();
        render.insert(0, json!("{{Param.Scene}}"));
        let mut merge: Vec<Value> = self.merge_words()[1..].iter().map(|word| json!(word)).collect();
        merge[1] = json!("{{Param.Folder}}");
        let mut parameters = vec![
            parameter("Program", &self.program, "What renders"),
            parameter("Scene", &self.scene, "What is rendered"),
        ];
        let mut steps = Vec::new();
        if self.has_pilot {
            let pilot: Vec<Value> =
                self.pilot(Path::new("{{Param.Folder}}"))[2..].iter().map(|word| json!(word)).collect();
            let arguments: Vec<Value> = std::iter::once(json!("{{Param.Scene}}")).chain(pilot).collect();
            steps.push(json!({
                "name": "Pilot",
                "script": { "actions": { "onRun": { "command": "{{Param.Program}}", "args": arguments } } },
            }));
        }
        let mut step = json!({
            "name": "Render",
            "parameterSpace": { "taskParameterDefinitions": [{ "name": name, "type": "INT", "range": range }]},
            "script": { "actions": { "onRun": {
                "command": "{{Param.Program}}", "args": render,
                // Told to end, it saves what it has.
                "cancelation": { "mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": 30 },
            }}},
        });
        if self.has_pilot {
            step["dependencies"] = json!([{ "dependsOn": "Pilot" }]);
        }
        steps.push(step);
        if self.merges() {
            let folder = self.folder.to_string_lossy();
            parameters.push(parameter("Folder", &folder, "Where the parts go: shared by all workers"));
            steps.push(json!({
                "name": "Merge",
                "dependencies": [{ "dependsOn": "Render" }],
                "script": { "actions": { "onRun": { "command": "{{Param.Program}}", "args": merge } } },
            }));
        }
        let template = json!({
            "specificationVersion": "jobtemplate-2023-09",
            "name": self.name,
            "parameterDefinitions": parameters,
            "steps": steps,
        });
        serde_json::to_string_pretty(&template).unwrap_or_default() + "\n"
    }

    pub(super) fn kubernetes(&self) -> Vec<JobFile> {
        let Self { name, here, .. } = self;
        let (Plan { image, volume, .. }, count) = (self.plan, self.count());
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
            "  completionMode: Indexed\n  completions: {count}\n  parallelism: {count}\n  backoffLimitPerIndex: 3\n  maxFailedIndexes: {count}\n"
        );
        let mut files = vec![("render.yaml", job(name, &array, &list(&self.render_any())))];
        if self.has_pilot {
            files.push(("pilot.yaml", job(&format!("{name}-pilot"), "", &list(&self.pilot(&self.folder)))));
        }
        if self.merges() {
            files.push(("merge.yaml", job(&format!("{name}-merge"), "", &list(&self.merge_words()))));
        }
        files
    }

    /// What to type next.
    pub(super) fn what_to_do(&self) -> String {
        let file = |name: &str| quoted(&self.path(name));
        let then = |command: String| if self.merges() { command } else { String::new() };
        let first = |command: String| if self.has_pilot { command } else { String::new() };
        match self.plan.engine {
            Engine::Slurm | Engine::Hyperqueue => format!("to submit: sh {}\n", file("submit.sh")),
            Engine::Openjd => format!(
                "to check: openjd check {template}\nto run here: openjd run {template} --step {step} --run-dependencies\n",
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
