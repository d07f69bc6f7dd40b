//! `rayfront info SCENE`: shows the contents of a scene without rendering it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::{Value, json};

use crate::cli::args::ModelOptions;
use crate::cli::{failure::Failure, output};
use crate::error::in_one_line;
use crate::film::Region;
use crate::formats::gltf::{ModelSummary, contents};
use crate::integrator::RenderSetup;
use crate::integrator::setup::NoPhotons;
use crate::math::{DVec3, Rgb, Vec3};
use crate::memory;
use crate::render::MemoryEstimate;
use crate::render::photons::{self, PhotonBytes};
use crate::scene::emitter_rows::{ConeRow, DirectionalRow, PlanarRow, PointRow, SphereRow};
use crate::scene::emitters::{flag, kind};
use crate::scene::{CompiledScene, WhittedLight};
use crate::world::{ColorInput, Light, Material, MaterialId, Settings, Shape, World};

/// `rayfront info`.
#[derive(Args, Debug)]
pub struct Info {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj, .stl)
    pub scene: PathBuf,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// The options for reading the scene.
    #[command(flatten)]
    pub model: ModelOptions,
}

pub fn run(arguments: &Info) -> Result<ExitCode, Failure> {
    let before = memory::resident();
    let world = crate::formats::load_with(&arguments.scene, &arguments.model.of_size(None))?;
    let scene = crate::compile::compile(&world, None).map_err(Failure::compile(&arguments.scene))?;
    let peak = memory::peak();
    let mut facts = facts(&world, &scene)?;
    // The part of its bound that the builder really uses depends on the timing of its threads.
    let meshes: usize = world.assets.meshes.iter().map(|mesh| mesh.bytes()).sum();
    let building = meshes + scene.memory().geometry + scene.bvh.statistics.peak_bytes;
    let building = before.map(|before| before + building as u64);
    let settings = world.settings.clone();
    let setup = crate::render::setup(scene, &settings);
    let region = Region::whole(settings.size);
    let needs = MemoryEstimate::usual(region);
    // The world is dropped before anything is rendered.
    let rendering = rendering_bytes(before, &setup, &settings, &needs);
    facts["memory_bytes"]["peak"] = peak.max(building).max(rendering).into();
    facts["photons"] = photons(&setup);
    let text = if arguments.json { format!("{facts}\n") } else { text(&facts) };
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the resident memory of a process in bytes while it renders, given its resident memory `before` the scene was
/// loaded.
pub fn rendering_bytes(
    before: Option<u64>,
    setup: &RenderSetup,
    settings: &Settings,
    needs: &MemoryEstimate,
) -> Option<u64> {
    Some(before? + setup.scene.memory().total() as u64 + needs.bytes(setup, settings))
}

/// Returns the facts about photons that are known before any is traced.
fn photons(setup: &RenderSetup) -> Value {
    let (count, PhotonBytes { ended, sorted }) = (photons::count_of(setup), PhotonBytes::most(setup));
    let none = count.err().map(NoPhotons::text);
    let turns_off = setup.chooses_photons;
    json!({"a_sample": count.unwrap_or(0), "none": none, "may_turn_off": turns_off, "ended_bytes": ended, "sorted_bytes": sorted})
}

/// Returns all facts as one JSON object; the text is made from it, so that both agree.
fn facts(world: &World, scene: &CompiledScene) -> Result<Value, Failure> {
    let memory = scene.memory();
    let [width, height] = world.settings.size;
    let film = width as usize * height as usize * size_of::<crate::film::PixelSum>();
    let images: Vec<Value> = world
        .assets
        .images
        .iter()
        .map(|i| json!({"file": i.source.as_deref().map(output::path_json), "width": i.width, "height": i.height}))
        .collect();
    let meshes: Vec<Value> = world
        .assets
        .meshes
        .iter()
        .map(|m| {
            let (vertices, triangles) = (m.positions.len(), m.triangles.len());
            json!({"name": m.name, "file": m.source.as_deref().map(output::path_json), "vertices": vertices, "triangles": triangles})
        })
        .collect();
    Ok(json!({
        "entities": world.entities.len(),
        "triangles": scene.geometry.triangles.len(),
        "triangles_placed": scene.geometry.placed_triangles,
        "spheres": scene.geometry.spheres.len(),
        "instances": scene.geometry.instances.len(),
        "meshes": meshes,
        "bounds_m": [rounded(scene.in_world(scene.bounds.min)), rounded(scene.in_world(scene.bounds.max))],
        "bvh": {
            "nodes": scene.bvh.nodes.len(),
            "triangle_blocks": scene.bvh.triangles.len(),
            "sphere_blocks": scene.bvh.spheres.len(),
        },
        "materials": scene.material_names[..scene.materials.len() - scene.sheets.len()],
        "lights": scene.lights.iter().map(|light| describe_light(scene, light)).collect::<Vec<_>>(),
        "emitters": emitters(world, scene),
        "cameras": crate::compile::camera_names(world),
        "models": models(world)?,
        "images": images,
        "memory_bytes": {
            "geometry": memory.geometry, "bvh": memory.bvh, "textures": memory.textures, "lights": memory.lights,
            "film": film, "total": memory.total() + film,
        },
        "warnings": scene.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
    }))
}

/// Returns the glTF files with their scenes, variants and animations.
fn models(world: &World) -> Result<Vec<Value>, Failure> {
    let is_model = |path: &PathBuf| {
        let extension = path.extension().unwrap_or_default();
        extension.eq_ignore_ascii_case("gltf") || extension.eq_ignore_ascii_case("glb")
    };
    let files = world.assets.files.all().into_keys().filter(is_model);
    let models = files.map(|path| {
        let ModelSummary { scenes, variants, animations } = contents(&path, &world.assets.files)?;
        let animations: Vec<Value> =
            animations.into_iter().map(|(name, end)| json!({"name": name, "seconds": end})).collect();
        Ok(json!({"file": output::path_json(&path), "scenes": scenes, "variants": variants, "animations": animations}))
    });
    models.collect()
}

/// Returns the emitters: entities that are lights, then emissive materials with the entities that have them.
fn emitters(world: &World, scene: &CompiledScene) -> Vec<Value> {
    let mut lights = Vec::new();
    let mut shown: BTreeMap<u32, Vec<String>> = BTreeMap::new();
    for entity in world.in_order() {
        let name = || world.name_of(entity);
        if let Ok(light) = world.entities.get::<&Light>(entity) {
            lights.push(json!({"entity": name(), "light": kind_of(&light)}));
        }
        let Ok(shape) = world.entities.get::<&Shape>(entity) else { continue };
        let own = world.entities.get::<&MaterialId>(entity).ok().map(|id| *id);
        let mesh = match *shape {
            Shape::Mesh(id) if own.is_none() => world.assets.meshes.get(id.0 as usize),
            _ => None,
        };
        let of_triangles = mesh.map_or(&[][..], |mesh| &mesh.triangle_materials);
        let mut materials: BTreeSet<u32> = of_triangles.iter().map(|id| id.0).collect();
        if materials.is_empty() {
            materials.insert(own.unwrap_or(MaterialId::DEFAULT).0);
        }
        for id in materials.into_iter().filter(|id| radiance(world, *id).max_component() > 0.0) {
            shown.entry(id).or_default().push(name());
        }
    }
    let materials = shown.into_iter().map(|(id, entities)| {
        let name = scene.material_names.get(id as usize);
        let radiance = radiance(world, id).to_array().map(|channel| significant(f64::from(channel)));
        json!({"material": name, "radiance": radiance, "entities": entities})
    });
    lights.into_iter().chain(materials).collect()
}

/// Returns a material's emitted radiance; if it is textured, an upper bound.
fn radiance(world: &World, material: u32) -> Rgb {
    let emission = match world.assets.materials.get(material as usize).map(|named| &named.material) {
        Some(Material::BlinnPhong(material)) => material.emission,
        Some(Material::Principled(material)) => material.emission,
        None => return Rgb::BLACK,
    };
    match emission {
        ColorInput::Constant(color) => color,
        ColorInput::Texture(id) => {
            world.assets.textures.get(id.0 as usize).map_or(Rgb::BLACK, |texture| texture.factor)
        }
    }
}

fn kind_of(light: &Light) -> &'static str {
    match light {
        Light::Point { .. } => "point",
        Light::Spot { .. } => "spot",
        Light::Photometric { .. } => "photometric",
        Light::Directional { .. } => "directional",
        Light::Environment { .. } => "environment",
        Light::Sky { .. } => "sky",
        Light::Area { .. } => "area",
    }
}

