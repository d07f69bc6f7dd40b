//! The authored scene, before it is prepared for rendering. Entities live in a [`hecs::World`]; bulk data (meshes,
//! images) and shared data (materials) live beside it in [`Assets`], referred to by integer ids. [`crate::compile`]
//! turns a world into a scene.

use std::hash::{Hash, Hasher};

use crate::error::{Diagnostic, Subject};
use fields::Forms;

pub(crate) mod asset_cache;
pub(crate) mod assets;
pub(crate) mod boundary;
pub(crate) mod bounds;
mod camera;
pub(crate) mod components;
pub(crate) mod copies;
pub(crate) mod fields;
pub(crate) mod ineffective;
pub(crate) mod material;
pub(crate) mod modifiers;
pub(crate) mod names;
#[cfg(feature = "formats")]
pub(crate) mod normals;
pub(crate) mod orbit_camera;
pub(crate) mod origin;
pub(crate) mod procedure;
pub(crate) mod quantity;
pub(crate) mod settings;
pub(crate) mod shape;
pub(crate) mod shapes;
pub(crate) mod source_files;
pub(crate) mod transforms;
pub(crate) mod triangulate;
#[cfg(feature = "formats")]
mod used_materials;

use crate::error::words;
pub(crate) use asset_cache::{AssetCache, DecodedImage};
pub use assets::*;
pub use camera::*;
pub use components::*;
pub use copies::{Array, ArrayRow, ScatteredCopies};
pub use hecs;
pub use material::*;
pub use modifiers::{Modifier, Modifiers, SubdivisionScheme};
pub(crate) use orbit_camera::{OrbitCamera, Pose};
pub use procedure::*;
pub use settings::*;
pub use shape::*;
pub(crate) use source_files::{FileDigest, SourceFiles};

/// The content of a scene file.
#[derive(Default)]
pub struct World {
    /// The entities with their components: a [`Transform`], a [`Shape`] with its [`MaterialId`], a [`Light`],
    /// a [`Camera`], a [`Name`], a [`Parent`].
    pub entities: hecs::World,
    /// Meshes, images, textures and materials, which entities share.
    pub assets: Assets,
    /// The render settings.
    pub settings: Settings,
    /// The loader's warnings, one line each.
    pub warnings: Vec<Diagnostic>,
    /// True if the scene's files contain anything that changes with time.
    pub(crate) is_animated: bool,
    /// The time of the last change in seconds, if the scene's files give it.
    pub(crate) animation_end_s: Option<f32>,
    /// True if no file sets the transport, which is then [`World::fitting_transport`].
    pub(crate) transport_is_chosen: bool,
    /// The maximum depth of scenes without glass if no file sets it; [`World::depth_under`] then gives the depth.
    pub(crate) usual_depth: Option<u32>,
}

/// The maximum depth of scenes with glass. Further bounces make no difference to a vase, and few paths reach this
/// depth.
const DEPTH_OF_GLASS: u32 = 64;

impl World {
    /// Extends the time of the last change.
    #[cfg(feature = "formats")]
    pub(crate) fn animated_until(&mut self, end_s: Option<f32>) {
        self.animation_end_s = self.animation_end_s.into_iter().chain(end_s).reduce(f32::max);
    }

    /// Returns the entities in the order in which they were spawned, which is the author's; hecs iterates by archetype.
    pub fn in_order(&self) -> Vec<hecs::Entity> {
        let mut entities: Vec<_> = self.entities.iter().map(|e| e.entity()).collect();
        // After a despawn, numbers are reused with a higher generation.
        entities.sort_by_key(|e| e.to_bits());
        entities
    }

    /// Returns the [`World::name_of`] each entity by its number.
    pub(crate) fn names(&self) -> std::collections::HashMap<u32, String> {
        self.entities.iter().map(|e| (e.entity().id(), self.name_of(e.entity()))).collect()
    }

