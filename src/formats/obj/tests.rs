use std::path::{Path, PathBuf};

use proptest::prelude::*;

use super::*;
use crate::world::{
    AlphaMode, BlinnPhong, Channel, ColorInput, Image, ImageId, Material, Principled, Texels, Texture,
};

/// The result of loading a file.
struct Loaded {
    mesh: Result<Mesh, String>,
    assets: Assets,
    warnings: Vec<String>,
    images: Vec<PathBuf>,
}

/// Loads `obj` as a.obj from a folder with the given other files. The image loader fails for names that contain
/// "missing"; other images are a texel of gray or, if the name says so, of normals or half transparent.
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
        let name = image.to_string_lossy();
        let texel = match (name.contains("normal"), name.contains("leaf")) {
            (true, _) => [128, 128, 255, 255],
            (_, true) => [128, 128, 128, 127],
            _ => [128, 128, 128, 255],
        };
        let texels = Texels::Rgba8(vec![texel]);
        Ok(Image { source: None, width: 1, height: 1, texels }.into())
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
            "a.obj:7: faces of fewer than three corners skipped: 1 (only polygons are rendered)",
            "a.obj:8: lines skipped: 1 (only polygons are rendered)",
            "a.obj:9: points skipped: 2 (only polygons are rendered)",
        ]
    );
}

