use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::world::{BlinnPhong, ColorInput, Material, Texture};

/// The result of loading a file.
struct Loaded {
    mesh: Result<Mesh, String>,
    assets: Assets,
    warnings: Vec<String>,
    images: Vec<PathBuf>,
}

/// Loads `obj` as a.obj from a folder with the given other files. The image loader fails for names that contain
/// "missing".
fn load_with(obj: &[u8], others: &[(&str, &str)]) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in others {
        let file = folder.path().join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, content).unwrap();
    }
    let path = folder.path().join("a.obj");
    std::fs::write(&path, obj).unwrap();
    let (mut assets, mut warnings, mut images) = (Assets::default(), Vec::new(), Vec::new());
    let relative = |path: &Path| path.strip_prefix(folder.path()).unwrap().to_owned();
    let mesh = load(&path, &mut assets, &mut warnings, &mut |image| {
        images.push(relative(image));
        if image.to_string_lossy().contains("missing") {
            return Err(LoadError::invalid(image, "is not there"));
        }
        Ok(ImageId(images.len() as u32))
    });
    let prefix = format!("{}/", folder.path().display());
    let shorten = |text: String| text.replace(&prefix, "");
    Loaded {
        mesh: mesh.map_err(|error| shorten(error.to_string())),
        assets,
        warnings: warnings.iter().map(|warning| shorten(warning.to_string())).collect(),
        images,
    }
}

fn mesh(obj: &str) -> Mesh {
    load_with(obj.as_bytes(), &[]).mesh.unwrap()
}

fn refusal(obj: &str) -> String {
    load_with(obj.as_bytes(), &[]).mesh.unwrap_err()
}

const CORNERS: &str = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\n";

#[test]
fn triangle_keeps_its_coordinates() {
    let mesh = mesh("o x\nv 0 0 0\nv 1 0 0\nv 0 1.5 0\nvt 0 0\nvt 1 0.25\nvn 0 0 1\nf 1/1/1 2/2/1 3/2/1\n");
    assert_eq!(mesh.name, "a");
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y * 1.5]);
    assert_eq!(mesh.uvs, [Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.75), Vec2::new(1.0, 0.75)]);
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert!(mesh.colors.is_empty() && mesh.triangle_materials.is_empty());
}

#[test]
fn concave_faces_are_triangulated_and_negative_indices_count_back() {
    let mesh = mesh(&format!("{CORNERS}f -5 -4 -3 -2 -1\nf 1 2 3\n"));
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (5, 4));
    let corner = |i: u32| mesh.positions[i as usize];
    let area = |t: &[u32; 3]| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).z / 2.0;
    assert!(mesh.triangles.iter().all(|t| area(t) > 0.0));
    assert_eq!(mesh.triangles[..3].iter().map(area).sum::<f32>(), 10.0);
}

#[test]
fn corners_without_normals_or_uvs_do_not_shift_the_others() {
    let mesh = mesh(&format!("{CORNERS}vt 0.5 0.5\nvn 1 0 0\nf 1 2 3\nf 1/1 2 4//1\nf 1/0/0 2/1/1 3\n"));
    for (position, (uv, normal)) in mesh.positions.iter().zip(mesh.uvs.iter().zip(&mesh.normals)) {
        assert!(*uv == Vec2::splat(0.5) || *uv == Vec2::new(0.0, 1.0), "{position}: {uv}");
        assert!(*normal == Vec3::X || *normal == Vec3::ZERO);
    }
    assert_eq!((mesh.uvs.len(), mesh.normals.len()), (mesh.positions.len(), mesh.positions.len()));
    let fourth = mesh.positions.iter().position(|p| p.x == 2.0).unwrap();
    assert_eq!(mesh.normals[fourth], Vec3::X);
}

