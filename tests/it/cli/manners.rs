//! Conventions of command lines: aliases, hints, pipes, exit codes, help.

use std::path::Path;
use std::process::{Command, Stdio};

use tempfile::TempDir;

use super::{SCENE, folder, json, run, stdout, text};

#[test]
fn render_command_and_aliases_of_options_are_accepted() {
    let folder = folder();
    let here = folder.path();
    let bytes = |words: &[&str]| {
        stdout(here, &[words, &["-q", "-o", "a.png"]].concat());
        std::fs::read(here.join("a.png")).expect("an image")
    };
    let plain = bytes(&["scene.ron", "--spp", "2"]);
    for words in [
        &["render", "scene.ron", "--spp", "2"][..],
        &["render", "scene.ron", "-s", "2", "-t", "1"],
        &["scene.ron", "-s2", "-t1"],
        &["scene.ron", "--samples-per-pixel=2"],
        &["scene.ron", "--samples", "2"],
    ] {
        assert_eq!(bytes(words), plain, "{words:?}: the same file");
    }
    let film = |samples: &str| json(here, &["render", "scene.ron", samples, "--json"])["film_hash"].clone();
    assert_ne!(film("--samples=0..2"), film("--samples=2"), "a range is a part of four samples");
    let help = stdout(here, &["--help"]);
    assert!(help.contains("rayfront render SCENE"), "{help}");
    for command in ["verify", "explain", "profile", "resume", "check", "view"] {
        let help = stdout(here, &[command, "--help"]);
        assert!(help.contains("-s, --spp") && help.contains("samples-per-pixel"), "{command}: {help}");
    }
}

/// Runs a command line in a shell. Returns the exit code and standard error; `line` follows the program's name.
#[cfg(unix)]
fn shell(folder: &Path, line: &str, input: Stdio) -> (Option<i32>, String) {
    let mut shell = Command::new("sh");
    let script = format!("exec {} {line}", env!("CARGO_BIN_EXE_rayfront"));
    shell.current_dir(folder).args(["-c", &script]).stdin(Stdio::null());
    let output = shell.stdout(input).stderr(Stdio::piped()).output().expect("a shell");
    (output.status.code(), text(&output.stderr).to_owned())
}

/// Standard output without a reader.
#[cfg(unix)]
fn closed_pipe() -> Stdio {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

#[cfg(unix)]
const PRINTING: [&str; 9] = [
    "--help",
    "info --json scene.ron",
    "check scene.ron",
    "explain scene.ron 3,3",
    "compare here.png here.png",
    "reproduce here.png",
    "plan scene.ron --shards 2 --for commands",
    "study study.ron",
    "scene.ron -o a.png",
];

#[cfg(unix)]
fn folder_with_files() -> TempDir {
    let folder = folder();
    stdout(folder.path(), &["scene.ron", "-o", "here.png"]);
    let study = r#"(title: "A", experiments: [(name: "a", scenes: [File("scene.ron")], with: (size: (8, 8)),
        x: Samples([1]), series: [(label: "one")], plots: [(y: RenderSeconds)])])"#;
    std::fs::write(folder.path().join("study.ron"), study).expect("a file");
    folder
}

#[cfg(unix)]
#[test]
fn closed_pipe_ends_the_program_quietly() {
    let folder = folder_with_files();
    for line in PRINTING {
        let (code, error) = shell(folder.path(), line, closed_pipe());
        assert_eq!(code, Some(141), "{line}: {error}");
        assert!(!error.contains("panicked") && !error.contains("error"), "{line}: {error}");
    }
    assert!(folder.path().join("a.png").is_file(), "what was rendered is there");
    // A failed write of an error message does not change the exit code.
    let (code, _) = shell(folder.path(), "nowhere.ron 2>&1", closed_pipe());
    assert_eq!(code, Some(1));
    let (code, _) = shell(folder.path(), "scene.ron -o - | head -c 1", Stdio::null());
    assert_eq!(code, Some(0), "the last one's code");
}

#[cfg(target_os = "linux")]
#[test]
fn full_disk_gives_an_error_line_and_exit_code_3() {
    let folder = folder_with_files();
    for line in PRINTING.into_iter().chain(["scene.ron -o -", "scene.ron --frames 0-1 -o -", "--version"]) {
        let (code, error) = shell(folder.path(), &format!("{line} > /dev/full"), Stdio::null());
        let tells = |line: &str| line.starts_with("error: cannot write") && line.contains("standard output");
        assert!(error.lines().any(tells), "{line}: {error}");
        assert_eq!(code, Some(3), "{line}: {error}");
    }
    // Standard error is full, too.
    let (code, _) = shell(folder.path(), "nowhere.ron 2> /dev/full", Stdio::null());
    assert_eq!(code, Some(1));
}

