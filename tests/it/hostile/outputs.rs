//! Nothing that a user has is lost to an output.

use std::path::Path;

use super::{ball, expect, folder, run, shell};

fn words(line: &str) -> Vec<String> {
    line.split(' ').map(str::to_owned).collect()
}

/// `merge`, `resume` and unrequested checkpoints.
#[test]
fn films_replace_no_other_film() {
    let folder = folder(&ball(""));
    let here = folder.path();
    let read = |name: &str| std::fs::read(here.join(name)).expect("a file");
    for line in [
        "scene.ron -q --spp 8 --shard 0/2 -o p0.film",
        "scene.ron -q --spp 8 --shard 1/2 -o p1.film",
        "scene.ron -q --seed 7 -o other.film",
        "merge p0.film p1.film -o whole.film -q",
        // The same once more.
        "merge p1.film p0.film -o whole.film -q",
    ] {
        expect(&run(here, &words(line)), 0, &[]);
    }
    let (other, part) = (read("other.film"), read("p0.film"));
    for (line, what) in [
        ("merge p0.film p1.film -o other.film -q", "--overwrite replaces it"),
        ("merge p0.film p1.film -o p0.film -q", "is one of the films to merge"),
        ("resume p1.film -o other.film -q", "--overwrite replaces it"),
    ] {
        expect(&run(here, &words(line)), 3, &[what]);
    }
    assert_eq!((read("other.film"), read("p0.film")), (other, part));
    expect(&run(here, &words("resume p1.film -o other.film -q --overwrite")), 0, &[]);

    std::fs::write(here.join("y.checkpoint.film"), "my notes").expect("a file");
    expect(
        &run(here, &words("scene.ron --spp 64 --checkpoint 1ms -o y.png")),
        0,
        &["y.checkpoint.film is something else"],
    );
    assert_eq!(read("y.checkpoint.film"), b"my notes");
}

#[test]
fn outputs_replace_no_input_and_not_each_other() {
    let folder = folder(&ball(r#"diffuse: Image("scene.png")"#));
    let here = folder.path();
    let picture = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/checker.png");
    for name in ["scene.png", "env.png", "i.png"] {
        std::fs::copy(&picture, here.join(name)).expect("a picture");
    }
    std::fs::write(here.join("ball.ron"), ball("")).expect("a file");
    std::fs::write(here.join("r.rays"), [0; 32]).expect("a file");
    let files = ["scene.png", "env.png", "i.png", "ball.ron", "r.rays"];
    let read = || files.map(|name| std::fs::read(here.join(name)).expect("a file"));
    let before = read();
    for (line, what) in [
        ("scene.ron -q", "scene.png is read for this scene"),
        ("ball.ron -q --transport path --env env.png -o ./env.png", "env.png is read for this scene"),
        ("trace ball.ron --rays r.rays --out ball.ron", "ball.ron is read"),
        ("trace ball.ron --rays r.rays --out r.rays", "r.rays is read"),
        ("compare i.png scene.png --heatmap i.png", "i.png is compared"),
        ("ball.ron -q -o a.png -o ./a.png", "a.png would be written twice"),
        ("ball.ron -q --denoise -o a.png -o a.denoised.png", "a.denoised.png would be written twice"),
    ] {
        expect(&run(here, &words(line)), 2, &[what]);
    }
    assert_eq!(read(), before);
    // A link that came with the scene leads anywhere.
    std::os::unix::fs::symlink("env.png", here.join("ball.png")).expect("a link");
    expect(&run(here, &words("ball.ron -q")), 3, &["ball.png is a link"]);
    assert_eq!(read(), before);
    expect(&run(here, &words("ball.ron -q -o ball.png")), 0, &[]);
}

/// Names that files and commands cannot hold as they are.
#[test]
fn odd_names_are_refused_where_they_would_be_changed() {
    let folder = folder(&ball(""));
    let here = folder.path();
    let output = shell(here, r"rayfront scene.ron -q --frames 5 -o $'y\xff.#.png'");
    expect(&output, 2, &["must be in UTF-8"]);
    let output = shell(here, r"rayfront scene.ron -q --shard 0/2 -o $'s\xff{shard}.film'");
    expect(&output, 2, &["must be in UTF-8"]);
    let output = shell(
        here,
        r"cp scene.ron $'c\ntouch PWNED #.ron'; rayfront plan $'c\ntouch PWNED #.ron' --shards 2 --for commands",
    );
    let error = expect(&output, 2, &["job files cannot hold such a name"]);
    assert_eq!(error.lines().count(), 1, "{error}");
}

/// What is said behind -- reaches the tasks or the merge, each once.
#[test]
fn planned_jobs_do_what_was_asked_for() {
    let folder = folder(&ball(""));
    let here = folder.path();
    let plan = "plan scene.ron --shards 2 --for commands --folder jobs -o a.png --";
    expect(&run(here, &words(&format!("{plan} --spp 4 --denoise --bits 16 -q"))), 0, &[]);
    let [parts, merge] = ["parts.txt", "merge.sh"]
        .map(|name| std::fs::read_to_string(here.join("jobs").join(name)).expect("a file"));
    assert!(merge.contains("--denoise --bits 16") && merge.contains("--current"), "{merge}");
    for line in parts.lines() {
        assert!(!line.contains("--denoise") && line.matches("--quiet").count() == 1, "{line}");
    }
    let output = shell(here, "xargs -d '\\n' -I {} sh -c {} < jobs/parts.txt && sh jobs/merge.sh");
    expect(&output, 0, &[]);
    assert!(here.join("a.denoised.png").is_file());
    // After an edit there is no old picture that passes for a new one.
    let scene = std::fs::read_to_string(here.join("scene.ron")).expect("a scene");
    std::fs::write(here.join("scene.ron"), scene.replace("radius_m: 1", "radius_m: 0.5")).expect("a scene");
    let output = shell(here, "xargs -d '\\n' -I {} sh -c {} < jobs/parts.txt; sh jobs/merge.sh");
    expect(&output, 1, &["part-0.film is of another scene"]);
    let output = run(here, &words("merge jobs --current -o b.png"));
    expect(&output, 1, &["scene.ron has been changed since the films were rendered"]);
    expect(&run(here, &words("merge jobs -o b.png")), 0, &["warning: ", "this is the scene as it was"]);
    for (options, what) in
        [("--shard 0/4", "what every task gets"), ("--camera left", "no camera has the name left")]
    {
        expect(&run(here, &words(&format!("{plan} {options}"))), 2, &[what]);
    }
}
