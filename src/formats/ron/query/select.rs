//! Evaluates queries on a world.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::{Comparison, FilterKey, Kind, Query, QueryFilter, is_like};
use crate::formats::ron::{Portrait, WrittenPart, portrait};
use crate::world::fields::Forms;
use crate::world::names::{composed, is_same_name};
use crate::world::{Camera, FromModel, Light, MaterialId, Model, Parent, Shape, Transform, World};

/// The result of a query.
#[derive(Clone, Debug, PartialEq)]
pub enum Selected {
    /// Entities, in the world's order.
    Entities(Vec<hecs::Entity>),
    /// Materials: the query is a `Material` atom with filters.
    Materials(Vec<MaterialId>),
}

impl Selected {
    /// The number of selected entities or materials.
    pub fn len(&self) -> usize {
        match self {
            Selected::Entities(entities) => entities.len(),
            Selected::Materials(materials) => materials.len(),
        }
    }

    /// True if nothing is selected.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Evaluates a query on a world.
pub fn select(world: &World, query: &Query) -> Selected {
    Index::new(world).select(world, query)
}

/// An index for a series of queries on a world whose entities keep their names: it avoids repeated searches.
pub struct Index {
    order: Vec<hecs::Entity>,
    by_name: HashMap<String, Vec<hecs::Entity>>,
    /// The materials in use by shapes, once computed.
    worn: Option<HashSet<MaterialId>>,
    /// The number of entities and materials that queries have tested so far.
    pub looked_at: u64,
}

impl Index {
    /// Builds the index of a world.
    pub fn new(world: &World) -> Index {
        let order = world.in_order();
        let mut by_name: HashMap<String, Vec<hecs::Entity>> = HashMap::new();
        for entity in &order {
            by_name.entry(composed(&world.name_of(*entity)).into_owned()).or_default().push(*entity);
        }
        Index { order, by_name, worn: None, looked_at: 0 }
    }

    /// The number of entities.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// The materials in use by shapes.
    pub fn worn(&mut self, world: &World) -> &HashSet<MaterialId> {
        self.worn.get_or_insert_with(|| world.worn())
    }

    /// Discards the cached materials in use, after shapes may have got other materials.
    pub fn forget_worn(&mut self) {
        self.worn = None;
    }

    /// Evaluates a query on the world; see [`select`].
    pub fn select(&mut self, world: &World, query: &Query) -> Selected {
        if let Query::Atom(Kind::Material, filters) = query
            && !filters.is_empty()
        {
            self.looked_at += world.assets.materials.len() as u64;
            let all = (0..world.assets.materials.len() as u32).map(MaterialId);
            let is_meant = |id: &MaterialId| {
                filters.iter().all(|filter| filter.takes(Some(&world.assets.material_name(*id))))
            };
            let mut meant: Vec<MaterialId> = all.filter(is_meant).collect();
            // The default material is not selected among others if no shape uses it.
            if meant.len() > 1 && !self.worn(world).contains(&MaterialId::DEFAULT) {
                meant.retain(|id| *id != MaterialId::DEFAULT);
            }
            return Selected::Materials(meant);
        }
        let among = self.among(query);
        let found = among.iter().copied().filter(|entity| query.matches(world, *entity)).collect();
        self.looked_at += among.len() as u64;
        Selected::Entities(found)
    }

