//! Planned jobs: their requests for resources, their reports, and the equality of their result with that of one
//! process.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

/// A light that becomes a hundred times brighter: frames with automatic exposure of their own would flicker.
const FADE: &str = r#"(
    settings: (size: (48, 32), samples: 8, exposure: Auto),
    entities: [
        (name: "eye", camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 4), to: (0, 0, 0))),
        (name: "lamp", light: Point(power_w: Keys([(0, 20), (4, 2000)])), transform: (translate: (2, 3, 3))),
        (name: "ball", shape: Sphere(radius_m: 1)),
    ],
)"#;

const ENGINES: [&str; 5] = ["slurm", "openjd", "hyperqueue", "kubernetes", "commands"];

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("fade.ron"), FADE).expect("a scene");
    folder
}

fn run(folder: &Path, line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rayfront"));
    command
        .current_dir(folder)
        .args(line.split_whitespace())
        .stdin(Stdio::null())
        .output()
        .expect("the program runs")
}

#[track_caller]
fn printed(folder: &Path, line: &str) -> [String; 2] {
    let output = run(folder, line);
    let [out, error] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    assert_eq!(output.status.code(), Some(0), "{line}: {error}");
    [out, error]
}

#[track_caller]
fn refused(folder: &Path, code: i32, line: &str) -> String {
    let output = run(folder, line);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{line}: {error}");
    error
}

/// Returns the job files written by a plan, concatenated.
fn files(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.map(|path| std::fs::read_to_string(path).expect("text")).collect()
}

fn template(folder: &Path) -> Value {
    let text = std::fs::read_to_string(folder.join("template.json")).expect("a template");
    serde_json::from_str(&text).expect("JSON")
}

/// Returns the words of a task, with values for the parameters.
fn task(template: &Value, step: &str, values: &[(&str, &str)]) -> Vec<String> {
    let steps = template["steps"].as_array().expect("steps");
    let step = steps.iter().find(|found| found["name"] == step).expect("the step");
    let run = &step["script"]["actions"]["onRun"];
    let words = std::iter::once(&run["command"]).chain(run["args"].as_array().expect("words"));
    let filled = |word: &Value| {
        let word = word.as_str().expect("a word").to_owned();
        values.iter().fold(word, |word, (name, value)| word.replace(&format!("{{{{{name}}}}}"), value))
    };
    words.map(filled).collect()
}

#[cfg(unix)]
#[test]
fn planned_frames_equal_those_of_one_process() {
    let folder = folder();
    let here = folder.path();
    printed(here, &format!("{}/fade.ron --frames 0-2 --fps 1 -o one.#.png", here.display()));
    let expected =
        [0, 1, 2].map(|frame| std::fs::read(here.join(format!("one.{frame}.png"))).expect("an image"));
    let check = |name: &str| {
        for (frame, expected) in expected.iter().enumerate() {
            let found = std::fs::read(here.join(format!("{name}.{frame}.png"))).expect("an image");
            assert!(found == *expected, "{name}: frame {frame} is another file");
        }
    };
    printed(here, "plan fade.ron --for commands --folder c -o c.#.png -- --frames 0-2 --fps 1");
    for line in std::fs::read_to_string(here.join("c/parts.txt")).expect("commands").lines() {
        assert!(Command::new("sh").args(["-c", line]).status().expect("a shell").success(), "{line}");
    }
    check("c");
    printed(here, "plan fade.ron --for openjd --folder o -o o.#.png -- --frames 0-2 --fps 1");
    let (template, program) = (template(&here.join("o")), env!("CARGO_BIN_EXE_rayfront"));
    let [scene, image] = ["fade.ron", "o.#.png"].map(|name| here.join(name).to_string_lossy().into_owned());
    for frame in ["0", "1", "2"] {
        let values = [
            ("Param.Program", program),
            ("Param.Scene", &scene),
            ("Param.Image", &image),
            ("Task.Param.Frame", frame),
        ];
        let words = task(&template, "Render", &values);
        let output = Command::new(&words[0]).args(&words[1..]).output().expect("a run");
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && told.contains("openjd_progress: 100\n"), "{words:?}: {told}");
    }
    check("o");
    // Each task of an array gets the whole list.
    for engine in ["slurm", "hyperqueue", "kubernetes"] {
        printed(here, &format!("plan fade.ron --for {engine} --folder {engine} -o a.#.png -- --frames 0-2"));
        assert!(files(&here.join(engine)).contains("auto/0-2"), "{engine}");
    }
}

