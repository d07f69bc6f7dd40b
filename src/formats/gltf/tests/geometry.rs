//! Accessors and meshes.

use super::*;
use crate::math::{Rgb, Vec2, Vec3};
use crate::world::{MaterialId, Shape, World};

#[test]
fn triangle_reads_the_same_from_json_and_glb() {
    let read_json = read(&triangle());
    let mesh = read_json.mesh();
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert!(mesh.normals.is_empty() && mesh.uvs.is_empty() && mesh.colors.is_empty());
    assert!(read_json.warnings.is_empty(), "{:?}", read_json.warnings);
    let mut binary = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    binary.extend([0, 0, 1, 0, 2, 0]);
    let bytes = glb(&with(&[("/buffers/0", json!({"byteLength": 42}))]), &binary);
    assert_eq!(read_bytes(&bytes).unwrap().mesh(), mesh);
}

#[test]
fn vertices_without_indices_form_triangles_in_order() {
    let mut file = triangle();
    file["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    assert_eq!(read(&file).mesh().triangles, [[0, 1, 2]]);
}

#[test]
fn indices_of_one_two_and_four_bytes_are_read() {
    for (component, bytes) in [
        (5121, vec![2u8, 1, 0]),
        (5123, vec![2, 0, 1, 0, 0, 0]),
        (5125, vec![2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]),
    ] {
        let mut file = triangle();
        let accessor = add_accessor(&mut file, &bytes, component, "SCALAR", 3);
        set(&mut file, "/meshes/0/primitives/0/indices", json!(accessor));
        assert_eq!(read(&file).mesh().triangles, [[2, 1, 0]]);
    }
}

#[test]
fn normalised_integers_are_converted_to_fractions() {
    let uvs = |component, bytes: &[u8], normalized: bool| {
        let mut file = with_attribute("TEXCOORD_0", bytes, component, "VEC2");
        set(&mut file, "/accessors/2/normalized", json!(normalized));
        read(&file).mesh().uvs.clone()
    };
    assert_eq!(uvs(5121, &[0, 255, 51, 102, 0, 0], true), [Vec2::Y, Vec2::new(0.2, 0.4), Vec2::ZERO]);
    assert_eq!(uvs(5120, &[0x80, 0x81, 127, 0, 0, 0], true)[..2], [Vec2::NEG_ONE, Vec2::X]);
    assert_eq!(uvs(5122, &[1, 0, 0xff, 0xff, 0, 0, 0, 0, 0, 0, 0, 0], false)[0], Vec2::new(1.0, -1.0));
    let wide: Vec<u8> = [65535u16, 0, 0, 0, 0, 0].iter().flat_map(|n| n.to_le_bytes()).collect();
    assert_eq!(uvs(5123, &wide, true)[0], Vec2::X);
}

#[test]
fn quantised_positions_and_normals_are_read() {
    let mut file = triangle();
    let positions = add_accessor(&mut file, &[0, 0, 0, 10, 0, 0, 0, 20, 0], 5120, "VEC3", 3);
    set(&mut file, "/meshes/0/primitives/0/attributes/POSITION", json!(positions));
    let normals = add_accessor(&mut file, &[0, 0, 127, 0, 0, 127, 0, 0, 127], 5120, "VEC3", 3);
    set(&mut file, "/meshes/0/primitives/0/attributes/NORMAL", json!(normals));
    set(&mut file, "/extensionsRequired", json!(["KHR_mesh_quantization"]));
    let read = read(&file);
    assert_eq!(read.mesh().positions[1..], [Vec3::X * 10.0, Vec3::Y * 20.0]);
    assert_eq!(read.mesh().normals, [Vec3::Z; 3]);
}

#[test]
fn colors_of_three_and_four_components_are_read() {
    let bytes = floats(&[1.0, 0.5, 0.0, 0.25, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let file = with_attribute("COLOR_0", &bytes, 5126, "VEC4");
    assert_eq!(read(&file).mesh().colors, [Rgb::new(1.0, 0.5, 0.0), Rgb::WHITE, Rgb::BLACK]);
    let file = with_attribute("COLOR_0", &[255, 0, 0, 0, 255, 0, 0, 0, 255], 5121, "VEC3");
    assert_eq!(read(&file).mesh().colors[1], Rgb::new(0.0, 1.0, 0.0));
}

#[test]
fn interleaved_vertices_are_read_with_their_stride() {
    let mut file = triangle();
    // Position and normal of each vertex.
    let vertex = |p: [f32; 3]| floats(&[p[0], p[1], p[2], 0.0, 0.0, 1.0]);
    let bytes = [vertex([1.0, 0.0, 0.0]), vertex([0.0, 2.0, 0.0]), vertex([0.0, 0.0, 3.0])].concat();
    let positions = add_accessor(&mut file, &bytes, 5126, "VEC3", 3);
    set(&mut file, "/bufferViews/2/byteStride", json!(24));
    let normals =
        json!({"bufferView": 2, "byteOffset": 12, "componentType": 5126, "type": "VEC3", "count": 3});
    set(&mut file, "/accessors/3", normals);
    set(&mut file, "/meshes/0/primitives/0/attributes", json!({"POSITION": positions, "NORMAL": 3}));
    let read = read(&file);
    assert_eq!(read.mesh().positions, [Vec3::X, Vec3::Y * 2.0, Vec3::Z * 3.0]);
    assert_eq!(read.mesh().normals, [Vec3::Z; 3]);
}

#[test]
fn sparse_accessors_override_their_base_or_zeros() {
    let sparse = |file: &mut Value, accessor: &str| {
        add_accessor(file, &[2], 5121, "SCALAR", 1);
        add_accessor(file, &floats(&[5.0, 6.0, 7.0]), 5126, "VEC3", 1);
        let value = json!({
            "count": 1, "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 3},
        });
        set(file, &format!("{accessor}/sparse"), value);
    };
    let mut file = triangle();
    sparse(&mut file, "/accessors/0");
    assert_eq!(read(&file).mesh().positions, [Vec3::ZERO, Vec3::X, Vec3::new(5.0, 6.0, 7.0)]);
    file["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert_eq!(read(&file).mesh().positions, [Vec3::ZERO, Vec3::ZERO, Vec3::new(5.0, 6.0, 7.0)]);
}

#[test]
fn primitives_of_a_mesh_are_merged_with_their_materials() {
    let mut file =
        with_attribute("NORMAL", &floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]), 5126, "VEC3");
    let (lines, strip) = (json!({"attributes": {"POSITION": 0}, "mode": 1}), 5);
    set(&mut file, "/meshes/0/primitives/1", lines);
    let other = json!({"attributes": {"POSITION": 0}, "mode": strip, "indices": 1, "material": 0});
    set(&mut file, "/meshes/0/primitives/2", other.clone());
    set(&mut file, "/meshes/0/primitives/3", other);
    set(&mut file, "/materials", json!([{"name": "paint"}]));
    let read = read(&file);
    let mesh = read.mesh();
    assert_eq!(mesh.positions.len(), 6, "the last two share their vertices");
    assert_eq!(mesh.normals[..3], [Vec3::Z; 3]);
    assert_eq!(mesh.normals[3..], [Vec3::ZERO; 3], "flat");
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5], [3, 4, 5]]);
    let names: Vec<_> = mesh
        .triangle_materials
        .iter()
        .map(|id| read.assets.materials[id.0 as usize].name.as_deref())
        .collect();
    assert_eq!(names, [None, Some("paint"), Some("paint")]);
    assert!(read.warnings[0].contains("1 primitive without triangles"), "{:?}", read.warnings);
}

