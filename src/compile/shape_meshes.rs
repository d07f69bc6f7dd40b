//! The triangles of flat and of parametric shapes.

use std::collections::HashMap;
use std::sync::Arc;

use hecs::Entity;

use super::memo::{ByPtr, DebugText, debug_text};
use super::modifiers;
use super::origin::ball_around;
use crate::error::CompileError;
use crate::math::{DAffine3, Vec2, Vec3};
use crate::scene::{CompiledCamera, Textures};
use crate::world::shapes::Fineness;
use crate::world::transforms::{WorldTransforms, entity_error, placement};
use crate::world::{Assets, Font, Image, Mesh, MeshId, Modifiers, Shape, Strands, World};

/// The meshes of a world, and those of its parametric shapes: equal ones share one.
pub(super) struct ShapeMeshes {
    /// The world's meshes, then those of shapes.
    pub meshes: Vec<Arc<Mesh>>,
    of: HashMap<Entity, MeshId>,
    modified: HashMap<ModifierInputs, Arc<Mesh>>,
    made: HashMap<ShapeInputs, (Fineness, Arc<Mesh>)>,
}

/// All that a shape's mesh depends on, but for its fineness.
#[derive(PartialEq, Eq, Hash)]
struct ShapeInputs(DebugText, ShapeSource);

/// All that a modified mesh depends on.
#[derive(PartialEq, Eq, Hash)]
struct ModifierInputs {
    mesh: Option<ByPtr<Mesh>>,
    shape: DebugText,
    modifiers: DebugText,
    textures: Option<ByPtr<Textures>>,
}

/// The asset that a shape is made of.
#[derive(PartialEq, Eq, Hash)]
enum ShapeSource {
    Nothing,
    Image(ByPtr<Image>),
    Strands(ByPtr<Strands>),
    Font(ByPtr<Font>),
}

/// The greatest distance of a silhouette from the true one, in pixels; half of it near the middle of the image.
const ERROR_PIXELS: f64 = 0.1;
/// The least distance from the camera that counts, relative to the radius of a ball around the shape.
const NEAREST: f64 = 1.0 / 64.0;

/// The camera, for the fineness of what it sees.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub camera: &'a CompiledCamera,
    /// The rows of the whole image.
    pub rows: u32,
}

impl View<'_> {
    /// The fineness of a shape with that transform: coarser by a power of two, so that a camera that moves leaves most
    /// shapes alone.
    fn fineness(&self, shape: &Shape, matrix: &DAffine3, world: &World) -> Fineness {
        let Some((center, radius)) = ball_around(shape, matrix, &world.assets) else {
            return Fineness::DEFAULT;
        };
        let from = center - self.camera.origin.as_dvec3();
        // Behind the camera is what mirrors show.
        let along = from.dot(self.camera.forward.as_dvec3()).abs();
        let depth = if self.camera.is_flat() { along } else { from.length() } - radius;
        let pixel = self.camera.pixel_at(depth.max(NEAREST * radius), self.rows);
        let axes = matrix.matrix3;
        let scale = [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| axis.length()).into_iter();
        let error = ERROR_PIXELS * pixel / scale.fold(f64::MIN_POSITIVE, f64::max);
        let step = libm::exp2(libm::floor(libm::log2(error)));
        if step > 0.0 && step.is_finite() { Fineness::Metres(step) } else { Fineness::DEFAULT }
    }
}

impl ShapeMeshes {
    /// Makes the meshes of parametric shapes, as fine as a camera needs. See [`ShapeMeshes::new`].
    pub fn seen_by(
        camera: &CompiledCamera,
        world: &World,
        order: &[Entity],
        transforms: &WorldTransforms,
        before: Option<&ShapeMeshes>,
    ) -> Result<ShapeMeshes, CompileError> {
        let view = View { camera, rows: world.settings.size[1] };
        ShapeMeshes::new(world, order, transforms, Some(view), before)
    }

