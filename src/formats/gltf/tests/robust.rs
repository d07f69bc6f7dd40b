//! Damaged files must not make the reader panic.

use proptest::prelude::*;

use super::*;

/// A file that uses most features, with its vertices in the binary chunk.
pub(super) fn everything() -> Vec<u8> {
    let mut file = moving::skinned();
    materials::add_texture(&mut file);
    let slot = json!({"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2], "rotation": 1}}});
    let material = json!({
        "pbrMetallicRoughness": {"baseColorTexture": slot, "metallicRoughnessTexture": slot},
        "emissiveFactor": [1, 1, 1], "normalTexture": slot, "alphaMode": "MASK", "alphaCutoff": 0.5,
        "extensions": {
            "KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyTexture": slot},
            "KHR_materials_volume": {"thicknessFactor": 1},
            "KHR_materials_pbrSpecularGlossiness": {"specularGlossinessTexture": slot},
        },
    });
    set(&mut file, "/materials", json!([material]));
    let attributes = [
        ("NORMAL", floats(&[0.0, 0.0, 1.0].repeat(3)), "VEC3"),
        ("TEXCOORD_0", floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]), "VEC2"),
        ("COLOR_0", floats(&[0.5; 12]), "VEC4"),
    ];
    for (name, bytes, kind) in attributes {
        let accessor = add_accessor(&mut file, &bytes, 5126, kind, 3);
        set(&mut file, &format!("/meshes/0/primitives/0/attributes/{name}"), json!(accessor));
    }
    set(&mut file, "/meshes/0/primitives/0/material", json!(0));
    set(&mut file, "/meshes/0/primitives/0/targets", json!([{"POSITION": 0}]));
    set(&mut file, "/meshes/0/weights", json!([0.5]));
    set(&mut file, "/cameras", json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}]));
    let lamp = json!({
        "extensions": {"KHR_lights_punctual": {"light": 0}, "KHR_node_visibility": {"visible": true}},
        "camera": 0, "rotation": [0, 0, 0, 1],
    });
    set(&mut file, "/nodes/3", lamp);
    let places = add_accessor(&mut file, &floats(&[0.0; 6]), 5126, "VEC3", 2);
    let instancing = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    set(&mut file, "/nodes/4", json!({"mesh": 0, "extensions": instancing}));
    set(&mut file, "/scenes/0/nodes", json!([0, 1, 3, 4]));
    let cube = json!({"lights": [{"specularImages": [[0, 0, 0, 0, 0, 0]]}]});
    let lights = json!({
        "KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}, "EXT_lights_image_based": cube,
    });
    set(&mut file, "/extensions", lights);
    set(&mut file, "/scenes/0/extensions", json!({"EXT_lights_image_based": {"light": 0}}));
    moving::animate(&mut file, "translation", "VEC3", 2, &[0.0, 0.0, 0.0, 4.0, 0.0, 2.0]);
    // The indices again, compressed.
    let data = [&[0xe1u8, 0xf0][..], &[0; 16]].concat();
    let indices = add_accessor(&mut file, &data, 5123, "SCALAR", 3);
    let (view, buffer) = (&file["accessors"][indices]["bufferView"], &file["buffers"]);
    let (view, buffer) = (view.as_u64().unwrap(), buffer.as_array().unwrap().len() - 1);
    let meshopt = json!({"EXT_meshopt_compression": {
        "buffer": buffer, "byteLength": data.len(), "byteStride": 2, "count": 3, "mode": "TRIANGLES",
    }});
    let value = json!({"buffer": buffer, "byteLength": 6, "byteStride": 2, "extensions": meshopt});
    set(&mut file, &format!("/bufferViews/{view}"), value);
    set(&mut file, "/meshes/0/primitives/0/indices", json!(indices));
    set(&mut file, "/buffers/0", json!({"byteLength": 42}));
    let mut binary = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    binary.extend([0, 0, 1, 0, 2, 0]);
    glb(&file, &binary)
}

/// True if the file is read, or rejected with a one-line message that names it.
fn is_fair(bytes: &[u8]) -> bool {
    let moment = LoadOptions { time_s: Some(0.5), ..LoadOptions::default() };
    [LoadOptions::default(), moment].iter().all(|options| match read_with(bytes, options) {
        Ok(_) => true,
        Err(error) => {
            let message = error.to_string();
            message.starts_with("dir/test.gltf") && !message.contains('\n')
        }
    })
}

#[test]
fn complete_file_is_read_and_truncated_ones_do_not_panic() {
    let bytes = everything();
    let read = read_bytes(&bytes).unwrap();
    assert!(read.warnings.iter().all(|warning| warning.contains("animations: nodes")), "{:?}", read.warnings);
    assert!((0..bytes.len()).step_by(7).all(|length| is_fair(&bytes[..length])));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn damaged_files_are_read_or_rejected(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4)) {
        let mut bytes = everything();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        prop_assert!(is_fair(&bytes));
    }

    #[test]
    fn changed_numbers_are_read_or_rejected(which in any::<prop::sample::Index>(), number in any::<i64>(), small in 0u8..4) {
        let bytes = everything();
        let length = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
        let text = std::str::from_utf8(&bytes[20..20 + length]).unwrap();
        let digits: Vec<usize> = text.match_indices(|c: char| c.is_ascii_digit()).map(|(at, _)| at).collect();
        let at = digits[which.index(digits.len())];
        let number = if small < 2 { number } else { i64::from(small) };
        let changed = format!("{}{number}{}", &text[..at], &text[at + 1..]);
        prop_assert!(is_fair(changed.as_bytes()));
    }
}