#[test]
fn oddities_of_real_files_are_read() {
    let text = "\u{feff}# caf\u{e9}\nv 0 0 0 1 0 0\nv 1 0 0 0.5 # a weight\nv 0 \\\n 1 0 0 1 0 1\nvt 0.5\n\
        f 1/1 2/1\\\n3/1\nf 1/1 2/1 3/1 # again\ng\n";
    let text = text.replacen("2/1\\\n3/1", "2/1 \\\n3/1", 1);
    for text in [text.clone(), text.replace('\n', "\r\n"), text.replace('\n', "\r")] {
        let mesh = mesh(&text);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 2]]);
        assert_eq!(mesh.positions[1], Vec3::X);
        assert_eq!(mesh.colors, [Rgb::new(1.0, 0.0, 0.0), Rgb::WHITE, Rgb::new(0.0, 1.0, 0.0)]);
        assert_eq!(mesh.uvs[0], Vec2::new(0.5, 1.0));
    }
    let latin = load_with(b"# \xe9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", &[]);
    assert_eq!(latin.mesh.unwrap().triangles.len(), 1);
}

#[test]
fn points_lines_and_degenerate_faces_are_skipped_with_a_warning() {
    let loaded = load_with(format!("{CORNERS}f 1 2 3\nf 1 2\nl 1 2 3 4\np 1\np 2\n").as_bytes(), &[]);
    assert_eq!(loaded.mesh.unwrap().triangles.len(), 1);
    assert_eq!(
        loaded.warnings,
        [
            "a.obj: points skipped: 2 (only polygons are rendered)",
            "a.obj: lines skipped: 1 (only polygons are rendered)",
            "a.obj: faces of fewer than three corners skipped: 1 (only polygons are rendered)",
        ]
    );
}

#[test]
fn errors_name_the_line_and_the_reason() {
    let with = |line: &str| refusal(&format!("{CORNERS}{line}\n"));
    assert_eq!(with("f 1 2 6"), "a.obj:6:1: vertex index 6 is out of range: there are 5");
    assert_eq!(with("f 1 2 -6"), "a.obj:6:7: vertex index -6 is out of range: there are 5 before this line");
    assert_eq!(with("f 1 2 0"), "a.obj:6:7: vertex index 0: OBJ counts from 1");
    assert_eq!(with("f 1 2 3//1"), "a.obj:6:1: normal index 1 is out of range: there are 0");
    assert_eq!(with("f 1 2 x"), "a.obj:6:7: \"x\" is not a vertex index");
    assert_eq!(with("f 1 2 /1"), "a.obj:6:7: \"\" is not a vertex index");
    assert_eq!(with("f 1 2 3/1/1/1"), "a.obj:6:7: \"3/1/1/1\" has more than three indices");
    assert_eq!(with("v 1 2"), "a.obj:6:1: a vertex needs three coordinates");
    assert_eq!(with("v 1 nan 2"), "a.obj:6:5: the coordinate nan is not finite");
    assert_eq!(with("v 1 1e99 2"), "a.obj:6:5: the coordinate 1e99 is not finite");
    assert_eq!(with("v é 1 2"), "a.obj:6:3: \"é\" is not a number");
    assert_eq!(with(""), "a.obj: has no faces (only points or lines?): make a surface of it first");
    assert_eq!(
        with("f 1 2 9223372036854775807"),
        "a.obj:6:7: vertex index 9223372036854775807 is out of range: there are 5 before this line"
    );
}

/// Loads a triangle with the material "m" of a library.
fn material(lines: &str) -> (BlinnPhong, Loaded) {
    let obj = format!("mtllib sub\\lib rary.mtl\n{CORNERS}usemtl m\nf 1 2 3\nusemtl none\nf 1 2 4\n");
    let library = format!("newmtl m\n{lines}\nnewmtl other\nmap_Kd unused.png\n");
    let loaded = load_with(obj.as_bytes(), &[("sub/lib rary.mtl", &library)]);
    assert_eq!(loaded.mesh.as_ref().unwrap().triangle_materials, [MaterialId(1), MaterialId::DEFAULT]);
    let named = &loaded.assets.materials[1];
    assert_eq!(named.name.as_deref(), Some("m"));
    let Material::BlinnPhong(material) = named.material.clone() else { panic!() };
    (material, loaded)
}

