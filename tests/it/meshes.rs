//! Every mesh file of the corpus, if present: set RAYFRONT_CORPUS to its folder.

use std::path::Path;

use rayfront::error::{Diagnostic, LoadError};
use rayfront::internals::formats::{obj, ply};
use rayfront::world::{Assets, ImageId, Mesh};

use crate::corpus::{self, Refusals};

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
        surprises.extend(corpus::surprise(EXPECTED_FAILURES, &corpus, path, error));
    }
    assert!(surprises.is_empty(), "{}", surprises.join("\n"));
}

/// Files that must be refused, by folder, and words that the message must contain.
const EXPECTED_FAILURES: &Refusals = &[
    (
        "apache-bsd/obj2gltf/specs/data/box-incomplete-attributes",
        &[("box-incomplete-normals.obj", "normal index 6 is out of range")],
    ),
    (
        "apache-bsd/obj2gltf/specs/data/box-missing-attributes",
        &[("box-missing-attributes.obj", "texture coordinate index 20 is out of range")],
    ),
    (
        "magnum-plugins/StanfordImporter/Test",
        &[
            ("colors-not-all.ply", "has no faces"),
            ("colors4-not-same-type.ply", "has no faces"),
            ("extra-token-face-element.ply", ":7:1: \"element\" takes two words"),
            ("extra-token-face-property-list.ply", ":8:1: a property is"),
            ("extra-token-face-property.ply", ":8:1: a property is"),
            ("extra-token-format.ply", ":2:1: \"format\" takes two words"),
            ("extra-token-vertex-element.ply", ":3:1: \"element\" takes two words"),
            ("extra-token-vertex-property.ply", ":4:1: a property is"),
            ("format-missing.ply", "ends before \"end_header\""),
            ("format-too-late.ply", ":3:1: \"format\" belongs on the second line"),
            ("integer-literal-too-large.ply", "ends before \"end_header\""),
            ("invalid-face-size-type.ply", ":4:1: a list's length must be of an integer type"),
            ("invalid-face-type.ply", ":4:1: unknown type \"float16\""),
            ("invalid-signature.ply", ":1:1: not a PLY file"),
            ("invalid-vertex-property.ply", ":4:1: a property is"),
            ("invalid-vertex-type.ply", ":4:1: unknown type \"float16\""),
            ("normals-not-all.ply", "has no faces"),
            ("normals-not-same-type.ply", "has no faces"),
            ("objectid-unsupported-type.ply", "has no faces"),
            ("positions-not-same-type.ply", "has no faces"),
            ("texcoords-not-all.ply", "has no faces"),
            ("texcoords-unsupported-type.ply", "has no faces"),
            ("unexpected-property.ply", ":3:1: a property before any element"),
            ("unknown-element.ply", "ends before \"end_header\""),
            ("unknown-line.ply", ":6:1: unknown keyword \"heh\""),
            ("unsupported-face-size.ply", "face 1: the file ends here"),
        ],
    ),
    (
        "magnum/ObjImporter/Test",
        &[
            ("empty.obj", "has no faces"),
            ("invalid-keywords.obj", "has no faces"),
            ("invalid-number-count.obj", ":2:1: a vertex needs three coordinates"),
            ("mesh-named-first-unnamed-index-first.obj", "has no faces"),
            ("mesh-named.obj", "has no faces"),
            ("mesh-negative-indices.obj", "has no faces"),
            ("mesh-normals.obj", "has no faces"),
            ("mesh-positions-optional-coordinate.obj", "has no faces"),
            ("mesh-primitive-lines.obj", "has no faces"),
            ("mesh-primitive-points.obj", "has no faces"),
            ("mesh-texture-coordinates-normals.obj", "has no faces"),
            ("mesh-texture-coordinates.obj", "has no faces"),
        ],
    ),
    (
        "ply-rs/example_plys",
        &[
            ("all_atomic_types_ok_ascii.ply", "has no vertices"),
            ("empty_ok_ascii.ply", "has no faces"),
            ("exponent_values_ok_ascii.ply", "has no vertices"),
            ("header_min_ok_ascii.ply", "has no vertices"),
        ],
    ),
    (
        "tinyobjloader/models",
        &[
            ("invalid-face-definition.obj", "has no faces"),
            ("invalid-relative-vertex-index.obj", ":1:3: vertex index -4 is out of range"),
            ("issue-140-zero-face-idx.obj", ":16:3: vertex index 0: OBJ counts from 1"),
            ("issue-356-leading-spaces-newmtl.obj", "has no faces"),
            ("smoothing-group-two-squares.obj", ":22:1: normal index 5 is out of range"),
            ("test-nan.obj", ":12:3: the coordinate nan is not finite"),
        ],
    ),
];
