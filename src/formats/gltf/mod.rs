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
//! A file whose hierarchy or geometry cannot be read is refused with the place in its JSON. What an image can do without
//! is mended or left out with a warning (`mending`).

mod accessor;
mod animation;
mod basis_universal;
mod choice;
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
mod mending;
mod mesh;
mod meshopt;
mod mikktspace;
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
use self::extensions::variants::{self, Variants};
use self::image::Images;
use self::import_report::ImportReport;
use self::material::Lowered;
use self::mesh::{MeshKey, PlacedMesh, ShapeKey};
use self::pose::Moved;
pub use self::summary::{ModelSummary, contents};
use self::texture::GltfTextures;
use super::LoadOptions;
use super::names::TakenNames;
use crate::error::{Diagnostic, LoadError};
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
    /// The time of the last key of the animations that are shown, if the file gives it.
    end_s: Option<f32>,
    /// The error about an animation that was chosen and does not exist. All animations are shown.
    pub unknown_animation: Option<LoadError>,
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
    /// The lights; none for those that are not as expected.
    lights: Vec<Option<extensions::light::GltfLight>>,
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
    let lights: Option<Lights> = document.extension(others, "KHR_lights_punctual", "");
    let lights = lights.map_or_else(Vec::new, |read| read.lights);
    let at = |number: usize| format!("/extensions/KHR_lights_punctual/lights/{number}");
    let lights: Vec<_> =
        lights.iter().enumerate().map(|(number, light)| document.lenient(light, at(number))).collect();
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
        moved: HashMap::new(),
        globals: HashMap::new(),
        aspect: None,
    };
    let clip = options.animation.as_deref().map(|asked| animation::choice(&document.root).find(asked));
    let (clip, unknown) = match clip.transpose() {
        Ok(clip) => (clip, None),
        Err(reason) => (None, Some(document.error("/animations", reason))),
    };
    // Who chooses an animation wants to see it.
    let time_s = options.time_s.or(clip.map(|_| 0.0));
    if let Some(time) = time_s {
        import.moved = animation::at_time(&document, time, clip, import.warnings)?;
    }
    let scene = node::scene(&document, options.scene.as_deref())?;
    let roots = node::roots(&document, scene, &import.parents)?;
    import.decode_ahead(&roots);
    let mut nodes = import.nodes(roots)?;
    nodes.extend(import.environment(scene)?);
    let aspect = import.aspect;
    let moves = !document.root.animations.is_empty();
    import.losses.animations = moves && time_s.is_none();
    let Import { losses, warnings, .. } = import;
    warnings.extend(losses.lines().map(|line| document.warning(line)));
    warnings.extend(document.mends());
    let shown = document.root.animations.iter().enumerate();
    let shown = shown.filter(|(number, _)| clip.is_none_or(|clip| clip == *number));
    let ends = shown.filter_map(|(_, animation)| animation::end(&document, animation));
    Ok(GltfModel { nodes, aspect, moves, end_s: ends.reduce(f32::max), unknown_animation: unknown })
}

/// Returns the number of the variant requested by name or number.
fn variant(document: &Document, asked: Option<&str>) -> Result<Option<usize>, LoadError> {
    let Some(asked) = asked else { return Ok(None) };
    let others = document.root.extensions.as_ref().map(|extensions| &extensions.others);
    let name = "KHR_materials_variants";
    let read: Option<Variants> = document.extension(others, name, "");
    let variants = read.map_or_else(Vec::new, |read| read.variants);
    let found = variants::choice(&variants).find(asked);
    found.map(Some).map_err(|reason| document.error(format_args!("/extensions/{name}"), reason))
}

impl GltfModel {
    /// True if the file has animations.
    pub fn moves(&self) -> bool {
        self.moves
    }

    /// Adds an entity for each node, under `parent` if there is one. Names that are already taken get a number.
    pub fn place(&self, world: &mut World, parent: Option<hecs::Entity>) {
        world.is_animated |= self.moves;
        world.animated_until(self.end_s);
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
