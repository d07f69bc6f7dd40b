//! Planned jobs: their requests for resources, their reports, and the equality of their result with that of one
//! process.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::program::{Folder, Place, empty_folder, ended};

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

/// A folder with `fade.ron`.
fn fade() -> Folder {
    let here = empty_folder();
    here.write("fade.ron", FADE);
    here
}

/// Returns the job files written by a plan, concatenated.
fn files(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.map(|path| std::fs::read_to_string(path).expect("text")).collect()
}

fn template(folder: &Path) -> Value {
    serde_json::from_str(&folder.text("template.json")).expect("JSON")
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
    let here = fade();
    here.out(&format!("{}/fade.ron --frames 0-2 --fps 1 -o one.#.png", here.display()));
    let frames = |name: &str| [0, 1, 2].map(|frame| here.bytes(&format!("{name}.{frame}.png")));
    let check = |name: &str| assert!(frames(name) == frames("one"), "{name}: a frame is another file");
    here.out("plan fade.ron --for commands --folder c -o c.#.png -- --frames 0-2 --fps 1");
    for line in here.text("c/parts.txt").lines() {
        Path::new("/").shell(line).ends(0, &[]);
    }
    check("c");
    here.out(&format!("{}/fade.ron --turntable 3 --time 1 -o turned.#.png", here.display()));
    here.out("plan fade.ron --for commands --folder t -o t.#.png -- --turntable 3 --time 1");
    for line in here.text("t/parts.txt").lines() {
        Path::new("/").shell(line).ends(0, &[]);
    }
    for frame in 1..=3 {
        assert!(
            here.bytes(&format!("t.{frame}.png")) == here.bytes(&format!("turned.{frame}.png")),
            "{frame}"
        );
    }
    here.out("plan fade.ron --for openjd --folder o -o o.#.png -- --frames 0-2 --fps 1");
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
        ended(Command::new(&words[0]).args(&words[1..])).ends(0, &["openjd_progress: 100\n"]);
    }
    check("o");
    // Each task of an array gets the whole list.
    for engine in ["slurm", "hyperqueue", "kubernetes"] {
        here.out(&format!("plan fade.ron --for {engine} --folder {engine} -o a.#.png -- --frames 0-2"));
        assert!(files(&here.join(engine)).contains("auto/0-2"), "{engine}");
    }
}

#[test]
fn tasks_report_progress_and_findings() {
    let here = fade();
    for engine in ENGINES {
        let form = if engine == "openjd" { "openjd" } else { "lines" };
        here.out(&format!("plan fade.ron --shards 2 --for {engine} --folder {engine}"));
        let text = files(&here.join(engine)).replace(['"', ',', '\n', ' '], "");
        assert!(text.contains(&format!("--progress{form}")) && !text.contains("--quiet"), "{engine}: {text}");
        // The user's own options replace it.
        for wanted in ["--quiet", "-q", "--progress json"] {
            here.out(&format!("plan fade.ron --shards 2 --for {engine} --folder {engine} -- {wanted}"));
            let text = files(&here.join(engine)).replace(['"', ',', '\n', ' '], "");
            let wanted = wanted.replace(' ', "");
            assert!(
                text.contains(&wanted) && !text.contains(&format!("--progress{form}")),
                "{engine}: {text}"
            );
        }
    }
    let told = |line: &str| here.messages(line);
    let lines = told("fade.ron --frames 0-1 -o f.#.png --progress lines --size 8x8");
    let percent: Vec<&str> = lines.lines().filter_map(|line| line.strip_prefix("Progress: ")).collect();
    let percent: Vec<&str> = percent.iter().filter_map(|line| line.split('%').next()).collect();
    assert_eq!(percent.last(), Some(&"100"), "{lines}");
    assert!(percent.contains(&"50"), "the first of two frames is half of all: {lines}");
    let objects = told("fade.ron -o f.png --progress json --size 8x8");
    let objects: Vec<Value> = objects.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    assert_eq!(objects.last().map(|object| &object["percent"]), Some(&Value::from(100)));
    // The same image is the same file, whatever was reported.
    let bytes = here.bytes("f.png");
    told("fade.ron -o f.png --size 8x8");
    assert!(bytes == here.bytes("f.png"));
    here.fails(2, "fade.ron --progress lines --quiet", &[]);
    // Findings are reported by the plan and by each task.
    let scene = FADE.replace("power_w: Keys([(0, 20), (4, 2000)])", "power_w: 0");
    here.write("fade.ron", scene);
    assert!(told("plan fade.ron --shards 2 --for commands").contains("warning: "));
}

#[test]
fn plans_refuse_jobs_that_would_fail_at_the_end() {
    let here = fade();
    let missing = |line: &str, what: &str| {
        here.fails(3, line, &[what]);
        assert!(!here.has("fade.jobs"), "{line}: nothing is written");
    };
    missing("plan fade.ron --shards 2 --for slurm -o nowhere/out.png", "nowhere/out.png");
    missing("plan fade.ron --shards 2 --for slurm -o out.png -o nowhere/out.film", "nowhere/out.film");
    missing("plan fade.ron --for slurm -o nowhere/f.##.png -- --frames 1-3", "nowhere/f.01.png");
    missing("plan fade.ron --shards 2 --for slurm -o out.gif", "out.gif");
    here.fails(2, "plan fade.ron --shards 2 --for kubernetes -o ../out.png", &["image must lie in"]);
    here.fails(2, "plan fade.ron --shards 2 --for slurm -- --camera ear", &["ear", "eye"]);
    here.fails(2, "plan fade.ron --shards 2 --for commands --time-limit 2h", &["--max-time"]);
}

#[test]
fn tasks_request_cores_memory_and_time() {
    let here = fade();
    let planned = |engine: &str, options: &str| {
        here.out(&format!("plan fade.ron --shards 2 --for {engine} --folder {engine} {options}"));
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
    let here = fade();
    let what_to_do = here.out("plan fade.ron --shards 2 --for openjd --folder jobs -o a.png -o b.exr");
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
    here.out("plan fade.ron --shards 2 --for commands --folder c -- --env sky.png");
    let sky = here.join("sky.png");
    assert_eq!(files(&here.join("c")).matches(&format!("--env {}", sky.display())).count(), 2);
    // And it is found by the merge, which reads the scene again.
    here.shell("sh c/parts.txt && sh c/merge.sh").ends(0, &[]);
}

#[test]
fn kubernetes_job_uses_the_containerfiles_image() {
    let here = fade();
    here.out("plan fade.ron --shards 2 --for kubernetes --folder k");
    let text = files(&here.join("k"));
    let (_, image) = text.split_once("image: \"").expect(&text);
    let image = image.split('"').next().expect("an end");
    let built = include_str!("../../Containerfile");
    assert!(built.contains(&format!("podman build --tag {image} .")), "{image}");
}
