//! Tests that go through the crate's public face, in one binary to link once.

mod gltf;
mod meshes;
mod pictures;
