//! An estimate of whether what a model's materials emit is the light of its image, or only a part of what is seen.

use std::collections::HashMap;
use std::rc::Rc;

use hecs::Entity;

use super::auto_camera;
use super::studio;
use crate::film::tonemap::srgb_decode;
use crate::math::{DAffine3, DVec3, Rgb, Vec2, Vec3};
use crate::query::{Coherence, HitBatch, RayBatch, Scene, SceneBuilder, Tracer};
use crate::world::assets::{ColorSpace, Wrap};
use crate::world::transforms::{self, WorldTransforms};
use crate::world::{
    AlphaMode, Camera, ColorInput, Material, MaterialId, Mesh, MeshId, Principled, Shape, Texels, Texture,
    Transform, World,
};

/// Surfaces that emit no more than white reflects in daylight are taken for displays and the like, which hardly light
/// anything.
pub(super) const DISPLAY: f32 = 1.0;
/// A surface is lit by emission if a studio would light it at most this many times as much: four stops, the most by
/// which an image can be made brighter before what emits is nothing but white.
const MOST_BRIGHTER: f32 = 16.0;
/// Camera rays along the longer side of the image.
const LONGER_SIDE: f64 = 24.0;
/// Rays to emitters, and rays to the studio, from each visible point.
const RAYS: u32 = 16;
/// The most triangles, each counted as often as it is placed, of models that are tested: others would take seconds.
const MOST_TRIANGLES: usize = 10_000_000;
/// The most surfaces that a ray passes: those that are invisible from behind.
const MOST_PASSED: usize = 16;

/// True if what emits light lights most of the surfaces that the first camera sees and that do not emit light
/// themselves. Surfaces that neither emission nor a studio around the model can light do not count.
pub(super) fn lights_most(world: &World) -> bool {
    if world.placed_triangles() > MOST_TRIANGLES {
        return true;
    }
    let Some(model) = LitModel::of(world) else { return true };
    let (mut lit, mut dim) = (0, 0);
    for point in model.visible_points() {
        let by_emission = model.by_emission(&point);
        let by_studio = model.by_studio(&point);
        if by_emission * MOST_BRIGHTER < by_studio {
            dim += 1;
        } else if by_emission > 0.0 {
            lit += 1;
        }
    }
    lit >= dim
}

/// A triangle of a placed mesh, in world space.
struct WorldTriangle {
    corners: [Vec3; 3],
    placed: usize,
    /// The index of the triangle in its mesh.
    triangle: usize,
}

impl WorldTriangle {
    /// The normal, whose length is twice the area.
    fn normal(&self) -> Vec3 {
        let [a, b, c] = self.corners.map(|corner| corner.as_dvec3());
        (b - a).cross(c - a).as_vec3()
    }

    fn at(&self, [u, v]: [f32; 2]) -> Vec3 {
        let [a, b, c] = self.corners;
        a * (1.0 - u - v) + b * u + c * v
    }
}

/// A mesh where it is placed.
struct SolidMesh<'w> {
    mesh: &'w Mesh,
    to_world: DAffine3,
    /// The material instead of the mesh's own.
    material: Option<MaterialId>,
    /// The index of each triangle that stops light.
    solid: Rc<Vec<u32>>,
}

/// A point that the camera sees.
struct SeenPoint {
    place: Vec3,
    /// The unit normal on the visible side.
    normal: Vec3,
}

/// A model that emits light.
struct LitModel<'w> {
    world: &'w World,
    placed: Vec<SolidMesh<'w>>,
    scene: Scene,
    emitters: Vec<WorldTriangle>,
    /// The sums of the emitters' weights up to each.
    weights: Vec<f64>,
    eye: (DAffine3, Camera),
    /// The length that counts as no distance.
    near: f32,
}

