use std::path::Path;

use proptest::prelude::*;

use super::*;

fn read(bytes: &[u8]) -> Result<(Mesh, Vec<String>), String> {
    let file = parse(bytes, Path::new("a.stl")).map_err(|error| error.to_string())?;
    let warnings = file.warnings.iter().map(ToString::to_string).collect();
    Ok((Arc::unwrap_or_clone(file.mesh), warnings))
}

const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.5, 0.0], [0.0, 0.0, -1e-3]];
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

/// A tetrahedron as text. Its normals are wrong.
fn text() -> String {
    let facet = |face: &[usize; 3]| {
        let corners: String = face
            .iter()
            .map(|v| format!("      vertex {:e} {} {}\n", CORNERS[*v][0], CORNERS[*v][1], CORNERS[*v][2]))
            .collect();
        format!("  facet normal 0 0 nan\n    outer loop\n{corners}    endloop\n  endfacet\n")
    };
    format!(
        "solid a vertex of facet\n{}endsolid a vertex of facet\n",
        FACES.iter().map(facet).collect::<String>()
    )
}

fn binary(comment: &str, count: u32) -> Vec<u8> {
    let mut file = format!("{comment:80}").into_bytes();
    file.extend(count.to_le_bytes());
    for face in FACES {
        file.extend([0; 12]);
        face.iter().flat_map(|v| CORNERS[*v]).for_each(|number| file.extend(number.to_le_bytes()));
        file.extend([0x1f, 0x80]);
    }
    file
}

#[test]
fn text_and_binary_give_the_same_merged_mesh() {
    let (expected, warnings) = read(text().as_bytes()).unwrap();
    assert_eq!((expected.name.as_str(), warnings), ("a", vec![]));
    assert_eq!(expected.positions.len(), 4);
    // Vertices are numbered in the order of their first use.
    assert_eq!(expected.triangles, [[0, 1, 2], [0, 2, 3], [2, 1, 3], [1, 0, 3]]);
    assert!(expected.normals.is_empty());
    for comment in ["made by hand", "solid but binary"] {
        assert_eq!(read(&binary(comment, 4)), Ok((expected.clone(), vec![])), "{comment}");
    }
    let upper = text().to_uppercase().replace('\n', "\r\n").replace("2.5", "2,5");
    let tight = text().replace('\n', "\r").replace("  ", "\t");
    let twice = text().replacen("  endfacet\n", "  endfacet\nendsolid\nsolid b\n", 1);
    let marked = format!("\u{feff}\n{}", text());
    for text in [upper, tight, twice, marked] {
        assert_eq!(read(text.as_bytes()).unwrap().0, expected, "{text}");
    }
    let negative = text().replace("vertex 0e0 0 0", "vertex -0 0.0 -0e5");
    assert_eq!(read(negative.as_bytes()).unwrap().0, expected);
}

#[test]
fn wrong_counts_and_files_cut_short_are_told() {
    let told = |bytes: &[u8]| {
        let (mesh, warnings) = read(bytes).unwrap();
        (mesh.triangles.len(), warnings.join("; "))
    };
    let binary = |count: u32| binary("solid x", count);
    let cut = "a.stl: its header promises 4 triangles, but only 2 follow: it is cut short";
    assert_eq!(told(&binary(4)[..84 + 120]), (2, cut.to_owned()));
    let zero = "a.stl: its header promises 0 triangles, but 4 follow: all are read";
    assert_eq!(told(&binary(0)), (4, zero.to_owned()));
    assert!(told(&binary(u32::MAX)).1.contains("promises 4294967295 triangles, but only 4"));
    let mut longer = binary(4);
    longer.extend([0; 7]);
    assert_eq!(told(&longer), (4, "a.stl: 7 bytes after the last triangle are ignored".to_owned()));
    let text = text();
    let third = text.match_indices("facet normal").nth(2).unwrap().0;
    for length in [third + 5, third + 60, third + 100] {
        let (count, said) = told(&text.as_bytes()[..length]);
        assert_eq!((count, said.contains("cut short")), (2, true), "{length}: {said}");
    }
    // A missing last line is no loss.
    assert_eq!(told(&text.as_bytes()[..text.find("endsolid").unwrap()]), (4, String::new()));
}

#[test]
fn polygons_in_loops_are_split() {
    let text = "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 2 2 0\nvertex 0 2 0\nendloop\nendfacet\nendsolid";
    assert_eq!(read(text.as_bytes()).unwrap().0.triangles, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn errors_name_the_place_and_the_reason() {
    let refusal = |bytes: &[u8]| read(bytes).unwrap_err();
    let bad = text().replacen("vertex 0e0 2.5 0", "vertex 0e0 x 0", 1);
    assert_eq!(refusal(bad.as_bytes()), "a.stl:5:18: \"x\" is not a number");
    let bad = text().replacen("vertex 0e0 2.5 0", "vertex 0e0 nan 0", 1);
    assert_eq!(refusal(bad.as_bytes()), "a.stl:7:5: facet 0: its corner [0, NaN, 0] is not finite");
    let mut bad = binary("x", 4);
    bad[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert_eq!(refusal(&bad), "a.stl: facet 1: its corner [inf, 0, 0] is not finite");
    assert!(refusal(b"ply\nformat ascii 1.0").starts_with("a.stl: not an STL file: neither"));
    let page = "<html>404: the file that you asked for is not here</html>".repeat(8);
    assert!(refusal(page.as_bytes()).starts_with("a.stl: not an STL file"));
    assert!(refusal(b"solid\nendsolid\n").ends_with("has no triangles"));
    assert!(refusal(&binary("x", 4)[..84]).contains("promises 4 triangles, but none follows"));
}

proptest! {
    #[test]
    fn damaged_files_do_not_panic(
        is_text in any::<bool>(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        length in any::<prop::sample::Index>(),
    ) {
        let mut file = if is_text { text().into_bytes() } else { binary("solid", 4) };
        for (place, value) in damage {
            let place = place.index(file.len());
            file[place] = value;
        }
        file.truncate(length.index(file.len() + 1));
        if let Ok((mesh, _)) = read(&file) {
            prop_assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < mesh.positions.len()));
            prop_assert!(mesh.positions.iter().all(|p| p.is_finite()));
        }
    }

    #[test]
    fn arbitrary_bytes_do_not_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read(&bytes);
        let _ = read(&[b"solid\n", &bytes[..]].concat());
    }
}
