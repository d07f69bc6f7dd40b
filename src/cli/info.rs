//! `rayfront info SCENE`: what there is, without rendering it.

use std::process::ExitCode;

use serde_json::{Value, json};

use super::{Failure, args, output};
use crate::math::Vec3;
use crate::scene::emitters::{flag, kind};
use crate::scene::{CompiledScene, LightSamples};
use crate::world::World;

pub(super) fn run(arguments: &args::Info) -> Result<ExitCode, Failure> {
    let world = crate::formats::load_with(&arguments.scene, &(&arguments.model).into())?;
    let scene = crate::compile::compile(&world, None).map_err(Failure::compile(&arguments.scene))?;
    let facts = facts(&world, &scene);
    let text = if arguments.json { format!("{facts}\n") } else { text(&facts) };
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Everything as one object; the text is made from it, so that both say the same.
fn facts(world: &World, scene: &CompiledScene) -> Value {
    let memory = scene.memory();
    let [width, height] = world.settings.size;
    let film = width as usize * height as usize * size_of::<crate::film::PixelSum>();
    let images: Vec<Value> = world
        .assets
        .images
        .iter()
        .map(|i| json!({"file": i.source, "width": i.width, "height": i.height}))
        .collect();
    let meshes: Vec<Value> = world
        .assets
        .meshes
        .iter()
        .map(|m| json!({"file": m.source, "vertices": m.positions.len(), "triangles": m.triangles.len()}))
        .collect();
    json!({
        "entities": world.entities.len(),
        "triangles": scene.geometry.triangles.len(),
        "triangles_placed": world.placed_triangles(),
        "spheres": scene.geometry.spheres.len(),
        "instances": scene.geometry.instances.len(),
        "meshes": meshes,
        "bounds_m": [rounded(scene.bounds.min), rounded(scene.bounds.max)],
        "bvh": {
            "nodes": scene.bvh.nodes.len(),
            "triangle_blocks": scene.bvh.triangles.len(),
            "sphere_blocks": scene.bvh.spheres.len(),
        },
        "materials": scene.material_names,
        "lights": scene.lights.iter().map(|light| describe_light(scene, light)).collect::<Vec<_>>(),
        "cameras": crate::compile::camera_names(world),
        "images": images,
        "memory_bytes": {
            "geometry": memory.geometry, "bvh": memory.bvh, "textures": memory.textures, "film": film,
            "total": memory.geometry + memory.bvh + memory.textures + film,
        },
        "warnings": scene.warnings,
    })
}

/// To five significant digits: the padding of boxes and the rounding of matrices are not news.
fn significant(value: f32) -> f64 {
    let value = f64::from(value);
    if value.abs() < 1e-9 { 0.0 } else { format!("{value:.4e}").parse().unwrap_or(value) }
}

fn rounded(v: Vec3) -> [f64; 3] {
    v.to_array().map(significant)
}

fn describe_light(scene: &CompiledScene, light: &LightSamples) -> String {
    let (kind, row) = scene.emitters.row(light.emitter);
    let vector = |at: usize| Vec3::from_slice(&row[at..]);
    let place = |v: Vec3| {
        let [x, y, z] = rounded(v);
        format!("({x}, {y}, {z})")
    };
    match kind {
        kind::POINT => format!("point at {}", place(vector(0))),
        kind::SPOT => format!("spot at {} along {}", place(vector(0)), place(vector(3))),
        kind::PHOTOMETRIC => format!("photometric at {} along {}", place(vector(0)), place(vector(3))),
        kind::DIRECTIONAL => format!("directional along {}", place(-vector(0))),
        _ => {
            let (up, across) = (vector(3), vector(6));
            let center = place(vector(0) + (up + across) * 0.5);
            let (w, h) = (significant(across.length()), significant(up.length()));
            let LightSamples { samples, pattern, .. } = light;
            let round = scene.emitters.flags[light.emitter as usize] & flag::ROUND != 0;
            let what = if round { "disc" } else { "area" };
            format!("{what} of {w} x {h} m at {center}, {samples} samples, {pattern:?}")
        }
    }
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
        "memory     {}: geometry {}, bvh {}, textures {}, film {}",
        megabytes(&memory["total"]),
        megabytes(&memory["geometry"]),
        megabytes(&memory["bvh"]),
        megabytes(&memory["textures"]),
        megabytes(&memory["film"])
    ));
    let plain = |v: &Value| v.as_str().map_or_else(|| v.to_string(), str::to_owned);
    for mesh in list(&facts["meshes"]) {
        lines.push(format!("mesh       {}: {} triangles", plain(&mesh["file"]), mesh["triangles"]));
    }
    for image in list(&facts["images"]) {
        lines.push(format!("image      {}: {} x {}", plain(&image["file"]), image["width"], image["height"]));
    }
    for (title, key) in
        [("camera", "cameras"), ("light", "lights"), ("material", "materials"), ("warning", "warnings")]
    {
        lines.extend(list(&facts[key]).iter().map(|v| format!("{title:<11}{}", plain(v))));
    }
    lines.join("\n") + "\n"
}