impl<'w> LitModel<'w> {
    fn of(world: &'w World) -> Option<LitModel<'w>> {
        let mut transforms = transforms::to_world(world, &world.in_order()).ok()?;
        let (mut place, camera) = eye(world, &transforms)?;
        // In single precision, places are finest around the camera.
        transforms::relative_to(&mut transforms, place.translation);
        place.translation = DVec3::ZERO;
        let eye = (place, camera);
        let mut builder = SceneBuilder::new();
        let mut shapes = HashMap::new();
        let mut placed = Vec::new();
        for entity in world.in_order() {
            let Ok(Shape::Mesh(id)) = world.entities.get::<&Shape>(entity).map(|shape| (*shape).clone())
            else {
                continue;
            };
            let material = world.entities.get::<&MaterialId>(entity).ok().map(|id| *id);
            let mesh = world.assets.meshes.get(id.0 as usize)?;
            let to_world = transforms::placement(world, &Shape::Mesh(id), transforms.get(&entity)?);
            let key: (MeshId, Option<MaterialId>) = (id, material);
            let (shape, solid) = match shapes.get(&key) {
                Some(known) => known,
                None => {
                    let solid = solid_triangles(world, mesh, material);
                    let triangles: Vec<[u32; 3]> =
                        solid.iter().map(|triangle| mesh.triangles[*triangle as usize]).collect();
                    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
                    let shape = builder.add_mesh(&positions, &triangles).ok()?;
                    shapes.entry(key).or_insert((shape, Rc::new(solid)))
                }
            };
            builder.place(*shape, &to_world).ok()?;
            placed.push(SolidMesh { mesh, to_world, material, solid: solid.clone() });
        }
        let scene = builder.build().ok()?;
        let near = 1e-5 * scene.bounds().map_or(1.0, |bounds| bounds.size().length());
        let mut model =
            LitModel { world, placed, scene, emitters: Vec::new(), weights: Vec::new(), eye, near };
        model.find_emitters();
        Some(model)
    }

    fn find_emitters(&mut self) {
        let mut sum = 0.0;
        for (number, placed) in self.placed.iter().enumerate() {
            for triangle in 0..placed.mesh.triangles.len() {
                let Some(material) = material_of(self.world, placed.mesh, placed.material, triangle) else {
                    continue;
                };
                let brightest = most_emitted(self.world, material);
                if brightest <= DISPLAY {
                    continue;
                }
                let found = self.triangle(number, triangle);
                sum += f64::from(found.normal().length() * brightest);
                self.emitters.push(found);
                self.weights.push(sum);
            }
        }
    }

    fn triangle(&self, placed: usize, triangle: usize) -> WorldTriangle {
        let SolidMesh { mesh, to_world, .. } = &self.placed[placed];
        let corner = |vertex: u32| transforms::point(to_world, mesh.positions[vertex as usize]);
        let corners = mesh.triangles[triangle].map(corner);
        // A mirrored mesh keeps its front.
        let [a, b, c] = corners;
        let corners = if to_world.matrix3.determinant() < 0.0 { [a, c, b] } else { corners };
        WorldTriangle { corners, placed, triangle }
    }

    /// The radiance that a triangle emits at a place, and true if it emits on both sides.
    fn emitted(&self, triangle: &WorldTriangle, weights: [f32; 2]) -> (f32, bool) {
        let SolidMesh { mesh, material, to_world, .. } = &self.placed[triangle.placed];
        let Some(material) = material_of(self.world, mesh, *material, triangle.triangle) else {
            return (0.0, false);
        };
        let radiance = match material.emission {
            ColorInput::Constant(color) => color,
            ColorInput::Texture(id) => {
                let Some(texture) = self.world.assets.textures.get(id.0 as usize) else {
                    return (0.0, false);
                };
                let uvs = if texture.uv_set == 1 { &mesh.uvs1 } else { &mesh.uvs };
                let mut corners = mesh.triangles[triangle.triangle];
                if to_world.matrix3.determinant() < 0.0 {
                    corners.swap(1, 2);
                }
                let [a, b, c] = corners.map(|vertex| uvs.get(vertex as usize).copied().unwrap_or_default());
                let [u, v] = weights;
                texel(self.world, texture, a * (1.0 - u - v) + b * u + c * v)
            }
        };
        (radiance.luminance(), material.double_sided)
    }

    /// The first visible surface along a ray: the triangle, the place on it and the normal towards the ray.
    fn first(
        &self,
        tracer: &mut Tracer,
        from: Vec3,
        towards: Vec3,
        most: f32,
    ) -> Option<(WorldTriangle, [f32; 2], SeenPoint)> {
        let mut least = self.near;
        for _ in 0..MOST_PASSED {
            let (mut ray, mut hits) = (RayBatch::default(), HitBatch::new(1));
            ray.push(from, towards, least, most);
            tracer.closest(ray.rays(), Coherence::Scattered, hits.hits_mut()).ok()?;
            let hit = hits.get(0)?;
            let found = self.scene.locate(&hit)?;
            let placed = found.instance.0 as usize;
            let triangle = *self.placed.get(placed)?.solid.get(found.primitive as usize)? as usize;
            let of_mesh = self.triangle(placed, triangle);
            let is_mirrored = self.placed[placed].to_world.matrix3.determinant() < 0.0;
            let weights = if is_mirrored { [hit.v, hit.u] } else { [hit.u, hit.v] };
            let normal = of_mesh.normal().normalize_or_zero();
            let is_back = normal.dot(towards) > 0.0;
            let SolidMesh { mesh, material, .. } = &self.placed[placed];
            let material = material_of(self.world, mesh, *material, triangle)?;
            if is_back && !material.double_sided {
                least = hit.t + self.near;
                continue;
            }
            let point =
                SeenPoint { place: of_mesh.at(weights), normal: if is_back { -normal } else { normal } };
            return Some((of_mesh, weights, point));
        }
        None
    }

    /// The points that the camera sees and that emit no light.
    fn visible_points(&self) -> Vec<SeenPoint> {
        let [width, height] = self.world.settings.size.map(f64::from);
        let scale = LONGER_SIDE / width.max(height);
        let [columns, rows] = [width, height].map(|side| (side * scale).round().max(1.0) as u32);
        let aspect = width / height;
        let (to_world, camera) = &self.eye;
        let axis = |axis: DVec3| (to_world.matrix3 * axis).normalize();
        let forward = axis(DVec3::NEG_Z);
        let right = forward.cross(axis(DVec3::Y)).normalize();
        let up = right.cross(forward);
        let mut tracer = self.scene.tracer();
        let mut points = Vec::new();
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let place = |at: u32, of: u32| 2.0 * (f64::from(at) + 0.5) / f64::from(of) - 1.0;
            let (x, y) = (place(column, columns) * aspect, -place(row, rows));
            let (from, towards) = match camera {
                Camera::Orthographic { height_m } => {
                    let half = 0.5 * f64::from(*height_m);
                    (to_world.translation + (right * x + up * y) * half, forward)
                }
                // Models have no panoramas.
                _ => {
                    let half = camera.slope(aspect).unwrap_or(1.0);
                    (to_world.translation, forward + (right * x + up * y) * half)
                }
            };
            let towards = towards.normalize().as_vec3();
            let Some((triangle, weights, point)) =
                self.first(&mut tracer, from.as_vec3(), towards, f32::INFINITY)
            else {
                continue;
            };
            if self.emitted(&triangle, weights).0 <= DISPLAY {
                points.push(point);
            }
        }
        points
    }

