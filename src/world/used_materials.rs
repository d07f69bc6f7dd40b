//! The materials in use by shapes.

use std::collections::HashSet;

use super::{MaterialId, Shape, World};

impl World {
    /// Returns the materials of all shapes.
    pub(crate) fn worn(&self) -> HashSet<MaterialId> {
        let mut query = self.entities.query::<(&Shape, Option<&MaterialId>)>();
        query.iter().flat_map(|(shape, own)| self.materials_of(shape, own)).collect()
    }

    /// Returns the material of an entity's shape, or `None` if it has several. Without a shape, it is the entity's own
    /// material.
    pub(crate) fn only_material(&self, entity: hecs::Entity) -> Option<MaterialId> {
        let own = self.entities.get::<&MaterialId>(entity).ok().map(|id| *id);
        let Ok(shape) = self.entities.get::<&Shape>(entity) else {
            return Some(own.unwrap_or(MaterialId::DEFAULT));
        };
        let mut all = self.materials_of(&shape, own.as_ref()).into_iter();
        all.next().filter(|_| all.next().is_none())
    }

    /// Returns the materials of a shape: its entity's own one, or those of its triangles.
    fn materials_of(&self, shape: &Shape, own: Option<&MaterialId>) -> HashSet<MaterialId> {
        let mesh = match shape {
            Shape::Mesh(id) => self.assets.meshes.get(id.0 as usize),
            _ => None,
        };
        let triangles = mesh.map_or(&[][..], |mesh| &mesh.triangle_materials);
        match own {
            Some(own) => HashSet::from([*own]),
            None if triangles.is_empty() => HashSet::from([MaterialId::DEFAULT]),
            // Consecutive triangles mostly have the same material.
            None => triangles.chunk_by(|a, b| a == b).map(|run| run[0]).collect(),
        }
    }
}