    /// Makes the meshes of parametric shapes, as fine as the view needs wherever they are placed. Meshes of `before` are
    /// used again.
    pub fn new(
        world: &World,
        order: &[Entity],
        transforms: &WorldTransforms,
        view: Option<View>,
        before: Option<&ShapeMeshes>,
    ) -> Result<ShapeMeshes, CompileError> {
        let mut wanted: Vec<(Entity, Fineness)> = Vec::new();
        let mut places: HashMap<ShapeInputs, usize> = HashMap::new();
        let mut number_of = Vec::new();
        for &entity in order {
            let Ok(shape) = world.entities.get::<&Shape>(entity) else { continue };
            if !shape.is_parametric() {
                continue;
            }
            let needed = match view.filter(|_| shape.is_curved()) {
                Some(view) => view.fineness(&shape, &transforms[&entity], world),
                None => Fineness::DEFAULT,
            };
            let number = *places.entry(ShapeInputs::new(&shape, world)).or_insert(wanted.len());
            match wanted.get_mut(number) {
                Some((_, fineness)) => *fineness = fineness.finer(needed),
                None => wanted.push((entity, needed)),
            }
            number_of.push((entity, number));
        }
        let mut made = HashMap::new();
        let mut meshes = world.assets.meshes.clone();
        let first = meshes.len();
        meshes.resize_with(first + wanted.len(), Arc::default);
        let mut places: Vec<_> = places.into_iter().collect();
        places.sort_unstable_by_key(|(_, number)| *number);
        for (key, number) in places {
            let (entity, fineness) = wanted[number];
            let known = before.and_then(|before| before.made.get(&key));
            let mesh = match known.filter(|(of, _)| *of == fineness) {
                Some((_, mesh)) => mesh.clone(),
                None => Arc::new(mesh_of(world, entity, fineness)?),
            };
            meshes[first + number] = mesh.clone();
            made.insert(key, (fineness, mesh));
        }
        let id = |number: usize| MeshId((first + number) as u32);
        let of = number_of.into_iter().map(|(entity, number)| (entity, id(number))).collect();
        Ok(ShapeMeshes { meshes, of, made, modified: HashMap::new() })
    }

    /// Makes the meshes of shapes with modifiers. Meshes of `before` are used again.
    pub fn modify(
        &mut self,
        world: &World,
        order: &[Entity],
        textures: &Arc<Textures>,
        before: Option<&ShapeMeshes>,
    ) -> Result<(), CompileError> {
        let mut ids: HashMap<*const Mesh, MeshId> = HashMap::new();
        for &entity in order {
            let Ok(modifiers) = world.entities.get::<&Modifiers>(entity) else { continue };
            let Some(shape) = self.shape(world, entity) else { continue };
            let inputs = ModifierInputs {
                mesh: match shape {
                    Shape::Mesh(id) => Some(ByPtr(self.meshes[id.0 as usize].clone())),
                    _ => None,
                },
                shape: debug_text(&shape),
                textures: modifiers.has_textures().then(|| ByPtr(textures.clone())),
                modifiers: debug_text(&modifiers.0),
            };
            let known = self.modified.get(&inputs);
            let known = known.or_else(|| before.and_then(|before| before.modified.get(&inputs))).cloned();
            let mesh = match known {
                Some(mesh) => mesh,
                None => {
                    let own = match &shape {
                        Shape::Mesh(id) => self.meshes[id.0 as usize].clone(),
                        Shape::Sphere { radius_m } => Arc::new(modifiers::ball(*radius_m)),
                        flat => Arc::new(flat_mesh(flat)),
                    };
                    Arc::new(modifiers::modified(&own, &modifiers, textures)?)
                }
            };
            let next = MeshId(self.meshes.len() as u32);
            let id = *ids.entry(Arc::as_ptr(&mesh)).or_insert(next);
            if id == next {
                self.meshes.push(mesh.clone());
            }
            self.of.insert(entity, id);
            self.modified.insert(inputs, mesh);
        }
        Ok(())
    }

    /// The matrix that places an entity's vertices, from the entity's own.
    pub fn placement(&self, world: &World, entity: Entity, shape: &Shape, matrix: &DAffine3) -> DAffine3 {
        let Some(id) = self.of.get(&entity) else { return placement(world, shape, matrix) };
        let origin = self.meshes[id.0 as usize].origin;
        DAffine3 { translation: matrix.transform_point3(origin), ..*matrix }
    }

    /// An entity's shape as it is compiled: a parametric one, and one with modifiers, is a mesh.
    pub fn shape(&self, world: &World, entity: Entity) -> Option<Shape> {
        match self.of.get(&entity) {
            Some(mesh) => Some(Shape::Mesh(*mesh)),
            None => world.entities.get::<&Shape>(entity).ok().map(|shape| (*shape).clone()),
        }
    }
}

impl ShapeInputs {
    fn new(shape: &Shape, world: &World) -> ShapeInputs {
        let Assets { images, strands, fonts, .. } = &world.assets;
        let source = match shape {
            Shape::HeightField { image: Some(id), .. } => {
                images.get(id.0 as usize).map(|image| ShapeSource::Image(ByPtr(image.clone())))
            }
            Shape::Strands { file, .. } => {
                strands.get(file.0 as usize).map(|strands| ShapeSource::Strands(ByPtr(strands.clone())))
            }
            Shape::Text { font, .. } => {
                fonts.get(font.0 as usize).map(|font| ShapeSource::Font(ByPtr(font.clone())))
            }
            _ => None,
        };
        ShapeInputs(debug_text(shape), source.unwrap_or(ShapeSource::Nothing))
    }
}