    /// The irradiance of a point by the emitters.
    fn by_emission(&self, point: &SeenPoint) -> f32 {
        let Some(total) = self.weights.last().copied().filter(|total| *total > 0.0) else { return 0.0 };
        let mut tracer = self.scene.tracer();
        let mut sum = 0.0;
        for ray in 0..RAYS {
            let [u, v] = spread(ray);
            let wanted = (f64::from(ray) + 0.5) / f64::from(RAYS) * total;
            let number = self.weights.partition_point(|sum| *sum < wanted).min(self.emitters.len() - 1);
            let before = if number == 0 { 0.0 } else { self.weights[number - 1] };
            let emitter = &self.emitters[number];
            let weights = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            let way = emitter.at(weights) - point.place;
            let distance = way.length();
            let towards = way / distance;
            let normal = emitter.normal();
            let (radiance, both_sides) = self.emitted(emitter, weights);
            let leaves = -normal.dot(towards);
            let leaves = if both_sides { leaves.abs() } else { leaves };
            let arrives = point.normal.dot(towards);
            if !(leaves > 0.0 && arrives > 0.0 && radiance > 0.0 && distance > 2.0 * self.near) {
                continue;
            }
            let end = distance - self.near * 2.0;
            if self.first(&mut tracer, point.place, towards, end).is_some() {
                continue;
            }
            // The weight is twice the area times the brightest radiance: the density is weight / (total · area).
            let per_area = total / (self.weights[number] - before);
            let area_times_cosine = 0.5 * leaves;
            sum += radiance * arrives * area_times_cosine * per_area as f32 / (distance * distance);
        }
        sum / RAYS as f32
    }

