//! World to scene: one system a file, each a function from components to columns.
//! The order of everything is that of the entities in the world.

mod camera;
mod classic;
mod emitters;
mod environment;
mod geometry;
pub mod light_tree;
mod lights;
mod materials;
mod principled;
mod textures;
pub mod transforms;

use crate::error::CompileError;
use crate::math::{Aabb, Vec3};
use crate::scene::CompiledScene;
use crate::world::{Material, Principled, Transport, World};

pub use camera::camera_names;
pub use lights::light_names;

/// Makes a world ready for rendering, looking through its first camera or the one named.
pub fn compile(world: &World, camera: Option<&str>) -> Result<CompiledScene, CompileError> {
    let order = world.in_order();
    let transforms = transforms::compile(world, &order)?;
    let camera = camera::compile(world, &order, &transforms, camera)?;
    let textures = textures::compile(&world.assets)?;
    let mut materials = materials::compile(&world.assets);
    let mut principled = principled::compile(&world.assets);
    let lights::Compiled { lights, rectangles, visible, angles } =
        lights::compile(world, &order, &transforms, &mut materials, &mut principled)?;
    let geometry::Compiled { geometry, bvh, placed } =
        geometry::compile(world, &order, &transforms, &rectangles)?;
    let environment = environment::compile(world, &order, &transforms);
    let surfaces = emitters::Surfaces { geometry: &geometry, materials: &principled, placed: &placed };
    let (emitters, left_out) = emitters::compile(&surfaces, &lights, &angles, &visible, &environment);
    let has_cutouts = geometry
        .parts
        .material
        .iter()
        .chain(&geometry.instance_materials)
        .any(|m| principled.get(*m as usize).is_some_and(|m| m.may_pass()));
    let bounds = bvh.root.map_or(Aabb { min: Vec3::ZERO, max: Vec3::ZERO }, |root| root.bounds);
    let mut scene = CompiledScene {
        camera,
        geometry,
        bvh,
        materials,
        textures,
        lights,
        principled,
        emitters,
        environment,
        has_cutouts,
        ambient: world.settings.ambient,
        bounds,
        warnings: Vec::new(),
    };
    scene.warnings = warnings(&scene, world);
    Ok(scene)
}
    if left_out > 0 && world.settings.transport == Transport::Path {
        scene.warnings.push(format!(
            "meshes that shine are placed so often that {left_out} of their places are found by chance alone, \
             which is noisier: more than {} triangles would be lights",
            emitters::MOST_PLACED
        ));
    }

/// What a person should know before waiting for the image.
fn warnings(scene: &CompiledScene, world: &World) -> Vec<String> {
    let mut warnings = world.warnings.clone();
    let ignored = |what: fn(&Principled) -> bool| {
        world.assets.materials.iter().any(|m| matches!(&m.material, Material::Principled(m) if what(m)))
    };
    for (name, there) in [
        ("iridescence", ignored(|m| m.iridescence.factor.factor > 0.0)),
        ("dispersion", ignored(|m| m.dispersion > 0.0)),
    ] {
        if there {
            warnings
                .push(format!("{name} of materials is not rendered yet: they look as they would without"));
        }
    }
    let emits = |m: &crate::scene::materials::ColorColumn| {
        m.is_textured() || m.constant.iter().any(|c| *c != [0.0; 3])
    };
    if scene.bvh.root.is_none() {
        warnings.push("no shape: the image shows the background alone".into());
    } else if scene.lights.is_empty()
        && scene.ambient.is_black()
        && !emits(&scene.materials.emission)
        && (world.settings.transport == Transport::Whitted || scene.environment.is_black())
    {
        let dark = world.settings.background == crate::world::Background::default();
        let seen = if dark { "the image will be black" } else { "shapes will be black" };
        warnings.push(format!("no light: {seen} (add an entity with light: Point(power_w: 100))"));
    }
    warnings
}
