//! Runs all systems in order, and reuses the results of those whose inputs are unchanged.

use std::sync::Arc;

use super::memo::Memo;
use super::shape_meshes::ShapeMeshes;
use super::{
    camera, contacts, copies, emitters, environment, geometry, ineffective_values, light_groups, lights,
    materials, misplaced, open_surfaces, origin, textures, unsupported_by_transport, validate,
};
use crate::bvh::Bvh;
use crate::error::CompileError;
use crate::error::Diagnostic;
use crate::math::{Aabb, DVec3, Vec3};
use crate::scene::{CompiledCamera, CompiledScene, Environment, Geometry, MaterialRecord, Textures};
use crate::world::{Sharing, Transport, World, transforms};

/// A scene, with the inputs and the result of each system.
pub struct MemoizedScene {
    /// The scene.
    pub scene: Arc<CompiledScene>,
    textures: Memo<textures::TextureInputs, Arc<Textures>>,
    environment: Memo<environment::EnvironmentInputs, Arc<Environment>>,
    shapes: ShapeMeshes,
    open_surfaces: Memo<open_surfaces::OpenSurfaceInputs, Vec<open_surfaces::Sheet>>,
    geometry: Memo<geometry::GeometryInputs, geometry::CompiledGeometry>,
    emitters: Memo<emitters::EmitterInputs, emitters::CompiledEmitters>,
}

/// Compiles a world for rendering, as seen through the camera that has the name `camera`, or through the first one.
///
/// # Errors
///
/// [`CompileError::NoCamera`] and [`CompileError::UnknownCamera`]; [`CompileError::Entity`] and
/// [`CompileError::Invalid`] if something refers to a missing object, or a number is out of its range;
/// [`CompileError::TooLarge`].
pub fn compile(world: &World, camera: Option<&str>) -> Result<CompiledScene, CompileError> {
    let MemoizedScene { scene, .. } = compile_after(world, camera, None)?;
    // This is the only reference.
    Ok(Arc::unwrap_or_clone(scene))
}