fn constant(r: f32, g: f32, b: f32) -> ColorInput {
    ColorInput::Constant(Rgb::new(r, g, b))
}

#[test]
fn colours_and_shininess_are_converted() {
    let (m, loaded) = material("Kd 0.1 0.2 0.3 # red\nKs 0.5\nNs 50\nKe 1 2 3\nillum 2\nKa 1 1 1");
    assert_eq!((m.diffuse, m.specular), (constant(0.1, 0.2, 0.3), constant(0.5, 0.5, 0.5)));
    assert_eq!((m.shininess, m.emission), (50.0, constant(1.0, 2.0, 3.0)));
    assert_eq!((m.ior, m.kr), (None, constant(0.0, 0.0, 0.0)));
    assert_eq!(loaded.warnings, ["a.obj: no library has the material \"none\": the default is used"]);
    assert_eq!(material("Ks 1 1 1\nillum 1").0.specular, constant(0.0, 0.0, 0.0));
    assert_eq!(material("").0, BlinnPhong::default());
}

#[test]
fn illumination_models_make_mirrors_and_glass() {
    let mirror = material("Ks 0.9 0.8 0.7\nillum 3").0;
    assert_eq!((mirror.kr, mirror.ior), (constant(0.9, 0.8, 0.7), None));
    let glass = material("Kd 1 1 1\nNi 1.33\nTf 0.9 1 1\nillum 7").0;
    assert_eq!(
        (glass.ior, glass.kt, glass.kr),
        (Some(1.33), Rgb::new(0.9, 1.0, 1.0), constant(1.0, 1.0, 1.0))
    );
    assert_eq!(glass.diffuse, constant(0.0, 0.0, 0.0));
    assert_eq!(material("illum 4\nNi 1").0.ior, Some(1.5));
    assert_eq!(material("illum 9").0.kr, constant(0.0, 0.0, 0.0));
    for lines in ["Kd 1 1 1\nd 0.75", "Kd 1 1 1\nTr 0.25", "Kd 1 1 1\nd -halo 0.75\nTr 0.5"] {
        let veil = material(lines).0;
        assert_eq!((veil.diffuse, veil.kt), (constant(0.75, 0.75, 0.75), Rgb::splat(0.25)), "{lines}");
        assert_eq!((veil.ior, veil.kr), (Some(1.0), constant(0.0, 0.0, 0.0)));
    }
}

#[test]
fn images_are_loaded_once_and_relative_to_the_library() {
    let (m, loaded) = material(
        "Kd 0 0 0\nmap_Kd -s 2 2 tex\\a b.png\nKs .5 .5 .5\nmap_Ks tex/a b.png\nmap_Ke C:\\me\\glow.png\nbump n.png",
    );
    assert_eq!(loaded.images, [Path::new("sub/tex/a b.png"), Path::new("sub/glow.png")]);
    let texture = |input| match input {
        ColorInput::Texture(id) => loaded.assets.textures[id.0 as usize],
        ColorInput::Constant(_) => panic!("no texture"),
    };
    assert_eq!(texture(m.diffuse).scale, Vec2::splat(2.0));
    assert_eq!(texture(m.diffuse).factor, Rgb::WHITE);
    assert_eq!(texture(m.specular), Texture { factor: Rgb::splat(0.5), ..Texture::new(ImageId(1)) });
    assert_eq!(texture(m.emission), Texture::new(ImageId(2)));
    assert!(
        loaded.warnings.iter().any(|w| w.ends_with("material \"m\": not supported and ignored: map_Bump")),
        "{:?}",
        loaded.warnings
    );
}