/// Rounds to five significant digits, without the padding of boxes and the rounding of matrices.
fn significant(value: f64) -> f64 {
    if value.abs() < 1e-9 { 0.0 } else { format!("{value:.4e}").parse().unwrap_or(value) }
}

fn rounded(v: DVec3) -> [f64; 3] {
    v.to_array().map(significant)
}

fn describe_light(scene: &CompiledScene, light: &WhittedLight) -> String {
    let (kind, row) = scene.emitters.row(light.emitter);
    let text = |v: DVec3| {
        let [x, y, z] = rounded(v);
        format!("({x}, {y}, {z})")
    };
    let place = |v: Vec3| text(scene.in_world(v));
    let way = |v: Vec3| text(v.as_dvec3());
    match kind {
        kind::POINT => format!("point at {}", place(PointRow::of(row).position)),
        kind::SPOT | kind::PHOTOMETRIC => {
            let (position, axis) = (PointRow::of(row).position, ConeRow::of(row).axis);
            let what = if kind == kind::SPOT { "spot" } else { "photometric" };
            format!("{what} at {} along {}", place(position), way(axis))
        }
        kind::SPHERE => {
            let SphereRow { center, radius, .. } = SphereRow::of(row);
            let ball = format!("ball of {} m at {}", significant(f64::from(2.0 * radius)), place(center));
            match scene.emitters.flags[light.emitter as usize] & flag::CONE {
                0 => ball,
                _ => format!("{ball} along {}", way(ConeRow::of(row).axis)),
            }
        }
        kind::DIRECTIONAL => format!("directional along {}", way(-DirectionalRow::of(row).to_light)),
        _ => {
            let PlanarRow { corner, e1: up, e2: across, .. } = PlanarRow::of(row);
            let center = place(corner + (up + across) * 0.5);
            let [w, h] = [across, up].map(|side| significant(f64::from(side.length())));
            let WhittedLight { samples, pattern, .. } = light;
            let round = scene.emitters.flags[light.emitter as usize] & flag::ROUND != 0;
            let what = if round { "disc" } else { "area" };
            format!("{what} of {w} x {h} m at {center}, {samples} samples, {pattern:?}")
        }
    }
}