#[test]
fn exit_codes_distinguish_input_usage_output_and_comparison() {
    let folder = folder();
    let here = folder.path();
    stdout(here, &["scene.ron", "-q", "-o", "a.exr"]);
    stdout(here, &["scene.ron", "-q", "-o", "b.exr", "--seed", "1"]);
    stdout(here, &["scene.ron", "-q", "-o", "a.film"]);
    std::fs::write(here.join("dark.ron"), SCENE.replace("power_w: 300", "power_w: 0")).expect("a file");
    for (arguments, code, word) in [
        (&["broken.ron"][..], 1, "broken.ron"),
        (&["check", "dark.ron"], 1, ""),
        (&["merge", "a.exr"], 1, "a.exr"),
        (&["scene.ron", "--size", "no"], 2, "--size"),
        (&["scene.ron", "--crop", "0,0,99,99"], 2, "--crop"),
        (&["scene.ron", "--camera", "side"], 2, "side"),
        (&["scene.ron", "-o", "no/such/folder.png"], 3, "folder.png"),
        (&["scene.ron", "-o", "a.jpg"], 3, "a.jpg"),
        (&["scene.ron", "--seed", "2", "-o", "a.film"], 3, "--overwrite"),
        (&["compare", "a.exr", "b.exr", "--max-rmse", "0"], 5, ""),
    ] {
        let output = run(here, arguments);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(word), "{arguments:?}: {error}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn image_larger_than_memory_exits_with_4() {
    let folder = folder();
    let output = run(folder.path(), &["scene.ron", "--size", "65536x65536"]);
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{error}");
    assert!(error.starts_with("error: an image of 65536x65536 takes"), "{error}");
}

#[test]
fn misspelt_commands_and_files_get_suggestions() {
    let folder = folder();
    let here = folder.path();
    std::fs::write(here.join("scene.png"), "").expect("a file");
    for (arguments, code, wanted) in [
        (&["veiw", "scene.ron"][..], 2, "no scene \"veiw\" (did you mean \"view\"?)"),
        (&["chek"], 2, "did you mean \"check\"?"),
        (&["--json", "chek"], 2, "did you mean \"check\"?"),
        (&["exlpain", "scene.ron", "3,3"], 2, "did you mean \"explain\"?"),
        (&["scnee.ron"], 1, "did you mean \"scene.ron\"?"),
        (&["info", "scne.ron"], 1, "did you mean \"scene.ron\"?"),
        (&["scene"], 1, "did you mean \"scene.ron\"?"),
        (&["info", "scene.gltf"], 1, ""),
        (&["elsewhere/scene.ron"], 1, ""),
    ] {
        let output = run(here, arguments);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(wanted) && error.lines().count() == 1, "{arguments:?}: {error}");
        assert_eq!(error.contains("did you mean"), !wanted.is_empty(), "{arguments:?}: {error}");
    }
    // An existing file of that name is a file.
    std::fs::write(here.join("chek"), SCENE).expect("a file");
    assert!(text(&run(here, &["chek"]).stderr).contains("scenes are .ron"));
    // Files of other programs, and a model in name only.
    for (name, content, wanted) in [
        ("part.stl", "solid part", "Blender imports it and exports .glb"),
        ("page.glb", "<!DOCTYPE html>", "this is no GLB file"),
    ] {
        std::fs::write(here.join(name), content).expect("a file");
        let told = run(here, &[name]);
        assert!(text(&told.stderr).contains(wanted), "{}", text(&told.stderr));
    }
}