/// Compiles a world after another state of it: a system whose inputs are unchanged reuses its result. Meshes and images
/// are compared by their pointers (see [`crate::world::AssetCache`]).
///
/// Everything that takes long is a system of its own, a function of its inputs only: changes that leave these alone
/// cost nothing there.
pub fn compile_after(
    world: &World,
    camera: Option<&str>,
    before: Option<&MemoizedScene>,
) -> Result<MemoizedScene, CompileError> {
    let order = world.in_order();
    misplaced::check(world)?;
    validate::check(world, &order)?;
    let mut transforms = transforms::to_world(world, &order)?;
    let found = camera::find(world, &order, camera)?;
    let origin = origin::choose(world, &order, &transforms, &transforms[&found.0]);
    transforms::relative_to(&mut transforms, origin);
    let (camera, aperture) = camera::compile(world, &transforms, found)?;
    let textures = textures_of(world, before.map(|before| &before.textures))?;
    let seen = (&camera, &textures.output, origin);
    let (shapes, copies) = meshes_and_copies(world, &order, &transforms, seen, before)?;
    let (mut materials, mut material_names) = materials::compile(&world.assets, world.settings.transport);
    let groups = &light_groups::LightGroups::new(world, &order, &materials);
    let (order, transforms) = (&order[..], &transforms);
    let placed = geometry::PlacedWorld { world, order, transforms, copies: &copies, shapes: &shapes, groups };
    let (lamps, panels) = lights::compile(&placed, &mut materials, &mut material_names)?;
    let open_surfaces = Memo::reuse_or_make(
        before.map(|before| &before.open_surfaces),
        open_surfaces::OpenSurfaceInputs::new(world, order, transforms, &shapes),
        |inputs| Ok::<_, CompileError>(open_surfaces::find(inputs)),
    )?;
    let open = open_surfaces.output.iter().map(|sheet| (sheet.entity, sheet)).collect();
    let mut sheets =
        materials::TwoSidedVariants::new(&mut materials, &mut material_names, world.settings.transport);
    let inputs = geometry::GeometryInputs::new(&placed, panels, &open, &mut sheets)?;
    let mut sheets = sheets.end();
    let bodies = materials::number_bodies(&mut materials, world.settings.transport);
    let mut bvh = before.map_or_else(Arc::default, |before| before.scene.bvh.clone());
    let geometry = Memo::reuse_or_make(before.map(|before| &before.geometry), inputs, |inputs| {
        let (made, tree) = geometry::compile(inputs, before.map(|before| &*before.scene))?;
        bvh = tree;
        Ok::<_, CompileError>(made)
    })?;
    let records =
        contacts::Records { materials: &mut materials, names: &mut material_names, added: &mut sheets };
    let joined = contacts::join(geometry.output.geometry.clone(), records);
    set_sidedness(&mut bvh, &joined, &materials, before.map(|before| &*before.scene));
    let environment = Memo::reuse_or_make(
        before.map(|before| &before.environment),
        environment::EnvironmentInputs::new(world, order, transforms),
        |inputs| environment::compile(inputs).map(Arc::new),
    )?;
    let emitters = Memo::reuse_or_make(
        before.map(|before| &before.emitters),
        emitters::EmitterInputs::new(&joined, &textures.output, &environment.output, &materials, &lamps),
        |_| {
            let geometry::CompiledGeometry { placed, copies, .. } = &geometry.output;
            let surfaces = emitters::EmittingSurfaces {
                geometry: &joined,
                materials: &materials,
                textures: &textures.output,
                placed,
                copies,
            };
            Ok::<_, CompileError>(emitters::compile(&surfaces, &lamps, &environment.output))
        },
    )?;
    let mut scene = CompiledScene {
        bounds: bvh.root.map_or(Aabb { min: Vec3::ZERO, max: Vec3::ZERO }, |root| root.bounds),
        origin,
        camera,
        aperture,
        geometry: joined,
        bvh,
        materials,
        bodies,
        material_names,
        sheets,
        textures: textures.output.clone(),
        emitters: emitters.output.emitters.clone(),
        lights: emitters.output.lights.clone(),
        environment: environment.output.clone(),
        around_group: groups.around,
        ambient: world.settings.ambient,
        light_groups: groups.names.clone(),
        warnings: Vec::new(),
    };
    scene.camera = camera::focused(&scene, world, transforms, found)?;
    scene.warnings = warnings(&scene, world);
    scene.warnings.extend(open_surfaces::told(&open_surfaces.output));
    let too_many = many_light_meshes(emitters.output.left_out, world);
    scene.warnings.extend(groups.too_many().into_iter().chain(too_many));
    let scene = Arc::new(scene);
    Ok(MemoizedScene { scene, textures, environment, shapes, open_surfaces, geometry, emitters })
}

fn textures_of(
    world: &World,
    before: Option<&Memo<textures::TextureInputs, Arc<Textures>>>,
) -> Result<Memo<textures::TextureInputs, Arc<Textures>>, CompileError> {
    Memo::reuse_or_make(before, textures::TextureInputs::new(&world.assets), |inputs| {
        textures::compile(&world.assets, inputs, before)
    })
}

/// Makes the meshes of shapes, as fine as the camera needs, and finds the places of copies.
fn meshes_and_copies(
    world: &World,
    order: &[hecs::Entity],
    transforms: &transforms::WorldTransforms,
    (camera, textures, origin): (&CompiledCamera, &Arc<Textures>, DVec3),
    before: Option<&MemoizedScene>,
) -> Result<(ShapeMeshes, copies::Copies), CompileError> {
    let before = before.map(|before| &before.shapes);
    let mut shapes = ShapeMeshes::seen_by(camera, world, order, transforms, before)?;
    shapes.modify(world, order, textures, before)?;
    let copies = copies::Copies::new(world, order, transforms, origin, &shapes)?;
    Ok((shapes, copies))
}

/// Sets each surface's sidedness by its material.
fn set_sidedness(
    bvh: &mut Arc<Bvh>,
    geometry: &Geometry,
    materials: &[MaterialRecord],
    before: Option<&CompiledScene>,
) {
    let presence = |materials: &[MaterialRecord]| -> Vec<_> {
        materials.iter().flat_map(|m| [false, true].map(|mirrored| m.sidedness(mirrored))).collect()
    };
    let is_as_before = |before: &CompiledScene| {
        let [old, new] = [&before.geometry, geometry];
        Arc::ptr_eq(bvh, &before.bvh)
            && presence(materials) == presence(&before.materials)
            && (&old.parts.material, &old.parts.sign) == (&new.parts.material, &new.parts.sign)
            && (&old.triangle_parts, &old.sphere_parts) == (&new.triangle_parts, &new.sphere_parts)
            && old.instance_materials == new.instance_materials
    };
    if before.is_some_and(is_as_before) {
        return;
    }
    let of = |primitive: u32| {
        let material = geometry.parts.material[geometry.part_of(primitive) as usize];
        materials[material as usize].sidedness(geometry.is_mirrored(primitive))
    };
    let given = geometry.instance_materials.iter();
    let placed: Vec<_> = given.map(|m| materials.get(*m as usize).map(|m| m.sidedness(false))).collect();
    Arc::make_mut(bvh).set_sidedness(of, &placed);
}

