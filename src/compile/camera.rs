//! Compiles the camera entity.

use hecs::Entity;

use crate::bvh::{AnyHitFilter, Crossing, FaceCulling, HitPredicate, Stack, closest_ray};
use crate::error::CompileError;
use crate::film::texels::linear_colors;
use crate::math::{Aabb, DAffine3, DVec3, Ray, Rgb, Vec3};
use crate::sampling::table::Distribution2d;
use crate::scene::material::Coverage;
use crate::scene::{
    Aperture, CompiledCamera, CompiledScene, HalfSize, Lens, Perspective, Projection, StereoPair,
};
use crate::shading::camera::CameraImage;
use crate::shading::crossing::{coverage_at, crossed};
use crate::simd::Isa;
use crate::world::names::is_same_name;
use crate::world::transforms::{WorldTransforms, direction, entity_error, point};
use crate::world::{self, FisheyeMapping, FocusAt, FocusOn, Image, Shape, Stereo, World};

/// The names of all cameras, in the order of the world; a camera without a name is called `entity N`.
pub fn camera_names(world: &World) -> Vec<String> {
    let cameras = world.in_order().into_iter().filter(|e| world.entities.get::<&world::Camera>(*e).is_ok());
    cameras.map(|e| world.name_of(e)).collect()
}

/// Returns the camera entity with a name, or the first one.
pub(super) fn find(
    world: &World,
    order: &[Entity],
    name: Option<&str>,
) -> Result<(Entity, world::Camera), CompileError> {
    let mut cameras = order.iter().filter_map(|&entity| {
        let camera = world.entities.get::<&world::Camera>(entity).ok()?;
        Some((entity, *camera))
    });
    match name {
        None => cameras.next().ok_or(CompileError::NoCamera),
        Some(name) => {
            cameras.find(|(entity, _)| is_same_name(&world.name_of(*entity), name)).ok_or_else(|| {
                let known = camera_names(world);
                let known = if known.is_empty() { "none".into() } else { known.join(", ") };
                CompileError::UnknownCamera { name: name.into(), known }
            })
        }
    }
}

/// A camera that focuses on what is seen at a place of the image, once the scene is there to be seen.
pub(super) fn focused(
    scene: &CompiledScene,
    world: &World,
    transforms: &WorldTransforms,
    (entity, mut camera): (Entity, world::Camera),
) -> Result<CompiledCamera, CompileError> {
    let at = world.entities.get::<&FocusAt>(entity).ok().map(|at| *at);
    let (Some(at), Some(distance)) = (at, camera.focus_distance_m()) else { return Ok(scene.camera) };
    let size = world.settings.size;
    let places = match at {
        FocusAt::Place(place) => vec![place],
        FocusAt::Middle => from_the_middle(),
    };
    let depth = places.iter().find_map(|place| {
        let pixel = [0, 1].map(|axis: usize| place[axis] * size[axis] as f32);
        depth_at(scene, size, pixel, at)
    });
    let Some(depth) = depth else {
        let [x, y] = [0, 1].map(|axis: usize| (places[0][axis] * size[axis] as f32).floor());
        let reason = format!(
            "it cannot focus on pixel {x},{y} of the image of {} x {} that these options give, where nothing is: choose another, or an entity (--focus)",
            size[0], size[1]
        );
        return Err(entity_error(world, entity, reason));
    };
    *distance = depth;
    Ok(compile(world, transforms, (entity, camera))?.0)
}

/// The depth of what is seen at a place of the image, in pixels. Of shadow catchers and thin veils hardly anything is
/// seen: who means them names their pixel.
fn depth_at(scene: &CompiledScene, size: [u32; 2], [x, y]: [f32; 2], at: FocusAt) -> Option<f32> {
    let is_named = at != FocusAt::Middle;
    let (ray, _) =
        CameraImage::new(&scene.camera, size).ray::<f32>((x, y), (x.floor(), y.floor()), (0.0, 0.0));
    let seen = SeenSurfaces { scene, ray, least: if is_named { 0.05 } else { 0.5 } };
    let filter = AnyHitFilter::new(&seen, 0);
    let hit = closest_ray(Isa::PORTABLE, &scene.bvh, &ray, filter, &mut Stack::new(&scene.bvh));
    if hit.is_miss() {
        return None;
    }
    let material = scene.geometry.material_of(hit.primitive, hit.instance) as usize;
    let [dx, dy, dz] = [ray.direction.x, ray.direction.y, ray.direction.z];
    let depth = hit.t * Vec3::new(dx, dy, dz).dot(scene.camera.forward);
    (is_named || !scene.materials[material].shadow_catcher).then_some(depth)
}

/// Places all over an image, in its widths and heights, from its middle outwards.
fn from_the_middle() -> Vec<[f32; 2]> {
    /// The places across and down: an odd number, so that one is in the middle.
    const ACROSS: u16 = 33;
    let place = |at: u16| (f32::from(at) + 0.5) / f32::from(ACROSS);
    let mut places: Vec<_> =
        (0..ACROSS).flat_map(|y| (0..ACROSS).map(move |x| [place(x), place(y)])).collect();
    let far = |[x, y]: &[f32; 2]| (x - 0.5) * (x - 0.5) + (y - 0.5) * (y - 0.5);
    // Stable, so that places of one distance keep their order.
    places.sort_by(|a, b| far(a).total_cmp(&far(b)));
    places
}

