//! Every scene that ships with the program loads, compiles and renders identically with both schedules.

use std::path::{Path, PathBuf};

use rayfront::internals::integrator::Schedule;
use rayfront::render::Options;

use crate::support;

/// Returns the scene files in the folder `scenes`, if it exists.
pub fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<_> =
        entries.map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "ron")).collect();
    files.sort();
    files
}

#[test]
fn shipped_scenes_render_identically_with_both_schedules() {
    let mut failures = Vec::new();
    for file in files() {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut world = match rayfront::internals::formats::load(&file) {
            Ok(world) => world,
            Err(error) => {
                failures.push(error.to_string());
                continue;
            }
        };
        let [width, height] = world.settings.size;
        world.settings.size = [48, (48 * height).div_ceil(width)];
        world.settings.samples = 2;
        // With copies of meshes that are placed several times, and with instances.
        for copied in [world.settings.copied_triangles, 0] {
            world.settings.copied_triangles = copied;
            let film = |schedule| support::film(&world, Options { schedule, ..Options::default() });
            let (wavefront, recursive) = (film(Schedule::Wavefront), film(Schedule::Recursive));
            if wavefront.hash() != recursive.hash() {
                failures.push(format!("{name}: the schedules differ, {copied} copies allowed"));
            }
            let colors: std::collections::HashSet<_> =
                wavefront.radiance().iter().map(|p| p.to_array().map(f32::to_bits)).collect();
            if colors.len() < 3 {
                failures.push(format!("{name}: only {} colours", colors.len()));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn shipped_studies_and_their_scenes_load() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/studies");
    let mut count = 0;
    for entry in std::fs::read_dir(&folder).expect("the studies").flatten() {
        let path = entry.path();
        if path.to_string_lossy().ends_with("_scene.ron") {
            rayfront::internals::formats::load(&path).unwrap_or_else(|error| panic!("{error}"));
            continue;
        }
        let study =
            rayfront::internals::formats::study::load(&path).unwrap_or_else(|error| panic!("{error}"));
        for scene in study.experiments.iter().flat_map(|experiment| &experiment.scenes) {
            if let rayfront::internals::formats::study::StudyScene::File(file) = scene {
                rayfront::internals::formats::load(folder.join(file))
                    .unwrap_or_else(|error| panic!("{error}"));
            }
        }
        count += 1;
    }
    assert_eq!(count, 7);
}
