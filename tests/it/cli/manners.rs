//! Conventions of command lines: aliases, hints, pipes, exit codes, help.

use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use super::SCENE;
use crate::program::{Folder, Place, ended, folder};

#[test]
fn render_command_and_aliases_of_options_are_accepted() {
    let here = folder(SCENE);
    let bytes = |line: &str| {
        here.out(&format!("{line} -q -o a.png"));
        here.bytes("a.png")
    };
    let plain = bytes("scene.ron --spp 2");
    for line in [
        "render scene.ron --spp 2", "render scene.ron -s 2 -t 1", "scene.ron -s2 -t1",
        "scene.ron --samples-per-pixel=2", "scene.ron --samples 2",
    ] {
        assert_eq!(bytes(line), plain, "{line}: the same file");
    }
    let film = |samples: &str| here.hash(&["render", "scene.ron", samples]);
    assert_ne!(film("--samples=0..2"), film("--samples=2"), "a range is a part of four samples");
    let help = here.out("--help");
    assert!(help.contains("rayfront render SCENE"), "{help}");
    for command in ["verify", "explain", "profile", "resume", "check", "view"] {
        let help = here.out(&[command, "--help"]);
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
    (output.status.code(), String::from_utf8(output.stderr).expect("UTF-8"))
}

/// Standard output without a reader.
#[cfg(unix)]
fn closed_pipe() -> Stdio {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

#[cfg(unix)]
const PRINTING: [&str; 10] = [
    "--help",
    "info --json scene.ron",
    "check scene.ron",
    "explain scene.ron 3,3",
    "furnace scene.ron ball --directions 64",
    "compare here.png here.png",
    "reproduce here.png",
    "plan scene.ron --shards 2 --for commands",
    "study study.ron",
    "scene.ron -o a.png",
];

#[cfg(unix)]
fn folder_with_files() -> Folder {
    let folder = folder(SCENE);
    folder.out("scene.ron -o here.png");
    let study = r#"(title: "A", experiments: [(name: "a", scenes: [File("scene.ron")], with: (size: (8, 8)),
        x: Samples([1]), series: [(label: "one")], plots: [(y: RenderSeconds)])])"#;
    folder.write("study.ron", study);
    folder
}

#[cfg(unix)]
#[test]
fn closed_pipe_ends_the_program_quietly() {
    let folder = folder_with_files();
    for line in PRINTING {
        let (code, error) = shell(&folder, line, closed_pipe());
        assert_eq!(code, Some(141), "{line}: {error}");
        assert!(!error.contains("panicked") && !error.contains("error"), "{line}: {error}");
    }
    assert!(folder.has("a.png"), "what was rendered is there");
    // A failed write of an error message does not change the exit code.
    let (code, _) = shell(&folder, "nowhere.ron 2>&1", closed_pipe());
    assert_eq!(code, Some(1));
    let (code, _) = shell(&folder, "scene.ron -o - | head -c 1", Stdio::null());
    assert_eq!(code, Some(0), "the last one's code");
}

#[cfg(target_os = "linux")]
#[test]
fn full_disk_gives_an_error_line_and_exit_code_3() {
    let folder = folder_with_files();
    for line in PRINTING.into_iter().chain(["scene.ron -o -", "scene.ron --frames 0-1 -o -", "--version"]) {
        let (code, error) = shell(&folder, &format!("{line} > /dev/full"), Stdio::null());
        let tells = |line: &str| line.starts_with("error: cannot write") && line.contains("standard output");
        assert!(error.lines().any(tells), "{line}: {error}");
        assert_eq!(code, Some(3), "{line}: {error}");
    }
    // Standard error is full, too.
    let (code, _) = shell(&folder, "nowhere.ron 2> /dev/full", Stdio::null());
    assert_eq!(code, Some(1));
}