/// The surfaces that a camera's ray sees: at least a part of what a cut-out or blended one could be.
struct SeenSurfaces<'a> {
    scene: &'a CompiledScene,
    ray: Ray<f32>,
    least: f32,
}

impl HitPredicate for SeenSurfaces<'_> {
    fn accepts(&self, _: usize, crossing: &Crossing) -> bool {
        crossed(self.scene, crossing, FaceCulling::AsBuilt).is_some_and(|material| {
            material.coverage == Coverage::Whole
                || coverage_at(self.scene, material, crossing, || self.ray) >= self.least
        })
    }
}

pub(super) fn compile(
    world: &World,
    transforms: &WorldTransforms,
    (entity, mut camera): (Entity, world::Camera),
) -> Result<(CompiledCamera, Option<Aperture>), CompileError> {
    let matrix = &transforms[&entity];
    // Only position and direction count; a scale would otherwise change the angle of view.
    let forward = direction(matrix, Vec3::NEG_Z);
    let up = direction(matrix, Vec3::Y).as_dvec3();
    let right = forward.as_dvec3().cross(up).normalize();
    let right = right * matrix.matrix3.determinant().signum();
    let up = right.cross(forward.as_dvec3()) * matrix.matrix3.determinant().signum();
    let aperture = match camera {
        world::Camera::ThinLens { aperture: Some(image), .. }
        | world::Camera::Photographic { f_stop: Some(_), aperture: Some(image), .. } => {
            let opening = aperture(&world.assets.images[image.0 as usize]);
            let dark =
                || entity_error(world, entity, "the picture of its lens's aperture is dark everywhere");
            Some(opening.ok_or_else(dark)?)
        }
        _ => None,
    };
    if let (Some(distance), Ok(focused)) = (camera.focus_distance_m(), world.entities.get::<&FocusOn>(entity))
    {
        let way = middle(world, focused.0, &transforms[&focused.0]) - matrix.translation;
        *distance = way.dot(forward.as_dvec3()) as f32;
        if !(*distance > 0.0 && distance.is_finite()) {
            let name = world.name_of(focused.0);
            let reason = format!("it cannot focus on \"{name}\", which is not in front of it");
            return Err(entity_error(world, entity, reason));
        }
    }
    let stereo = world.entities.get::<&Stereo>(entity).ok().map(|pair| StereoPair {
        layout: pair.layout,
        half_distance: 0.5 * pair.eye_distance_m,
        convergence: 1.0 / pair.convergence_m,
    });
    let [right, up] = [right.as_vec3(), up.normalize().as_vec3()];
    let camera = CompiledCamera {
        origin: point(matrix, Vec3::ZERO),
        right,
        up,
        forward,
        projection: projection(&camera, [right, up, forward]),
        stereo,
    };
    Ok((camera, aperture))
}

/// The middle of an entity's shape in world space, or its origin if it has no shape.
fn middle(world: &World, entity: Entity, matrix: &DAffine3) -> DVec3 {
    let shape = world.entities.get::<&Shape>(entity);
    let middle = match shape.as_deref() {
        Ok(Shape::Mesh(id)) => {
            let mesh = &world.assets.meshes[id.0 as usize];
            let bounds = Aabb::around(mesh.positions.iter().copied());
            if bounds.is_empty() { mesh.origin } else { mesh.origin + bounds.center().as_dvec3() }
        }
        Ok(shape) => match shape.flat_corners() {
            Some((origin, corners)) => {
                let sum: DVec3 = corners.iter().map(|corner| corner.as_dvec3()).sum();
                origin + sum / corners.len() as f64
            }
            None => DVec3::ZERO,
        },
        Err(_) => DVec3::ZERO,
    };
    matrix.transform_point3(middle)
}

