//! The material that a name means.

use crate::error::did_you_mean;
use crate::world::{MaterialId, Shape, World};

/// Returns the material of that name, or that of the entity of that name. The error says which names there are.
pub fn material(world: &World, name: &str) -> Result<MaterialId, String> {
    let count = world.assets.materials.len() as u32;
    let of_name = (0..count).map(MaterialId).find(|id| world.assets.material_name(*id) == name);
    if let Some(id) = of_name {
        return Ok(id);
    }
    let mut names: Vec<String> =
        (0..count).map(|id| world.assets.material_name(MaterialId(id)).into_owned()).collect();
    for entity in world.in_order() {
        // As profiles call it, also without a name of its own.
        let known = world.name_of(entity);
        if known == name {
            if world.entities.get::<&Shape>(entity).is_err() {
                return Err(format!("\"{name}\" has no shape, and so no material: name one that has"));
            }
            return world.only_material(entity).ok_or_else(|| {
                format!("\"{name}\" has several materials: name one of them (rayfront info lists them)")
            });
        }
        names.push(known);
    }
    let hint = did_you_mean(name, names.iter().map(String::as_str));
    Err(format!("no material and no entity is named \"{name}\"{hint}: rayfront ls lists them"))
}