fn mesh_of(world: &World, entity: Entity, fineness: Fineness) -> Result<Mesh, CompileError> {
    let shape = world.entities.get::<&Shape>(entity).ok();
    let mesh = shape.and_then(|shape| shape.to_mesh(&world.assets, fineness));
    let mesh = mesh.unwrap_or_else(|| Ok(Mesh::default()));
    mesh.map_err(|error| match error {
        CompileError::TooLarge(reason) => {
            CompileError::TooLarge(format!("{}: {reason}", world.name_of(entity)))
        }
        CompileError::Invalid { place, reason } => entity_error(world, entity, format!("{place}: {reason}")),
        other => other,
    })
}

/// The triangles of a flat shape, with its texture coordinates; none of other shapes.
pub(super) fn flat_mesh(shape: &Shape) -> Mesh {
    let Some((origin, corners)) = shape.flat_corners() else { return Mesh::default() };
    let flat = fan_mesh(&corners);
    match shape {
        Shape::Triangle { normals, uvs, .. } => Mesh {
            normals: normals.map_or_else(Vec::new, |n| n.to_vec()),
            uvs: uvs.unwrap_or([Vec2::ZERO, Vec2::X, Vec2::Y]).to_vec(),
            origin,
            ..flat
        },
        _ => Mesh { uvs: plane_uvs(&corners), origin, ..flat },
    }
}

/// The projections of each corner on the two edges that meet in the first one, divided by the edges' lengths.
fn plane_uvs(corners: &[Vec3]) -> Vec<Vec2> {
    let [a, b, _, d] = [0, 1, 2, 3].map(|at| corners[at].as_dvec3());
    let (u_edge, v_edge) = (b - a, d - a);
    let project = |p: &Vec3| {
        let q = p.as_dvec3() - a;
        Vec2::new(
            (q.dot(u_edge) / u_edge.length_squared()) as f32,
            (q.dot(v_edge) / v_edge.length_squared()) as f32,
        )
    };
    corners.iter().map(project).collect()
}