    /// The irradiance of a point by a studio around the model.
    fn by_studio(&self, point: &SeenPoint) -> f32 {
        let mut tracer = self.scene.tracer();
        let across = point.normal.any_orthonormal_vector();
        let along = point.normal.cross(across);
        let mut sum = 0.0;
        for ray in 0..RAYS {
            let [u, v] = spread(ray);
            let (angle, radius) = (std::f64::consts::TAU * f64::from(u), f64::from(v.sqrt()));
            let [x, y] = [libm::cos(angle) * radius, libm::sin(angle) * radius].map(|number| number as f32);
            let towards = across * x + along * y + point.normal * (1.0 - v).max(0.0).sqrt();
            if self.first(&mut tracer, point.place, towards, f32::INFINITY).is_none() {
                sum += studio::radiance(towards.normalize());
            }
        }
        sum * std::f32::consts::PI / RAYS as f32
    }
}

/// The place and the kind of the first camera; one that was added is where it will be placed.
fn eye(world: &World, transforms: &WorldTransforms) -> Option<(DAffine3, Camera)> {
    if let Some((_, transform, camera)) = auto_camera::added(world).into_iter().next() {
        let Transform::Trs { translation, rotation, .. } = transform else { return None };
        let to_world = DAffine3::from_rotation_translation(rotation.as_dquat().normalize(), translation);
        return Some((to_world, camera));
    }
    let is_camera = |entity: &Entity| world.entities.get::<&Camera>(*entity).is_ok();
    let first = world.in_order().into_iter().find(is_camera)?;
    let camera = *world.entities.get::<&Camera>(first).ok()?;
    Some((*transforms.get(&first)?, camera))
}

/// The material of a triangle.
fn material_of<'w>(
    world: &'w World,
    mesh: &Mesh,
    instead: Option<MaterialId>,
    triangle: usize,
) -> Option<&'w Principled> {
    let id =
        instead.or_else(|| mesh.triangle_materials.get(triangle).copied()).unwrap_or(MaterialId::DEFAULT);
    match &world.assets.materials.get(id.0 as usize)?.material {
        Material::Principled(material) => Some(material),
        Material::BlinnPhong(_) => None,
    }
}

/// The triangles that stop light: of materials that are neither glass nor partly absent.
fn solid_triangles(world: &World, mesh: &Mesh, instead: Option<MaterialId>) -> Vec<u32> {
    let is_solid = |triangle: &u32| {
        let material = material_of(world, mesh, instead, *triangle as usize);
        material.is_some_and(|m| m.transmission.factor == 0.0 && m.alpha_mode == AlphaMode::Opaque)
    };
    (0..mesh.triangles.len() as u32).filter(is_solid).collect()
}

/// The greatest component of the radiance that a material can emit.
pub(super) fn most_emitted(world: &World, material: &Principled) -> f32 {
    match material.emission {
        ColorInput::Constant(color) => color.max_component(),
        ColorInput::Texture(id) => {
            let texture = world.assets.textures.get(id.0 as usize);
            texture.map_or(0.0, |texture| texture.factor.max_component())
        }
    }
}