#[test]
fn tasks_report_progress_and_findings() {
    let folder = folder();
    let here = folder.path();
    for engine in ENGINES {
        let form = if engine == "openjd" { "openjd" } else { "lines" };
        printed(here, &format!("plan fade.ron --shards 2 --for {engine} --folder {engine}"));
        let text = files(&here.join(engine)).replace(['"', ',', '\n', ' '], "");
        assert!(text.contains(&format!("--progress{form}")) && !text.contains("--quiet"), "{engine}: {text}");
        // The user's own options replace it.
        for wanted in ["--quiet", "-q", "--progress json"] {
            printed(here, &format!("plan fade.ron --shards 2 --for {engine} --folder {engine} -- {wanted}"));
            let text = files(&here.join(engine)).replace(['"', ',', '\n', ' '], "");
            let wanted = wanted.replace(' ', "");
            assert!(
                text.contains(&wanted) && !text.contains(&format!("--progress{form}")),
                "{engine}: {text}"
            );
        }
    }
    let told = |line: &str| printed(here, line)[1].clone();
    let lines = told("fade.ron --frames 0-1 -o f.#.png --progress lines --size 8x8");
    let percent: Vec<&str> = lines.lines().filter_map(|line| line.strip_prefix("Progress: ")).collect();
    let percent: Vec<&str> = percent.iter().filter_map(|line| line.split('%').next()).collect();
    assert_eq!(percent.last(), Some(&"100"), "{lines}");
    assert!(percent.contains(&"50"), "the first of two frames is half of all: {lines}");
    let objects = told("fade.ron -o f.png --progress json --size 8x8");
    let objects: Vec<Value> = objects.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    assert_eq!(objects.last().map(|object| &object["percent"]), Some(&Value::from(100)));
    // The same image is the same file, whatever was reported.
    let bytes = std::fs::read(here.join("f.png")).expect("an image");
    told("fade.ron -o f.png --size 8x8");
    assert!(bytes == std::fs::read(here.join("f.png")).expect("an image"));
    refused(here, 2, "fade.ron --progress lines --quiet");
    // Findings are reported by the plan and by each task.
    let scene = FADE.replace("power_w: Keys([(0, 20), (4, 2000)])", "power_w: 0");
    std::fs::write(here.join("fade.ron"), scene).expect("a scene");
    assert!(told("plan fade.ron --shards 2 --for commands").contains("warning: "));
}

#[test]
fn plans_refuse_jobs_that_would_fail_at_the_end() {
    let folder = folder();
    let here = folder.path();
    let missing = |line: &str, what: &str| {
        let error = refused(here, 3, line);
        assert!(error.contains(what), "{line}: {error}");
        assert!(!here.join("fade.jobs").exists(), "{line}: nothing is written");
    };
    missing("plan fade.ron --shards 2 --for slurm -o nowhere/out.png", "nowhere/out.png");
    missing("plan fade.ron --shards 2 --for slurm -o out.png -o nowhere/out.film", "nowhere/out.film");
    missing("plan fade.ron --for slurm -o nowhere/f.##.png -- --frames 1-3", "nowhere/f.01.png");
    missing("plan fade.ron --shards 2 --for slurm -o out.jpg", "out.jpg");
    let error = refused(here, 2, "plan fade.ron --shards 2 --for kubernetes -o ../out.png");
    assert!(error.contains("image must lie in"), "{error}");
    let error = refused(here, 2, "plan fade.ron --shards 2 --for slurm -- --camera ear");
    assert!(error.contains("ear") && error.contains("eye"), "{error}");
    let error = refused(here, 2, "plan fade.ron --shards 2 --for commands --time-limit 2h");
    assert!(error.contains("--max-time"), "{error}");
}