/// Warnings for the user, known before the image is rendered.
fn warnings(scene: &CompiledScene, world: &World) -> Vec<Diagnostic> {
    let mut warnings = world.warnings.clone();
    warnings.extend(unsupported_by_transport::by_transport(world));
    warnings.extend(unshared(world));
    warnings.extend(ineffective_values::values(world));
    warnings.extend(endless_forks(scene, world));
    if scene.bvh.root.is_none() {
        warnings.push(Diagnostic::warning("no-shape", "no shape: the image shows the background alone"));
    } else if !emits(scene) && scene.environment.is_black() {
        warnings.push(no_light());
    }
    warnings
}

/// The warning about a scene whose surfaces are all black.
pub(crate) fn no_light() -> Diagnostic {
    let remedy = "add an entity with light: Point(power_w: 100), or `--env studio`";
    Diagnostic::warning("no-light", "there is no light").fixed_by(remedy)
}

/// True if anything but the surroundings emits light, or needs none.
pub(crate) fn emits(scene: &CompiledScene) -> bool {
    !scene.lights.is_empty()
        || !scene.emitters.is_empty()
        || !scene.ambient.is_black()
        || scene.materials.iter().any(|material| material.emits() || material.unlit)
}

/// A warning about glass that splits paths in two without an end: each bounce can double the work.
fn endless_forks(scene: &CompiledScene, world: &World) -> Option<Diagnostic> {
    const MANY: u32 = 16;
    let settings = &world.settings;
    // Each path carries at least the part min_throughput, so at any depth there are at most 1 / min_throughput paths.
    let is_endless = settings.transport == Transport::Whitted
        && settings.max_depth > MANY
        && settings.min_throughput < 1e-5
        && scene.materials.iter().any(|material| material.classic.ior > 0.0);
    is_endless.then(|| {
        let depth = settings.max_depth;
        let text = format!("glass splits paths in two, up to 2^{depth} of them for each sample");
        let remedy = format!("raise min_throughput to 0.001, or lower max_depth: `--depth {MANY}`");
        Diagnostic::warning("endless-forks", text).fixed_by(remedy)
    })
}

/// A warning about placed meshes that emit light and are too many to be sampled.
fn many_light_meshes(left_out: usize, world: &World) -> Option<Diagnostic> {
    (left_out > 0 && world.settings.transport == Transport::Path).then(|| {
        let text = format!(
            "meshes that shine are placed so often that {left_out} of them are found by chance alone, which is noisier: \
             more than {} triangles would be lights",
            emitters::MOST_PLACED
        );
        Diagnostic::warning("too-many-light-meshes", text)
    })
}

