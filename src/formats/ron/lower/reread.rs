//! Reads a single component again, for an existing world.

use std::collections::HashMap;
use std::path::Path;

use hecs::Entity;

use super::{LoweredAssets, Lowering, transform};
use crate::error::LoadError;
use crate::formats::AssetFiles;
use crate::formats::ron::parts::TextPart;
use crate::formats::ron::query::Kind;
use crate::formats::ron::source::{Raw, SceneText};
use crate::world::{Camera, FocusOn, MaterialId, Shape, World};

/// A component of an entity that scene files can express.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    Transform,
    Shape,
    Light,
    Camera,
    Material,
}

impl Component {
    /// All components by their keys in scene files.
    pub const ALL: [(&str, Component); 5] = [
        ("transform", Component::Transform),
        ("shape", Component::Shape),
        ("light", Component::Light),
        ("camera", Component::Camera),
        ("material", Component::Material),
    ];

    /// The component that a query's kind stands for.
    pub fn of(kind: Kind) -> Option<Component> {
        match kind {
            Kind::Transform => Some(Component::Transform),
            Kind::Shape => Some(Component::Shape),
            Kind::Form(name) if Shape::FORMS.contains(&name) => Some(Component::Shape),
            Kind::Camera => Some(Component::Camera),
            Kind::Form(name) if Camera::FORMS.contains(&name) => Some(Component::Camera),
            Kind::Material => Some(Component::Material),
            Kind::Light | Kind::Form(_) => Some(Component::Light),
            Kind::Entity | Kind::Model | Kind::Placed => None,
        }
    }

    /// The component's key in scene files.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, component)| *component == self).map_or("", |(name, _)| name)
    }
}

/// Named materials, collected once and only if needed: a statement may change a hundred thousand entities.
pub type Names = Option<HashMap<String, MaterialId>>;

/// Reads a component from its text and sets it on an entity, or replaces the content of an existing material. Numbers
/// in the text (`"#3"`) refer to the world's meshes and images.
pub fn reread(
    world: &mut World,
    component: Component,
    (entity, material): (Option<Entity>, Option<MaterialId>),
    text: &str,
    files: &mut dyn AssetFiles,
    names: &mut Names,
) -> Result<(), LoadError> {
    let part = TextPart::new(text, Path::new(""));
    let source = SceneText::new(std::slice::from_ref(&part), files.time_s().unwrap_or(0.0));
    let raw: Raw = source.root()?;
    // Only an entity's material refers to materials by name.
    let refers = component == Component::Material && material.is_none();
    let materials = match names.take() {
        None if refers => material_names(world),
        known => known.unwrap_or_default(),
    };
    let assets = LoweredAssets::new(files).with_numbers();
    let world_before = std::mem::take(world);
    let mut lowering =
        Lowering { source: &source, world: world_before, assets, materials, reads_numbers: false };
    let read = lowering.component(component, entity, material, raw);
    let Lowering { world: mut changed, assets, materials, .. } = lowering;
    *names = (refers || !materials.is_empty()).then_some(materials);
    let images = assets.read_images(&source, &mut changed);
    *world = changed;
    read.and(images)
}

fn material_names(world: &World) -> HashMap<String, MaterialId> {
    let named = world.assets.materials.iter().enumerate();
    named.filter_map(|(number, named)| Some((named.name.clone()?, MaterialId(number as u32)))).collect()
}

/// Reads the settings of a world again.
pub fn reread_settings(world: &mut World, text: &str, files: &mut dyn AssetFiles) -> Result<(), LoadError> {
    let part = TextPart::new(text, Path::new(""));
    let source = SceneText::new(std::slice::from_ref(&part), 0.0);
    let assets = LoweredAssets::new(files);
    let (world_before, materials) = (World::default(), HashMap::new());
    let mut lowering =
        Lowering { source: &source, world: world_before, assets, materials, reads_numbers: false };
    let (settings, transport, names_depth) = lowering.settings(source.root()?)?;
    let depth = world.settings.max_depth;
    world.settings = settings;
    if names_depth {
        world.usual_depth = None;
    } else {
        world.settings.max_depth = depth;
    }
    match transport {
        Some(transport) => (world.settings.transport, world.transport_is_chosen) = (transport, false),
        None => world.settings.transport = world.fitting_transport(),
    }
    world.settings.max_depth = world.depth_under(world.settings.transport);
    Ok(())
}

impl<'a> Lowering<'_, 'a> {
    fn component(
        &mut self,
        component: Component,
        entity: Option<Entity>,
        material: Option<MaterialId>,
        raw: Raw<'a>,
    ) -> Result<(), LoadError> {
        if let Some(id) = material {
            let read = self.material(raw)?;
            if let Some(named) = self.world.assets.materials.get_mut(id.0 as usize) {
                named.material = read;
            }
            return Ok(());
        }
        let Some(entity) = entity else { return Ok(()) };
        // The entity was selected, so it exists.
        let _ = match component {
            Component::Transform => {
                let read = transform::transform(self.source, raw)?;
                self.world.entities.insert_one(entity, read)
            }
            Component::Shape => {
                let read = self.shape(raw)?;
                self.world.entities.insert_one(entity, read)
            }
            Component::Light => {
                let read = self.light(raw)?;
                self.world.entities.insert_one(entity, read)
            }
            Component::Camera => {
                let read = self.camera(raw, self.world.entities.satisfies::<&FocusOn>(entity))?;
                self.world.entities.insert_one(entity, read)
            }
            Component::Material => {
                let read = self.material_of_entity(raw)?;
                self.world.entities.insert_one(entity, read)
            }
        };
        Ok(())
    }
}