#[test]
fn second_texture_coordinates_and_vertex_alphas_are_read() {
    let mut file = with_attribute("TEXCOORD_1", &floats(&[0.5; 6]), 5126, "VEC2");
    let alphas =
        add_accessor(&mut file, &[255, 255, 255, 0, 255, 255, 255, 255, 0, 0, 0, 255], 5121, "VEC4", 3);
    set(&mut file, "/meshes/0/primitives/0/attributes/COLOR_0", json!(alphas));
    let read = read(&file);
    assert_eq!(read.mesh().uvs1, [Vec2::splat(0.5); 3]);
    assert!(read.mesh().uvs.is_empty());
    assert_eq!(read.mesh().alphas, [0.0, 1.0, 1.0]);
}

/// Two triangles that share an edge; the texture of the right one is mirrored.
pub(super) fn mirrored() -> Value {
    let positions = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let mut file = triangle();
    let attributes = [
        ("POSITION", floats(&positions), "VEC3"),
        ("NORMAL", floats(&[0.0, 0.0, 1.0].repeat(4)), "VEC3"),
        ("TEXCOORD_0", floats(&[0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.5, 2.0]), "VEC2"),
    ];
    for (name, bytes, kind) in attributes {
        let accessor = add_accessor(&mut file, &bytes, 5126, kind, 4);
        set(&mut file, &format!("/meshes/0/primitives/0/attributes/{name}"), json!(accessor));
    }
    let indices = add_accessor(&mut file, &[0, 1, 2, 1, 3, 2], 5121, "SCALAR", 6);
    set(&mut file, "/meshes/0/primitives/0/indices", json!(indices));
    materials::add_texture(&mut file);
    set(&mut file, "/materials", json!([{"normalTexture": {"index": 0}}]));
    set(&mut file, "/meshes/0/primitives/0/material", json!(0));
    file
}

