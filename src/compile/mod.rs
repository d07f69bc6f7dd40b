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

use std::collections::BTreeSet;

use crate::error::CompileError;
use crate::math::{Aabb, Vec3};
use crate::scene::CompiledScene;
use crate::world::{AlphaMode, Material, Principled, Transport, World};

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
    if left_out > 0 && world.settings.transport == Transport::Path {
        scene.warnings.push(format!(
            "meshes that shine have so many instances that {left_out} of them are found by chance alone, \
             which is noisier: more than {} triangles would be lights",
            emitters::MOST_PLACED
        ));
    }
    Ok(scene)
}

/// What a person should know before waiting for the image.
fn warnings(scene: &CompiledScene, world: &World) -> Vec<String> {
    let mut warnings = world.warnings.clone();
    if world.settings.transport == Transport::Whitted {
        warnings.extend(ignored_alpha(scene, world));
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

/// Surfaces that are partly there are all there under Whitted's transport.
fn ignored_alpha(scene: &CompiledScene, world: &World) -> Option<String> {
    let geometry = &scene.geometry;
    let used: BTreeSet<u32> =
        geometry.parts.material.iter().chain(&geometry.instance_materials).copied().collect();
    let whole = |m: &Principled| {
        let all = m.alpha.texture.is_none() && m.alpha.factor >= 1.0 && geometry.alphas.is_empty();
        all || m.alpha_mode == AlphaMode::Opaque
    };
    let names: Vec<&str> = (0_u32..)
        .zip(&world.assets.materials)
        .filter(|(id, named)| {
            used.contains(id) && matches!(&named.material, Material::Principled(m) if !whole(m))
        })
        .map(|(id, _)| scene.materials.names[id as usize].as_str())
        .collect();
    let (first, more) = (names.first()?, names.len() - 1);
    let more = if more == 0 { String::new() } else { format!(" (and {more} more)") };
    Some(format!(
        "material \"{first}\"{more} has an alpha, which the Whitted transport ignores: its surfaces are all \
         there (transport: Path renders it)"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{ScalarInput, Shape, Transform};

    #[test]
    fn whitted_says_that_it_ignores_alpha() {
        let said = |alpha: f32, alpha_mode: AlphaMode, transport: Transport, uses: u32| {
            let mut world = World::default();
            world.settings.transport = transport;
            for name in ["leaf", "veil"] {
                let alpha = ScalarInput::constant(alpha);
                let material = Principled { alpha, alpha_mode, ..Principled::default() };
                let id =
                    world.assets.add_material(Some(name.into()), Material::Principled(Box::new(material)));
                if name == "leaf" || uses > 1 {
                    world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, Transform::IDENTITY, id));
                }
            }
            world.entities.spawn((crate::world::Camera::Pinhole { vertical_fov: 1.0 }, Transform::IDENTITY));
            let warnings = compile(&world, None).unwrap().warnings;
            warnings.into_iter().find(|warning| warning.contains("alpha"))
        };
        let (blend, mask) = (AlphaMode::Blend, AlphaMode::Mask { cutoff: 0.5 });
        let one = said(0.4, blend, Transport::Whitted, 1).unwrap();
        assert!(one.starts_with("material \"leaf\" has") && one.contains("transport: Path"), "{one}");
        let two = said(0.4, mask, Transport::Whitted, 2).unwrap();
        assert!(two.starts_with("material \"leaf\" (and 1 more) has"), "{two}");
        for (alpha, mode, transport) in [
            (0.4, blend, Transport::Path),
            (1.0, blend, Transport::Whitted),
            (0.4, AlphaMode::Opaque, Transport::Whitted),
        ] {
            assert_eq!(said(alpha, mode, transport, 2), None);
        }
    }
}