/// A convex polygon as a fan of triangles.
pub(super) fn fan_mesh(corners: &[Vec3]) -> Mesh {
    let triangles = Shape::fan(corners.len()).collect();
    Mesh { positions: corners.to_vec(), triangles, ..Mesh::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::compile;
    use crate::compile::compiled::compile_after;
    use crate::math::{DVec3, Quat};
    use crate::world::{Camera, Texels, Transform};

    fn at(translation: DVec3, scale: f32) -> Transform {
        Transform::Trs { translation, rotation: Quat::IDENTITY, scale: Vec3::splat(scale) }
    }

    /// A world with shapes at places and scales in front of a camera at the origin.
    fn world(camera: Camera, rows: u32, shapes: &[(Shape, DVec3, f32)]) -> World {
        let mut world = World::default();
        world.settings.size = [2 * rows, rows];
        world.entities.spawn((camera, Transform::IDENTITY));
        for (shape, place, scale) in shapes {
            world.entities.spawn((shape.clone(), at(*place, *scale)));
        }
        world
    }

    const EYE: Camera = Camera::Pinhole { vertical_fov: 1.0 };

    fn cylinder() -> Shape {
        Shape::Cylinder { radius_m: 0.5, height_m: 1.0, segments: None }
    }

    fn triangles(world: &World) -> usize {
        compile(world, None).unwrap().geometry.triangles.len()
    }

    /// The largest distance between the middle of a rim's edge and the true rim, in pixels of the image.
    fn rim_error(camera: Camera, rows: u32, depth: f64, scale: f32) -> f64 {
        let place = DVec3::new(0.1, 0.05, -depth);
        let scene = compile(&world(camera, rows, &[(cylinder(), place, scale)]), None).unwrap();
        let mut most = 0.0f64;
        let radius = 0.5 * f64::from(scale);
        for triangle in &scene.geometry.triangles {
            let corners = triangle
                .map(|vertex| Vec3::from_array(scene.geometry.positions[vertex as usize]).as_dvec3() - place);
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let is_rim = |p: DVec3| p.x.hypot(p.z) > 0.99 * radius;
                if (a.y - b.y).abs() < 1e-6 && is_rim(a) && is_rim(b) {
                    let middle = 0.5 * (a + b);
                    let from = depth - middle.z;
                    most = most.max((radius - middle.x.hypot(middle.z)) / scene.camera.pixel_at(from, rows));
                }
            }
        }
        most
    }

    #[test]
    fn silhouettes_are_within_a_tenth_of_a_pixel_and_not_much_finer() {
        let cameras = [
            EYE,
            Camera::Pinhole { vertical_fov: 0.1 },
            Camera::Orthographic { height_m: 3.0 },
            Camera::ThinLens {
                vertical_fov: 0.5,
                lens_radius_m: 0.01,
                focus_distance_m: 3.0,
                aperture: None,
                pattern: crate::world::Pattern::Jittered,
            },
        ];
        for camera in cameras {
            for (rows, depth, scale) in [(100, 3.0, 1.0), (2000, 3.0, 1.0), (1000, 200.0, 30.0)] {
                let error = rim_error(camera, rows, depth, scale);
                assert!((0.01..0.1).contains(&error), "{camera:?} {rows} {depth} {scale}: {error}");
            }
        }
    }

    #[test]
    fn equal_shapes_share_the_mesh_that_the_nearest_one_needs_in_any_order() {
        let [near, far] = [(cylinder(), DVec3::Z * -2.0, 1.0), (cylinder(), DVec3::Z * -90.0, 1.0)];
        let alone = triangles(&world(EYE, 1000, std::slice::from_ref(&near)));
        let coarse = triangles(&world(EYE, 1000, std::slice::from_ref(&far)));
        assert!(coarse < alone, "{coarse} {alone}");
        for shapes in [[near.clone(), far.clone()], [far, near]] {
            let mut world = world(EYE, 1000, &shapes);
            assert_eq!(triangles(&world), 2 * alone);
            world.settings.copied_triangles = 0;
            let scene = compile(&world, None).unwrap();
            assert_eq!((scene.geometry.instances.len(), scene.geometry.triangles.len()), (2, alone));
            assert_eq!(scene.geometry.placed_triangles, 2 * alone as u64);
        }
    }

    #[test]
    fn shapes_around_and_behind_the_camera_have_a_sensible_number_of_triangles() {
        for place in [DVec3::ZERO, DVec3::Z * 5.0, DVec3::new(0.4, 0.0, 0.0)] {
            for shape in [cylinder(), Shape::Torus { radius_m: 3.0, tube_radius_m: 1.0, segments: None }] {
                let count = triangles(&world(EYE, 2000, &[(shape.clone(), place, 1.0)]));
                assert!((100..1 << 20).contains(&count), "{shape:?} {place}: {count}");
            }
        }
        // A given number is what it is.
        let shape = Shape::Cylinder { radius_m: 0.5, height_m: 1.0, segments: Some(5) };
        assert_eq!(triangles(&world(EYE, 2000, &[(shape, DVec3::Z * -2.0, 1.0)])), 20);
    }

    #[test]
    fn a_camera_that_moves_a_little_keeps_meshes_and_trees() {
        let mut image =
            crate::world::Image { source: None, width: 2, height: 2, texels: Texels::Rgba8(vec![[9; 4]; 4]) };
        let field = Shape::HeightField {
            image: Some(crate::world::ImageId(0)),
            size_m: Vec2::ONE,
            height_m: 1.0,
            smooth: true,
        };
        let shapes = [(cylinder(), DVec3::Z * -3.5, 1.0), (field, DVec3::new(1.0, 0.0, -4.0), 1.0)];
        let mut world = world(EYE, 500, &shapes);
        world.assets.add_image(image.clone());
        let first = compile_after(&world, None, None).unwrap();
        let eye = world.in_order()[0];
        let _ = world.entities.insert_one(eye, at(DVec3::new(0.0, 0.01, 0.01), 1.0));
        let moved = compile_after(&world, None, Some(&first)).unwrap();
        assert!(Arc::ptr_eq(&first.scene.bvh, &moved.scene.bvh));
        let _ = world.entities.insert_one(eye, at(DVec3::Z * -2.0, 1.0));
        let near = compile_after(&world, None, Some(&moved)).unwrap();
        assert!(near.scene.geometry.triangles.len() > moved.scene.geometry.triangles.len());
        assert_eq!(near.scene.difference(&compile_after(&world, None, None).unwrap().scene), None);
        // Another image of the same number is another height field.
        image.texels = Texels::Rgba8(vec![[200; 4]; 4]);
        world.assets.images[0] = Arc::new(image);
        let higher = compile_after(&world, None, Some(&near)).unwrap();
        assert_eq!(higher.scene.difference(&compile_after(&world, None, None).unwrap().scene), None);
        assert!(!Arc::ptr_eq(&near.scene.geometry, &higher.scene.geometry));
    }
}