#[test]
fn errors_name_the_line_and_the_reason() {
    let with = |line: &str| refusal(&format!("{CORNERS}{line}\n"));
    assert_eq!(with("f 1 2 6"), "a.obj:6:7: vertex index 6 is out of range: there are 5");
    assert_eq!(with("f 1 2 -6"), "a.obj:6:7: vertex index -6 is out of range: there are 5 before this line");
    assert_eq!(with("f 1 2 0"), "a.obj:6:7: vertex index 0: OBJ counts from 1");
    assert_eq!(with("f 1 2 x"), "a.obj:6:7: \"x\" is not a vertex index");
    assert_eq!(with("f 1 2 /1"), "a.obj:6:7: \"\" is not a vertex index");
    let used = |line: &str| with(&format!("{line}\nf 1 2 3\nf 1 2 6"));
    assert_eq!(used("v 1 2"), "a.obj:6:1: a vertex needs three coordinates");
    assert_eq!(used("v 1 nan 2"), "a.obj:6:5: the coordinate nan is not finite");
    assert_eq!(used("v 1 1e99 2"), "a.obj:6:5: the coordinate 1e99 is not finite");
    assert_eq!(used("v é 1 2"), "a.obj:6:3: \"é\" is not a number");
    assert_eq!(with(""), "a.obj: has no faces (only points or lines?): make a surface of it first");
    assert_eq!(
        with("f 1 2 9223372036854775807"),
        "a.obj:6:7: vertex index 9223372036854775807 is out of range: there are 5"
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
    assert_eq!(loaded.warnings, ["a.obj:9: no library has the material \"none\": the default is used"]);
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
    // Blender's surface with an alpha of a quarter.
    let quarter = material("Kd 1 1 1\nNi 1.5\nd 0.25\nillum 9").0;
    assert_eq!((quarter.ior, quarter.kt), (Some(1.0), Rgb::splat(0.75)));
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
    // The last one is read to see if it holds normals.
    let mut images = loaded.images.clone();
    images.sort();
    assert_eq!(images, ["sub/glow.png", "sub/n.png", "sub/tex/a b.png"].map(Path::new));
    let texture = |input| match input {
        ColorInput::Texture(id) => loaded.assets.textures[id.0 as usize],
        ColorInput::Constant(_) => panic!("no texture"),
    };
    assert_eq!(texture(m.diffuse).scale, Vec2::splat(2.0));
    assert_eq!(texture(m.diffuse).factor, Rgb::WHITE);
    assert_eq!(texture(m.specular), Texture { factor: Rgb::splat(0.5), ..Texture::trilinear(ImageId(1)) });
    assert_eq!(texture(m.emission), Texture::trilinear(ImageId(2)));
    assert!(
        loaded.warnings.contains(&"sub/lib rary.mtl:7: not supported and ignored: bump (line 7)".to_owned()),
        "{:?}",
        loaded.warnings
    );
}

#[test]
fn missing_files_and_values_cause_warnings() {
    let (m, loaded) = material("Kd 0.5 0.5 0.5\nmap_Kd missing.png\nKs red\nNs\nillum x\nmap_Ks");
    assert_eq!((m.diffuse, m.specular), (constant(0.5, 0.5, 0.5), constant(0.0, 0.0, 0.0)));
    let lines = "4 (Ks), 5 (Ns), 6 (illum), 7 (map_Ks)";
    let expected = format!("sub/lib rary.mtl:4: lines without a proper value are ignored: {lines}");
    assert!(loaded.warnings.contains(&expected), "{expected}: {:?}", loaded.warnings);
    assert!(loaded.warnings.contains(&"sub/missing.png: is not there".to_owned()));
    let loaded = load_with(format!("mtllib no.mtl\n{CORNERS}usemtl m\nf 1 2 3\n").as_bytes(), &[]);
    assert!(loaded.mesh.unwrap().triangle_materials.is_empty());
    assert!(loaded.warnings[0].starts_with("a.obj:1: cannot read the material library no.mtl: "));
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

#[test]
fn colours_of_vertices_follow_the_srgb_curve() {
    let colors = |lines: &str| {
        let loaded = load_with(format!("{lines}\nf 1 2 3\n").as_bytes(), &[]);
        (loaded.mesh.unwrap().colors, loaded.warnings)
    };
    let (plain, warnings) = colors("v 0 0 0 0.501961 0 1\nv 1 0 0\nv 0 1 0 nan 1 1");
    assert!((plain[0].r - 0.215_860_9).abs() < 1e-6 && plain[0].b == 1.0, "{plain:?}");
    assert_eq!(plain[1..], [Rgb::WHITE; 2]);
    assert_eq!(warnings, ["a.obj:3: colours that are not finite numbers: 1; 1 instead"]);
    let (bytes, warnings) = colors("v 0 0 0 128 0 255\nv 1 0 0\nv 0 1 0 255 255 255");
    assert!((bytes[0].r - 0.215_860_5).abs() < 1e-6 && bytes[0].b == 1.0, "{bytes:?}");
    assert_eq!(bytes[1..], [Rgb::WHITE; 2]);
    let expected = "a.obj: the colours of its vertices go up to 255, not 1: they are taken for 0 to 255 and divided by it";
    assert_eq!(warnings, [expected]);
}

#[test]
fn bad_values_that_are_no_geometry_are_mended_and_told() {
    // Two upright faces along an edge; the second is three times as large. No face uses the last vertex.
    let file = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 3\nv 1 nan 0\nvt nan 0\nvt 1\nvt x 1\nvn 0 0 inf\nvn 1 0\n\
                f 1/1/1 2/2/1 3/3/2\nf 1/9/9 3//-7 4/x/x\nf 1/1/1/1 2 3\n";
    let loaded = load_with(file.as_bytes(), &[]);
    let mesh = loaded.mesh.unwrap();
    assert_eq!(mesh.positions.iter().filter(|p| **p == Vec3::ZERO).count(), 2, "{mesh:?}");
    let smooth = Vec3::new(3.0, 0.0, 1.0 + 1.0).normalize();
    for triangle in &mesh.triangles[..2] {
        let normal = mesh.normals[triangle[0] as usize];
        assert!((normal - smooth).length() < 1e-6, "{normal}");
    }
    let expected = [
        "5: vertices without a finite position: 1; no face uses them, so they are left out",
        "6: texture coordinates that are not finite numbers: 2; (0, 0) instead",
        "9: normals that are not finite numbers: 2; worked out from the faces instead",
        "12: texture coordinates that faces name, but that do not exist: 2; (0, 0) instead",
        "12: normals that faces name, but that do not exist: 3; worked out from the faces instead",
        "13: corners of more than three indices: 1; the first three count",
    ];
    assert_eq!(loaded.warnings, expected.map(|line| format!("a.obj:{line}")));
}

/// Some lines change nothing in a picture; those that leave something out are told.
#[test]
fn lines_that_are_not_used_are_told_where_something_is_missing() {
    let file = "g\no\nvp 0.1 0.2\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl\nlod 3\nd_interp on\nshadow_obj a.obj\n\
                cstype bspline\ndeg 3\ncurv 0 1 1 2\ncall part.obj\ncsh ls\nf 1 2 3\n";
    let warnings = load_with(file.as_bytes(), &[]).warnings;
    let expected = [
        "13: free-form curves and surfaces skipped: 1 (only polygons are rendered)",
        "14: lines that include other files skipped: 2 (a scene can show several: shape: Mesh(\"file.obj\"))",
    ];
    assert_eq!(warnings, expected.map(|line| format!("a.obj:{line}")));
}

/// Two quadrilaterals along an edge, at a right angle.
const BENT: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 -1\nv 1 1 -1\n";

#[test]
fn smoothing_groups_without_normals_become_normals() {
    let edge = |faces: &str| {
        let mesh = mesh(&format!("{BENT}vt 0 0\nvt 1 1\nvn 0 1 0\n{faces}"));
        let at = |corner: u32| mesh.normals.get(corner as usize).copied();
        // The second vertex, in both faces.
        let uses = mesh.triangles.iter().flatten().filter(|v| mesh.positions[**v as usize] == Vec3::X);
        let normals: Vec<_> = uses.map(|v| at(*v)).collect();
        (normals[0], normals[normals.len() - 1], mesh.positions.len())
    };
    let smooth = Some(Vec3::new(1.0, 0.0, 1.0).normalize());
    let near = |a: Option<Vec3>, b: Option<Vec3>| (a.unwrap() - b.unwrap()).length() < 1e-6;
    // One group, also where texture coordinates differ: both faces have equal areas.
    for faces in
        ["s 1\nf 1 2 3 4\nf 2 5 6 3", "s on\nf 1 2 3 4\nf 2 5 6 3", "s 7\nf 1 2/1 3 4\nusemtl x\nf 2/2 5 6 3"]
    {
        let (first, last, _) = edge(faces);
        assert!(near(first, smooth) && near(last, smooth), "{faces}: {first:?}, {last:?}");
    }
    // Different groups split the vertices of the edge.
    let (first, last, count) = edge("s 1\nf 1 2 3 4\ns 2\nf 2 5 6 3");
    assert!(near(first, Some(Vec3::Z)) && near(last, Some(Vec3::X)) && count == 8);
    // A face without a group is flat, and so is a file without groups; normals of the file count more.
    let (first, last, _) = edge("s 1\nf 1 2 3 4\ns off\nf 2 5 6 3");
    assert!(near(first, Some(Vec3::Z)) && last == Some(Vec3::ZERO));
    assert_eq!(edge("s 0\nf 1 2 3 4\nf 2 5 6 3"), (None, None, 6));
    assert_eq!(edge("s 1\nf 1//1 2//1 3//1\nf 2//1 5//1 6//1").0, Some(Vec3::Y));
}

#[test]
fn objects_stay_apart_where_a_scene_consists_of_the_file() {
    let apart = |text: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, format!("{CORNERS}{text}")).unwrap();
        let no_image = &mut |_: &Path| panic!("no image");
        let parts = load_objects(&path, &mut Assets::default(), &mut Vec::new(), no_image).unwrap();
        parts.into_iter().map(|(name, mesh)| (name, mesh.triangles.len())).collect::<Vec<_>>()
    };
    let named =
        |list: &[(&str, usize)]| list.iter().map(|(name, n)| ((*name).to_owned(), *n)).collect::<Vec<_>>();
    let text = "f 1 2 3\no the wheel\ng left\nf 1 2 3\nusemtl x\nf 1 2 4\no empty\no car\nf 1 2 5\no the wheel\nf 2 3 4\n";
    assert_eq!(apart(text), named(&[("", 1), ("the wheel", 3), ("car", 1)]));
    assert_eq!(apart("g a\nf 1 2 3\ng b\nf 1 2 3\n"), named(&[("a", 1), ("b", 1)]));
    assert_eq!(apart("o a\ng b\nf 1 2 3\ng c\nf 1 2 3\n"), named(&[("a", 2)]));
    assert_eq!(apart("f 1 2 3\n"), named(&[("", 1)]));
    assert_eq!(mesh(&format!("{CORNERS}{text}")).triangles.len(), 5);
}

