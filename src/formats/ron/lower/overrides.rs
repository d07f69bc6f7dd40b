//! Reads `overrides`: replacements for the materials of a glTF file.

use std::collections::{BTreeSet, HashMap};

use super::Lowering;
use crate::error::LoadError;
use crate::formats::ron::source::{Raw, shorten, suggest};
use crate::world::names::is_same_name;
use crate::world::{MaterialId, Mesh, MeshId, Overrides, Shape};

/// An override: the place and name of a material of the file, and its replacement.
pub(super) struct Override<'a> {
    place: Raw<'a>,
    name: String,
    material: MaterialId,
}

/// An entity with a mesh, and the material that replaces the mesh's own, if any.
type Placed = (hecs::Entity, MeshId, Option<MaterialId>);

/// The change of a mesh by overrides.
#[derive(Clone, Copy)]
enum MeshChange {
    /// One material for the whole mesh.
    Whole(MaterialId),
    /// A copy with other materials for some triangles.
    Copy(MeshId),
}

impl<'a> Lowering<'_, 'a> {
    /// Reads `{"name in the file": material, …}`.
    pub(super) fn overrides(&mut self, raw: Raw<'a>) -> Result<Vec<Override<'a>>, LoadError> {
        let mut overrides: Vec<Override> = Vec::new();
        let mut names = BTreeSet::new();
        for (place, value) in self.source.map(raw, "the overrides")? {
            let name = self.source.string(place, "the file's name of a material")?;
            if !names.insert(name.clone()) {
                let reason = format!("there is already an override of \"{}\"", shorten(&name));
                return Err(self.source.error(place.0, reason));
            }
            let material = self.material_of_entity(value)?;
            overrides.push(Override { place, name, material });
        }
        Ok(overrides)
    }

    /// Applies the overrides to the entities of a glTF file: those whose number is at least `first`.
    pub(super) fn apply(&mut self, first: u32, overrides: &[Override<'a>]) -> Result<(), LoadError> {
        let mut placed: Vec<Placed> = Vec::new();
        let mut query = self.world.entities.query::<(hecs::Entity, &Shape, Option<&MaterialId>)>();
        for (entity, shape, material) in query.iter() {
            if let Shape::Mesh(mesh) = shape
                && entity.id() >= first
            {
                placed.push((entity, *mesh, material.copied()));
            }
        }
        drop(query);
        placed.sort_by_key(|(entity, ..)| entity.id());
        self.refuse_unknown(&placed, overrides)?;
        let mut changes = HashMap::new();
        for (entity, id, own) in placed {
            let change = match (own, changes.get(&id)) {
                (Some(own), _) => self.new_one(own, overrides).map(MeshChange::Whole),
                (None, Some(known)) => *known,
                (None, None) => {
                    let change = self.change(id, overrides);
                    changes.insert(id, change);
                    change
                }
            };
            // The entity was found above, so insertion succeeds.
            let _ = match change {
                None => Ok(()),
                Some(MeshChange::Whole(material)) => self.world.entities.insert_one(entity, material),
                Some(MeshChange::Copy(mesh)) => self.world.entities.insert_one(entity, Shape::Mesh(mesh)),
            };
            self.world.mark_placed(entity);
        }
        Ok(())
    }

    /// Returns an error for an override whose name no material of the placed meshes has.
    fn refuse_unknown(&self, placed: &[Placed], overrides: &[Override<'a>]) -> Result<(), LoadError> {
        let meshes: BTreeSet<MeshId> =
            placed.iter().filter(|(.., own)| own.is_none()).map(|(_, mesh, _)| *mesh).collect();
        let used =
            meshes.into_iter().filter_map(|id| self.mesh(id)).flat_map(|mesh| &mesh.triangle_materials);
        let own = placed.iter().filter_map(|(.., own)| *own);
        let used: BTreeSet<MaterialId> = used.copied().chain(own).collect();
        let known: BTreeSet<&str> = used.into_iter().filter_map(|id| self.name(id)).collect();
        let unknown = overrides.iter().find(|one| {
            !known.contains(&one.name[..]) && !known.iter().any(|name| is_same_name(name, &one.name))
        });
        unknown.map_or(Ok(()), |one| {
            let suggestion = suggest(&one.name, known.iter().copied());
            let name = shorten(&one.name);
            let some: Vec<String> =
                known.iter().take(16).map(|known| format!("\"{}\"", shorten(known))).collect();
            let names = match some.len() {
                0 => ": its materials have no names".to_owned(),
                count if count < known.len() => format!("; there are: {}, …", some.join(", ")),
                _ => format!("; there are: {}", some.join(", ")),
            };
            let reason = format!("nothing in the file has a material \"{name}\"{suggestion}{names}");
            Err(self.source.error(one.place.0, reason))
        })
    }

    /// The change of a mesh by the overrides, if any.
    fn change(&mut self, id: MeshId, overrides: &[Override<'a>]) -> Option<MeshChange> {
        let mesh = self.mesh(id)?;
        let of = |old: MaterialId| self.new_one(old, overrides);
        let used: BTreeSet<MaterialId> = mesh.triangle_materials.iter().copied().collect();
        let new: HashMap<MaterialId, MaterialId> =
            used.iter().filter_map(|old| Some((*old, of(*old)?))).collect();
        let targets: BTreeSet<MaterialId> = new.values().copied().collect();
        if new.is_empty() {
            return None;
        }
        if new.len() == used.len()
            && let [only] = Vec::from_iter(targets)[..]
        {
            return Some(MeshChange::Whole(only));
        }
        let materials = mesh.triangle_materials.iter().map(|old| *new.get(old).unwrap_or(old)).collect();
        let copy = Mesh { triangle_materials: materials, ..mesh.clone() };
        Some(MeshChange::Copy(self.world.assets.add_made_mesh(copy)))
    }

    /// The replacement of a material, if it is overridden.
    fn new_one(&self, old: MaterialId, overrides: &[Override<'a>]) -> Option<MaterialId> {
        let name = self.name(old)?;
        overrides.iter().find(|one| is_same_name(&one.name, name)).map(|one| one.material)
    }

    fn mesh(&self, id: MeshId) -> Option<&Mesh> {
        self.world.assets.meshes.get(id.0 as usize).map(|mesh| &**mesh)
    }

    fn name(&self, id: MaterialId) -> Option<&str> {
        self.world.assets.materials.get(id.0 as usize)?.name.as_deref()
    }
}

/// The overrides as the entity stores them.
pub(super) fn component(overrides: &[Override]) -> Overrides {
    Overrides(overrides.iter().map(|one| (one.name.clone(), one.material)).collect())
}
