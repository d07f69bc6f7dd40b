//! Invalid files, and the messages about them.

use super::*;

#[test]
fn mistakes_are_named_with_their_place() {
    let vec2 = json!({"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2"});
    let cases: &[(&str, Value, &str)] = &[
        ("/asset/version", json!("1.1"), "/asset: glTF of version 1.1: only 2.0"),
        ("/asset/minVersion", json!("2.1"), "/asset: glTF of version 2.1: only 2.0"),
        ("/extensionsRequired", json!(["KHR_x"]), "/extensionsRequired: not supported: KHR_x"),
        ("/nodes/0/mesh", json!(3), "/nodes/0/mesh: there is no mesh 3"),
        ("/nodes/0/children", json!([0]), "/nodes/0: a node cannot be its own ancestor"),
        ("/nodes/0/translation", json!([1e39, 0, 0]), "/nodes/0/translation: a number is too large"),
        (
            "/nodes/0/matrix",
            json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
            "/nodes/0/matrix: the matrix",
        ),
        ("/accessors/0", vec2, "/meshes/0/primitives/0/attributes/POSITION: accessor 0 is Vec2 of F32"),
        (
            "/accessors/0/count",
            json!(4),
            "/attributes/POSITION: accessor 0 reaches byte 48 of buffer view 0, which has 36",
        ),
        ("/accessors/0/count", json!(u64::MAX), "/attributes/POSITION: accessor 0 reaches byte"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "/attributes/POSITION: accessor 0 reaches byte"),
        ("/accessors/0/count", json!(0), "accessor 0 has a count of 0"),
        ("/accessors/0/componentType", json!(5124), "accessor 0 is of an unknown type"),
        (
            "/accessors/0/count",
            json!(2),
            "/meshes/0/primitives/0/indices: index 2 is 2, but there are 2 vertices",
        ),
        (
            "/accessors/1/componentType",
            json!(5122),
            "/meshes/0/primitives/0/indices: accessor 1 is Scalar of I16",
        ),
        ("/bufferViews/0/byteLength", json!(999), "buffer view 0 reaches byte 999 of buffer 0, which has 42"),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "of buffer 0, which has 42"),
        ("/bufferViews/0/byteStride", json!(8), "elements of 12 bytes, its buffer view a byteStride of 8"),
        ("/bufferViews/0/buffer", json!(9), "buffer view 0 is of buffer 9, which is not there"),
        ("/buffers/0/byteLength", json!(43), "buffer 0: it is to have 43 bytes, but there are 42"),
        ("/buffers/0/uri", json!("../secret.bin"), "buffer 0: \"../secret.bin\" leaves the folder"),
        ("/buffers/0/uri", json!("missing.bin"), "buffer 0: cannot read dir/missing.bin"),
        (
            "/nodes/0/mesh",
            json!("red"),
            "/nodes/0/mesh: invalid type: string \"red\", expected the number of an item",
        ),
        ("/nodes/0/translation", json!([1, 2]), "/nodes/0/translation"),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(-1),
            "/meshes/0/primitives/0/attributes/POSITION: invalid type: integer `-1`",
        ),
        ("/accessors/0/count", Value::Null, "/accessors/0/count: this is null or NaN"),
    ];
    for (pointer, value, expected) in cases {
        let message = refused(&with(&[(pointer, value.clone())]));
        assert!(message.contains(expected), "{message}\n{expected}");
    }
}

#[test]
fn nodes_with_two_parents_or_cycles_are_rejected() {
    let nodes = json!([{"children": [1, 2]}, {"children": [2]}, {}]);
    assert!(
        refused(&with(&[("/nodes", nodes)]))
            .starts_with("/nodes/1/children/0: node 2 already has the parent 0")
    );
    let nodes = json!([{}, {"children": [2]}, {"children": [1]}]);
    assert!(refused(&with(&[("/nodes", nodes)])).starts_with("/nodes/1: a node cannot be its own ancestor"));
    let nodes = json!([{}, {"children": [0]}]);
    assert!(
        refused(&with(&[("/nodes", nodes)])).starts_with("/scenes/0/nodes/0: node 0 is a child of node 1")
    );
}

#[test]
fn sparse_overrides_are_checked() {
    let sparse = |count: u64, index: u8| {
        let mut file = triangle();
        add_accessor(&mut file, &[index], 5121, "SCALAR", 1);
        let sparse = json!({
            "count": count, "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 0},
        });
        set(&mut file, "/accessors/0/sparse", sparse);
        refused(&file)
    };
    assert!(sparse(1, 3).contains("accessor 0 overrides element 3 of 3"));
    assert!(sparse(4, 0).contains("accessor 0 overrides 4 of its 3 elements"));
    assert!(sparse(2, 0).contains("accessor 0 reaches byte 2 of buffer view 2, which has 1"));
}

#[test]
fn memory_is_bounded_by_the_file_size() {
    let mut file = triangle();
    set(&mut file, "/accessors/0", json!({"componentType": 5126, "count": 1u64 << 40, "type": "VEC3"}));
    assert!(refused(&file).contains("POSITION: the decoded data are far larger"));
    // Each copy of a buffer takes only a few bytes of JSON.
    let mut file = triangle();
    let accessor = add_accessor(&mut file, &vec![0; 1 << 18], 5121, "SCALAR", 1 << 18);
    let primitive = json!({"attributes": {"POSITION": 0}, "indices": accessor});
    set(&mut file, "/meshes/0/primitives", json!(vec![primitive; 4000]));
    assert!(refused(&file).contains("far larger"));
}

#[test]
fn invalid_json_is_reported_by_line_and_column() {
    let message = |bytes: &[u8]| read_bytes(bytes).unwrap_err().to_string();
    assert_eq!(
        message(b"{\n  \"asset\": 5,"),
        "dir/test.gltf:2:12: invalid type: integer `5`, expected struct Asset"
    );
    assert!(message(b"").starts_with("dir/test.gltf:1:0: EOF"));
    assert!(message(b"{}").contains("this is not glTF"));
    let bytes = glb(&json!({"asset": {"version": "2.0"}, "nodes": 1}), &[]);
    assert_eq!(message(&bytes), "dir/test.gltf: /nodes: invalid type: integer `1`, expected a sequence");
    let mut bytes = glb(&json!({"asset": {"version": "2.0"}}), &[]);
    bytes[20] = b'[';
    assert!(message(&bytes).starts_with("dir/test.gltf: JSON chunk, line 1, column "));
}
