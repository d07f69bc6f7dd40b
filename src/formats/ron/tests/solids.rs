//! Shapes of files: strands and text.

use std::path::Path;
use std::sync::Arc;

use super::{only, read};
use crate::formats::ron::write;
use crate::world::shapes::text::tests::font_file;
use crate::world::{Shape, World};

/// A folder with strands and a font.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    put("hair.txt", b"0 0 0\n0 1 0\n\n1 0 0\n1 1 0\n1 2 0\n");
    put("bad.txt", b"0 0 0\n0 1 x\n");
    put("our.ttf", &font_file());
    put("none.ttf", b"no font");
    folder
}

fn load(folder: &Path, shape: &str) -> Result<World, String> {
    let scene = folder.join("scene.ron");
    std::fs::write(&scene, format!("(entities: [(shape: {shape}), (camera: Pinhole())])")).unwrap();
    crate::formats::load(&scene).map_err(|error| error.to_string().replace(&*folder.to_string_lossy(), ""))
}

#[test]
fn strands_and_text_are_read_once_written_and_compiled() {
    let folder = folder();
    for shape in [
        "Strands(file: \"hair.txt\", radius_m: 0.01, curve: Linear)",
        "Text(text: \"I \\\"O\\\"\\no\", font: \"our.ttf\", size_m: 2, depth_m: 0.5, bevel_m: 0.1, align: Center)",
    ] {
        let shape = shape.replace("\\\"", "");
        let world = load(folder.path(), &shape).unwrap();
        let text = write(&world, &folder.path().join("again.ron")).unwrap();
        assert!(text.contains(&shape), "{text}");
        let scene = crate::compile::compile(&world, None).unwrap();
        assert!(!scene.geometry.triangles.is_empty());
    }
    let strands = Arc::clone(&load(folder.path(), "Strands(file: \"hair.txt\")").unwrap().assets.strands[0]);
    assert_eq!((&strands.ends[..], strands.points.len()), (&[2, 5][..], 5));
    let world = load(folder.path(), "Text(text: \"I\", font: \"our.ttf\")").unwrap();
    let Shape::Text { size_m, .. } = only::<Shape>(&world) else { panic!("a text") };
    assert_eq!(size_m, 1.0);
}

#[test]
fn mistakes_in_files_of_shapes_are_named_with_their_place() {
    let folder = folder();
    for (shape, message) in [
        ("Strands(file: \"bad.txt\")", "/scene.ron:1:35: /bad.txt:2:5: expected a number, found \"x\""),
        ("Strands(file: \"our.ttf\")", "strands are .txt or .hair files, not \".ttf\""),
        ("Strands(file: \"hare.txt\")", "cannot read"),
        ("Text(text: \"I\", font: \"none.ttf\")", "/scene.ron:1:43: /none.ttf: is no font that can be read"),
        ("Text(text: \" \", font: \"our.ttf\")", "/scene.ron:1:32: the text is blank"),
        ("Text(text: \"Ix\", font: \"our.ttf\")", "/scene.ron:1:32: the font has no 'x'"),
        (
            "Text(text: \"I\", font: \"our.ttf\", bevel_m: 0.2)",
            "bevel_m (0.2) must be at most half of depth_m (0.2)",
        ),
        ("Text(text: 3, font: \"our.ttf\")", "expected the shape's text in quotes, found 3"),
    ] {
        let error = load(folder.path(), shape).map(|_| ()).unwrap_err();
        assert!(error.contains(message), "{error}");
    }
}

/// Python writes arrays in parentheses; any coordinate may have keys.
#[test]
fn lists_of_points_may_stand_in_parentheses_and_have_keys() {
    let [list, tuple, keyed] = [
        "Tube(points: [(0, 0, 0), (1, 1, 0)], radius_m: [0.1, 0.2])",
        "Tube(points: ((0, 0, 0), (1, 1, 0)), radius_m: (0.1, 0.2))",
        "Tube(points: [(0, 0, 0), (Keys([(0, 1), (1, 2)]), 1, 0)], radius_m: [0.1, Keys([(0, 0.2), (2, 1)])])",
    ]
    .map(|shape| only::<Shape>(&read(&format!("(entities: [(shape: {shape})])")).unwrap()));
    assert_eq!((&list, &list), (&tuple, &keyed));
}