/// The nearest texel of a texture.
fn texel(world: &World, texture: &Texture, uv: Vec2) -> Rgb {
    let image = texture.image().and_then(|image| world.assets.images.get(image.0 as usize));
    let Some(image) = image else { return Rgb::BLACK };
    let scaled = uv * texture.scale;
    let (sin, cos) = (libm::sin(f64::from(texture.rotation)), libm::cos(f64::from(texture.rotation)));
    let (sin, cos) = (sin as f32, cos as f32);
    let turned = Vec2::new(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x);
    let [u, v] = (turned + texture.offset).to_array();
    let place = |at: f32, wrap: Wrap, size: u32| {
        let at = match wrap {
            Wrap::Repeat => at - at.floor(),
            Wrap::Clamp => at.clamp(0.0, 1.0),
            Wrap::Mirror => 1.0 - (1.0 - (at * 0.5 - (at * 0.5).floor()) * 2.0).abs(),
        };
        ((at * size as f32) as u32).min(size - 1) as usize
    };
    let [wrap_u, wrap_v] = texture.wrap;
    let index = place(v, wrap_v, image.height) * image.width as usize + place(u, wrap_u, image.width);
    let [r, g, b, _] = image.texels.stored(index).map(|channel| channel as f32);
    let stored = Rgb::new(r, g, b);
    // Floats are linear.
    let is_encoded = texture.color_space == ColorSpace::Srgb && !matches!(image.texels, Texels::Rgb32(_));
    (if is_encoded { stored.map(srgb_decode) } else { stored }) * texture.factor
}

