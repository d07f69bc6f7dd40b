//! World to scene: one system a file, each a function from components to columns.
//! The order of everything is that of the entities in the world.

mod camera;
mod classic;
mod emitters;
mod environment;
mod geometry;
mod glow;
pub mod light_tree;
mod lights;
mod materials;
mod textures;
pub mod transforms;

use crate::bvh::Bvh;
use crate::error::CompileError;
use crate::math::{Aabb, Vec3};
use crate::scene::{CompiledScene, Geometry, Material};
use crate::world::{Light, Settings, Sharing, Transport, World};

pub use camera::camera_names;
pub use lights::light_names;

/// Makes a world ready for rendering, looking through its first camera or the one named.
pub fn compile(world: &World, camera: Option<&str>) -> Result<CompiledScene, CompileError> {
    let order = world.in_order();
    let transforms = transforms::compile(world, &order)?;
    let camera = camera::compile(world, &order, &transforms, camera)?;
    let textures = textures::compile(&world.assets)?;
    let (mut materials, mut material_names) = materials::compile(&world.assets);
    let lights::CompiledLights { lamps, rectangles } =
        lights::compile(world, &order, &transforms, &mut materials, &mut material_names)?;
    let mut sheets = materials::Sheets::new(&mut materials, &mut material_names);
    let geometry::CompiledGeometry { geometry, mut bvh, placed, copies } =
        geometry::compile(world, &order, &transforms, &rectangles, &mut sheets)?;
    set_presence(&mut bvh, &geometry, &materials);
    let environment = environment::compile(world, &order, &transforms);
    let surfaces = emitters::Surfaces {
        geometry: &geometry,
        materials: &materials,
        textures: &textures,
        placed: &placed,
        copies: &copies,
    };
    let emitters::CompiledEmitters { emitters, lights, left_out } =
        emitters::compile(&surfaces, &lamps, &environment);
    let bounds = bvh.root.map_or(Aabb { min: Vec3::ZERO, max: Vec3::ZERO }, |root| root.bounds);
    let mut scene = CompiledScene {
        camera,
        geometry,
        bvh,
        materials,
        material_names,
        textures,
        emitters,
        lights,
        environment,
        ambient: world.settings.ambient,
        bounds,
        warnings: Vec::new(),
    };
    scene.warnings = warnings(&scene, world);
    if left_out > 0 && world.settings.transport == Transport::Path {
        scene.warnings.push(format!(
            "meshes that shine are placed so often that {left_out} of them are found by chance alone, \
             which is noisier: more than {} triangles would be lights",
            emitters::MOST_PLACED
        ));
    }
    Ok(scene)
}

/// Says from where each surface is there, by its material.
fn set_presence(bvh: &mut Bvh, geometry: &Geometry, materials: &[Material]) {
    let of = |primitive: u32| {
        let material = geometry.parts.material[geometry.part_of(primitive) as usize];
        materials[material as usize].presence(geometry.is_mirrored(primitive))
    };
    let given = geometry.instance_materials.iter();
    let placed: Vec<_> = given.map(|m| materials.get(*m as usize).map(|m| m.presence(false))).collect();
    bvh.set_presence(of, &placed);
}

/// What a person should know before waiting for the image.
fn warnings(scene: &CompiledScene, world: &World) -> Vec<String> {
    let mut warnings = world.warnings.clone();
    warnings.extend(ignored(world));
    warnings.extend(unshared(world));
    if scene.bvh.root.is_none() {
        warnings.push("no shape: the image shows the background alone".into());
    } else if scene.lights.is_empty()
        && scene.ambient.is_black()
        && !scene.materials.iter().any(|m| m.emits() || m.unlit)
        && (world.settings.transport == Transport::Whitted || scene.environment.is_black())
    {
        let dark = world.settings.background == crate::world::Background::default();
        let seen = if dark { "the image will be black" } else { "shapes will be black" };
        warnings.push(format!("no light: {seen} (add an entity with light: Point(power_w: 100))"));
    }
    warnings
}

/// Groups that somebody asks for and that other settings rule out.
fn unshared(world: &World) -> Option<String> {
    let settings = &world.settings;
    let asked = matches!(settings.sharing, Sharing::Groups(_)) && settings.transport == Transport::Path;
    let limit = settings.depth_limits.given().map(|(name, _)| name).next();
    let why = settings.clamp.map(|_| "clamp").or(limit).filter(|_| asked)?;
    Some(format!("paths are not shared: {why} is about each path for itself (leave one of both out)"))
}

/// What the world says that its transport has no use for.
fn ignored(world: &World) -> Option<String> {
    let (settings, usual) = (&world.settings, Settings::default());
    let mut names: Vec<&str> = Vec::new();
    let mut note = |name: &'static str, is_said: bool| names.extend(is_said.then_some(name));
    let (transport, other) = match settings.transport {
        Transport::Whitted => {
            settings.depth_limits.given().for_each(|(name, _)| note(name, true));
            note("roulette_depth", settings.roulette_depth != usual.roulette_depth);
            note("clamp", settings.clamp.is_some());
            note("sampler", settings.sampler != usual.sampler);
            note("sharing", matches!(settings.sharing, Sharing::Groups(_)));
            let lights = &mut world.entities.query::<&Light>();
            let wide = |light: &Light| matches!(light, Light::Directional { angle, .. } if *angle > 0.0);
            note("the angle of directional lights", lights.iter().any(wide));
            ("Whitted", "Path")
        }
        Transport::Path => {
            note("ambient", !settings.ambient.is_black());
            note("min_throughput", settings.min_throughput != usual.min_throughput);
            note("pixel_pattern", settings.pixel_pattern != usual.pixel_pattern);
            ("path", "Whitted")
        }
    };
    let list = names.join(", ");
    (!names.is_empty())
        .then(|| format!("the {transport} transport makes no use of {list} (transport: {other} does)"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::world::{Camera, Transform};

    #[test]
    fn what_a_transport_ignores_it_says() {
        let said = |change: fn(&mut World)| {
            let mut world = World::default();
            world.entities.spawn((Camera::Pinhole { vertical_fov: 1.0 }, Transform::IDENTITY));
            change(&mut world);
            let warnings = compile(&world, None).expect("a scene").warnings;
            warnings.into_iter().find(|warning| warning.contains("makes no use of"))
        };
        assert_eq!(said(|_| ()), None);
        assert_eq!(said(|world| world.settings.transport = Transport::Path), None);
        let whitted = said(|world| {
            world.settings.clamp = Some(3.0);
            world.settings.depth_limits.glossy = Some(1);
            let sun = Light::Directional { irradiance: Rgb::WHITE, angle: 0.01 };
            world.entities.spawn((sun, Transform::IDENTITY));
        });
        let expected = "the Whitted transport makes no use of glossy_depth, clamp, the angle of directional \
                        lights (transport: Path does)";
        assert_eq!(whitted.as_deref(), Some(expected));
        let path = said(|world| {
            world.settings.transport = Transport::Path;
            world.settings.ambient = Rgb::WHITE;
        });
        let expected = "the path transport makes no use of ambient (transport: Whitted does)";
        assert_eq!(path.as_deref(), Some(expected));
    }
}