#[test]
fn the_only_material_of_a_library_needs_no_usemtl() {
    let text = format!("mtllib a.mtl\n{CORNERS}f 1 2 3\nf 1 2 4\n");
    let loaded = load_with(text.as_bytes(), &[("a.mtl", "newmtl red\nKd 1 0 0")]);
    assert_eq!(loaded.mesh.unwrap().triangle_materials, [MaterialId(1); 2]);
    assert_eq!(loaded.warnings, Vec::<String>::new());
    let loaded = load_with(text.as_bytes(), &[("a.mtl", "newmtl red\nnewmtl blue")]);
    assert!(loaded.mesh.unwrap().triangle_materials.is_empty());
    let expected = "a.obj:1: none of the 2 materials of its library is used: there is no usemtl line";
    assert_eq!(loaded.warnings, [expected]);
}

#[test]
fn values_out_of_range_are_limited_and_told() {
    let (m, loaded) = material("Kd 255 51 0\nKs -1 0 0\nNs -5\nd 3\nillum 42\nTf 2 1 1");
    assert_eq!((m.diffuse, m.specular), (constant(1.0, 0.2, 0.0), constant(0.0, 0.0, 0.0)));
    assert_eq!((m.shininess, m.ior, m.kt), (0.0, None, Rgb::WHITE));
    let expected = "sub/lib rary.mtl:2: values out of range: Kd goes up to 255, not 1: divided by 255 (line 2), \
                    Ks -1 0 0 becomes 0 0 0 (line 3), Ns -5 becomes 0 (line 4), d 3 becomes 1 (line 5), \
                    illum 42 becomes 2 (line 6), Tf 2 1 1 becomes 1 1 1 (line 7)";
    assert!(loaded.warnings.contains(&expected.to_owned()), "{:?}", loaded.warnings);
    assert_eq!(
        material("kd 1.25 1 1\nMAP_KD a.png").0.diffuse,
        ColorInput::Texture(crate::world::TextureId(0))
    );
}