/// Returns the first few names, and the number of the others.
fn some(names: &[String]) -> String {
    const MOST: usize = 4;
    let more = names.len().saturating_sub(MOST);
    let first = names[..names.len() - more].join(", ");
    if more > 0 { format!("{first} and {more} more") } else { first }
}

fn text(facts: &Value) -> String {
    let number = |v: &Value| v.as_u64().unwrap_or(0);
    let megabytes = |v: &Value| format!("{:.1} MB", number(v) as f64 / 1e6);
    let list = |v: &Value| v.as_array().cloned().unwrap_or_default();
    let mut lines = vec![
        format!("entities   {}", facts["entities"]),
        format!("triangles  {}, {} where they are placed", facts["triangles"], facts["triangles_placed"]),
        format!("spheres    {}", facts["spheres"]),
        format!("instances  {}", facts["instances"]),
        format!("bounds     {} to {} m", facts["bounds_m"][0], facts["bounds_m"][1]),
        format!(
            "bvh        {} nodes, {} triangle blocks, {} sphere blocks",
            facts["bvh"]["nodes"], facts["bvh"]["triangle_blocks"], facts["bvh"]["sphere_blocks"]
        ),
    ];
    let memory = &facts["memory_bytes"];
    lines.push(format!(
        "memory     {} while it renders; of the scene geometry {}, bvh {}, textures {}, lights {}; of the image {}",
        megabytes(&memory["peak"]),
        megabytes(&memory["geometry"]),
        megabytes(&memory["bvh"]),
        megabytes(&memory["textures"]),
        megabytes(&memory["lights"]),
        megabytes(&memory["film"])
    ));
    let photons = &facts["photons"];
    lines.push(match photons["none"].as_str() {
        Some(none) => format!("photons    none: {none}"),
        None => format!(
            "photons    {}{} a sample{}; in memory about {} as they end, and {} sorted",
            if photons["may_turn_off"] == true { "at most " } else { "" },
            photons["a_sample"],
            if photons["may_turn_off"] == true { ", if they turn out to be of use" } else { "" },
            megabytes(&photons["ended_bytes"]),
            megabytes(&photons["sorted_bytes"])
        ),
    });
    let plain = |v: &Value| v.as_str().map_or_else(|| v.to_string(), in_one_line);
    for mesh in list(&facts["meshes"]) {
        let file = mesh["file"].as_str().map_or(String::new(), |file| format!(" of {file}"));
        lines.push(format!("mesh       {}{file}: {} triangles", plain(&mesh["name"]), mesh["triangles"]));
    }
    for image in list(&facts["images"]) {
        let file = if image["file"].is_null() { "without a file".to_owned() } else { plain(&image["file"]) };
        lines.push(format!("image      {file}: {} x {}", image["width"], image["height"]));
    }
    for model in list(&facts["models"]) {
        let file = plain(&model["file"]);
        lines.extend(list(&model["animations"]).iter().map(|it| {
            let end = it["seconds"].as_f64().map_or(String::new(), |end| format!(", up to {end:.2} s"));
            format!("animation  {} of {file}{end}", plain(&it["name"]))
        }));
        for (title, key) in [("variant", "variants"), ("scene", "scenes")] {
            let names = list(&model[key]);
            lines.extend(names.iter().map(|name| format!("{title:<11}{} of {file}", plain(name))));
        }
    }
    for emitter in list(&facts["emitters"]) {
        lines.push(match emitter["light"].as_str() {
            Some(kind) => format!("emits      {}: {kind} light", plain(&emitter["entity"])),
            None => {
                let entities: Vec<String> = list(&emitter["entities"]).iter().map(plain).collect();
                let (radiance, material) = (&emitter["radiance"], plain(&emitter["material"]));
                format!("emits      {}: material {material}, {radiance} W/(m² sr)", some(&entities))
            }
        });
    }
    for (title, key) in
        [("camera", "cameras"), ("light", "lights"), ("material", "materials"), ("warning", "warnings")]
    {
        lines.extend(list(&facts[key]).iter().map(|v| format!("{title:<11}{}", plain(v))));
    }
    lines.join("\n") + "\n"
}