#[test]
fn exit_codes_distinguish_input_usage_output_and_comparison() {
    let here = folder(SCENE);
    here.out("scene.ron -q -o a.exr");
    here.out("scene.ron -q -o b.exr --seed 1");
    here.out("scene.ron -q -o a.film");
    here.write("dark.ron", SCENE.replace("power_w: 300", "power_w: 0"));
    for (code, line, word) in [
        (1, "broken.ron", "broken.ron"),
        (1, "check dark.ron", ""),
        (1, "merge a.exr", "a.exr"),
        (2, "scene.ron --size no", "--size"),
        (2, "scene.ron --crop 0,0,99,99", "--crop"),
        (2, "scene.ron --camera side", "side"),
        (3, "scene.ron -o no/such/folder.png", "folder.png"),
        (3, "scene.ron -o a.gif", "a.gif"),
        (3, "scene.ron --seed 2 -o a.film", "--overwrite"),
        (5, "compare a.exr b.exr --max-rmse 0", ""),
    ] {
        here.run(line).ends(code, &[word]);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn image_larger_than_memory_exits_with_4() {
    let folder = folder(SCENE);
    folder.fails(4, "scene.ron --size 65536x65536", &["error: an image of 65536x65536 takes"]);
}

#[test]
fn misspelt_commands_and_files_get_suggestions() {
    let here = folder(SCENE);
    here.write("scene.png", "");
    for (code, line, wanted) in [
        (2, "veiw scene.ron", "no scene \"veiw\" (did you mean \"view\"?)"),
        (2, "chek", "did you mean \"check\"?"),
        (2, "--json chek", "did you mean \"check\"?"),
        (2, "exlpain scene.ron 3,3", "did you mean \"explain\"?"),
        (1, "scnee.ron", "did you mean \"scene.ron\"?"),
        (1, "info scne.ron", "did you mean \"scene.ron\"?"),
        (1, "scene", "did you mean \"scene.ron\"?"),
        (1, "info scene.gltf", ""),
        (1, "elsewhere/scene.ron", ""),
    ] {
        let error = here.fails(code, line, &[wanted]);
        assert_eq!(error.lines().count(), 1, "{error}");
        assert_eq!(error.contains("did you mean"), !wanted.is_empty(), "{error}");
    }
    // An existing file of that name is a file; files of other programs, and a model in name only.
    for (name, content, wanted) in [
        ("chek", SCENE, "scenes are .ron"),
        ("part.fbx", "Kaydara FBX Binary", "Blender imports it and exports .glb"),
        ("page.glb", "<!DOCTYPE html>", "this is no GLB file"),
    ] {
        here.write(name, content);
        here.fails(1, name, &[wanted]);
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
    let here = folder(SCENE);
    here.write("sign.gltf", MODEL);
    let facts = here.json("info sign.gltf");
    let expected = json!({
        "file": "sign.gltf", "scenes": ["day", "1"], "variants": ["red", "blue"],
        "animations": [{"name": "sway", "seconds": 2.5}],
    });
    assert_eq!(facts["models"], json!([expected]));
    assert_eq!(
        (&facts["meshes"][0]["name"], &facts["meshes"][0]["triangles"]),
        (&"letters".into(), &1.into())
    );
    let emitters = facts["emitters"].as_array().expect("a list");
    let neon = json!({"material": "neon", "radiance": [1.0, 0.5, 0.0], "entities": ["sign"]});
    assert!(emitters.contains(&neon), "{emitters:?}");
    let out = here.out("info sign.gltf");
    for line in [
        "mesh       letters of sign.gltf: 1 triangles",
        "animation  sway of sign.gltf, up to 2.50 s",
        "variant    blue of sign.gltf",
        "scene      day of sign.gltf",
        "emits      sign: material neon, [1.0,0.5,0.0] W/(m² sr)",
    ] {
        assert!(out.lines().any(|found| found == line), "{line}: {out}");
    }
    let out = here.out("info scene.ron");
    assert!(out.contains("emits      lamp: area light\n"), "{out}");
    assert_eq!(here.json("info scene.ron")["models"], json!([]));
}

#[test]
fn help_has_groups_completions_and_man_pages() {
    let here = folder(SCENE);
    let help = here.out("--help");
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
    assert_eq!(group(&here.out("trace --help"), "--repeat"), "Options:");
    let examples = help.split("Examples:\n").nth(1).expect("examples");
    assert_eq!(examples.lines().take_while(|line| line.starts_with("  rayfront ")).count(), 3, "{help}");
    assert!(here.out("render --help").contains("Examples:"));
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = here.out(&["completions", shell]);
        assert!(script.contains("samples-per-pixel") && script.contains("explain"), "{shell}");
    }
    here.out("man pages/man1");
    assert!(here.text("pages/man1/rayfront.1").contains("CPU renderer"));
    assert!(here.text("pages/man1/rayfront-explain.1").contains("Follow the samples"));
}

#[test]
fn progress_is_hidden_when_quiet_or_quick() {
    let folder = folder(SCENE);
    assert_eq!(folder.messages("scene.ron --quiet"), "");
    assert!(!folder.messages("scene.ron").contains("rendering"));
}

/// An environment lights the surfaces of a scene that sets no transport.
#[test]
fn environment_option_selects_the_path_transport() {
    let folder = folder(SCENE);
    for (options, transport) in [("", "whitted"), ("--env studio", "path"), ("--env none", "whitted")] {
        let report = folder.json(&format!("scene.ron --spp 1 -o a.png {options}"));
        assert_eq!(report["transport"], transport, "{options}");
    }
    let told = folder.messages("scene.ron --env studio --transport whitted -o a.png");
    assert!(!told.contains("was chosen"), "{told}");
}

/// This includes black, although that is also the default.
#[test]
fn backgrounds_hidden_by_an_environment_are_reported() {
    let folder = folder(SCENE);
    let told = |words: &str| folder.messages(&format!("scene.ron --spp 1 -o a.png {words}"));
    let count = |words: &str| told(words).matches("background does nothing").count();
    for hidden in
        ["--env studio --set 'settings.background = 1'", "--set 'settings.background = 0' --env sky:-3"]
    {
        assert_eq!(count(hidden), 1, "{hidden}");
    }
    assert!(told("--env sky --set 'settings.background = 0'").contains("\"sky\" is all around"));
    for seen in [
        "--background '#ffffff'", "--background 0", "--env none --background 0.5", "--env studio",
        // Behind an environment, which still gives light.
        "--env studio --background '#ffffff'", "--env sky --background 0", "--background 0 --env sky:-3",
    ] {
        assert_eq!(count(seen), 0, "{seen}");
    }
}

#[test]
fn json_output_includes_findings() {
    let folder = folder(SCENE);
    let report = folder.json("scene.ron --hide Light --spp 1 -o a.png");
    let findings = report["findings"].to_string();
    assert!(findings.contains("there is no light"), "{findings}");
}

#[test]
fn invalid_values_of_options_exit_with_2() {
    let folder = folder(SCENE);
    for option in [
        "--set '\"ball\".shape = Cube'", "--set '\"bal\".shape = Sphere'", "--only '\"bal\"'",
        "--hide Light[", "--background 'Srgb(2)'", "--env studo",
    ] {
        folder.fails(2, &format!("scene.ron {option} -o a.png"), &[]);
    }
    for option in [
        "--background '#ff8000'",
        "--background 0.1,0.2,0.4",
        "--background 'Srgb(0.1, 0.2, 0.4)'",
        "--set '\"ball\".transform.translate += (0, 1, 0)'",
    ] {
        folder.out(&format!("scene.ron --spp 1 {option} -o a.png"));
    }
    // A view straight down has an up direction, too.
    folder.out("scene.ron --spp 1 --look-at 0,5,0 0,0,0 -o a.png");
}

/// An error in a statement is marked below it; two points may be one word.
#[test]
fn invalid_statements_are_marked_and_points_may_be_one_word() {
    let here = folder(SCENE);
    let told = here.fails(2, "scene.ron --set '\"ball\".shape = Cube' -o a.png", &[]);
    let lines: Vec<&str> = told.lines().collect();
    let [reason, statement, mark] = lines[..] else { panic!("{told}") };
    assert!(reason.starts_with("error: --set: "), "{told}");
    let at = mark.find('^').expect("a mark");
    assert_eq!((&statement[at..], mark.trim()), ("Cube", "^^^^"), "{told}");
    let film = |words: &str| here.hash(&format!("scene.ron --spp 1 -o a.png {words}"));
    let two = film("--look-at 0,1,4 0,0,-0.5");
    assert_eq!(film("--look-at '0,1,4 0,0,-0.5'"), two, "both in one word");
    here.fails(2, "scene.ron --look-at 0,1,4 -o a.png", &["expected two places"]);
    let all = here.out("ls scene.ron");
    assert!(all.contains("\"lamp\"  ") && !all.contains("brass"), "{all}");
    let named = SCENE.replace("(\n    settings", "(materials: {\"brass\": (kr: 0.5)},\n    settings");
    here.write("named.ron", named);
    let all = here.out("ls named.ron");
    assert!(all.contains("\"brass\"  material: BlinnPhong("), "{all}");
}

#[test]
fn noise_above_the_requested_limit_is_reported() {
    let folder = folder(SCENE);
    let told = |words: &str| folder.messages(&format!("scene.ron --spp 4 -o a.png --until {words}"));
    let few = told("noise=0.01%");
    assert!(few.contains("all 4 samples are done") && few.contains("--spp"), "{few}");
    assert!(!told("noise=90%").contains("--until"));
    assert!(!told("noise=0.01% --quiet").contains("--until"));
}

/// Frames with automatic exposure share one, whichever process renders them.
#[test]
fn frames_share_their_exposure_and_are_kept() {
    let here = folder(SCENE);
    let scene = SCENE
        .replace("samples: 4", "samples: 4, exposure: Auto")
        .replace("power_w: 300", "power_w: Keys([(0, 300), (1, 3000)])");
    here.write("fade.ron", scene);
    let exposures = |words: &str, task: Option<&str>| -> Vec<f64> {
        let mut program = here.command(&format!("fade.ron --fps 2 --json {words}"));
        let run = ended(program.envs(task.map(|task| ("SLURM_ARRAY_TASK_ID", task))));
        assert_eq!(run.code, Some(0), "{}", run.err);
        let reports = run.out.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        reports.filter_map(|report| report["exposure_ev"].as_f64()).collect()
    };
    let all = exposures("--frames 0-2 -o a.#.png", None);
    assert_eq!(all.len(), 3);
    assert!(all.iter().all(|exposure| *exposure == all[0]), "{all:?}");
    let alone = [0, 1].map(|time| exposures(&format!("--time {time} -o b.png"), None)[0]);
    assert!((alone[0] - all[0]).abs() < 0.3, "that of the first frame: {alone:?} {all:?}");
    assert!(alone[0] - alone[1] > 2.0, "the last frame by itself is ten times as bright: {alone:?}");
    assert_eq!(exposures("--frames auto/0-2 -o c.#.png", Some("2")), [all[0]]);
    // An interrupted frame is unfinished.
    here.out("fade.ron --fps 2 --time 1 --samples 0..2 -o a.2.png");
    let told = |words: &str| here.messages(&format!("fade.ron --frames 0-2 {words}"));
    let kept = told("--fps 2 -o a.#.png");
    assert_eq!(
        [" is there", "frame 2 is unfinished"].map(|what| kept.matches(what).count()),
        [2, 1],
        "{kept}"
    );
    let count = |words: &str, what: &str| told(words).matches(what).count();
    // A frame that reached the requested noise is finished.
    let words = "--fps 2 -o d.#.png --spp 64 --until noise=60%";
    assert_eq!(count(words, " is there"), 0);
    assert_eq!(count(words, " is there, with 4 of 64 samples (--overwrite"), 3);
    // Existing frames of another command are reported.
    for (options, reports) in [("", 0), ("--json", 0), ("--size 8x6", 3)] {
        assert_eq!(count(&format!("--fps 2 -o a.#.png {options}"), "by another command"), reports);
    }
    // So are those with other samples, another time, or files that have changed since.
    assert_eq!(count("--fps 2 -o a.#.png --spp 3", "was rendered with 4 samples and is kept"), 3);
    assert_eq!(count("--fps 4 -o a.#.png", "was rendered at another time and is kept"), 2);
    let scene = here.text("fade.ron");
    here.write("fade.ron", scene.replace("(1, 3000)", "(1, 2000)"));
    assert_eq!(count("--fps 2 -o a.#.png", "was rendered before fade.ron was changed and is kept"), 3);
}

/// Names without quotes and colours of variables get what to type in a shell; options without an effect are reported.
#[test]
fn mistakes_in_names_and_variables_print_what_to_type() {
    let here = folder(SCENE);
    let typed = |line: &str, before: &str, after: &str| {
        let error = here.fails(2, line, &[before]);
        let rest = &error[error.find(before).expect("advice") + before.len()..];
        rest[..rest.find(after).expect("its end")].to_owned()
    };
    let name = typed("ls scene.ron ball", "in a shell ", "?");
    assert_eq!(name, "'\"ball\"'");
    assert!(here.shell(&format!("rayfront ls scene.ron {name}")).printed().contains("Sphere"));
    let name = typed("scene.ron -o a.png --hide Ball", "in a shell ", "?");
    here.shell(&format!("rayfront scene.ron --spp 1 -o a.png --hide {name}")).printed();

    let scene = SCENE.replace("(0.8, 0.4, 0.2)", "$accent").replacen(
        '(',
        "(variables: {\"accent\": \"red\", \"spare\": 1}, ",
        1,
    );
    here.write("colors.ron", scene);
    for value in ["navy", "'#102030'"] {
        let option = typed(&format!("colors.ron -o a.png --var accent={value}"), "(write ", ")");
        here.shell(&format!("rayfront colors.ron --spp 1 -o a.png {option}")).printed();
    }
    let option = typed("colors.ron -o a.png --set '$accent = \"navy\"'", "is set by ", "\n");
    here.shell(&format!("rayfront colors.ron --spp 1 -o a.png {option}")).printed();

    let empty = std::fs::read_to_string(here.join("colors.ron")).expect("the scene");
    here.write("colors.ron", empty.replacen("entities: [", "entities: [(name: \"empty\"), ", 1));
    let told =
        here.messages("colors.ron --spp 1 -o a.png --var spare=2 --hide 'Entity[\"empty\"]' --hide Sphere");
    assert!(told.contains("nothing in the scene uses $spare"), "{told}");
    assert!(told.contains("hide: Entity[\"empty\"]: nothing of that"), "{told}");
    assert!(!told.contains("hide: Sphere") && !told.contains("$accent"), "{told}");
}

#[test]
fn pixels_in_two_words_and_clipping_planes_get_a_tip() {
    let here = folder(SCENE);
    let error = here.fails(2, "explain scene.ron 12 7", &["two numbers are one word: 12,7"]);
    assert!(error.contains("unexpected argument '7'"), "{error}");
    here.out("explain scene.ron 12,7");
    here.fails(2, "scene.ron --clip 0.5", &["no distance is cut off"]);
    here.fails(1, "scene.ron --fov 30 --f-stop 2 --focus 0,0 --size 30x20 -o a.png", &["image of 30 x 20"]);
}

/// `check` finds what a rendering warns of; what was only chosen is a note.
#[test]
fn check_finds_what_renderings_warn_of() {
    let here = folder(SCENE);
    here.write("clamp.ron", SCENE.replace("samples: 4", "samples: 4, transport: Whitted, clamp: 3"));
    let told = here.messages("clamp.ron --spp 1 -o a.png");
    assert!(told.contains("warning: ") && told.contains("makes no use of clamp"), "{told}");
    let run = here.run("check clamp.ron");
    assert!(run.out.contains("found: ") && run.out.contains("makes no use of clamp"), "{}", run.out);
    assert!(!run.out.contains("nothing is wrong"), "{}", run.out);
    run.ends(1, &[]);
}
