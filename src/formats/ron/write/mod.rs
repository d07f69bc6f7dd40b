//! Writes a world as a scene file that reads back as the same world: numbers with as many digits as their bits need,
//! defaults left out, one entity per line.
//!
//! Entities from a glTF file are written as a reference to that file; it is an error if they have been changed.
//! Anything else that a file cannot express is an error, too: meshes and images without a file of their own, two
//! entities with the same name, infinity and NaN. Since a file refers by name, some names are made up: for parents, for
//! unnamed materials that several entities share, and for materials whose name is taken by another one.

mod assets;
mod components;
mod fields;
mod material;
mod number;
mod settings;
#[cfg(test)]
mod tests;
mod texture;

use std::collections::{HashMap, HashSet};
use std::path::Path;

use self::assets::AssetPaths;
use super::lower::reread::Component;
use crate::error::SaveError;
use crate::files;
use crate::math::{DVec3, Vec3};
use crate::world::assets::NamedMaterial;
use crate::world::fields::Slot;
use crate::world::{
    Array, Camera, FocusAt, FocusOn, FromModel, Light, LightGroup, MaterialId, Model, Modifiers, Name,
    Overrides, Parent, ScatteredCopies, Shape, Stereo, Transform, WithoutCaustics, World,
};

/// The longest entity on one line, in characters; longer entities take a line for each key.
const LONGEST_LINE: usize = 110;

/// Writes `world` to `path`; paths of meshes and images become relative to its folder.
pub fn save(world: &World, path: &Path) -> Result<(), SaveError> {
    let text = write(world, path)?;
    files::replace(path, text.as_bytes())
}

/// The text of the scene file that [`save`] would write to `scene_path`.
pub fn write(world: &World, scene_path: &Path) -> Result<String, SaveError> {
    text(world, scene_path).map_err(|reason| SaveError::new(scene_path, reason))
}

/// A component of an entity, or a material, as in a scene file, with numbers such as `"#3"` for meshes and images; none
/// if the entity lacks the component.
pub(super) fn component_text(
    world: &World,
    component: Component,
    entity: Option<hecs::Entity>,
    material: Option<MaterialId>,
) -> Result<Option<String>, String> {
    let paths = AssetPaths::numbers(&world.assets);
    let of = |id: MaterialId| material::material(&lookup(world, id)?.material, &paths);
    if let Some(id) = material {
        return of(id).map(Some);
    }
    let Some(entity) = entity else { return Ok(None) };
    let entities = &world.entities;
    Ok(match component {
        Component::Transform => {
            let transform = entities.get::<&Transform>(entity).map(|it| *it).unwrap_or_default();
            Some(components::transform(&transform)?.unwrap_or_else(|| "()".to_owned()))
        }
        Component::Shape => {
            entities.get::<&Shape>(entity).ok().map(|it| components::form(&*it, &paths)).transpose()?
        }
        Component::Light => {
            entities.get::<&Light>(entity).ok().map(|it| components::form(&*it, &paths)).transpose()?
        }
        Component::Camera => {
            entities.get::<&Camera>(entity).ok().map(|it| components::form(&*it, &paths)).transpose()?
        }
        Component::Material => {
            let several = "it has several materials: Material[\"…\"] means one of them";
            Some(of(world.only_material(entity).ok_or(several)?)?)
        }
    })
}

/// Writes single values as in a scene file, with numbers such as `"#3"` for meshes and images.
pub struct ValueWriter<'a>(AssetPaths<'a>);

impl<'a> ValueWriter<'a> {
    /// Creates a writer of a world's values.
    pub fn new(world: &'a World) -> Self {
        Self(AssetPaths::numbers(&world.assets))
    }

    /// The text of a value; none if it is absent, a structure with all defaults, or cannot be written.
    pub(crate) fn text(&self, slot: Slot) -> Option<String> {
        texture::WrittenTextures::new(&self.0).value(slot).ok().flatten()
    }
}

/// The settings as in a scene file, with the depth of paths, or without one that no file sets.
pub(super) fn settings_text(world: &World, names_depth: bool) -> Result<String, String> {
    let depth = match world.usual_depth {
        Some(_) if !names_depth => world.settings.max_depth,
        _ => world.fitting_depth(),
    };
    settings::settings(&world.settings, world.fitting_transport(), depth)
}

