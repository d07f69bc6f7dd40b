//! [glTF 2.0](https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html), as JSON or GLB.
//!
//! The `gltf` crate parses the structure of the JSON. Its contents are checked here: the crate panics on wrongly typed
//! accessors and on views that end past their buffers, accepts nodes that are their own ancestors and supports few
//! extensions. Hence this module has its own accessor reader (`accessor`), resolver of references (`uri`) and list of
//! extensions (`extensions`), which arrive as JSON.
//!
//! [`load`] reads the nodes of a scene into a [`GltfModel`]; [`GltfModel::place`] creates entities from it, as often as
//! wanted. Meshes are deformed by their morph targets and joints while they are read (`vertex`, `skin`), at the
//! requested time (`animation`).
//!
//! An invalid node is an error that names its place in the JSON. An image that cannot be read is a warning, and so is
//! everything left out.

mod accessor;
mod animation;
mod basis_universal;
mod closed_meshes;
mod container;
mod document;
mod draco;
mod emitter;
pub(super) mod environment;
mod extensions;
mod image;
mod import_report;
mod instancing;
mod layers;
mod material;
mod mesh;
mod meshopt;
mod node;
mod pose;
mod prefetch_images;
mod skin;
mod summary;
mod tangent;
#[cfg(test)]
mod tests;
mod texture;
mod uri;
mod vertex;

use std::collections::HashMap;
use std::path::Path;

use self::document::Document;
use self::extensions::light::Lights;
use self::extensions::variants::Variants;
use self::image::Images;
use self::import_report::ImportReport;
use self::material::Lowered;
use self::mesh::{MeshKey, PlacedMesh, ShapeKey};
use self::pose::Moved;
pub use self::summary::{ModelSummary, contents};
use self::texture::GltfTextures;
use super::LoadOptions;
use super::names::TakenNames;
use crate::error::{Diagnostic, LoadError, did_you_mean, words};
use crate::math::DAffine3;
use crate::world::{Assets, Camera, Light, MeshId, Parent, Shape, Transform, World};

/// The nodes of one of a file's scenes. Meshes and materials are in the asset store.
#[derive(Debug)]
pub struct GltfModel {
    /// The nodes; parents precede their children.
    nodes: Vec<GltfNode>,
    /// Width over height of the first camera's image, if the file gives it.
    pub aspect: Option<f32>,
    /// True if the file has animations.
    moves: bool,
}

/// A node that becomes an entity.
#[derive(Debug)]
struct GltfNode {
    /// The index of its parent among the nodes.
    parent: Option<usize>,
    name: Option<String>,
    transform: Transform,
    mesh: Option<PlacedMesh>,
    light: Option<Light>,
    camera: Option<Camera>,
}

/// The state of reading a file.
struct Import<'a> {
    document: &'a Document<'a>,
    assets: &'a mut Assets,
    warnings: &'a mut Vec<Diagnostic>,
    losses: ImportReport,
    lights: Vec<extensions::light::GltfLight>,
    /// The factor for the lights' intensities.
    light_scale: f32,
    /// See [`LoadOptions`].
    solid_glass: bool,
    /// True if all surfaces are visible from behind.
    double_sided: bool,
    /// The number of the requested variant.
    variant: Option<usize>,
    images: Images,
    textures: GltfTextures,
    /// The converted materials by their numbers in the file; `None` is the default material.
    materials: HashMap<Option<usize>, Lowered>,
    meshes: HashMap<MeshKey, Option<PlacedMesh>>,
    shapes: HashMap<ShapeKey, MeshId>,
    parents: Vec<Option<usize>>,
    /// Nodes that an animation moves, with their transforms and weights.
    moved: HashMap<usize, Moved>,
    /// The transforms from nodes to the scene computed up to now.
    globals: HashMap<usize, DAffine3>,
    /// Aspect ratio of the first camera.
    aspect: Option<f32>,
}

/// Reads the file at `path`. Its meshes, materials and images go into `assets`.
pub fn load(
    path: &Path,
    options: &LoadOptions,
    assets: &mut Assets,
    warnings: &mut Vec<Diagnostic>,
) -> Result<GltfModel, LoadError> {
    let bytes = assets.files.read(path).map_err(LoadError::io(path))?;
    parse(&bytes, path, options, assets, warnings)
}

