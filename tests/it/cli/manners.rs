//! What other tools have taught: other names, hints, pipes, exit codes, help.

use super::{folder, json, stdout};

#[test]
fn render_is_a_word_and_options_have_other_names() {
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
