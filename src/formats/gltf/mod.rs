//! [glTF 2.0](https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html), as JSON or GLB.
//!
//! The `gltf` crate gives the structure of the JSON. What it says is checked here: the crate
//! panics on wrongly typed accessors and on views that end past their buffers, accepts nodes
//! that are their own ancestors and knows few extensions. So there is an accessor reader
//! (`accessor`), a resolver of references (`uri`) and a list of extensions (`extensions`) of
//! our own; extensions arrive as JSON.
//!
//! [`load`] makes a [`Model`] of the default scene's nodes, [`Model::place`] makes entities
//! of these, as often as wanted. `material` and `emitter` say what becomes of physically
//! based materials and photometric lights under our classic model.
//!
//! A node that is wrong is an error that names its place in the JSON. A picture that cannot
//! be had is a warning, and so is what is left out.

mod accessor;
mod container;
mod document;
mod emitter;
mod extensions;
mod image;
mod losses;
mod material;
mod mesh;
mod node;
#[cfg(test)]
mod tests;
mod texture;
mod uri;

use std::collections::HashMap;
use std::path::Path;

use self::document::Document;
use self::extensions::Lights;
use self::image::Images;
use self::losses::Losses;
use self::material::Lowered;
use super::names::Names;
use crate::error::LoadError;
use crate::math::Aabb;
use crate::world::{Assets, Camera, Light, MeshId, Parent, Placed, Shape, Transform, World};

/// The nodes of a file's default scene. Meshes and materials are in the asset store.
#[derive(Debug)]
pub struct Model {
    /// Each after its parent.
    nodes: Vec<Node>,
    /// Around all triangles.
    pub bounds: Aabb,
}

/// What becomes an entity.
#[derive(Debug)]
struct Node {
    /// Its place among the nodes.
    parent: Option<usize>,
    name: Option<String>,
    transform: Transform,
    mesh: Option<MeshId>,
    light: Option<Light>,
    camera: Option<Camera>,
}

/// What reading carries along.
struct Import<'a> {
    document: &'a Document<'a>,
    assets: &'a mut Assets,
    warnings: &'a mut Vec<String>,
    losses: Losses,
    lights: Vec<extensions::Light>,
    images: Images,
    /// By their numbers in the file; none stands for the default material.
    materials: HashMap<Option<usize>, Lowered>,
    meshes: HashMap<usize, Option<MeshId>>,
}

/// Reads the file at `path`. Its meshes, materials and images go into `assets`.
pub fn load(path: &Path, assets: &mut Assets, warnings: &mut Vec<String>) -> Result<Model, LoadError> {
    let bytes = std::fs::read(path).map_err(LoadError::io(path))?;
    parse(&bytes, path, assets, warnings)
}

/// [`load`] for a file in memory; `path` is what messages call it and what its references
/// are relative to.
pub fn parse(
    bytes: &[u8],
    path: &Path,
    assets: &mut Assets,
    warnings: &mut Vec<String>,
) -> Result<Model, LoadError> {
    let document = Document::open(bytes, path)?;
    extensions::check(&document, warnings)?;
    let others = document.root.extensions.as_ref().map(|extensions| &extensions.others);
    let lights: Option<Lights> = document.extension(others, "KHR_lights_punctual", "")?;
    let mut import = Import {
        document: &document,
        assets,
        warnings,
        losses: Losses::default(),
        lights: lights.map_or_else(Vec::new, |read| read.lights),
        images: Images::default(),
        materials: HashMap::new(),
        meshes: HashMap::new(),
    };
    let (nodes, bounds) = import.nodes()?;
    import.losses.animations = !document.root.animations.is_empty();
    let Import { losses, warnings, .. } = import;
    warnings.extend(losses.lines().map(|line| document.warning(line)));
    Ok(Model { nodes, bounds })
}

impl Model {
    /// Adds an entity for each node, under `parent` if there is one. Names that another
    /// entity has are numbered.
    pub fn place(&self, world: &mut World, parent: Option<hecs::Entity>) {
        let mut names = Names::of(world);
        let mut entities: Vec<hecs::Entity> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let mut builder = hecs::EntityBuilder::new();
            builder.add(node.transform);
            let parent = node.parent.and_then(|place| entities.get(place).copied()).or(parent);
            if let Some(parent) = parent {
                builder.add_bundle((Parent(parent), Placed));
            }
            if let Some(name) = &node.name {
                builder.add(names.unique(name));
            }
            if let Some(mesh) = node.mesh {
                builder.add(Shape::Mesh(mesh));
            }
            if let Some(light) = &node.light {
                builder.add(light.clone());
            }
            if let Some(camera) = node.camera {
                builder.add(camera);
            }
            entities.push(world.entities.spawn(builder.build()));
        }
    }
}
