//! Every mesh file of the corpus, if there is one: set RAYFRONT_CORPUS to its folder.

use std::path::{Path, PathBuf};

use rayfront::error::LoadError;
use rayfront::formats::{obj, ply};
use rayfront::world::{Assets, ImageId, Mesh};

fn files_below(folder: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() {
            files_below(&path, files);
        } else if path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("ply") || e.eq_ignore_ascii_case("obj"))
        {
            files.push(path);
        }
    }
}

/// What must hold of every mesh.
fn check(mesh: &Mesh, assets: &Assets) {
    let vertices = mesh.positions.len();
    assert!(!mesh.triangles.is_empty());
    assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < vertices));
    assert!(mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite()));
    assert!(mesh.uvs.iter().all(|uv| uv.is_finite()));
    assert!(mesh.colors.iter().all(|color| color.is_finite()));
    for length in [mesh.normals.len(), mesh.uvs.len(), mesh.colors.len()] {
        assert!(length == 0 || length == vertices);
    }
    assert!([0, mesh.triangles.len()].contains(&mesh.triangle_materials.len()));
    assert!(mesh.triangle_materials.iter().all(|id| (id.0 as usize) < assets.materials.len()));
}

fn load(path: &Path, warnings: &mut Vec<String>) -> Result<(Mesh, Assets), LoadError> {
    let mut assets = Assets::default();
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply")) {
        return ply::load(path).map(|mesh| (mesh, assets));
    }
    let mut images = |image: &Path| match image.is_file() {
        true => Ok(ImageId(0)),
        false => Err(LoadError::invalid(image, "no such picture")),
    };
    obj::load(path, &mut assets, warnings, &mut images).map(|mesh| (mesh, assets))
}

#[test]
fn the_corpus_loads_or_says_why_not() {
    let Some(corpus) = std::env::var_os("RAYFRONT_CORPUS") else {
        println!("skipped: RAYFRONT_CORPUS is not set");
        return;
    };
    let corpus = PathBuf::from(corpus);
    let mut files = Vec::new();
    files_below(&corpus, &mut files);
    files.sort();
    assert!(!files.is_empty(), "{} holds no meshes", corpus.display());
    let mut surprises = Vec::new();
    for path in &files {
        let name = path.strip_prefix(&corpus).unwrap_or(path).display().to_string();
        let expected = EXPECTED_FAILURES.iter().find(|(file, _)| *file == name).map(|(_, reason)| *reason);
        let mut warnings = Vec::new();
        let outcome = load(path, &mut warnings);
        match &outcome {
            Ok((mesh, assets)) => {
                check(mesh, assets);
                println!("{name}: {} triangles", mesh.triangles.len());
            }
            Err(error) => println!("{name}: {error}"),
        }
        for warning in &warnings {
            println!("    warning: {warning}");
            assert!(!warning.contains('\n'), "{warning:?}");
        }
        match (outcome, expected) {
            (Ok(_), None) => {}
            (Ok(_), Some(reason)) => surprises.push(format!("{name} loads, but: {reason}")),
            (Err(error), None) => surprises.push(error.to_string()),
            (Err(error), Some(reason)) => {
                let message = error.to_string();
                let names_file = message.starts_with(&path.display().to_string());
                if !names_file || message.contains('\n') || !message.contains(reason) {
                    surprises.push(format!("{message:?} does not say {reason:?}"));
                }
            }
        }
    }
    assert!(surprises.is_empty(), "{}", surprises.join("\n"));
}

/// Files that must be refused, and words that the message must have.
const EXPECTED_FAILURES: &[(&str, &str)] = &[];