/// [`load`] for a file in memory. Messages use `path` as its name, and its references are relative to it.
pub fn parse(
    bytes: &[u8],
    path: &Path,
    options: &LoadOptions,
    assets: &mut Assets,
    warnings: &mut Vec<Diagnostic>,
) -> Result<GltfModel, LoadError> {
    let document = Document::open(bytes, path, &assets.files)?;
    extensions::check(&document, warnings)?;
    let others = document.root.extensions.as_ref().map(|extensions| &extensions.others);
    let lights: Option<Lights> = document.extension(others, "KHR_lights_punctual", "")?;
    let lights = lights.map_or_else(Vec::new, |read| read.lights);
    let light_scale = emitter::light_scale(&document, &lights, options.light_units, warnings);
    let mut import = Import {
        document: &document,
        assets,
        warnings,
        losses: ImportReport::default(),
        lights,
        light_scale,
        solid_glass: options.solid_glass,
        double_sided: options.double_sided,
        variant: variant(&document, options.variant.as_deref())?,
        images: Images::default(),
        textures: GltfTextures::default(),
        materials: HashMap::new(),
        meshes: HashMap::new(),
        shapes: HashMap::new(),
        parents: node::parents(&document)?,
        moved: match options.time_s {
            Some(time) => animation::at_time(&document, time)?,
            None => HashMap::new(),
        },
        globals: HashMap::new(),
        aspect: None,
    };
    let scene = node::scene(&document, options.scene.as_deref())?;
    let roots = node::roots(&document, scene, &import.parents)?;
    import.decode_ahead(&roots);
    let mut nodes = import.nodes(roots)?;
    nodes.extend(import.environment(scene)?);
    let aspect = import.aspect;
    let moves = !document.root.animations.is_empty();
    import.losses.animations = moves && options.time_s.is_none();
    let Import { losses, warnings, .. } = import;
    warnings.extend(losses.lines().map(|line| document.warning(line)));
    Ok(GltfModel { nodes, aspect, moves })
}

/// Returns the number of the variant requested by name or number.
fn variant(document: &Document, asked: Option<&str>) -> Result<Option<usize>, LoadError> {
    let Some(asked) = asked else { return Ok(None) };
    let others = document.root.extensions.as_ref().map(|extensions| &extensions.others);
    let name = "KHR_materials_variants";
    let read: Option<Variants> = document.extension(others, name, "")?;
    let variants = read.map_or_else(Vec::new, |read| read.variants);
    let called: Vec<String> =
        variants.iter().enumerate().map(|(number, variant)| variant.called(number)).collect();
    let number = called.iter().position(|name| name == asked);
    let number = number.or_else(|| asked.parse().ok().filter(|number| *number < called.len()));
    number.map(Some).ok_or_else(|| {
        let names = presentable(called.iter().map(|name| &name[..]));
        let all: Vec<String> = names.clone().take(32).map(words).collect();
        let (asked, hint) = (words(asked), did_you_mean(asked, names));
        let reason = match called.len() {
            0 => format!("there is no variant \"{asked}\": the file has none"),
            _ => format!("there is no variant \"{asked}\"{hint}; variants: {}", all.join(", ")),
        };
        document.error(format_args!("/extensions/{name}"), reason)
    })
}

/// Filters names that can be printed on a line as they are.
fn presentable<'n>(names: impl Iterator<Item = &'n str> + Clone) -> impl Iterator<Item = &'n str> + Clone {
    names.filter(|name| name.len() <= 64 && !name.contains(char::is_control))
}

impl GltfModel {
    /// Adds an entity for each node, under `parent` if there is one. Names that are already taken get a number.
    pub fn place(&self, world: &mut World, parent: Option<hecs::Entity>) {
        world.is_animated |= self.moves;
        let mut names = TakenNames::of(world);
        let mut entities: Vec<hecs::Entity> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let mut builder = hecs::EntityBuilder::new();
            builder.add(node.transform);
            let parent = node.parent.and_then(|place| entities.get(place).copied()).or(parent);
            if let Some(parent) = parent {
                builder.add(Parent(parent));
            }
            if let Some(name) = &node.name {
                builder.add(names.unique(name));
            }
            if let Some(mesh) = node.mesh {
                builder.add(Shape::Mesh(mesh.id));
                if let Some(material) = mesh.material {
                    builder.add(material);
                }
            }
            if let Some(light) = &node.light {
                builder.add(light.clone());
            }
            if let Some(camera) = node.camera {
                builder.add(camera);
            }
            let entity = world.entities.spawn(builder.build());
            if parent.is_some() {
                world.mark_placed(entity);
            }
            entities.push(entity);
        }
    }
}
