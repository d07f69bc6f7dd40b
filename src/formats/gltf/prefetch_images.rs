//! Parallel decoding of images, before materials are read in sequence.

use std::collections::{HashMap, HashSet};

use gltf::json::{self, Index};
use rayon::prelude::*;
use serde_json::Value;

use super::Import;
use super::image::{Encoded, ImageLocation, place, whole};
use crate::error::LoadError;
use crate::world::DecodedImage;

impl Import<'_> {
    /// Decodes the images of all materials used by nodes below `roots`. Errors are not reported here: reading the
    /// material that uses the image reports them, or succeeds.
    pub(super) fn decode_ahead(&mut self, roots: &[usize]) {
        let document = self.document;
        let mut encoded: Vec<(ImageLocation, Encoded)> = Vec::new();
        let mut known = HashSet::new();
        let mut lengths: HashMap<usize, u64> = HashMap::new();
        for texture in self.textures_below(roots) {
            let at = format!("/textures/{}", texture.value());
            let Some(image) = self.source(texture, "") else { continue };
            let Some(place) = place(document, image, &at) else { continue };
            if !known.insert(place.clone()) {
                continue;
            }
            if let ImageLocation::Buffer(buffer, _, length) = place {
                // Overlapping views are an error as soon as a material uses them.
                let sum = lengths.entry(buffer).or_default();
                *sum = sum.saturating_add(length);
                if *sum > whole(document, buffer) {
                    continue;
                }
            }
            if let Some(picture) = Encoded::of(document, image, &place) {
                encoded.push((place, picture));
            }
        }
        let sources = &self.assets.files;
        let decoded: Vec<(ImageLocation, Result<DecodedImage, LoadError>)> =
            encoded.into_par_iter().map(|(place, picture)| (place, picture.decode(sources))).collect();
        self.images.ahead.extend(decoded);
    }

    /// The textures of all materials used by nodes below `roots`, each once, in order.
    fn textures_below(&self, roots: &[usize]) -> Vec<Index<json::Texture>> {
        let root = &self.document.root;
        let (mut meshes, mut materials, mut found) = (HashSet::new(), HashSet::new(), Vec::new());
        let mut textures = HashSet::new();
        let mut stack: Vec<usize> = roots.iter().rev().copied().collect();
        while let Some(node) = stack.pop() {
            let Some(node) = root.nodes.get(node) else { continue };
            stack.extend(node.children.iter().flatten().rev().map(|child| child.value()));
            let Some(mesh) = node.mesh.map(|mesh| mesh.value()).filter(|mesh| meshes.insert(*mesh)) else {
                continue;
            };
            for primitive in root.meshes.get(mesh).iter().flat_map(|mesh| &mesh.primitives) {
                let Some(material) = self.material_index(primitive, "") else { continue };
                let Some(material) = root.materials.get(material.value()) else { continue };
                if materials.insert(std::ptr::from_ref(material)) {
                    let material = serde_json::to_value(material).unwrap_or_default();
                    slots(&material, &mut |texture| {
                        if textures.insert(texture) {
                            found.push(Index::new(texture));
                        }
                    });
                }
            }
        }
        found
    }
}

/// Visits the texture numbers in the slots of a material and its extensions: `…Texture: { index: … }`. A path tracer
/// does not use occlusion.
fn slots(value: &Value, found: &mut dyn FnMut(u32)) {
    let Some(fields) = value.as_object() else { return };
    for (name, value) in fields.iter().filter(|(name, _)| *name != "occlusionTexture") {
        let index = value.get("index").and_then(Value::as_u64).and_then(|index| u32::try_from(index).ok());
        match index.filter(|_| name.ends_with("Texture")) {
            Some(index) => found(index),
            None => slots(value, found),
        }
    }
}
