//! Every mesh file of the corpus, if present: set RAYFRONT_CORPUS to its folder.

use std::path::Path;

use rayfront::error::{Diagnostic, LoadError};
use rayfront::internals::formats::{obj, ply};
use rayfront::world::{Assets, ImageId, Mesh};

use crate::corpus;

/// Checks the invariants of every mesh.
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

fn load(path: &Path, warnings: &mut Vec<Diagnostic>) -> Result<(Mesh, Assets), LoadError> {
    let mut assets = Assets::default();
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply")) {
        return ply::load(path).map(|mesh| (mesh, assets));
    }
    let mut images = |image: &Path| match image.is_file() {
        true => Ok(ImageId(0)),
        false => Err(LoadError::Invalid { file: image.into(), reason: "no such picture".into() }),
    };
    obj::load(path, &mut assets, warnings, &mut images).map(|mesh| (mesh, assets))
}

#[test]
fn corpus_meshes_load_or_fail_as_expected() {
    let Some(corpus) = corpus::folder() else { return };
    let files = corpus::files(&corpus, &["ply", "obj"]);
    let mut surprises = Vec::new();
    for path in &files {
        let name = path.strip_prefix(&corpus).unwrap_or(path).display().to_string();
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
            assert!(!warning.to_string().contains('\n'), "{warning:?}");
        }
        let error = outcome.as_ref().err().map(|error| error as &dyn std::error::Error);
        surprises.extend(corpus::surprise(&corpus, path, error));
    }
    assert!(surprises.is_empty(), "{}", surprises.join("\n"));
}
