//! The light groups of a scene: which entity's light the film sums up by itself.

use std::collections::HashMap;

use hecs::Entity;

use crate::error::Diagnostic;
use crate::film::MOST_LIGHT_GROUPS as MOST;
use crate::math::NONE;
use crate::scene::MaterialRecord;
use crate::world::fields::Forms;
use crate::world::{Light, LightGroup, MaterialId, Name, Parent, Shape, World};

/// The groups by name, and those of entities.
#[derive(Debug, Default)]
pub(super) struct LightGroups {
    pub names: Vec<String>,
    of_entity: HashMap<Entity, u32>,
    /// The group of the light from all around, or [`NONE`].
    pub around: u32,
    /// The number of names for which there was no room.
    left_out: usize,
}

impl LightGroups {
    /// Finds the groups of all entities that may emit light.
    pub(super) fn new(world: &World, order: &[Entity], materials: &[MaterialRecord]) -> LightGroups {
        let mut groups = LightGroups { around: NONE, ..LightGroups::default() };
        let mut is_surrounded = false;
        for &entity in order {
            // Also without light at this moment: all moments of an exposure have the same groups.
            if let Ok(group) = world.entities.get::<&LightGroup>(entity) {
                groups.number_of(group.0.clone());
            }
            let light = world.entities.get::<&Light>(entity).ok();
            if light.is_none() && !has_emission(world, entity, materials) {
                continue;
            }
            let own = || world.settings.light_groups.then(|| groups.own_name(world, entity));
            let Some(name) = named(world, entity).or_else(own) else {
                is_surrounded |= light.is_some_and(|light| light.is_around());
                continue;
            };
            let group = groups.number_of(name);
            groups.of_entity.insert(entity, group);
            // Only the first one counts.
            if light.is_some_and(|light| light.is_around()) && !std::mem::replace(&mut is_surrounded, true) {
                groups.around = group;
            }
        }
        if world.settings.light_groups && !is_surrounded && !world.settings.background.is_black() {
            groups.around = groups.number_of("background".into());
        }
        groups
    }

    /// The group of what an entity emits, or [`NONE`].
    pub(super) fn of(&self, entity: Entity) -> u32 {
        self.of_entity.get(&entity).copied().unwrap_or(NONE)
    }

    /// The name of an entity, or, without one, that of its light or shape: "sky", "point 2".
    fn own_name(&self, world: &World, entity: Entity) -> String {
        if world.entities.satisfies::<&Name>(entity) {
            return world.name_of(entity);
        }
        let light = world.entities.get::<&Light>(entity).ok().map(|light| Light::FORMS[light.form()]);
        let shape = world.entities.get::<&Shape>(entity).ok().map(|shape| Shape::FORMS[shape.form()]);
        let form = light.or(shape).unwrap_or("light").to_lowercase();
        let numbered = (2..=MOST).map(|number| format!("{form} {number}"));
        let free = std::iter::once(form.clone()).chain(numbered).find(|name| !self.names.contains(name));
        free.unwrap_or(form)
    }

    fn number_of(&mut self, name: String) -> u32 {
        if let Some(known) = self.names.iter().position(|other| *other == name) {
            return known as u32;
        }
        if self.names.len() == MOST {
            self.left_out += 1;
            return NONE;
        }
        self.names.push(name);
        self.names.len() as u32 - 1
    }

    /// A warning if there are too many.
    pub(super) fn too_many(&self) -> Option<Diagnostic> {
        (self.left_out > 0).then(|| {
            let lamps = MOST + self.left_out;
            let text = format!(
                "a film keeps at most {MOST} light groups, and {lamps} are wanted: the rest is mixed as one"
            );
            let remedy = "give lamps that belong together one name: group: \"ceiling\" on each";
            Diagnostic::warning("too-many-light-groups", text).fixed_by(remedy)
        })
    }
}

/// The name that an entity, or the nearest one above it, gives the group.
fn named(world: &World, entity: Entity) -> Option<String> {
    let parent = |entity: &Entity| world.entities.get::<&Parent>(*entity).ok().map(|parent| parent.0);
    std::iter::successors(Some(entity), parent)
        .find_map(|entity| world.entities.get::<&LightGroup>(entity).ok().map(|group| group.0.clone()))
}

/// True if an entity has a shape some of which emits light.
fn has_emission(world: &World, entity: Entity, materials: &[MaterialRecord]) -> bool {
    let emits = |id: &MaterialId| materials.get(id.0 as usize).is_some_and(MaterialRecord::emits);
    if let Ok(material) = world.entities.get::<&MaterialId>(entity) {
        return world.entities.satisfies::<&Shape>(entity) && emits(&material);
    }
    let mesh = world.entities.get::<&Shape>(entity).ok().and_then(|shape| match *shape {
        Shape::Mesh(id) => world.assets.meshes.get(id.0 as usize),
        _ => None,
    });
    mesh.is_some_and(|mesh| mesh.triangle_materials.iter().any(emits))
}