#[test]
fn missing_files_and_values_cause_warnings() {
    let (m, loaded) = material("Kd 0.5 0.5 0.5\nmap_Kd missing.png\nKs red\nNs\nillum x\nmap_Ks");
    assert_eq!((m.diffuse, m.specular), (constant(0.5, 0.5, 0.5), constant(0.0, 0.0, 0.0)));
    let lines = "4 (Ks), 5 (Ns), 6 (illum), 7 (map_Ks)";
    let expected = format!("sub/lib rary.mtl: lines without a proper value are ignored: {lines}");
    assert!(loaded.warnings.contains(&expected), "{expected}: {:?}", loaded.warnings);
    assert!(loaded.warnings.contains(&"sub/missing.png: is not there".to_owned()));
    let loaded = load_with(format!("mtllib no.mtl\n{CORNERS}usemtl m\nf 1 2 3\n").as_bytes(), &[]);
    assert!(loaded.mesh.unwrap().triangle_materials.is_empty());
    assert!(loaded.warnings[0].starts_with("a.obj: cannot read the material library no.mtl: "));
}

#[test]
fn all_libraries_on_a_line_are_read() {
    let obj =
        format!("mtllib a.mtl b.mtl\n{CORNERS}usemtl a\nf 1 2 3\nusemtl\tb\nf 1 2 4\nusemtl a\nf 1 2 5");
    let loaded =
        load_with(obj.as_bytes(), &[("a.mtl", "newmtl a\nKd 1 0 0"), ("b.mtl", "newmtl b\nKd 0 1 0")]);
    assert_eq!(loaded.warnings, Vec::<String>::new());
    assert_eq!(loaded.mesh.unwrap().triangle_materials, [1, 2, 1].map(MaterialId));
    assert_eq!(loaded.assets.materials.len(), 3);
}

/// Words that break a careless parser.
const WORDS: [&str; 34] = [
    "v", "vt", "vn", "f", "l", "p", "o", "g", "usemtl", "mtllib", "a.mtl", "newmtl", "Kd", "map_Kd", "-s",
    "0", "1", "-1", "2/1", "1//1", "1/1/1", "3", "nan", "inf", "1e39", "9223372036854775807",
    "-9223372036854775808", "3/6148914691236517205/1", "#", "\\", "/", "é", "\t", "\n",
];

proptest! {
    #[test]
    fn arbitrary_words_do_not_panic(words in prop::collection::vec(0usize..WORDS.len() * 3 / 2, 0..120)) {
        let line_end = |i: &usize| WORDS.get(*i).copied().unwrap_or("\n");
        let text: Vec<&str> = words.iter().map(line_end).collect();
        let text = text.join(" ");
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nmtllib a.mtl\n{text}");
        let loaded = load_with(text.as_bytes(), &[("a.mtl", &text)]);
        if let Ok(mesh) = loaded.mesh {
            prop_assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < mesh.positions.len()));
            for length in [mesh.uvs.len(), mesh.normals.len(), mesh.colors.len()] {
                prop_assert!(length == 0 || length == mesh.positions.len());
            }
        }
    }

    #[test]
    fn arbitrary_bytes_do_not_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        load_with(&bytes, &[]).mesh.ok();
    }
}

#[test]
fn many_references_are_limited_and_reported_briefly() {
    let names: String =
        (0..1000).map(|i| format!("usemtl m{i}\nf 1 2 3\nmtllib {}a.mtl\n", "./".repeat(i % 500))).collect();
    let loaded = load_with(format!("{CORNERS}{names}").as_bytes(), &[("a.mtl", "newmtl m0")]);
    assert_eq!(loaded.mesh.unwrap().triangles.len(), 1000);
    assert_eq!(loaded.warnings.len(), 2, "{:?}", loaded.warnings);
    assert!(loaded.warnings[0].ends_with("only the first 256 material libraries are read"));
    assert!(loaded.warnings[1].contains("\"m8\" and 991 more"), "{}", loaded.warnings[1]);
}

#[test]
fn references_fall_back_to_the_folder_of_the_file() {
    let obj =
        format!("mtllib /home/me/x/a.mtl\nmtllib gone/b.mtl\n{CORNERS}usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3");
    let loaded = load_with(obj.as_bytes(), &[("a.mtl", "newmtl a"), ("b.mtl", "newmtl b")]);
    assert_eq!(loaded.warnings, Vec::<String>::new());
    assert_eq!(loaded.assets.materials.len(), 3);
}