/// The parts of a scene file in human-readable form, for listing and comparison.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Portrait {
    /// The settings.
    pub settings: String,
    /// The materials: name (or number) and text.
    pub materials: Vec<(String, String)>,
    /// The entities: names, keys and values.
    pub entities: Vec<WrittenPart>,
}

/// A name, with keys and the text of their values.
pub type WrittenPart = (String, Vec<(&'static str, String)>);

/// All parts of a world, as the scene file at `scene_path` would contain them. Assets without a file of their own are
/// referred to by number.
pub fn portrait(world: &World, scene_path: &Path) -> Portrait {
    let files = AssetPaths::new(&world.assets, scene_path);
    let numbers = AssetPaths::numbers(&world.assets);
    // If a part cannot be written at all, the reason takes its place.
    let best = |text: &dyn Fn(&AssetPaths) -> Written| {
        text(&files).or_else(|_| text(&numbers)).unwrap_or_else(|reason| format!("({reason})"))
    };
    let materials = world.assets.materials.iter().enumerate().skip(1);
    let materials = materials.map(|(number, named)| {
        let name = world.assets.material_name(MaterialId(number as u32)).into_owned();
        (name, best(&|paths| material::material(&named.material, paths)))
    });
    let name_of = |id: MaterialId| format!("{:?}", world.assets.material_name(id));
    let entities = world.in_order().into_iter().map(|entity| {
        let get = &world.entities;
        let mut keys = Vec::new();
        keys.extend(
            get.get::<&Parent>(entity).ok().map(|it| ("parent", format!("{:?}", world.name_of(it.0)))),
        );
        let transform = get.get::<&Transform>(entity).ok();
        let transform = transform.and_then(|it| components::transform(&it).ok().flatten());
        keys.extend(transform.map(|text| ("transform", text)));
        let array = get.get::<&Array>(entity).ok().and_then(|it| components::array(&it).ok());
        keys.extend(array.map(|text| ("array", text)));
        let scatter = get.get::<&ScatteredCopies>(entity).ok();
        keys.extend(scatter.map(|it| ("scatter", best(&|p| components::part(&mut (*it).clone(), p)))));
        keys.extend(get.get::<&Shape>(entity).ok().map(|it| ("shape", best(&|p| components::form(&*it, p)))));
        keys.extend(get.get::<&Model>(entity).ok().map(|it| ("gltf", best(&|p| p.model(&it.0)))));
        keys.extend(get.get::<&MaterialId>(entity).ok().map(|it| ("material", name_of(*it))));
        keys.extend(get.get::<&Light>(entity).ok().map(|it| ("light", best(&|p| components::form(&*it, p)))));
        let without_caustics = get.satisfies::<&WithoutCaustics>(entity);
        keys.extend(without_caustics.then(|| ("caustics", "false".to_owned())));
        keys.extend(get.get::<&LightGroup>(entity).ok().map(|it| ("group", format!("{:?}", it.0))));
        keys.extend(
            get.get::<&Camera>(entity).ok().map(|it| ("camera", best(&|p| components::form(&*it, p)))),
        );
        keys.extend(
            get.get::<&Stereo>(entity).ok().map(|it| ("stereo", best(&|paths| stereo_pair(&it, paths)))),
        );
        let focused = get.get::<&FocusOn>(entity).ok().map(|it| format!("{:?}", world.name_of(it.0)));
        keys.extend(focused.map(|name| ("focus_on", name)));
        (world.name_of(entity), keys)
    });
    Portrait {
        settings: settings_text(world, true).unwrap_or_default(),
        materials: materials.collect(),
        entities: entities.collect(),
    }
}

/// A camera as the scene file at `scene_path` would contain it.
pub fn camera(world: &World, camera: &Camera, scene_path: &Path) -> Result<String, SaveError> {
    let paths = AssetPaths::new(&world.assets, scene_path);
    components::form(camera, &paths).map_err(|reason| SaveError::new(scene_path, reason))
}

/// A stereo pair as in a scene file.
fn stereo_pair(stereo: &Stereo, paths: &AssetPaths) -> Written {
    Ok(texture::WrittenTextures::new(paths).structure(&mut stereo.clone())?.finish(""))
}

/// The transform `LookAt(from: …, to: …, up: …)`, as in a scene file.
pub fn look_at(from: DVec3, to: DVec3, up: Vec3) -> Result<String, String> {
    components::look_at(from, to, up)
}

/// The result of writing a part; errors are reasons without a path.
type Written<T = String> = Result<T, String>;

fn text(world: &World, scene_path: &Path) -> Written {
    let mut order = world.in_order();
    // Entities from a glTF file will be read from it again, so they must be unchanged.
    let placed = |entity: hecs::Entity| world.entities.get::<&FromModel>(entity).ok().map(|placed| placed.0);
    if let Some(changed) = order.iter().find(|e| placed(**e).is_some_and(|was| was != world.fingerprint(**e)))
    {
        let name = world.name_of(*changed);
        let reason = "it came with a glTF file and has been changed, which a scene cannot say: take away its \
                      Placed and the Model above it, or save it as a glTF file";
        return Err(format!("{name}: {reason}"));
    }
    order.retain(|entity| placed(*entity).is_none());
    let names = entity_names(world, &order)?;
    let paths = AssetPaths::new(&world.assets, scene_path);
    let materials = material_names(world, &order);
    let mut text = String::from("(\n");
    let settings = settings_text(world, true)?;
    if settings != "()" {
        text.push_str(&format!("    settings: {settings},\n"));
    }
    let mut named: Vec<_> = materials.iter().collect();
    named.sort_by_key(|(id, _)| id.0);
    if !named.is_empty() {
        text.push_str("    materials: {\n");
        for (id, name) in named {
            let material = material::material(&lookup(world, *id)?.material, &paths)?;
            text.push_str(&format!("        {}: {material},\n", quote(name)?));
        }
        text.push_str("    },\n");
    }
    text.push_str("    entities: [\n");
    for entity in order {
        text.push_str(&one_entity(world, entity, &names, &materials, &paths)?);
    }
    text.push_str("    ],\n)\n");
    Ok(text)
}

fn one_entity(
    world: &World,
    entity: hecs::Entity,
    names: &HashMap<hecs::Entity, String>,
    materials: &HashMap<MaterialId, String>,
    paths: &AssetPaths,
) -> Written {
    let within = |reason: String| format!("{}: {reason}", world.name_of(entity));
    let mut keys = Vec::new();
    if let Some(name) = names.get(&entity) {
        keys.push(format!("name: {}", quote(name)?));
    }
    if let Ok(parent) = world.entities.get::<&Parent>(entity) {
        let name =
            reference(world, names, parent.0).map_err(|reason| within(format!("its parent {reason}")))?;
        keys.push(format!("parent: {}", quote(&name)?));
    }
    if let Ok(transform) = world.entities.get::<&Transform>(entity) {
        keys.extend(components::transform(&transform).map_err(within)?.map(|t| format!("transform: {t}")));
    }
    if let Ok(array) = world.entities.get::<&Array>(entity) {
        keys.push(format!("array: {}", components::array(&array).map_err(within)?));
    }
    if let Ok(modifiers) = world.entities.get::<&Modifiers>(entity) {
        let all = modifiers.0.iter().map(|modifier| components::form(modifier, paths));
        let all = all.collect::<Written<Vec<String>>>().map_err(within)?;
        keys.push(format!("modifiers: [{}]", all.join(", ")));
    }
    keys.extend(scatter(world, entity, names, paths).map_err(within)?);
    if let Ok(shape) = world.entities.get::<&Shape>(entity) {
        keys.push(format!("shape: {}", components::form(&*shape, paths).map_err(within)?));
    }
    if let Ok(model) = world.entities.get::<&Model>(entity) {
        keys.push(format!("gltf: {}", paths.model(&model.0).map_err(within)?));
    }
    // The material's name in the file, or its full text.
    let written = |id: MaterialId| match materials.get(&id) {
        Some(name) => quote(name),
        None => {
            let written = material::material(&lookup(world, id)?.material, paths)?;
            Ok(written.strip_prefix("BlinnPhong").map_or(written.clone(), str::to_owned))
        }
    };
    if let Ok(overrides) = world.entities.get::<&Overrides>(entity) {
        let one = |(name, id): &(String, MaterialId)| Ok(format!("{}: {}", quote(name)?, written(*id)?));
        let all: Vec<String> = overrides.0.iter().map(one).collect::<Written<_>>().map_err(within)?;
        keys.push(format!("overrides: {{{}}}", all.join(", ")));
    }
    if let Ok(id) = world.entities.get::<&MaterialId>(entity) {
        keys.push(format!("material: {}", written(*id).map_err(within)?));
    }
    if let Ok(light) = world.entities.get::<&Light>(entity) {
        keys.push(format!("light: {}", components::form(&*light, paths).map_err(within)?));
    }
    if world.entities.satisfies::<(&Light, &WithoutCaustics)>(entity) {
        keys.push("caustics: false".to_owned());
    }
    if let Ok(group) = world.entities.get::<&LightGroup>(entity) {
        keys.push(format!("group: {}", quote(&group.0)?));
    }
    if let Ok(camera) = world.entities.get::<&Camera>(entity) {
        keys.push(format!("camera: {}", components::form(&*camera, paths).map_err(within)?));
    }
    if let Ok(stereo) = world.entities.get::<&Stereo>(entity) {
        keys.push(format!("stereo: {}", stereo_pair(&stereo, paths).map_err(within)?));
    }
    if world.entities.satisfies::<&FocusAt>(entity) {
        return Err(within("it focuses on a pixel: focus it on an entity instead".to_owned()));
    }
    if let Ok(focused) = world.entities.get::<&FocusOn>(entity) {
        let name = reference(world, names, focused.0);
        let name = name.map_err(|reason| within(format!("the entity it focuses on {reason}")))?;
        keys.push(format!("focus_on: {}", quote(&name)?));
    }
    if keys.is_empty() {
        // An entity needs at least one key, and this is the default.
        keys.push("transform: ()".to_owned());
    }
    let line = keys.join(", ");
    Ok(if line.chars().count() <= LONGEST_LINE {
        format!("        ({line}),\n")
    } else {
        format!("        (\n            {},\n        ),\n", keys.join(",\n            "))
    })
}

/// The scattered copies of an entity, if it has any.
fn scatter(
    world: &World,
    entity: hecs::Entity,
    names: &HashMap<hecs::Entity, String>,
    paths: &AssetPaths,
) -> Written<Option<String>> {
    let Ok(scatter) = world.entities.get::<&ScatteredCopies>(entity) else { return Ok(None) };
    let mut scatter = (*scatter).clone();
    let ground = ground_of(world, &scatter);
    if let Some(on) = ground.filter(|on| world.entities.get::<&FromModel>(*on).is_ok()) {
        let name = reference(world, names, on);
        scatter.on = name.map_err(|reason| format!("the entity it is scattered on {reason}"))?;
    }
    Ok(Some(format!("scatter: {}", components::part(&mut scatter, paths)?)))
}

/// Returns the words by which a scene refers to an entity: its name, or `entity/node` if it is a node of a glTF file.
/// Errors follow "its parent".
fn reference(world: &World, names: &HashMap<hecs::Entity, String>, to: hecs::Entity) -> Written {
    if world.entities.get::<&FromModel>(to).is_err() {
        return names.get(&to).cloned().ok_or_else(|| "does not exist".to_owned());
    }
    let node = world.entities.get::<&Name>(to);
    let node = node.map_err(|_| "is a node without a name in a glTF file: give it one there")?;
    let model = model_of(world, to).and_then(|model| names.get(&model));
    Ok(format!("{}/{}", model.ok_or("is in no glTF file")?, node.0))
}

/// The entity on which copies are scattered.
fn ground_of(world: &World, scatter: &ScatteredCopies) -> Option<hecs::Entity> {
    let mut named = world.entities.query::<(hecs::Entity, &Name)>();
    named.iter().find(|(_, name)| name.0 == scatter.on).map(|(entity, _)| entity)
}

/// The entity that places the glTF file of a node.
fn model_of(world: &World, node: hecs::Entity) -> Option<hecs::Entity> {
    let above = |entity: &hecs::Entity| world.entities.get::<&Parent>(*entity).ok().map(|parent| parent.0);
    // Nodes of glTF files form no cycles.
    let mut above = std::iter::successors(above(&node), above);
    above.find(|entity| world.entities.get::<&FromModel>(*entity).is_err())
}

/// The names of entities; unnamed parents and targets of cameras get a new name.
fn entity_names(world: &World, order: &[hecs::Entity]) -> Written<HashMap<hecs::Entity, String>> {
    let mut names = HashMap::new();
    let mut taken = HashSet::new();
    for entity in order {
        let Ok(name) = world.entities.get::<&Name>(*entity) else { continue };
        if !taken.insert(name.0.clone()) {
            return Err(format!("two entities are called \"{}\": rename one of them", name.0));
        }
        names.insert(*entity, name.0.clone());
    }
    for entity in order {
        let parent = world.entities.get::<&Parent>(*entity).ok().map(|parent| parent.0);
        let focused = world.entities.get::<&FocusOn>(*entity).ok().map(|focused| focused.0);
        let scatter = world.entities.get::<&ScatteredCopies>(*entity);
        let ground = scatter.ok().and_then(|scatter| ground_of(world, &scatter));
        for mut other in parent.into_iter().chain(focused).chain(ground) {
            if world.entities.get::<&FromModel>(other).is_ok() {
                other = model_of(world, other).unwrap_or(other);
            }
            if world.entities.contains(other) && !names.contains_key(&other) {
                let name = free_name(&world.name_of(other), &taken);
                taken.insert(name.clone());
                names.insert(other, name);
            }
        }
    }
    Ok(names)
}

/// The materials for the file's map of materials, and their names in it: named materials, except those used only by the
/// triangles of mesh files (which are read with the mesh again), and unnamed ones that several entities share.
fn material_names(world: &World, order: &[hecs::Entity]) -> HashMap<MaterialId, String> {
    let mut users: HashMap<MaterialId, usize> = HashMap::new();
    for entity in order {
        if let Ok(id) = world.entities.get::<&MaterialId>(*entity) {
            *users.entry(*id).or_default() += 1;
        }
        if let Ok(overrides) = world.entities.get::<&Overrides>(*entity) {
            for (_, id) in &overrides.0 {
                *users.entry(*id).or_default() += 1;
            }
        }
    }
    let of_meshes: HashSet<MaterialId> =
        world.assets.meshes.iter().flat_map(|mesh| mesh.triangle_materials.iter().copied()).collect();
    let mut taken: HashSet<String> =
        world.assets.materials.iter().filter_map(|material| material.name.clone()).collect();
    let mut given = HashSet::new();
    let mut names = HashMap::new();
    for (index, material) in world.assets.materials.iter().enumerate() {
        let id = MaterialId(index as u32);
        let users = users.get(&id).copied().unwrap_or(0);
        let name = match &material.name {
            Some(_) if users == 0 && of_meshes.contains(&id) => continue,
            Some(name) if given.insert(name.clone()) => name.clone(),
            Some(name) => free_name(name, &taken),
            // The default material is written inline, in only two characters.
            None if users > 1 && *material != NamedMaterial::default() => {
                free_name(&format!("material {index}"), &taken)
            }
            None => continue,
        };
        taken.insert(name.clone());
        names.insert(id, name);
    }
    names
}

/// The first of `wish`, `wish (2)`, … that is not taken.
fn free_name(wish: &str, taken: &HashSet<String>) -> String {
    let numbered = (2..).map(|number: u64| format!("{wish} ({number})"));
    let mut candidates = std::iter::once(wish.to_owned()).chain(numbered);
    candidates.find(|name| !taken.contains(name)).unwrap_or_default()
}

fn lookup(world: &World, id: MaterialId) -> Written<&NamedMaterial> {
    let found = world.assets.materials.get(id.0 as usize);
    found.ok_or_else(|| format!("there is no material of number {}", id.0))
}

/// A string in RON's quotes.
fn quote(string: &str) -> Written {
    ron::to_string(string).map_err(|error| error.to_string())
}