#[test]
fn maps_of_opacity_and_transparent_images_cut_out() {
    let cut = |lines: &str| {
        let (m, loaded) = material(lines);
        let texture = m
            .alpha
            .texture
            .map(|(id, channel)| (loaded.assets.textures[id.0 as usize].image().unwrap().0, channel));
        (m.alpha.factor, texture, m.alpha_mode, m.ior)
    };
    let blend = AlphaMode::Blend;
    assert_eq!(cut("map_Kd a.png\nmap_d b.png"), (1.0, Some((0, Channel::Red)), blend, None));
    assert_eq!(cut("map_Kd leaf.png\nd 0.5"), (0.5, Some((0, Channel::Alpha)), blend, None));
    assert_eq!(cut("map_Kd leaf.png\nmap_d b.png"), (1.0, Some((0, Channel::Red)), blend, None));
    assert_eq!(cut("map_d -imfchan g leaf.png\nd 0"), (1.0, Some((0, Channel::Green)), blend, None));
    assert_eq!(cut("map_Kd a.png"), (1.0, None, AlphaMode::Opaque, None));
    assert_eq!(cut("d 0"), (0.0, None, blend, None));
    let (_, loaded) = material("Kd 1 1 1\nd 0");
    let expected = "sub/lib rary.mtl:3: material \"m\" has d 0: nothing of it is there";
    assert!(loaded.warnings.contains(&expected.to_owned()), "{:?}", loaded.warnings);
}

/// The physically based material "m" of a library.
fn physical(lines: &str) -> (Principled, Loaded) {
    let obj = format!("mtllib a.mtl\n{CORNERS}usemtl m\nf 1 2 3\n");
    let loaded = load_with(obj.as_bytes(), &[("a.mtl", &format!("newmtl m\n{lines}\n"))]);
    let Material::Principled(material) = loaded.assets.materials[1].material.clone() else { panic!() };
    (*material, loaded)
}

/// Blender writes normal maps like this, without any line of the extension.
#[test]
fn a_bump_map_of_normals_makes_a_material_physical() {
    let lines = "Kd 0.5 0.5 0.5\nNs 250\nmap_Bump -bm 0.5 normal.png";
    let (m, loaded) = physical(lines);
    assert_eq!(m.normal.map(|map| map.scale), Some(0.5));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let (_, heights) = material("Kd 0.5 0.5 0.5\nmap_Bump heights.png");
    assert!(heights.warnings.iter().any(|line| line.contains("map_Bump")), "{:?}", heights.warnings);
}