fn projection(camera: &world::Camera, axes: [Vec3; 3]) -> Projection {
    let tangent = |fov: f32| libm::tan(fov as f64 * 0.5) as f32;
    match *camera {
        world::Camera::Pinhole { vertical_fov } => {
            Projection::Pinhole(Perspective::upright(tangent(vertical_fov)))
        }
        world::Camera::ThinLens { vertical_fov, lens_radius_m, focus_distance_m, pattern, .. } => {
            Projection::ThinLens {
                view: Perspective::upright(tangent(vertical_fov)),
                lens: Lens::new(axes, lens_radius_m, focus_distance_m, (1.0, [0.0; 2])),
                pattern,
            }
        }
        world::Camera::Orthographic { height_m } => Projection::Orthographic { half_height: height_m * 0.5 },
        world::Camera::Photographic {
            focal_length_mm,
            sensor_width_mm,
            f_stop,
            focus_distance_m,
            shift,
            tilt_degrees,
            pattern,
            ..
        } => {
            let half = HalfSize::LongerSide(0.5 * sensor_width_mm / focal_length_mm);
            let view = Perspective { half, shift: shift.to_array() };
            let tangents = tilt_degrees.to_array().map(|it| libm::tan(f64::from(it).to_radians()));
            match f_stop {
                None => Projection::Pinhole(view),
                Some(f_stop) => Projection::ThinLens {
                    view,
                    lens: Lens::new(
                        axes,
                        0.5e-3 * focal_length_mm / f_stop,
                        focus_distance_m,
                        (1e-3 * focal_length_mm, tangents),
                    ),
                    pattern,
                },
            }
        }
        world::Camera::Intrinsics { fx, fy, cx, cy, size } => {
            let [width, height] = size.map(|side| side as f32);
            Projection::Pinhole(Perspective {
                half: HalfSize::Both([0.5 * width / fx, 0.5 * height / fy]),
                shift: [0.5 - cx / width, cy / height - 0.5],
            })
        }
        world::Camera::Panorama { horizontal, vertical } => {
            Projection::Panorama { half_turns: [horizontal, vertical].map(half_turns) }
        }
        world::Camera::Fisheye { fov, mapping, circular } => Projection::Fisheye {
            mapping,
            half_turns: half_turns(fov),
            rim: rim(mapping, 0.5 * f64::from(fov)),
            is_circular: circular,
        },
    }
}

/// Half of an angle in radians, in turns.
fn half_turns(angle: f32) -> f32 {
    (0.5 * f64::from(angle) / std::f64::consts::TAU) as f32
}

/// The function of the angle to a fisheye's axis to which the radius is proportional, at the rim of the disc.
fn rim(mapping: FisheyeMapping, half_angle: f64) -> f32 {
    let rim = match mapping {
        FisheyeMapping::Equidistant => half_angle,
        FisheyeMapping::Equisolid => libm::sin(0.5 * half_angle),
        FisheyeMapping::Stereographic => libm::tan(0.5 * half_angle),
        FisheyeMapping::Orthographic => libm::sin(half_angle),
    };
    rim as f32
}

/// The most columns and rows of an aperture: larger images are reduced.
const FINEST: usize = 512;

/// An image's luminance, with a dark border; none if it is dark everywhere.
fn aperture(image: &Image) -> Option<Aperture> {
    let texels = linear_colors(&image.texels);
    let (width, height) = (image.width as usize, image.height as usize);
    let step = width.max(height).div_ceil(FINEST);
    let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
    let mut nodes = vec![0.0; (columns + 2) * (rows + 2)];
    for (row, line) in texels.chunks(width).enumerate() {
        for (column, texel) in line.iter().enumerate() {
            // Texels that share a cell are summed.
            let node = (row / step + 1) * (columns + 2) + column / step + 1;
            nodes[node] += Rgb::from(*texel).luminance();
        }
    }
    let scale = [columns, rows].map(|count| (count + 2) as f32 / count as f32);
    let bright = nodes.iter().any(|node| *node > 0.0);
    bright.then(|| Aperture { table: Distribution2d::new(&nodes, columns + 2), scale })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::camera::on_lens;
    use crate::world::Texels;

    /// With two texels side by side, 7/8 of each one's light passes through its own half, since they are interpolated.
    #[test]
    fn lens_transmits_light_where_its_aperture_image_is_bright() {
        let texels = vec![[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255; 4]];
        let picture = Image { source: None, width: 2, height: 2, texels: Texels::Rgba8(texels) };
        let aperture = aperture(&picture).unwrap();
        let count = 512;
        let mut found = [[0.0f64; 2]; 2];
        for i in 0..count * count {
            let u = [i / count, i % count].map(|k| (k as f32 + 0.5) / count as f32);
            let (x, y): (f32, f32) = on_lens(Some(&aperture), (u[0], u[1]));
            assert!(x.abs() <= 2.0 && y.abs() <= 2.0, "within the dark edge");
            found[usize::from(y < 0.0)][usize::from(x > 0.0)] += 1.0 / f64::from(count * count);
        }
        let own = [[0.2126, 0.7152], [0.0722, 1.0]];
        let sum: f64 = own.as_flattened().iter().sum();
        for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let part = |i: usize, k: usize| if i == k { 0.875 } else { 0.125 };
            let places = [(0, 0), (0, 1), (1, 0), (1, 1)];
            let blended = places.map(|(i, k)| part(row, i) * part(column, k) * own[i][k] / sum);
            let expected: f64 = blended.iter().sum();
            assert!(
                (found[row][column] - expected).abs() < 3e-3,
                "{row} {column}: {found:?}, not {expected}"
            );
        }
    }

    #[test]
    fn apertures_of_any_size_are_accepted_except_dark_ones() {
        let grey = |width: u32, height: u32, value: u8| {
            let texels = vec![[value; 4]; (width * height) as usize];
            aperture(&Image { source: None, width, height, texels: Texels::Rgba8(texels) })
        };
        for (width, height) in [(1, 1), (2000, 1), (3, 1500), (513, 600)] {
            let opening = grey(width, height, 255).unwrap();
            assert!(opening.scale.iter().all(|scale| (1.0..=3.0).contains(scale)), "{width} {height}");
        }
        assert!(grey(4, 4, 0).is_none());
    }
}
