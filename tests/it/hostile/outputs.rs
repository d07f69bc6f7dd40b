//! Outputs never destroy a user's files.

use super::{PICTURE, ball};
use crate::program::{Place, empty_folder, folder};

/// `merge`, `resume` and default checkpoints.
#[test]
fn films_never_replace_other_films() {
    let here = folder(&ball(""));
    for line in [
        "scene.ron -q --spp 8 --shard 0/2 -o p0.film",
        "scene.ron -q --spp 8 --shard 1/2 -o p1.film",
        "scene.ron -q --seed 7 -o other.film",
        "merge p0.film p1.film -o whole.film -q",
        // Repeated with the same result.
        "merge p1.film p0.film -o whole.film -q",
    ] {
        here.out(line);
    }
    let (other, part) = (here.bytes("other.film"), here.bytes("p0.film"));
    for (line, what) in [
        ("merge p0.film p1.film -o other.film -q", "--overwrite replaces it"),
        ("merge p0.film p1.film -o p0.film -q", "is one of the films to merge"),
        ("resume p1.film -o other.film -q", "--overwrite replaces it"),
    ] {
        here.run(line).ends(3, &[what]);
    }
    assert_eq!((here.bytes("other.film"), here.bytes("p0.film")), (other, part));
    here.out("resume p1.film -o other.film -q --overwrite");

    here.write("y.checkpoint.film", "my notes");
    here.run("scene.ron --spp 64 --checkpoint 1ms -o y.png")
        .ends(0, &["y.checkpoint.film is something else"]);
    assert_eq!(here.bytes("y.checkpoint.film"), b"my notes");
}