    /// A superset of the entities that a query selects, in the world's order.
    fn among(&self, query: &Query) -> &[hecs::Entity] {
        match query {
            Query::Atom(_, filters) => {
                let is_name = |filter: &&QueryFilter| {
                    filter.key == FilterKey::Name && filter.comparison == Comparison::Equal
                };
                let named = |filter: &QueryFilter| {
                    self.by_name.get(&*composed(&filter.text)).map_or(&[][..], Vec::as_slice)
                };
                filters.iter().find(is_name).map_or(&self.order, named)
            }
            Query::And(one, other) => {
                let [one, other] = [one, other].map(|query| self.among(query));
                if one.len() < other.len() { one } else { other }
            }
            Query::Not(_) | Query::Or(..) => &self.order,
        }
    }
}

/// The entities or materials that a query selects, as the scene file at `scene_path` would contain them; without a
/// query, all entities and materials.
pub fn list(world: &World, query: Option<&Query>, scene_path: &Path) -> Vec<WrittenPart> {
    let Portrait { materials, entities, .. } = portrait(world, scene_path);
    let materials = materials.into_iter().map(|(name, text)| (name, vec![("material", text)]));
    match query.map(|query| select(world, query)) {
        None => entities.into_iter().chain(materials).collect(),
        Some(Selected::Materials(ids)) => {
            let meant: HashSet<u32> = ids.into_iter().map(|id| id.0).collect();
            // The default material has the number 0 and is not in the list.
            (1..).zip(materials).filter(|(id, _)| meant.contains(id)).map(|(_, part)| part).collect()
        }
        Some(Selected::Entities(ids)) => {
            let meant: HashSet<_> = ids.into_iter().collect();
            let order = world.in_order().into_iter().zip(entities);
            order.filter(|(entity, _)| meant.contains(entity)).map(|(_, part)| part).collect()
        }
    }
}

impl Query {
    /// Tests if the query selects an entity.
    pub fn matches(&self, world: &World, entity: hecs::Entity) -> bool {
        match self {
            Query::Atom(kind, filters) => {
                kind.takes(world, entity)
                    && filters.iter().all(|filter| filter.takes(filter.key.of(world, entity).as_deref()))
            }
            Query::Not(query) => !query.matches(world, entity),
            Query::And(one, other) => one.matches(world, entity) && other.matches(world, entity),
            Query::Or(one, other) => one.matches(world, entity) || other.matches(world, entity),
        }
    }
}

impl Kind {
    fn takes(self, world: &World, entity: hecs::Entity) -> bool {
        let has = |found: bool| found;
        let entities = &world.entities;
        match self {
            Kind::Entity => true,
            Kind::Shape => has(entities.get::<&Shape>(entity).is_ok()),
            Kind::Light => has(entities.get::<&Light>(entity).is_ok()),
            Kind::Camera => has(entities.get::<&Camera>(entity).is_ok()),
            Kind::Material => has(entities.get::<&MaterialId>(entity).is_ok()),
            Kind::Transform => has(entities.get::<&Transform>(entity).is_ok()),
            Kind::Model => has(entities.get::<&Model>(entity).is_ok()),
            Kind::Placed => has(entities.get::<&FromModel>(entity).is_ok()),
            Kind::Form(name) => forms(world, entity).contains(&Some(name)),
        }
    }
}

/// True if a material has a name.
pub(super) fn is_named(world: &World, name: &str) -> bool {
    let mut names = world.assets.materials.iter().filter_map(|named| named.name.as_deref());
    names.any(|found| is_same_name(found, name))
}

/// The forms of an entity's shape, light and camera.
pub(super) fn forms(world: &World, entity: hecs::Entity) -> [Option<&'static str>; 3] {
    fn name(form: &dyn Forms) -> &'static str {
        form.names()[form.form()]
    }
    let shape = world.entities.get::<&Shape>(entity).ok().map(|shape| name(&*shape));
    let light = world.entities.get::<&Light>(entity).ok().map(|light| name(&*light));
    let camera = world.entities.get::<&Camera>(entity).ok().map(|camera| name(&*camera));
    [shape, light, camera]
}

impl FilterKey {
    /// The entity's value for this key.
    fn of(self, world: &World, entity: hecs::Entity) -> Option<String> {
        match self {
            FilterKey::Name => Some(world.name_of(entity)),
            FilterKey::Parent => {
                world.entities.get::<&Parent>(entity).ok().map(|parent| world.name_of(parent.0))
            }
            FilterKey::Material => {
                let id = *world.entities.get::<&MaterialId>(entity).ok()?;
                world.assets.materials.get(id.0 as usize)?.name.clone()
            }
        }
    }
}

impl QueryFilter {
    fn takes(&self, found: Option<&str>) -> bool {
        match self.comparison {
            Comparison::Equal => found.is_some_and(|found| is_same_name(found, &self.text)),
            Comparison::Unequal => !found.is_some_and(|found| is_same_name(found, &self.text)),
            Comparison::Like => found.is_some_and(|found| is_like(&composed(found), &composed(&self.text))),
        }
    }
}