/// The `n`th of evenly spread points in the unit square (the sequence by the plastic number).
fn spread(n: u32) -> [f32; 2] {
    [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|step: f64| {
        let at = 0.5 + step * f64::from(n);
        (at - at.floor()) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::super::framing::add_camera;
    use super::*;
    use crate::world::Image;

    /// A world of boxes, each with its lowest and highest corner and the radiance that it emits. A room has its inside
    /// outside.
    fn boxes(all: &[([f32; 3], [f32; 3], f32)], room: Option<f32>) -> World {
        let mut world = World::default();
        for (least, most, radiance) in all {
            add_box(&mut world, [*least, *most], false, ColorInput::Constant(Rgb::splat(*radiance)));
        }
        if let Some(size) = room {
            add_box(&mut world, [[-size; 3], [size; 3]], true, ColorInput::Constant(Rgb::BLACK));
        }
        add_camera(&mut world);
        world
    }

    fn add_box(world: &mut World, [least, most]: [[f32; 3]; 2], is_inside_out: bool, emission: ColorInput) {
        let corner = |number: usize| {
            Vec3::from_array(std::array::from_fn(|axis| {
                if number >> axis & 1 == 0 { least[axis] } else { most[axis] }
            }))
        };
        let positions: Vec<Vec3> = (0..8).map(corner).collect();
        let faces: [[u32; 4]; 6] =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut triangles: Vec<[u32; 3]> =
            faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        if is_inside_out {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        let uvs = vec![Vec2::splat(0.25); 8];
        let material = Material::Principled(Box::new(Principled { emission, ..Principled::default() }));
        let material = world.assets.add_material(None, material);
        let mesh = world.assets.add_mesh(Mesh { positions, triangles, uvs, ..Mesh::default() });
        world.entities.spawn((Shape::Mesh(mesh), Transform::IDENTITY, material));
    }

    #[test]
    fn irradiance_of_a_panel_is_that_of_its_form_factor() {
        // A panel of 2 × 2 m, 1 m above a floor: at the point below its middle the form factor is 0.5541.
        let world = boxes(
            &[([-1.0, 1.0, -1.0], [1.0, 1.1, 1.0], 3.0), ([-5.0, -0.1, -5.0], [5.0, 0.0, 5.0], 0.0)],
            None,
        );
        let model = LitModel::of(&world).unwrap();
        let (camera, _) = eye(&world, &transforms::to_world(&world, &world.in_order()).unwrap()).unwrap();
        let seen = |height: f64| SeenPoint {
            place: (DVec3::Y * height - camera.translation).as_vec3(),
            normal: Vec3::Y,
        };
        let point = seen(0.0);
        let (found, expected) = (model.by_emission(&point), 3.0 * std::f32::consts::PI * 0.5541);
        assert!((found / expected - 1.0).abs() < 0.25, "{found} {expected}");
        let below = seen(-0.2);
        assert!(model.by_emission(&below) == 0.0 && model.by_studio(&below) == 0.0, "the floor is between");
        let outside = seen(9.0);
        assert!((1.0..5.0).contains(&model.by_studio(&outside)), "{}", model.by_studio(&outside));
    }

    #[test]
    fn rooms_and_sets_with_glowing_panels_are_lit_by_them() {
        // A lamp below the ceiling of a closed room, whose walls are invisible from outside, and a thing in it.
        let lamp = ([-0.3, 1.8, -0.3], [0.3, 1.9, 0.3], 20.0);
        let thing = ([-0.5, -2.0, -0.5], [0.5, -1.0, 0.5], 0.0);
        assert!(lights_most(&boxes(&[lamp, thing], Some(2.0))));
        // Two panels beside a thing on a floor, as a photographer arranges them.
        let panels = [([-2.5, 0.5, -0.5], [-2.4, 2.5, 1.5], 8.0), ([1.0, 2.4, 0.0], [2.5, 2.5, 1.5], 8.0)];
        let floor = ([-3.0, -0.1, -3.0], [3.0, 0.0, 3.0], 0.0);
        let thing = ([-0.5, 0.0, -0.5], [0.5, 1.0, 0.5], 0.0);
        assert!(lights_most(&boxes(&[panels[0], panels[1], floor, thing], None)));
        // A room that is open in front, with a faint lamp below its ceiling.
        let lamp = ([-0.25, 0.98, -0.25], [0.25, 0.99, 0.25], 1.5);
        let walls = [
            ([-1.1, -1.0, -1.0], [-1.0, 1.0, 1.0], 0.0),
            ([1.0, -1.0, -1.0], [1.1, 1.0, 1.0], 0.0),
            ([-1.1, -1.1, -1.0], [1.1, -1.0, 1.0], 0.0),
            ([-1.1, 1.0, -1.0], [1.1, 1.1, 1.0], 0.0),
            ([-1.1, -1.1, -1.1], [1.1, 1.1, -1.0], 0.0),
        ];
        assert!(lights_most(&boxes(&[&[lamp][..], &walls].concat(), None)));
        // Everything emits.
        assert!(lights_most(&boxes(&[([-1.0; 3], [1.0; 3], 2.0)], None)));
    }

    #[test]
    fn things_with_glowing_parts_are_not_lit_by_them() {
        let body = ([-1.0; 3], [1.0; 3], 0.0);
        // Eyes, which light nothing of the face that they are in.
        let eyes = [([-0.5, 0.3, 1.0], [-0.3, 0.5, 1.01], 5.0), ([0.3, 0.3, 1.0], [0.5, 0.5, 1.01], 5.0)];
        let mut face = boxes(&[body, eyes[0], eyes[1]], None);
        assert!(!lights_most(&face));
        // Far away, relative to a point of the mesh's own.
        for mesh in &mut face.assets.meshes {
            std::sync::Arc::make_mut(mesh).origin = DVec3::new(450_123.4, 312.7, -5_412_345.6);
        }
        assert!(!lights_most(&face));
        // A tail light behind, and several things of which one glows.
        assert!(!lights_most(&boxes(&[body, ([-0.5, -0.5, -1.1], [0.5, 0.5, -1.0], 50.0)], None)));
        let row = [([-4.5, 0.0, -0.5], [-3.5, 1.0, 0.5], 0.0), ([-1.5, 0.0, -0.5], [-0.5, 1.0, 0.5], 5.0)];
        let others = [([1.5, 0.0, -0.5], [2.5, 1.0, 0.5], 0.0), ([4.5, 0.0, -0.5], [5.5, 1.0, 0.5], 0.0)];
        assert!(!lights_most(&boxes(&[row[0], row[1], others[0], others[1]], None)));
    }

    #[test]
    fn emission_textures_count_by_their_texels() {
        let is_lit = |texel: u8| {
            let mut world = boxes(&[([-5.0, -0.1, -5.0], [5.0, 0.0, 5.0], 0.0)], None);
            // The texture coordinates lie in the first of four texels.
            let mut texels = vec![[255; 4]; 4];
            texels[0] = [texel, texel, texel, 255];
            let image = Image { source: None, width: 2, height: 2, texels: Texels::Rgba8(texels) };
            let image = world.assets.add_image(image);
            let texture = Texture { factor: Rgb::splat(10.0), ..Texture::new(image) };
            let texture = ColorInput::Texture(world.assets.add_texture(texture));
            add_box(&mut world, [[-4.0, 3.0, -4.0], [4.0, 3.1, 4.0]], false, texture);
            lights_most(&world)
        };
        assert!(is_lit(255) && !is_lit(0));
    }
}