#[test]
fn normal_maps_get_tangents_and_mirrored_ones_split_vertices() {
    let read = read(&mirrored());
    let mesh = read.mesh();
    assert_eq!(mesh.triangles[0], [0, 1, 2]);
    assert_eq!(mesh.triangles[1][1], 3);
    assert_eq!(mesh.positions.len(), 6, "the shared edge is there twice");
    for columns in [mesh.normals.len(), mesh.uvs.len(), mesh.tangents.len()] {
        assert_eq!(columns, 6);
    }
    // The texture is upright, as v points down: u runs along x, the bitangent points up.
    for corner in mesh.triangles[0] {
        let tangent = mesh.tangents[corner as usize];
        assert!((tangent.truncate() - Vec3::X).length() < 1e-6 && tangent.w == 1.0, "{tangent}");
    }
    assert!(mesh.triangles[1].iter().all(|corner| mesh.tangents[*corner as usize].w == -1.0));
}

#[test]
fn given_tangents_are_kept_and_normalised() {
    let mut file = with_attribute("NORMAL", &floats(&[0.0, 0.0, 1.0].repeat(3)), 5126, "VEC3");
    let given = floats(&[0.0, 2.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0]);
    let tangents = add_accessor(&mut file, &given, 5126, "VEC4", 3);
    set(&mut file, "/meshes/0/primitives/0/attributes/TANGENT", json!(tangents));
    let read = read(&file);
    let tangents = &read.mesh().tangents;
    assert_eq!(tangents[0].to_array(), [0.0, 1.0, 0.0, -1.0]);
    assert!((tangents[1].truncate().length() - 1.0).abs() < 1e-6 && tangents[1].z == 0.0, "{}", tangents[1]);
}

#[test]
fn tangent_generation_terminates_for_degenerate_meshes() {
    let strange = |positions: &[f32], uvs: &[f32], indices: &[u16]| {
        let mut file = mirrored();
        let count = positions.len() / 3;
        let attributes = [
            ("POSITION", floats(positions), "VEC3"),
            ("NORMAL", floats(&[0.0, 0.0, 1.0].repeat(count)), "VEC3"),
            ("TEXCOORD_0", floats(uvs), "VEC2"),
        ];
        for (name, bytes, kind) in attributes {
            let accessor = add_accessor(&mut file, &bytes, 5126, kind, count);
            set(&mut file, &format!("/meshes/0/primitives/0/attributes/{name}"), json!(accessor));
        }
        let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        let indices = add_accessor(&mut file, &bytes, 5123, "SCALAR", indices.len());
        set(&mut file, "/meshes/0/primitives/0/indices", json!(indices));
        let read = read(&file);
        assert!(read.mesh().tangents.iter().all(|tangent| tangent.is_finite()));
        read.warnings.len()
    };
    let huge = [3e38, 0.0, 0.0, -3e38, 3e38, 0.0, 0.0, -3e38, 3e38];
    assert_eq!(strange(&huge, &[1e30, -1e30, 3e38, 0.0, 0.0, 3e38], &[0, 1, 2]), 0);
    let tiny = [1e-44, 0.0, 0.0, 0.0, 1e-44, 0.0, 0.0, 0.0, 1e-44];
    assert_eq!(strange(&tiny, &[0.0; 6], &[0, 1, 2, 2, 1, 0]), 0);
    assert_eq!(strange(&[0.0; 9], &[0.0; 6], &[0, 1, 2]), 0);
    // Far too many triangles around one edge.
    let fan = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    assert_eq!(strange(&fan, &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0], &[0, 1, 2].repeat(20_000)), 1);
}