#[test]
fn tasks_request_cores_memory_and_time() {
    let folder = folder();
    let here = folder.path();
    let planned = |engine: &str, options: &str| {
        printed(here, &format!("plan fade.ron --shards 2 --for {engine} --folder {engine} {options}"));
        files(&here.join(engine))
    };
    let given = "--cores 3 --time-limit 90m -- --memory 512M";
    let count =
        |text: &str, parts: &[&str]| parts.iter().map(|part| text.matches(part).count()).collect::<Vec<_>>();
    let slurm = planned("slurm", given);
    let lines = ["#SBATCH --cpus-per-task=3\n", "#SBATCH --mem=512M\n", "#SBATCH --time=90\n", "--threads 3"];
    assert_eq!(count(&slurm, &lines), [2, 2, 2, 2], "{slurm}");
    let hyperqueue = planned("hyperqueue", given);
    let words = ["--cpus 3 --resource mem=537 --time-limit 5400s", "--threads 3"];
    assert_eq!(count(&hyperqueue, &words), [2, 2], "{hyperqueue}");
    let kubernetes = planned("kubernetes", given);
    let lines = ["{ requests: { cpu: \"3\", memory: 512Mi } }\n", "activeDeadlineSeconds: 5400\n"];
    assert_eq!(count(&kubernetes, &lines), [2, 2], "{kubernetes}");
    planned("openjd", given);
    let jobs = template(&here.join("openjd"));
    for step in jobs["steps"].as_array().expect("steps") {
        let amounts = serde_json::json!([
            {"name": "amount.worker.memory", "min": 512}, {"name": "amount.worker.vcpu", "min": 3}
        ]);
        assert_eq!(step["hostRequirements"]["amounts"], amounts);
        assert_eq!(step["script"]["actions"]["onRun"]["timeout"], 5400);
    }
    // Defaults: memory by the estimate, and as many threads as cores.
    let slurm = planned("slurm", "");
    let number = |option: &str| -> u64 {
        let (_, rest) = slurm.split_once(option).unwrap_or_else(|| panic!("{option} in {slurm}"));
        rest.chars().map_while(|digit| digit.to_digit(10)).fold(0, |all, digit| 10 * all + u64::from(digit))
    };
    assert!((32..2048).contains(&number("--mem=")), "{slurm}");
    assert_eq!(number("--cpus-per-task="), number("--threads "), "{slurm}");
    assert!(!slurm.contains("--time="), "{slurm}");
    let hyperqueue = planned("hyperqueue", "-- -t2");
    assert!(hyperqueue.contains("--cpus 2 ") && hyperqueue.contains("--threads 2"), "{hyperqueue}");
    // A worker of a farm runs one task at a time, which gets all of its cores.
    planned("openjd", "");
    let jobs = template(&here.join("openjd"));
    assert_eq!(jobs["steps"][0]["hostRequirements"]["amounts"].as_array().map(Vec::len), Some(1));
    assert!(!jobs.to_string().contains("--threads"));
}

#[test]
fn openjd_templates_declare_every_path() {
    let folder = folder();
    let here = folder.path();
    let [what_to_do, _] =
        printed(here, "plan fade.ron --shards 2 --for openjd --folder jobs -o a.png -o b.exr");
    let jobs = template(&here.join("jobs"));
    let definitions = jobs["parameterDefinitions"].as_array().expect("parameters");
    let kind = |name: &str| {
        definitions
            .iter()
            .find(|it| it["name"] == name)
            .map(|it| (it["type"].as_str(), it["default"].as_str()))
    };
    for name in ["Scene", "Image", "Image2"] {
        assert_eq!(kind(name), Some((Some("PATH"), None)), "{name}");
        assert!(what_to_do.contains(&format!(" -p {name}={}", here.display())), "{what_to_do}");
    }
    assert_eq!(kind("Folder"), Some((Some("PATH"), Some("."))));
    // Paths occur in parameters only.
    let steps = jobs["steps"].to_string();
    assert!(!steps.contains(&*here.to_string_lossy()), "{steps}");
    // The path of an environment image is absolute.
    image::GrayImage::new(8, 4).save(here.join("sky.png")).expect("a picture");
    printed(here, "plan fade.ron --shards 2 --for commands --folder c -- --env sky.png");
    let sky = here.join("sky.png");
    assert_eq!(files(&here.join("c")).matches(&format!("--env {}", sky.display())).count(), 2);
    // And it is found by the merge, which reads the scene again.
    let run = |script: &str| {
        let done = std::process::Command::new("bash").arg("-c").arg(script).current_dir(here).output();
        let done = done.expect("a shell");
        assert!(done.status.success(), "{script}: {}", String::from_utf8_lossy(&done.stderr));
    };
    run("sh c/parts.txt && sh c/merge.sh");
}

#[test]
fn kubernetes_job_uses_the_containerfiles_image() {
    let folder = folder();
    printed(folder.path(), "plan fade.ron --shards 2 --for kubernetes --folder k");
    let text = files(&folder.path().join("k"));
    let (_, image) = text.split_once("image: \"").expect(&text);
    let image = image.split('"').next().expect("an end");
    let built = include_str!("../../Containerfile");
    assert!(built.contains(&format!("podman build --tag {image} .")), "{image}");
}