#[test]
fn the_extension_for_physically_based_materials_is_read() {
    let lines = "Kd 0.9 0.6 0.2\nPm 1\nPr 0.1\nPc 0.5\nPcr 0.25\nPs 0.125\naniso 0.5\nanisor 0.25\nKe 1 2 3\nNi 1.4\nillum 2";
    let (m, loaded) = physical(lines);
    assert_eq!(loaded.warnings, Vec::<String>::new());
    assert_eq!((m.base_color, m.emission), (constant(0.9, 0.6, 0.2), constant(1.0, 2.0, 3.0)));
    assert_eq!((m.metallic.factor, m.roughness.factor, m.ior), (1.0, 0.1, 1.4));
    assert_eq!((m.clearcoat.factor, m.clearcoat_roughness.factor), (0.5, 0.25));
    assert_eq!(m.sheen_color, constant(0.125, 0.125, 0.125));
    assert!(
        (m.anisotropy.rotation - std::f32::consts::FRAC_PI_2).abs() < 1e-6 && m.anisotropy.strength == 0.5
    );
    assert!(m.double_sided && m.alpha_mode == AlphaMode::Opaque);

    let maps = "map_Kd leaf.png\nPr 0.5\nmap_Pr r.png\nmap_Pm -imfchan b m.png\nnorm -bm 0.5 n.png\nbump h.png\ndisp d.png";
    let (m, loaded) = physical(maps);
    let channel = |input: crate::world::ScalarInput| input.texture.unwrap().1;
    assert_eq!(
        (channel(m.roughness), m.roughness.factor, channel(m.metallic)),
        (Channel::Red, 1.0, Channel::Blue)
    );
    assert_eq!((m.normal.unwrap().scale, channel(m.alpha)), (0.5, Channel::Alpha));
    assert_eq!(loaded.warnings, ["a.mtl:7: not supported and ignored: bump (line 7), disp (line 8)"]);
    let (_, loaded) = physical("Pr 1\nKa 1 1 1\nmap_Ka a.png\nshine 3\nKd 0 1");
    let expected = [
        "a.mtl:6: lines without a proper value are ignored: 6 (Kd)",
        "a.mtl:5: not supported and ignored: shine (line 5)",
    ];
    assert_eq!(loaded.warnings, expected);

    // Normals in a map for heights, as most exporters write them; heights themselves have no scale.
    assert_eq!(physical("Pr 1\nmap_Bump -bm 2 normals.png").0.normal.unwrap().scale, 2.0);
    let (m, loaded) = physical("Pm 0\nmap_bump heights.png");
    assert!(m.normal.is_none() && loaded.warnings[0].ends_with("ignored: map_Bump (line 3)"));
    let (m, _) = physical("Pr 0.2\nillum 7\nTf 0.5 1 1");
    assert!(m.volume.is_some() && m.transmission.factor == 1.0 && m.base_color == constant(0.5, 1.0, 1.0));
    let (m, _) = physical("Pr 0.2\nd 0.25");
    assert_eq!((m.alpha.factor, m.alpha_mode), (0.25, AlphaMode::Blend));
}

#[test]
fn positions_far_from_the_origin_keep_their_digits() {
    let far = "v 450123.456 312.5 -5412345.678\nv 450124.456 312.5 -5412345.678\nv 450123.456 313.625 -5412345.678\nf 1 2 3\n";
    // Equal vertices say nothing of the size.
    let twice = mesh(&format!("v 450123.456 312.5 -5412345.678\n{}", far.replace("f 1 2 3", "f 2 3 4")));
    let far = mesh(far);
    assert_eq!(twice.origin, far.origin);
    let position = |at: usize| far.origin + far.positions[at].as_dvec3();
    let expected = crate::math::DVec3::new(450123.456, 313.625, -5412345.678);
    assert!((position(2) - expected).length() < 1e-6, "{}", position(2));
    assert_eq!(mesh(&format!("{CORNERS}f 1 2 3\n")).origin, crate::math::DVec3::ZERO);
}

#[test]
fn texts_of_other_systems_are_read() {
    let obj = format!("mtllib zwölf.mtl\n{CORNERS}usemtl grün\nf 1 2 3\n");
    let wide = |text: &str, unit: fn(u16) -> [u8; 2]| -> Vec<u8> {
        std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(unit).collect()
    };
    for unit in [u16::to_le_bytes as fn(u16) -> [u8; 2], u16::to_be_bytes] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, wide(&obj, unit)).unwrap();
        std::fs::write(folder.path().join("zwölf.mtl"), wide("newmtl grün\r\nKd 0 1 0\r\n", unit)).unwrap();
        let (mut assets, mut warnings) = (Assets::default(), Vec::new());
        let mesh = load(&path, &mut assets, &mut warnings, &mut |_| panic!("no image")).unwrap();
        assert_eq!((mesh.triangle_materials, warnings), (vec![MaterialId(1)], vec![]));
        assert_eq!(assets.materials[1].name.as_deref(), Some("grün"));
    }
}

#[test]
fn names_may_have_blanks_and_comments() {
    let faces = "usemtl dark red # the roof\nf 1 2 3\nusemtl light\tblue\nf 1 2 4\nusemtl #3\nf 1 2 5\n";
    let obj = format!("mtllib my first.mtl my second.mtl\tthird.mtl # all\n{CORNERS}{faces}");
    let others = [
        ("my first.mtl", "newmtl dark red"),
        ("my second.mtl", "newmtl light\tblue"),
        ("third.mtl", "newmtl #3"),
    ];
    let loaded = load_with(obj.as_bytes(), &others);
    assert_eq!(loaded.warnings, Vec::<String>::new());
    assert_eq!(loaded.mesh.unwrap().triangle_materials, [1, 2, 3].map(MaterialId));
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