    /// A hash of an entity's transform, shape, material, light, camera and parent. It is comparable only within one run
    /// of the program.
    pub(crate) fn fingerprint(&self, entity: hecs::Entity) -> u64 {
        type Components<'a> = (
            Option<&'a Transform>,
            Option<&'a Shape>,
            Option<&'a MaterialId>,
            Option<&'a Light>,
            Option<&'a Camera>,
            Option<&'a Parent>,
        );
        let mut hasher = std::hash::DefaultHasher::new();
        let mut query = self.entities.query_one::<Components>(entity);
        format!("{:?}", query.get().ok()).hash(&mut hasher);
        hasher.finish()
    }

    /// Marks an entity as loaded from a [`Model`] in its current state.
    pub(crate) fn mark_placed(&mut self, entity: hecs::Entity) {
        let placed = FromModel(self.fingerprint(entity));
        // An entity that does not exist needs no mark.
        let _ = self.entities.insert_one(entity, placed);
    }

    /// The code of the note that the path transport was chosen.
    pub(crate) const PATH_IS_CHOSEN: &'static str = "path-is-chosen";

    /// Sets the transport, if no file names one, to [`World::fitting_transport`], and the depth to match.
    pub(crate) fn choose_transport(&mut self) {
        self.warnings.retain(|warning| warning.code != Self::PATH_IS_CHOSEN);
        if self.transport_is_chosen {
            self.settings.transport = self.fitting_transport();
            if self.settings.transport == Transport::Path {
                let (has_model, is_surrounded) = (self.has_model(), self.surroundings().next().is_some());
                let why = match (has_model, self.has_principled(), is_surrounded) {
                    (true, ..) => "a glTF file",
                    (_, true, _) => "a Principled material",
                    _ => "surroundings",
                };
                let text = format!("the path transport was chosen, because the scene has {why}");
                let note = Diagnostic::note(Self::PATH_IS_CHOSEN, text);
                self.warnings.push(note.fixed_by("settings: (transport: Path) says so in the scene"));
            }
        }
        self.settings.max_depth = self.depth_under(self.settings.transport);
    }

    /// The maximum depth under a transport: that of the files, or else the one that glass needs under the path
    /// transport. (Whitted's transport splits paths at glass, so its time grows with the depth.)
    pub(crate) fn depth_under(&self, transport: Transport) -> u32 {
        match self.usual_depth {
            None => self.settings.max_depth,
            Some(_) if transport == Transport::Path && self.has_glass() => DEPTH_OF_GLASS,
            Some(usual) => usual,
        }
    }

    /// The maximum depth of a scene file that does not set one.
    #[cfg(feature = "formats")]
    pub(crate) fn fitting_depth(&self) -> u32 {
        let is_glass = self.settings.transport == Transport::Path && self.has_glass();
        if is_glass { DEPTH_OF_GLASS } else { Settings::default().max_depth }
    }

    /// True if any material refracts light.
    fn has_glass(&self) -> bool {
        self.assets.materials.iter().any(|named| match &named.material {
            Material::BlinnPhong(material) => material.ior.is_some_and(|ior| ior != 1.0),
            Material::Principled(material) => {
                material.volume.is_some() && material.transmission.factor > 0.0 && material.ior != 1.0
            }
        })
    }

    /// Returns the transport that supports everything in the world, `Auto` in scene files: the path transport if there
    /// are glTF files, principled materials, environments or skies, which Whitted's renders only in part. In a program,
    /// once the world is complete: `world.settings.transport = world.fitting_transport()`.
    pub fn fitting_transport(&self) -> Transport {
        let entities = &self.entities;
        let asks = self.has_model()
            || entities.query::<&Light>().iter().any(Light::is_around)
            || self.has_principled();
        if asks { Transport::Path } else { Transport::Whitted }
    }

    /// True if any entity places a glTF file.
    fn has_model(&self) -> bool {
        self.entities.query::<&Model>().iter().next().is_some()
    }

    /// True if any material is physically based.
    pub(crate) fn has_principled(&self) -> bool {
        self.assets.materials.iter().any(|named| matches!(named.material, Material::Principled(_)))
    }

    /// The environments and skies, in the author's order. Only the first one counts; it hides the background.
    pub(crate) fn surroundings(&self) -> impl Iterator<Item = hecs::Entity> {
        let is_around =
            |entity: &hecs::Entity| self.entities.get::<&Light>(*entity).is_ok_and(|light| light.is_around());
        self.in_order().into_iter().filter(is_around)
    }

    /// The reason why the background is not visible, if it is not.
    pub(crate) fn hidden_background(&self) -> Option<Diagnostic> {
        let name = words(&self.name_of(self.surroundings().next()?));
        let text = format!("background does nothing: \"{name}\" is all around");
        Some(
            Diagnostic::warning("hidden-background", text)
                .fixed_by("write backplate or backdrop instead, or `--env none`"),
        )
    }

    /// Calls `change` on every light.
    #[doc(hidden)]
    pub fn change_lights(&mut self, change: impl FnMut(&mut Light)) {
        self.entities.query_mut::<&mut Light>().into_iter().for_each(change);
    }

    /// Calls `change` on every camera.
    pub(crate) fn change_cameras(&mut self, change: impl FnMut(&mut Camera)) {
        self.entities.query_mut::<&mut Camera>().into_iter().for_each(change);
    }

    /// The number of triangles of all meshes and flat shapes; those of a mesh count once for each placement.
    pub(crate) fn placed_triangles(&self) -> usize {
        let of = |shape: &Shape| match shape {
            Shape::Mesh(id) => self.assets.meshes[id.0 as usize].triangles.len(),
            _ => shape.flat_corners().map_or(0, |(_, corners)| Shape::fan(corners.len()).count()),
        };
        self.entities.query::<&Shape>().iter().map(of).sum()
    }

    /// Returns an entity as the subject of a diagnostic: by its name, or as "the mesh of own.ron:15".
    pub(crate) fn subject(&self, entity: hecs::Entity) -> Subject {
        let written = self.entities.get::<&WrittenAt>(entity).ok();
        let has_name = self.entities.satisfies::<&Name>(entity);
        let name = match &written {
            Some(written) if !has_name => {
                let file = written.file.file_name().unwrap_or_default().to_string_lossy();
                format!("the {} of {file}:{}", self.kind(entity), written.position[0])
            }
            _ => self.name_of(entity),
        };
        let file = written.as_ref().map(|written| written.file.to_path_buf());
        Subject { name, file, position: written.map(|written| written.position) }
    }

    /// The kind of an entity, as a noun.
    fn kind(&self, entity: hecs::Entity) -> String {
        let has = |form: &dyn Forms| form.names()[form.form()].to_lowercase();
        let shape = self.entities.get::<&Shape>(entity).ok().map(|shape| has(&*shape));
        let light = self.entities.get::<&Light>(entity).is_ok().then(|| "light".to_owned());
        let camera = self.entities.get::<&Camera>(entity).is_ok().then(|| "camera".to_owned());
        shape.or(light).or(camera).unwrap_or_else(|| "entity".to_owned())
    }

    /// Returns the entity's [`Name`], or `entity N`, where N is its number.
    pub fn name_of(&self, entity: hecs::Entity) -> String {
        match self.entities.get::<&Name>(entity) {
            Ok(name) => name.0.clone(),
            Err(_) => format!("entity {}", entity.id()),
        }
    }
}