/// Exporters repeat a mesh for each of its materials.
#[test]
fn meshes_with_the_same_accessors_are_stored_once() {
    let primitive = |indices: usize, material: usize| json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": indices, "material": material}]});
    let mut file = triangle();
    let again = add_accessor(&mut file, &[0, 0, 2, 0, 1, 0], 5123, "SCALAR", 3);
    set(
        &mut file,
        "/meshes",
        json!([primitive(1, 0), primitive(1, 1), primitive(again, 1), primitive(1, 0)]),
    );
    set(&mut file, "/materials", json!([{"name": "paint"}, {"name": "metal"}]));
    set(&mut file, "/nodes", json!([{"mesh": 0}, {"mesh": 1}, {"mesh": 2}, {"mesh": 3}]));
    set(&mut file, "/scenes/0/nodes", json!([0, 1, 2, 3]));
    let read = read(&file);
    assert_eq!(read.assets.meshes.len(), 2);
    let mut world = World { assets: read.assets, ..World::default() };
    read.model.place(&mut world, None);
    let shown: Vec<_> = world
        .in_order()
        .into_iter()
        .map(|entity| {
            let shape = world.entities.get::<&Shape>(entity).map(|shape| (*shape).clone());
            let Ok(Shape::Mesh(mesh)) = shape else { panic!("no mesh") };
            let own = world.assets.meshes[mesh.0 as usize].triangle_materials[0];
            let material = world.entities.get::<&MaterialId>(entity).map_or(own, |own| *own);
            (mesh.0, world.assets.materials[material.0 as usize].name.clone().unwrap_or_default())
        })
        .collect();
    let expected = [(0, "paint"), (0, "metal"), (1, "metal"), (0, "paint")];
    assert_eq!(shown, expected.map(|(mesh, name)| (mesh, name.to_owned())));
}

/// 350 meshes of one set of accessors, a million triangles in total, in a file of 100 KB.
#[test]
fn shared_meshes_are_charged_once() {
    let corners: Vec<f32> = (0..1000).flat_map(|i| [i as f32, (i % 7) as f32, 0.0]).collect();
    let corner = |triangle: u32, corner: u32| ((triangle * 31 + corner * 333) % 1000) as u16;
    let indices: Vec<u8> =
        (0..3000).flat_map(|t| [0, 1, 2].map(|c| corner(t, c))).flat_map(u16::to_le_bytes).collect();
    let mut file = triangle();
    let positions = add_accessor(&mut file, &floats(&corners), 5126, "VEC3", 1000);
    let indices = add_accessor(&mut file, &indices, 5123, "SCALAR", 9000);
    let mesh = |material: usize| json!({"primitives": [{"attributes": {"POSITION": positions}, "indices": indices, "material": material}]});
    set(&mut file, "/meshes", (0..350).map(mesh).collect());
    set(&mut file, "/materials", (0..350).map(|i| json!({"name": i.to_string()})).collect());
    set(&mut file, "/nodes", (0..350).map(|i| json!({"mesh": i})).collect());
    set(&mut file, "/scenes/0/nodes", (0..350).collect());
    let read = read(&file);
    assert_eq!((read.assets.meshes.len(), read.mesh().triangles.len()), (1, 3000));
}
