//! Nothing that a file says makes the reader panic.

use proptest::prelude::*;

use super::*;

/// A file with something of everything.
fn everything() -> Vec<u8> {
    let mut file = with_attribute("TEXCOORD_0", &floats(&[0.5; 6]), 5126, "VEC2");
    materials::add_texture(&mut file);
    let pbr =
        json!({"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}});
    set(&mut file, "/materials", json!([{"pbrMetallicRoughness": pbr, "emissiveFactor": [1, 1, 1]}]));
    set(&mut file, "/meshes/0/primitives/0/material", json!(0));
    set(&mut file, "/cameras", json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}]));
    let lamp =
        json!({"extensions": {"KHR_lights_punctual": {"light": 0}}, "camera": 0, "rotation": [0, 0, 0, 1]});
    set(&mut file, "/nodes/1", lamp);
    set(&mut file, "/nodes/0/children", json!([1]));
    let lights = json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}});
    set(&mut file, "/extensions", lights);
    set(&mut file, "/buffers/0", json!({"byteLength": 42}));
    let mut binary = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    binary.extend([0, 0, 1, 0, 2, 0]);
    glb(&file, &binary)
}

/// One line that names the file, or a file that was read.
fn is_fair(bytes: &[u8]) -> bool {
    match read_bytes(bytes) {
        Ok(_) => true,
        Err(error) => {
            let message = error.to_string();
            message.starts_with("dir/test.gltf") && !message.contains('\n')
        }
    }
}

#[test]
fn the_whole_is_read_and_no_prefix_panics() {
    let bytes = everything();
    read_bytes(&bytes).unwrap();
    assert!((0..bytes.len()).step_by(7).all(|length| is_fair(&bytes[..length])));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn damaged_files_are_read_or_refused(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4)) {
        let mut bytes = everything();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        prop_assert!(is_fair(&bytes));
    }

    #[test]
    fn other_numbers_are_read_or_refused(which in any::<prop::sample::Index>(), number in any::<i64>(), small in 0u8..4) {
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
