//! Reads `entities` and resolves their parents.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::overrides::{self, Override};
use super::{Lowering, transform};
use crate::error::LoadError;
use crate::formats::ron::source::{Raw, SceneText, shorten, suggest};
use crate::world::components::WrittenAt;
use crate::world::copies::{check_array, check_scatter};
use crate::world::names::is_same_name;
use crate::world::{
    Array, ArrayRow, FocusOn, LightGroup, Model, Modifier, Modifiers, Name, Parent, ScatteredCopies, Stereo,
    Transform, WithoutCaustics,
};

/// The entities before their parents are resolved. Indices are places in `entities`.
#[derive(Default)]
struct Family<'a> {
    entities: Vec<hecs::Entity>,
    /// Names: place in the text and entity.
    names: HashMap<String, (Raw<'a>, usize)>,
    /// Entities with a parent, and the place of its name in the text.
    parents: Vec<(usize, Raw<'a>)>,
    /// Entities whose parent is a node of a glTF file.
    children: Vec<(usize, NodeOfModel<'a>)>,
    /// Cameras that focus on an entity, and the place of its name in the text.
    focused: Vec<(usize, Raw<'a>)>,
    /// Entities below the place that their file is included at, and its entity.
    below: Vec<(usize, usize)>,
    /// Entities that are scattered, and the place in the text and the name of what they are scattered on.
    grounds: Vec<(usize, Raw<'a>, String)>,
    /// Entities that place a glTF file: the file and the material overrides.
    models: Vec<(usize, Raw<'a>, Vec<Override<'a>>)>,
    /// The memory for the components of an entity, for one after another.
    builder: hecs::EntityBuilder,
}

/// A node of a glTF file that an entity places.
struct NodeOfModel<'a> {
    /// The place in the text where it is named.
    raw: Raw<'a>,
    model: usize,
    name: String,
}

/// The thing that a name in a scene refers to.
enum Referent<'a> {
    Entity(usize),
    Node(NodeOfModel<'a>),
}

/// The keys of an entity.
const ENTITY: [&str; 16] = [
    "name", "parent", "transform", "shape", "gltf", "overrides", "material", "light", "camera", "caustics",
    "stereo", "focus_on", "array", "scatter", "modifiers", "group",
];

impl<'a> Lowering<'_, 'a> {
    /// Reads the entities of each file: its number and its list.
    pub(super) fn entities(&mut self, files: &[(usize, Option<Raw<'a>>)]) -> Result<(), LoadError> {
        let (source, mut family) = (self.source, Family::default());
        let mut places = HashMap::new();
        for (number, list) in files {
            let place = self.place_of_file(*number, &places, &mut family);
            let Some(place) = source.recover(place)? else { continue };
            places.insert(*number, place);
            let list = list.map_or(Ok(Vec::new()), |raw| source.list(raw, "the entities"));
            let list = source.recover(list)?.unwrap_or_default();
            family.entities.reserve(list.len());
            for raw in list {
                let keys = source.recover(source.keys(raw, "an entity", 0, ENTITY))?;
                let read = keys.map_or(Ok(()), |keys| self.entity((raw, *number, place), keys, &mut family));
                source.recover(read)?;
            }
        }
        // An entity with a fault may have no name.
        if self.source.has_faults() {
            return Ok(());
        }
        let parents = self.parents(&mut family)?;
        self.refuse_cycles(&family, &parents)?;
        for (child, parent) in parents.iter().enumerate() {
            let Some(parent) = *parent else { continue };
            // Both were spawned above.
            let _ = self.world.entities.insert_one(family.entities[child], Parent(family.entities[parent]));
        }
        // Last, so that the scene's own entities keep their names and come first.
        for (index, raw, overrides) in &family.models {
            let (source, file) = self.assets.model(self.source, *raw, &mut self.world)?;
            let entity = family.entities[*index];
            let _ = self.world.entities.insert_one(entity, Model(file));
            // Entities are numbered in the order of spawning, and none has been removed.
            let first = self.world.entities.len();
            source.place(&mut self.world, Some(entity));
            if !overrides.is_empty() {
                let _ = self.world.entities.insert_one(entity, overrides::component(overrides));
                self.apply(first, overrides)?;
            }
        }
        for (child, node) in &family.children {
            let parent = Parent(self.node(&family, node)?);
            let _ = self.world.entities.insert_one(family.entities[*child], parent);
        }
        for (camera, raw) in &family.focused {
            let focus = FocusOn(self.entity_of(&family, self.referent(&family, *raw, "entity")?)?);
            let _ = self.world.entities.insert_one(family.entities[*camera], focus);
        }
        for (index, raw, name) in &family.grounds {
            let ground = self.named(&family, *raw, name).ok_or_else(|| {
                let suggestion = suggest(name, family.names.keys().map(String::as_str));
                let reason = format!("there is no entity \"{}\" to scatter on{suggestion}", shorten(name));
                self.source.error(raw.0, reason)
            })?;
            let ground = self.world.name_of(self.entity_of(&family, ground)?);
            if let Ok(mut scatter) = self.world.entities.get::<&mut ScatteredCopies>(family.entities[*index])
            {
                scatter.on = ground;
            }
        }
        Ok(())
    }

    /// Finds the entity that a name refers to, once all models are placed.
    fn entity_of(&self, family: &Family<'a>, referent: Referent<'a>) -> Result<hecs::Entity, LoadError> {
        match referent {
            Referent::Entity(index) => Ok(family.entities[index]),
            Referent::Node(node) => self.node(family, &node),
        }
    }

    /// The entity below which the file with a number is placed, if its entry of `include`, or that of a file that
    /// includes it, has a parent or a transform.
    fn place_of_file(
        &mut self,
        number: usize,
        places: &HashMap<usize, Option<usize>>,
        family: &mut Family<'a>,
    ) -> Result<Option<usize>, LoadError> {
        let source = self.source;
        let Some(inclusion) = &source.parts[number].inclusion else { return Ok(None) };
        let entry = Raw(source.slice(inclusion.entry));
        let [_, _, parent, transform, _] = source.include_entry(entry)?;
        let outer = places.get(&inclusion.by).copied().flatten();
        if parent.or(transform).is_none() {
            return Ok(outer);
        }
        let index = family.entities.len();
        let transform = transform.map_or(Ok(Transform::IDENTITY), |raw| transform::transform(source, raw))?;
        family.entities.push(self.world.entities.spawn((transform, written_at(source, entry))));
        match (parent, outer) {
            (Some(raw), _) => family.parents.push((index, raw)),
            (None, Some(outer)) => family.below.push((index, outer)),
            (None, None) => {}
        }
        Ok(Some(index))
    }

    /// Finds a node by name below an entity that places a glTF file.
    fn node(&self, family: &Family<'a>, node: &NodeOfModel<'a>) -> Result<hecs::Entity, LoadError> {
        let NodeOfModel { raw, model, name } = node;
        let (world, model) = (&self.world, family.entities[*model]);
        let parent = |entity: hecs::Entity| world.entities.get::<&Parent>(entity).ok().map(|it| it.0);
        let is_below = |entity: hecs::Entity| {
            // glTF nodes form no cycles.
            std::iter::successors(parent(entity), |entity| parent(*entity)).any(|above| above == model)
        };
        let below: Vec<_> = world.in_order().into_iter().filter(|entity| is_below(*entity)).collect();
        let found = below.iter().find(|entity| is_same_name(&world.name_of(**entity), name));
        found.copied().ok_or_else(|| {
            let names: Vec<String> = below.iter().map(|entity| world.name_of(*entity)).collect();
            let suggestion = suggest(name, names.iter().map(String::as_str));
            self.source.error(raw.0, format!("the model has no node \"{}\"{suggestion}", shorten(name)))
        })
    }

    fn entity(
        &mut self,
        (raw, number, below): (Raw<'a>, usize, Option<usize>),
        given: [Option<Raw<'a>>; 16],
        family: &mut Family<'a>,
    ) -> Result<(), LoadError> {
        let source = self.source;
        if given.iter().all(Option::is_none) {
            let keys = ENTITY.join(", ");
            return Err(source.error(raw.0, format!("an entity needs at least one key; keys: {keys}")));
        }
        let [
            name,
            parent,
            transform,
            shape,
            gltf,
            overrides,
            material,
            light,
            camera,
            caustics,
            stereo,
            focus_on,
            array,
            scatter,
            modifiers,
            group,
        ] = given;
        if let (Some(_), Some(material), None) = (gltf, material, shape) {
            let reason = "a glTF file has materials of its own: overrides: {\"its name\": …} replaces one";
            return Err(source.error(material.0, reason));
        }
        let index = family.entities.len();
        let mut builder = std::mem::take(&mut family.builder);
        builder.add(written_at(source, raw));
        if let Some(raw) = name {
            builder.add(self.name_of_entity(raw, number, family)?);
        }
        let place = transform.map_or(Ok(Transform::IDENTITY), |raw| transform::transform(source, raw));
        builder.add(source.recover(place)?.unwrap_or_default());
        if let Some(shape) = self.recovered(shape, Self::shape)? {
            builder.add(shape);
        }
        if let Some(material) = self.recovered(material, Self::material_of_entity)? {
            builder.add(material);
        }
        if let Some(light) = self.recovered(light, Self::light)? {
            builder.add(light);
        }
        if let Some(raw) = caustics {
            if light.is_none() {
                let reason = "an entity without a light has no caustics of its own: write it in the material";
                return Err(source.error(raw.0, reason));
            }
            if !source.flag(raw)? {
                builder.add(WithoutCaustics);
            }
        }
        if let Some(raw) = group {
            builder.add(LightGroup(source.string(raw, "the name of a light group")?));
        }
        self.camera_of_entity(camera, [stereo, focus_on], &mut builder)?;
        family.focused.extend(focus_on.map(|raw| (index, raw)));
        if let Some(ground) = self.copies_of_entity([array, scatter, modifiers], &mut builder)? {
            family.grounds.extend(scatter.map(|raw| (index, raw, ground)));
        }
        let overrides = match (overrides, gltf) {
            (None, _) => Vec::new(),
            (Some(raw), None) => {
                return Err(source.error(raw.0, "there is nothing to override: the entity has no gltf"));
            }
            (Some(raw), Some(_)) => self.overrides(raw)?,
        };
        family.models.extend(gltf.map(|raw| (index, raw, overrides)));
        match (parent, below) {
            (Some(raw), _) => family.parents.push((index, raw)),
            (None, below) => family.below.extend(below.map(|place| (index, place))),
        }
        family.entities.push(self.world.entities.spawn(builder.build()));
        family.builder = builder;
        Ok(())
    }

    /// Reads the name of the entity that is next in the family.
    fn name_of_entity(
        &self,
        raw: Raw<'a>,
        number: usize,
        family: &mut Family<'a>,
    ) -> Result<Name, LoadError> {
        let source = self.source;
        let name = format!("{}{}", source.parts[number].prefix, source.string(raw, "a name")?);
        match family.names.entry(name.clone()) {
            Entry::Occupied(first) => {
                let (first, remedy) = (source.place(first.get().0, raw), source.keep_apart(number));
                let name = shorten(&name);
                let reason = format!("there is already an entity \"{name}\" at {first}{remedy}");
                Err(source.error(raw.0, reason))
            }
            Entry::Vacant(place) => {
                place.insert((raw, family.entities.len()));
                Ok(Name(name))
            }
        }
    }

    /// Reads an entity's camera with its `stereo`; whether it can `focus_on` something is checked.
    fn camera_of_entity(
        &mut self,
        camera: Option<Raw<'a>>,
        [stereo, focus_on]: [Option<Raw<'a>>; 2],
        builder: &mut hecs::EntityBuilder,
    ) -> Result<(), LoadError> {
        let source = self.source;
        if let (Some(raw), None) = (stereo.or(focus_on), camera) {
            return Err(source.error(raw.0, "this is for cameras, and the entity has none"));
        }
        if let Some(mut camera) = self.recovered(camera, |this, raw| this.camera(raw, focus_on.is_some()))? {
            if let (Some(raw), None) = (focus_on, camera.focus_distance_m()) {
                let reason = "everything is sharp: a ThinLens or a Photographic with an f_stop can focus";
                return Err(source.error(raw.0, reason));
            }
            builder.add(camera);
        }
        if let Some(raw) = stereo {
            let mut pair = Stereo::default();
            self.structure(raw, &mut pair)?;
            builder.add(pair);
        }
        Ok(())
    }

    /// Reads an entity's copies and modifiers; returns the name of what it is scattered on.
    fn copies_of_entity(
        &mut self,
        [array, scatter, modifiers]: [Option<Raw<'a>>; 3],
        builder: &mut hecs::EntityBuilder,
    ) -> Result<Option<String>, LoadError> {
        if let Some(array) = self.recovered(array, Self::array)? {
            builder.add(array);
        }
        if let Some(modifiers) = self.recovered(modifiers, Self::modifiers)? {
            builder.add(modifiers);
        }
        let Some(places) = self.recovered(scatter, Self::scatter)? else { return Ok(None) };
        let ground = places.on.clone();
        builder.add(places);
        Ok(Some(ground))
    }

    /// A row, `(count: …, step: …)`, or a list of rows.
    fn array(&mut self, raw: Raw<'a>) -> Result<Array, LoadError> {
        let source = self.source;
        let rows = if raw.0.starts_with('[') { source.list(raw, "rows")? } else { vec![raw] };
        let row = |raw: &Raw<'a>| {
            let [count, step] = source.keys(*raw, "a row of an array", 2, ["count", "step"])?;
            let count =
                count.map_or(Ok(1), |raw| source.whole(raw, "count", 1, ScatteredCopies::MOST.into()))?;
            let step = step.map_or(Ok(Transform::IDENTITY), |raw| transform::transform(source, raw))?;
            Ok(ArrayRow { count: count as u32, step })
        };
        let array = Array(rows.iter().map(row).collect::<Result<_, LoadError>>()?);
        check_array(&array).map_err(|reason| source.error(raw.0, reason))?;
        Ok(array)
    }

    /// A list of modifiers.
    fn modifiers(&mut self, raw: Raw<'a>) -> Result<Modifiers, LoadError> {
        let mut all = Vec::new();
        for raw in self.source.list(raw, "modifiers")? {
            let mut modifier = Modifier::Normals { smooth: 0.0 };
            self.form(raw, &mut modifier)?;
            all.push(modifier);
        }
        Ok(Modifiers(all))
    }

    fn scatter(&mut self, raw: Raw<'a>) -> Result<ScatteredCopies, LoadError> {
        let mut scatter = ScatteredCopies::default();
        self.structure(raw, &mut scatter)?;
        if !self.source.has_faults() {
            check_scatter(&scatter).map_err(|reason| self.source.error(raw.0, reason))?;
        }
        Ok(scatter)
    }

    /// Reads a component; none if there is none, or if it has a fault and faults are collected.
    fn recovered<T>(
        &mut self,
        raw: Option<Raw<'a>>,
        read: impl FnOnce(&mut Self, Raw<'a>) -> Result<T, LoadError>,
    ) -> Result<Option<T>, LoadError> {
        let component = raw.map(|raw| read(self, raw)).transpose();
        self.source.recover(component).map(Option::flatten)
    }

    /// Finds an entity by a name that is written at a place: its index.
    fn find(&self, family: &Family<'a>, raw: Raw<'a>, name: &str) -> Option<usize> {
        self.source.find_name(raw, name, |name: &str| family.names.get(name).map(|(_, index)| *index))
    }

    /// The parent of each entity, as indices in file order. Parents inside glTF files are left to [`Family::children`].
    fn parents(&self, family: &mut Family<'a>) -> Result<Vec<Option<usize>>, LoadError> {
        let mut parents = vec![None; family.entities.len()];
        for (child, place) in &family.below {
            parents[*child] = Some(*place);
        }
        for (child, raw) in &family.parents {
            match self.referent(family, *raw, "parent")? {
                Referent::Entity(parent) => parents[*child] = Some(parent),
                Referent::Node(node) => family.children.push((*child, node)),
            }
        }
        Ok(parents)
    }

    /// Finds the thing that a name refers to: an entity, or `entity/node`, a node of the glTF file that it places.
    fn named(&self, family: &Family<'a>, raw: Raw<'a>, name: &str) -> Option<Referent<'a>> {
        if let Some(entity) = self.find(family, raw, name) {
            return Some(Referent::Entity(entity));
        }
        let (model, node) = name.split_once('/')?;
        let model = self.find(family, raw, model)?;
        Some(Referent::Node(NodeOfModel { raw, model, name: node.to_owned() }))
    }

    fn referent(&self, family: &Family<'a>, raw: Raw<'a>, what: &str) -> Result<Referent<'a>, LoadError> {
        let name = self.source.string(raw, &format!("the name of the {what}"))?;
        self.named(family, raw, &name).ok_or_else(|| {
            let suggestion = suggest(&name, family.names.keys().map(String::as_str));
            self.source.error(raw.0, format!("unknown {what} \"{}\"{suggestion}", shorten(&name)))
        })
    }

    /// Returns an error if parents form a cycle. Follows each chain of ancestors until it ends or meets an entity
    /// already seen.
    fn refuse_cycles(&self, family: &Family<'a>, parents: &[Option<usize>]) -> Result<(), LoadError> {
        let mut seen_from = vec![usize::MAX; parents.len()];
        for (start, raw) in &family.parents {
            let mut at = Some(*start);
            while let Some(entity) = at {
                if seen_from[entity] == *start {
                    return Err(self
                        .cycle(family, parents, entity)
                        .unwrap_or_else(|| self.source.error(raw.0, "these parents form a cycle")));
                }
                if seen_from[entity] != usize::MAX {
                    break;
                }
                seen_from[entity] = *start;
                at = parents[entity];
            }
        }
        Ok(())
    }

    /// The error for the cycle that contains `member`, reported at the `parent` key that comes first in the file.
    fn cycle(&self, family: &Family<'a>, parents: &[Option<usize>], member: usize) -> Option<LoadError> {
        const MOST_NAMES: usize = 8;
        let mut members = vec![member];
        while let Some(parent) = parents[*members.last()?].filter(|parent| *parent != member) {
            members.push(parent);
        }
        let first = members.iter().enumerate().min_by_key(|(_, entity)| **entity)?.0;
        members.rotate_left(first);
        let (_, place) = family.parents.iter().find(|(child, _)| *child == members[0])?;
        // Every member is a parent: it has a name, unless it is the place of an included file.
        let name = |entity: usize| {
            let found = family.names.iter().find(|(_, (_, index))| *index == entity);
            found.map(|(name, _)| format!("\"{}\"", shorten(name)))
        };
        let mut names: Vec<String> =
            members.iter().take(MOST_NAMES).filter_map(|entity| name(*entity)).collect();
        names.push(if members.len() > MOST_NAMES { "…".to_owned() } else { names.first()?.clone() });
        let reason = format!("an entity cannot be its own ancestor: {}", names.join(" is a child of "));
        Some(self.source.error(place.0, reason))
    }
}

/// The place where an entity is written.
fn written_at(source: &SceneText, raw: Raw) -> WrittenAt {
    let (line, column) = source.position(raw.0);
    WrittenAt { file: source.file(raw).clone(), position: [line as u32, column as u32] }
}