/// An emissive triangle, with scenes, variants and an animation.
const MODEL: &str = r#"{"asset": {"version": "2.0"}, "extensionsUsed": ["KHR_materials_variants"],
    "extensions": {"KHR_materials_variants": {"variants": [{"name": "red"}, {"name": "blue"}]}},
    "scenes": [{"name": "day", "nodes": [0]}, {"nodes": [0]}], "nodes": [{"name": "sign", "mesh": 0}],
    "materials": [{"name": "neon", "emissiveFactor": [1, 0.5, 0]}],
    "meshes": [{"name": "letters", "primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
    "animations": [{"name": "sway", "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                    "samplers": [{"input": 1, "output": 2}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [2.5]},
        {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 8},
                    {"buffer": 0, "byteOffset": 44, "byteLength": 24}],
    "buffers": [{"byteLength": 68, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAIEAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAA="}]}"#;

#[test]
fn info_lists_variants_animations_and_emitters() {
    let folder = folder();
    let here = folder.path();
    std::fs::write(here.join("sign.gltf"), MODEL).expect("a file");
    let facts = json(here, &["info", "sign.gltf", "--json"]);
    let expected = serde_json::json!({
        "file": "sign.gltf", "scenes": ["day", "1"], "variants": ["red", "blue"],
        "animations": [{"name": "sway", "seconds": 2.5}],
    });
    assert_eq!(facts["models"], serde_json::json!([expected]));
    assert_eq!(
        (&facts["meshes"][0]["name"], &facts["meshes"][0]["triangles"]),
        (&"letters".into(), &1.into())
    );
    let emitters = facts["emitters"].as_array().expect("a list");
    let neon = serde_json::json!({"material": "neon", "radiance": [1.0, 0.5, 0.0], "entities": ["sign"]});
    assert!(emitters.contains(&neon), "{emitters:?}");
    let out = stdout(here, &["info", "sign.gltf"]);
    for line in [
        "mesh       letters of sign.gltf: 1 triangles",
        "animation  sway of sign.gltf, up to 2.50 s",
        "variant    blue of sign.gltf",
        "scene      day of sign.gltf",
        "emits      sign: material neon, [1.0,0.5,0.0] W/(m² sr)",
    ] {
        assert!(out.lines().any(|found| found == line), "{line}: {out}");
    }
    let out = stdout(here, &["info", "scene.ron"]);
    assert!(out.contains("emits      lamp: area light\n"), "{out}");
    assert_eq!(json(here, &["info", "scene.ron", "--json"])["models"], serde_json::json!([]));
}

#[test]
fn help_has_groups_completions_and_man_pages() {
    let folder = folder();
    let here = folder.path();
    let help = stdout(here, &["--help"]);
    let groups = ["Picture:", "Light:", "Model:", "Output:", "Parts and frames:", "Stopping:", "Work:"];
    let places: Vec<usize> =
        groups.iter().map(|group| help.find(&format!("\n{group}\n")).expect(group)).collect();
    assert!(places.is_sorted(), "{help}");
    let group = |help: &str, option: &str| {
        let before = &help[..help.find(&format!("{option} ")).expect(option)];
        before.lines().rfind(|line| !line.starts_with(' ') && line.ends_with(':')).expect(option).to_owned()
    };
    for (option, name) in
        [("--seed", "Picture:"), ("--crop", "Picture:"), ("--aov", "Output:"), ("--fps", groups[4])]
    {
        assert_eq!(group(&help, option), name, "{option}");
    }
    assert_eq!(group(&stdout(here, &["trace", "--help"]), "--repeat"), "Options:");
    let examples = help.split("Examples:\n").nth(1).expect("examples");
    assert_eq!(examples.lines().take_while(|line| line.starts_with("  rayfront ")).count(), 3, "{help}");
    assert!(stdout(here, &["render", "--help"]).contains("Examples:"));
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = stdout(here, &["completions", shell]);
        assert!(script.contains("samples-per-pixel") && script.contains("explain"), "{shell}");
    }
    stdout(here, &["man", "pages/man1"]);
    let page = |name: &str| std::fs::read_to_string(here.join("pages/man1").join(name)).expect(name);
    assert!(page("rayfront.1").contains("CPU renderer"));
    assert!(page("rayfront-explain.1").contains("Follow the samples"));
}

#[test]
fn progress_is_hidden_when_quiet_or_quick() {
    let folder = folder();
    for arguments in [&["scene.ron", "--quiet"][..], &["scene.ron"]] {
        let output = run(folder.path(), arguments);
        let error = text(&output.stderr);
        assert!(output.status.success() && !error.contains("rendering"), "{error}");
        assert!(error.is_empty() || !arguments.contains(&"--quiet"), "{error}");
    }
}

/// An environment lights the surfaces of a scene that sets no transport.
#[test]
fn environment_option_selects_the_path_transport() {
    let folder = folder();
    let transport = |arguments: &[&str]| {
        let all = [&["scene.ron", "--json", "--spp", "1", "-o", "a.png"], arguments].concat();
        json(folder.path(), &all)["transport"].as_str().map(str::to_owned)
    };
    assert_eq!(transport(&[]).as_deref(), Some("whitted"));
    assert_eq!(transport(&["--env", "studio"]).as_deref(), Some("path"));
    assert_eq!(transport(&["--env", "none"]).as_deref(), Some("whitted"));
    let output =
        run(folder.path(), &["scene.ron", "--env", "studio", "--transport", "whitted", "-o", "a.png"]);
    assert!(!text(&output.stderr).contains("was chosen"), "{}", text(&output.stderr));
}

/// This includes black, although that is also the default.
#[test]
fn backgrounds_hidden_by_an_environment_are_reported() {
    let folder = folder();
    let told = |words: &str| {
        let words = ["scene.ron", "--spp", "1", "-o", "a.png"].into_iter().chain(words.split(' '));
        text(&run(folder.path(), &words.collect::<Vec<_>>()).stderr)
            .matches("background does nothing")
            .count()
    };
    for hidden in
        ["--env studio --background #ffffff", "--env sky --background 0", "--background 0 --env sky:-3"]
    {
        assert_eq!(told(hidden), 1, "{hidden}");
    }
    let statement =
        ["scene.ron", "--spp", "1", "-o", "a.png", "--env", "sky", "--set", "settings.background = 0"];
    assert!(text(&run(folder.path(), &statement).stderr).contains("\"sky\" is all around"));
    for seen in ["--background #ffffff", "--background 0", "--env none --background 0.5", "--env studio"] {
        assert_eq!(told(seen), 0, "{seen}");
    }
}

#[test]
fn json_output_includes_findings() {
    let folder = folder();
    let report =
        json(folder.path(), &["scene.ron", "--hide", "Light", "--spp", "1", "--json", "-o", "a.png"]);
    let findings = report["findings"].to_string();
    assert!(findings.contains("there is no light"), "{findings}");
}

#[test]
fn invalid_values_of_options_exit_with_2() {
    let folder = folder();
    for (option, value) in [
        ("--set", "\"ball\".shape = Cone"),
        ("--set", "\"bal\".shape = Sphere"),
        ("--only", "\"bal\""),
        ("--hide", "Light["),
        ("--background", "Srgb(2)"),
        ("--env", "studo"),
    ] {
        let output = run(folder.path(), &["scene.ron", option, value, "-o", "a.png"]);
        assert_eq!(output.status.code(), Some(2), "{option} {value}: {}", text(&output.stderr));
    }
    for (option, value) in [
        ("--background", "#ff8000"),
        ("--background", "0.1,0.2,0.4"),
        ("--background", "Srgb(0.1, 0.2, 0.4)"),
        ("--set", "\"ball\".transform.translate += (0, 1, 0)"),
    ] {
        let output = run(folder.path(), &["scene.ron", "--spp", "1", option, value, "-o", "a.png"]);
        assert_eq!(output.status.code(), Some(0), "{option} {value}: {}", text(&output.stderr));
    }
    // A view straight down has an up direction, too.
    stdout(folder.path(), &["scene.ron", "--spp", "1", "--look-at", "0,5,0", "0,0,0", "-o", "a.png"]);
}

/// An error in a statement is marked below it; two points may be one word.
#[test]
fn invalid_statements_are_marked_and_points_may_be_one_word() {
    let folder = folder();
    let here = folder.path();
    let output = run(here, &["scene.ron", "--set", "\"ball\".shape = Cone", "-o", "a.png"]);
    let told = text(&output.stderr);
    let lines: Vec<&str> = told.lines().collect();
    let [reason, statement, mark] = lines[..] else { panic!("{told}") };
    assert!(reason.starts_with("error: --set: "), "{told}");
    let at = mark.find('^').expect("a mark");
    assert_eq!((&statement[at..], mark.trim()), ("Cone", "^^^^"), "{told}");
    let film = |words: &[&str]| {
        json(here, &[&["scene.ron", "--spp", "1", "--json", "-o", "a.png"], words].concat())["film_hash"]
            .clone()
    };
    let two = film(&["--look-at", "0,1,4", "0,0,-0.5"]);
    assert_eq!(film(&["--look-at", "0,1,4 0,0,-0.5"]), two, "both in one word");
    let output = run(here, &["scene.ron", "--look-at", "0,1,4", "-o", "a.png"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("expected two places"), "{}", text(&output.stderr));
    let all = stdout(here, &["ls", "scene.ron"]);
    assert!(all.contains("\"lamp\"  ") && !all.contains("brass"), "{all}");
    let named = SCENE.replace("(\n    settings", "(materials: {\"brass\": (kr: 0.5)},\n    settings");
    std::fs::write(here.join("named.ron"), named).expect("a file");
    let all = stdout(here, &["ls", "named.ron"]);
    assert!(all.contains("\"brass\"  material: BlinnPhong("), "{all}");
}

#[test]
fn noise_above_the_requested_limit_is_reported() {
    let folder = folder();
    let told = |words: &[&str]| {
        let words = [&["scene.ron", "--spp", "4", "-o", "a.png"], words].concat();
        text(&run(folder.path(), &words).stderr).to_owned()
    };
    let few = told(&["--until", "noise=0.01%"]);
    assert!(few.contains("all 4 samples are done") && few.contains("--spp"), "{few}");
    assert!(!told(&["--until", "noise=90%"]).contains("--until"));
    assert!(!told(&["--until", "noise=0.01%", "--quiet"]).contains("--until"));
}

/// Frames with automatic exposure share one, whichever process renders them.
#[test]
fn frames_share_their_exposure_and_are_kept() {
    let folder = folder();
    let here = folder.path();
    let scene = SCENE
        .replace("samples: 4", "samples: 4, exposure: Auto")
        .replace("power_w: 300", "power_w: Keys([(0, 300), (1, 3000)])");
    std::fs::write(here.join("fade.ron"), scene).expect("a file");
    let exposures = |words: &[&str], task: Option<&str>| -> Vec<f64> {
        let mut program = super::command(here, &[&["fade.ron", "--fps", "2", "--json"], words].concat());
        if let Some(task) = task {
            program.env("SLURM_ARRAY_TASK_ID", task);
        }
        let output = program.output().expect("the program runs");
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let told = |line: &str| {
            serde_json::from_str::<serde_json::Value>(line).expect("JSON")["exposure_ev"].as_f64()
        };
        text(&output.stdout).lines().filter_map(told).collect()
    };
    let all = exposures(&["--frames", "0-2", "-o", "a.#.png"], None);
    assert_eq!(all.len(), 3);
    assert!(all.iter().all(|exposure| *exposure == all[0]), "{all:?}");
    let alone = ["0", "1"].map(|time| exposures(&["--time", time, "-o", "b.png"], None)[0]);
    assert!((alone[0] - all[0]).abs() < 0.3, "that of the first frame: {alone:?} {all:?}");
    assert!(alone[0] - alone[1] > 2.0, "the last frame by itself is ten times as bright: {alone:?}");
    assert_eq!(exposures(&["--frames", "auto/0-2", "-o", "c.#.png"], Some("2")), [all[0]]);
    // An interrupted frame is unfinished.
    let words = ["fade.ron", "--fps", "2", "--time", "1", "--samples", "0..2", "-o", "a.2.png"];
    stdout(here, &words);
    let told =
        text(&run(here, &["fade.ron", "--fps", "2", "--frames", "0-2", "-o", "a.#.png"]).stderr).to_owned();
    let told_of = |what: &str| told.matches(what).count();
    assert_eq!((told_of(" is there"), told_of("frame 2 is unfinished")), (2, 1), "{told}");
    // A frame that reached the requested noise is finished.
    let words =
        ["fade.ron", "--fps", "2", "--frames", "0-2", "-o", "d.#.png", "--spp", "64", "--until", "noise=60%"];
    stdout(here, &words);
    let told = text(&run(here, &words).stderr).to_owned();
    assert_eq!(told.matches(" is there, with 4 of 64 samples (--overwrite").count(), 3, "{told}");
    // Existing frames of another command are reported.
    let again = |words: &[&str]| {
        let words = [&["fade.ron", "--fps", "2", "--frames", "0-2", "-o", "a.#.png"], words].concat();
        text(&run(here, &words).stderr).matches("by another command").count()
    };
    assert_eq!((again(&[]), again(&["--json"]), again(&["--size", "8x6"])), (0, 0, 3));
    // So are those with other samples, another time, or files that have changed since.
    let told = |words: &[&str]| {
        let words = [&["fade.ron", "--frames", "0-2", "-o", "a.#.png"], words].concat();
        text(&run(here, &words).stderr).to_owned()
    };
    assert_eq!(
        told(&["--fps", "2", "--spp", "3"]).matches("was rendered with 4 samples and is kept").count(),
        3
    );
    assert_eq!(told(&["--fps", "4"]).matches("was rendered at another time and is kept").count(), 2);
    let scene = std::fs::read_to_string(here.join("fade.ron")).expect("a file");
    std::fs::write(here.join("fade.ron"), scene.replace("(1, 3000)", "(1, 2000)")).expect("a file");
    assert_eq!(
        told(&["--fps", "2"]).matches("was rendered before fade.ron was changed and is kept").count(),
        3
    );
}