/// A warning about requested path reuse that other settings rule out.
fn unshared(world: &World) -> Option<Diagnostic> {
    let settings = &world.settings;
    let asked = matches!(settings.sharing, Sharing::Groups(_)) && settings.transport == Transport::Path;
    let limit = settings.depth_limits.given().map(|(name, _)| name).next();
    let why = settings.clamp.map(|_| "clamp").or(limit).filter(|_| asked)?;
    let text = format!("paths are not shared: {why} is about each path for itself");
    Some(Diagnostic::warning("paths-not-shared", text).fixed_by("leave one of both out"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{self, Camera, Transform};

    #[test]
    fn scene_without_light_gives_a_warning() {
        use crate::math::Rgb;
        use crate::world::{Falloff, Light, Shape};

        let told = |change: &dyn Fn(&mut World)| {
            let mut world = World::default();
            world.entities.spawn((Camera::Pinhole { vertical_fov: 1.0 },));
            world.entities.spawn((Shape::Sphere { radius_m: 1.0 },));
            change(&mut world);
            let scene = compile(&world, None).unwrap();
            scene.warnings.iter().any(|warning| warning.code == "no-light")
        };
        assert!(told(&|_| ()));
        assert!(told(&|world| world.settings.transport = Transport::Path));
        assert!(!told(&|world| world.settings.ambient = Rgb::WHITE));
        let lamp = Light::Point { power_w: Rgb::WHITE, falloff: Falloff::InverseSquare, radius_m: 0.0 };
        assert!(!told(&|world| {
            world.entities.spawn((lamp.clone(), Transform::IDENTITY));
        }));
    }

    /// A world that is compiled after another one equals one compiled by itself, and shares what is unchanged.
    #[test]
    fn unchanged_parts_of_a_recompiled_scene_are_shared() {
        use crate::math::Vec2;
        use crate::world::{
            AlphaMode, ColorInput, Image, Material, Mesh, Principled, Shape, Texels, Texture,
        };

        let kept = world::AssetCache::keeping();
        let world = |change: fn(&mut World)| {
            let mut world = World::default();
            world.settings.transport = Transport::Path;
            world.settings.copied_triangles = 0;
            world.assets.files = world::SourceFiles::with(kept.clone());
            let texels = Texels::Rgba8((0..64).map(|i| [i as u8 * 3, 7, 200 - i as u8, 255]).collect());
            let image = world.assets.add_made_image(Image { source: None, width: 8, height: 8, texels });
            let texture = world.assets.add_texture(Texture::new(image));
            let base_color = ColorInput::Texture(texture);
            let material = Material::Principled(Box::new(Principled { base_color, ..Principled::default() }));
            let material = world.assets.add_material(None, material);
            let meshes = [1.0, 2.0].map(|size| {
                let positions = vec![Vec3::ZERO, Vec3::X * size, Vec3::Y * size];
                let uvs = vec![Vec2::ZERO, Vec2::X, Vec2::Y];
                let mesh = Mesh { positions, uvs, triangles: vec![[0, 1, 2]], ..Mesh::default() };
                world.assets.add_made_mesh(mesh)
            });
            let at = |x: f64| Transform::Trs {
                translation: crate::math::DVec3::new(x, 0.0, 0.0),
                rotation: crate::math::Quat::IDENTITY,
                scale: Vec3::ONE,
            };
            for (x, mesh) in [(0.0, 0), (2.0, 1), (5.0, 0), (8.0, 1)] {
                world.entities.spawn((Shape::Mesh(meshes[mesh]), at(x), material));
            }
            world.entities.spawn((Camera::Pinhole { vertical_fov: 1.0 }, Transform::IDENTITY));
            change(&mut world);
            world
        };
        let compiled = |change, before| compile_after(&world(change), None, before).expect("a scene");
        let first = compiled(|_| (), None);
        let third_is_of_the_second_mesh = |world: &mut World| {
            let third = world.in_order()[2];
            let Ok(second) = world.entities.get::<&Shape>(world.in_order()[1]).map(|shape| (*shape).clone())
            else {
                return;
            };
            let _ = world.entities.insert_one(third, second);
        };
        /// A change, and whether trees and texels stay.
        type Change = (fn(&mut World), bool, bool);
        let changes: [Change; 6] = [
            (|world| world.change_cameras(|c| *c = Camera::Orthographic { height_m: 2.0 }), true, true),
            (
                |world| {
                    world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, Transform::IDENTITY));
                },
                false,
                true,
            ),
            (third_is_of_the_second_mesh, false, true),
            (|world| Arc::make_mut(&mut world.assets.meshes[1]).positions[1].x = 2.5, false, true),
            (
                |world| {
                    if let Texels::Rgba8(t) = &mut Arc::make_mut(&mut world.assets.images[0]).texels {
                        t[9][1] = 8
                    }
                },
                true,
                false,
            ),
            (
                |world| {
                    if let Some(Material::Principled(paint)) =
                        world.assets.materials.last_mut().map(|m| &mut m.material)
                    {
                        paint.double_sided = true;
                        paint.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
                    }
                },
                false,
                true,
            ),
        ];
        for (number, (change, trees, texels)) in changes.into_iter().enumerate() {
            let [after, alone] = [Some(&first), None].map(|before| compiled(change, before).scene);
            let first = &first.scene;
            assert_eq!(after.difference(&alone), None, "change {number}");
            assert_eq!(Arc::ptr_eq(&first.bvh, &after.bvh), trees, "change {number}");
            assert_eq!(Arc::ptr_eq(&first.textures, &after.textures), texels, "change {number}");
        }
    }
}