#[test]
fn outputs_never_replace_inputs_or_each_other() {
    let here = folder(&ball(r#"diffuse: Image("scene.png")"#));
    for name in ["scene.png", "env.png", "i.png", "x.a.png"] {
        here.write(name, PICTURE);
    }
    here.write("x.ron", ball(r#"diffuse: Image("x.a.png")"#));
    here.write("ball.ron", ball(""));
    here.write("r.rays", [0; 32]);
    here.write("h.hits", [0; 16]);
    let files = ["scene.png", "env.png", "i.png", "ball.ron", "r.rays", "h.hits", "x.a.png"];
    let read = || files.map(|name| here.bytes(name));
    let before = read();
    for (line, what) in [
        ("scene.ron -q", "scene.png is read for this scene"),
        ("ball.ron -q --transport path --env env.png -o ./env.png", "env.png is read for this scene"),
        ("ab x.ron --hide Light --spp 2", "x.a.png is read for this scene"),
        ("trace ball.ron --rays r.rays --out ball.ron", "ball.ron is read"),
        ("trace ball.ron --rays r.rays --out r.rays", "r.rays is read"),
        (
            "trace scene.ron --rays r.rays --out scene.png",
            "scene.png is read for this scene: name another --out",
        ),
        (
            "trace scene.ron --rays r.rays --reference h.hits --out h.hits",
            "h.hits is read: name another --out",
        ),
        ("furnace scene.ron ball --html scene.png", "scene.png is read for this scene: name another --html"),
        ("compare i.png scene.png --heatmap i.png", "i.png is compared"),
        ("ball.ron -q -o a.png -o ./a.png", "a.png would be written twice"),
        ("ball.ron -q --denoise -o a.png -o a.denoised.png", "a.denoised.png would be written twice"),
    ] {
        here.run(line).ends(2, &[what]);
    }
    assert_eq!(read(), before);
    // A link that came with the scene may lead anywhere.
    std::os::unix::fs::symlink("env.png", here.join("ball.png")).expect("a link");
    here.run("ball.ron -q").ends(3, &["ball.png: cannot write: this is a link"]);
    assert_eq!(read(), before);
    here.out("ball.ron -q -o ball.png");
}

/// Links in a downloaded folder, with the names of default outputs, would redirect what is written.
#[test]
fn links_that_came_with_a_scene_lead_nowhere() {
    use std::os::unix::fs::symlink;
    let (here, home) = (folder(&ball("")), empty_folder());
    home.write("letter.txt", "my letter");
    std::fs::create_dir_all(here.join("jobs")).expect("a folder");
    std::fs::create_dir_all(here.join("out/s/plots")).expect("a folder");
    let study = r#"(title: "t", experiments: [(name: "e", scenes: [Ball], x: Triangles([20]), series: [(label: "a")],
                   plots: [(y: CpuSeconds)])])"#;
    here.write("s.ron", study);
    here.write("y.checkpoint.film", "junk");
    // The author of the scene can know the second name of a checkpoint.
    let slow = "scene.ron --spp 100000 --max-time 200ms --checkpoint 1ms";
    let said = here.run(&format!("{slow} -o y.png")).ends(0, &["saved to"]);
    let (_, second) = said.split_once("saved to ").expect("a name");
    let second = second.split_whitespace().next().expect("a name").to_owned();
    let slow_y = format!("{slow} -o y.png");
    for (link, line) in [
        ("scene.png", "scene.ron -q"),
        (&second, &slow_y),
        ("z.checkpoint.film", &format!("{slow} -o z.png")),
        ("x.denoised.png", "scene.ron -q --denoise -o x.png"),
        ("x.aov.exr", "scene.ron -q --aov depth -o x.png"),
        ("scene.0001.png", "scene.ron -q --frames 1 --overwrite"),
        ("f.0001.png", "scene.ron -q --frames 1 --overwrite -o f.####.png"),
        ("scene.0-of-2.film", "scene.ron -q --shard 0/2 --overwrite"),
        ("part-1.film", "scene.ron -q --shard 1/2 --overwrite -o part-{shard}.film"),
        ("scene.a.png", "ab scene.ron --set Sphere.shape.radius_m=0.5"),
        ("scene.diff.png", "ab scene.ron --set Sphere.shape.radius_m=0.5"),
        ("scene.jobs", "plan scene.ron --shards 2 --for commands"),
        ("jobs/merge.sh", "plan scene.ron --shards 2 --for commands --folder jobs"),
        ("jobs/part-0.film", "plan scene.ron --shards 2 --for commands --folder jobs"),
        ("out/s/references", "study s.ron -q"),
        ("out/s/results.csv", "study s.ron -q"),
        ("out/s/plots/e_cpuseconds.svg", "study s.ron -q"),
        ("pages/rayfront.1", "man pages"),
    ] {
        let place = here.join(link);
        std::fs::create_dir_all(place.parent().expect("a folder")).expect("a folder");
        for target in ["letter.txt", "new"] {
            let _ = std::fs::remove_file(&place);
            symlink(home.join(target), &place).expect("a link");
            println!("{link}: {line}");
            here.run(line).ends(3, &["this is a link", link]);
            assert_eq!(home.text("letter.txt"), "my letter", "{line}");
            assert_eq!(std::fs::read_dir(&home).expect("a folder").count(), 1, "{line}");
        }
        std::fs::remove_file(place).expect("the link is there");
    }
    // An output named explicitly may be a link.
    symlink(home.join("new.png"), here.join("mine.png")).expect("a link");
    here.out("scene.ron -q -o mine.png");
    assert!(here.join("mine.png").is_symlink() && home.has("new.png"));
}

/// Write-protected files, pilots, and man pages on a full disk.
#[test]
fn protected_files_and_pilots_are_not_overwritten() {
    use std::os::unix::fs::PermissionsExt;
    let here = folder(&ball(""));
    here.write("kept.png", "mine");
    std::fs::set_permissions(here.join("kept.png"), PermissionsExt::from_mode(0o444)).expect("a mode");
    here.run("scene.ron -q -o kept.png").ends(3, &["kept.png", "write-protected"]);
    assert_eq!(here.bytes("kept.png"), b"mine");
    let unbiased = "scene.ron -q --spp 64 --adaptive=unbiased --pilot p.film";
    for output in ["p.film", "./p.film"] {
        here.run(&format!("{unbiased} -o {output}")).ends(2, &["p.film is the pilot"]);
    }
    assert!(!here.has("p.film"));
    // A limit on file sizes simulates a full disk.
    here.shell("trap '' XFSZ; ulimit -f 4; rayfront man pages").ends(3, &["pages"]);
    for page in std::fs::read_dir(here.join("pages")).expect("a folder").flatten() {
        let text = std::fs::read_to_string(page.path()).expect("a page");
        assert!(text.len() < 4096 && text.contains(".SH NAME"), "{}", page.path().display());
    }
}

/// The records in films and images name files; their authors may be hostile.
#[test]
fn a_record_names_no_file_elsewhere() {
    let here = folder(&ball(""));
    std::fs::create_dir(here.join("upload")).expect("a folder");
    std::fs::copy(here.join("scene.ron"), here.join("upload/scene.ron")).expect("a file");
    let line = "scene.ron -q --spp 4 --samples 0..2 -o part.film";
    here.join("upload").out(line);
    let film = here.join("upload/part.film");
    let forged = |change: &dyn Fn(&mut rayfront::internals::formats::film_file::FilmHeader)| {
        use rayfront::internals::formats::film_file::{load, save};
        let mut file = load(&film).expect("a film");
        change(&mut file.header);
        save(&here.join("upload/forged.film"), &file.header, &file.film, None).expect("written");
    };
    // Output files.
    for image in ["new.png", "upload/../new.png", "../new.png"] {
        forged(&|header| header.note.outputs = vec![image.into()]);
        let resumed = here.run("resume upload/forged.film -q --scene-file upload/scene.ron");
        resumed.ends(3, &["new.png", "not in the film's folder", "-o"]);
    }
    forged(&|header| header.note.outputs = vec!["upload/new.png".into()]);
    here.out("resume upload/forged.film -q --scene-file upload/scene.ron");
    assert!(here.has("upload/new.png") && !here.has("new.png"));
    // The scene, whose text must not appear in a message.
    here.write("secret.ron", "password");
    for scene in ["secret.ron", "upload/../secret.ron", "/etc/hostname"] {
        forged(&|header| header.scene.path = scene.into());
        for command in ["resume", "reproduce", "merge --partial --denoise -o a.png"] {
            let output = here.run(&format!("{command} upload/forged.film -q"));
            let error = output.ends(1, &["not in its folder", "--scene-file"]);
            assert!(!error.contains("password"), "{error}");
        }
    }
    // Environment images.
    here.write("env.png", PICTURE);
    forged(&|header| {
        let picture = rayfront::formats::EnvironmentPreset::Picture(here.join("env.png"));
        header.view.options.surroundings = Some(picture);
    });
    let line = "reproduce upload/forged.film -q --scene-file upload/scene.ron";
    here.run(line).ends(1, &["env.png", "--allow-outside"]);
    // The printed command to continue works wherever the film is.
    std::fs::create_dir(here.join("films")).expect("a folder");
    let line = "scene.ron --spp 100000 --max-time 100ms --checkpoint 1ms -o films/a.png";
    let said = here.run(line).ends(0, &["to go on: rayfront resume films/a.checkpoint.film"]);
    let (_, typed) = said.split_once("to go on: ").expect("a command");
    let typed = typed.lines().next().expect("a line");
    here.shell(&format!("{typed} --max-time 1ms -q -o films/a.png")).ends(0, &[]);
    // And wherever the images are.
    std::fs::create_dir(here.join("images")).expect("a folder");
    let line = "scene.ron --spp 100000 --max-time 100ms --checkpoint 1ms -o films/b.png -o images/b.exr";
    let said = here.run(line).ends(0, &["to go on: rayfront resume films/b.checkpoint.film"]);
    let (_, typed) = said.split_once("to go on: ").expect("a command");
    let typed = typed.lines().next().expect("a line");
    here.shell(&format!("{typed} --max-time 1ms -q")).ends(0, &[]);
}

/// Names that job files and metadata cannot store unchanged.
#[test]
fn names_that_cannot_be_stored_are_refused() {
    let here = folder(&ball(""));
    for name in [r"--frames 5 -o $(printf 'y\377.#.png')", r"--shard 0/2 -o $(printf 's\377{shard}.film')"] {
        here.shell(&format!("rayfront scene.ron -q {name}")).ends(2, &["must be in UTF-8"]);
    }
    std::fs::copy(here.join("scene.ron"), here.join("c\ntouch PWNED #.ron")).expect("a copy");
    let plan = "plan 'c\ntouch PWNED #.ron' --shards 2 --for commands";
    let error = here.fails(2, plan, &["job files cannot hold such a name"]);
    assert_eq!(error.lines().count(), 1, "{error}");
}

/// Options after -- are passed to the tasks or to the merge, each once.
#[test]
fn planned_jobs_pass_options_to_tasks_or_the_merge() {
    let here = folder(&ball(""));
    let plan = "plan scene.ron --shards 2 --for commands --folder jobs -o a.png --";
    here.out(&format!("{plan} --spp 4 --denoise --bits 16 -q"));
    let [parts, merge] = ["jobs/parts.txt", "jobs/merge.sh"].map(|name| here.text(name));
    assert!(merge.contains("--denoise --bits 16") && merge.contains("--current"), "{merge}");
    for line in parts.lines() {
        assert!(!line.contains("--denoise") && line.matches("--quiet").count() == 1, "{line}");
    }
    let parts = "xargs -d '\\n' -I {} sh -c {} < jobs/parts.txt";
    here.shell(&format!("{parts} && sh jobs/merge.sh")).ends(0, &[]);
    assert!(here.has("a.denoised.png"));
    // After an edit, no old image is taken for a new one.
    let scene = here.text("scene.ron");
    here.write("scene.ron", scene.replace("radius_m: 1", "radius_m: 0.5"));
    here.shell(&format!("{parts}; sh jobs/merge.sh")).ends(1, &["part-0.film is of another scene"]);
    for (code, line, parts) in [
        (1, "--current", &["scene.ron, which is not in its folder", "--scene-file"][..]),
        (
            1,
            "--current --scene-file scene.ron",
            &["scene.ron has been changed since the films were rendered"],
        ),
        (0, "--scene-file scene.ron", &["warning: ", "this is the scene as it was"]),
    ] {
        here.run(&format!("merge jobs {line} -o b.png")).ends(code, parts);
    }
    for (options, what) in
        [("--shard 0/4", "what every task gets"), ("--camera left", "there is no camera \"left\"")]
    {
        here.run(&format!("{plan} {options}")).ends(2, &[what]);
    }
}
