//! Everything that lights surfaces to the columns that the path transport samples.

use std::collections::HashMap;

use super::light_tree::{self, LightBounds};
use crate::math::{Aabb, NONE, Rgb, Vec3};
use crate::scene::emitters::{Emitters, flag, kind};
use crate::scene::environment::Environment;
use crate::scene::principled::Principled;
use crate::scene::{Geometry, Light};

/// A visible area light: its material and its place among the lights.
pub(super) struct VisibleArea {
    pub material: u32,
    pub light: u32,
}

pub(super) fn compile(
    geometry: &Geometry,
    materials: &[Principled],
    lights: &[Light],
    angles: &[f32],
    visible: &[VisibleArea],
    environment: &Environment,
) -> Emitters {
    let mut out = Emitters::default();
    let mut areas = HashMap::new();
    for (index, light) in lights.iter().enumerate() {
        let seen = visible.iter().find(|area| area.light as usize == index);
        if let Some(emitter) = finite(&mut out, light, seen.is_some())
            && let Some(area) = seen
        {
            areas.insert(area.material, emitter);
        }
    }
    surfaces(&mut out, geometry, materials, &areas);
    out.finite = out.len() as u32;
    let bounds: Vec<LightBounds> = (0..out.len()).map(|emitter| bounds(&out, emitter)).collect();
    out.tree = light_tree::build(&bounds);
    for (index, light) in lights.iter().enumerate() {
        if let Light::Directional { to_light, irradiance } = light {
            let mut row = row_of(*to_light, Vec3::ZERO, Vec3::ZERO, *irradiance);
            row[3] = (1.0 - libm::cos(angles[index] as f64 / 2.0)) as f32;
            push(&mut out, kind::DIRECTIONAL, 0, row);
        }
    }
    // What is nearly even all around is found by drawn directions as well as by any other way.
    if environment.panorama.is_some() && !environment.is_black() {
        let row = row_of(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, Rgb::BLACK);
        push(&mut out, kind::ENVIRONMENT, flag::VISIBLE, row);
    }
    out
}

fn row_of(a: Vec3, b: Vec3, c: Vec3, light: Rgb) -> [f32; 13] {
    [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z, 0.0, light.r, light.g, light.b]
}

/// Where an emitter is, where it shines to and how bright it is.
fn bounds(out: &Emitters, emitter: usize) -> LightBounds {
    let row = &out.rows[emitter];
    let vector = |at: usize| Vec3::new(row[at], row[at + 1], row[at + 2]);
    let place = vector(0);
    let light = Rgb::new(row[10], row[11], row[12]).luminance();
    let has = |flag: u32| out.flags[emitter] & flag != 0;
    let pi = std::f32::consts::PI;
    let around = |points: &[Vec3]| {
        let min = points.iter().copied().fold(place, Vec3::min);
        Aabb { min, max: points.iter().copied().fold(place, Vec3::max) }
    };
    let everywhere = |bounds: Aabb, power: f32| LightBounds {
        bounds,
        power,
        axis: Vec3::Z,
        cos_spread: -1.0,
        cos_emission: 0.0,
        two_sided: false,
    };
    match out.kinds[emitter] {
        kind::TRIANGLE | kind::QUAD => {
            let (e1, e2) = (vector(3), vector(6));
            let cross = e1.cross(e2);
            let part = if out.kinds[emitter] == kind::QUAD { 1.0 } else { 0.5 };
            let corners = [place + e1, place + e2, if part == 1.0 { place + e1 + e2 } else { place }];
            LightBounds {
                bounds: around(&corners),
                power: light * cross.length() * part * pi,
                axis: if has(flag::REVERSED) { -cross } else { cross },
                cos_spread: 1.0,
                cos_emission: 0.0,
                two_sided: has(flag::TWO_SIDED),
            }
        }
        kind::SPHERE => {
            let radius = Vec3::splat(row[9]);
            let box_of = Aabb { min: place - radius, max: place + radius };
            everywhere(box_of, light * 4.0 * pi * pi * row[9] * row[9])
        }
        kind::SPOT => LightBounds {
            bounds: around(&[]),
            power: light * 4.0 * pi,
            axis: vector(3),
            cos_spread: 1.0,
            cos_emission: row[6],
            two_sided: false,
        },
        _ => everywhere(around(&[]), light * 4.0 * pi),
    }
}

fn push(out: &mut Emitters, kind: u32, flags: u32, row: [f32; 13]) -> u32 {
    out.kinds.push(kind);
    out.flags.push(flags);
    out.rows.push(row);
    out.material.push(NONE);
    out.primitive.push(NONE);
    out.kinds.len() as u32 - 1
}

/// The emitter of a light that stands somewhere.
fn finite(out: &mut Emitters, light: &Light, visible: bool) -> Option<u32> {
    let (kind, flags, row) = match light {
        Light::Directional { .. } => return None,
        Light::Point { position, intensity, falloff } => {
            let mut row = row_of(*position, Vec3::ZERO, Vec3::ZERO, *intensity);
            row[9] = f32::from(*falloff);
            (kind::POINT, 0, row)
        }
        Light::Spot { position, intensity, falloff, axis, cos_outer, scale } => {
            let mut row = row_of(*position, *axis, Vec3::new(*cos_outer, *scale, 0.0), *intensity);
            row[9] = f32::from(*falloff);
            (kind::SPOT, 0, row)
        }
        Light::Area { corner, edge_u, edge_v, normal, intensity, samples, .. } => {
            let cross = edge_u.as_dvec3().cross(edge_v.as_dvec3());
            let radiance = *intensity * (*samples as f32 / cross.length() as f32);
            let turned = cross.dot(normal.as_dvec3()) < 0.0;
            let (first, second) = if turned { (*edge_v, *edge_u) } else { (*edge_u, *edge_v) };
            let flags = if visible { flag::VISIBLE } else { 0 };
            (kind::QUAD, flags, row_of(*corner, first, second, radiance))
        }
    };
    Some(push(out, kind, flags, row))
}

/// A corner and two edges of the parallelogram that a triangle and the next one make, if they do:
/// one emitter is sampled better than two. The edges' product points where `front` does.
fn parallelogram(geometry: &Geometry, index: usize, front: Vec3) -> Option<[Vec3; 3]> {
    let place = |v: u32| Vec3::from_array(geometry.positions[v as usize]);
    let [one, other] = [index, index + 1].map(|i| geometry.triangles[i].map(place));
    for k in 0..3 {
        // The corner of the first that is opposite to the shared edge, if that is the one.
        let (corner, left, right) = (one[k], one[(k + 1) % 3], one[(k + 2) % 3]);
        for j in 0..3 {
            let (far, a, b) = (other[j], other[(j + 1) % 3], other[(j + 2) % 3]);
            if [a, b] == [right, left]
                && (left + right - corner - far).length() <= 1e-6 * (left - right).length()
            {
                let (e1, e2) = (left - corner, right - corner);
                return Some(if e1.cross(e2).dot(front) > 0.0 { [corner, e1, e2] } else { [corner, e2, e1] });
            }
        }
    }
    None
}

/// Triangles and spheres whose material gives off light. Those of instances are found by rays
/// alone.
fn surfaces(out: &mut Emitters, geometry: &Geometry, materials: &[Principled], areas: &HashMap<u32, u32>) {
    let shines = |part: u32| {
        let material = geometry.parts.material[part as usize];
        materials[material as usize].emits().then_some(material)
    };
    if !(0..geometry.parts.material.len() as u32).any(|part| shines(part).is_some()) {
        return;
    }
    let triangles = geometry.world_triangles as usize;
    let spheres = geometry.world_spheres as usize;
    out.of_primitive = vec![NONE; triangles + spheres];
    for index in 0..triangles {
        let part = geometry.triangle_parts[index];
        let Some(material) = shines(part) else { continue };
        if out.of_primitive[index] != NONE {
            continue;
        }
        if let Some(area) = areas.get(&material) {
            out.of_primitive[index] = *area;
            continue;
        }
        let record = &materials[material as usize];
        let [a, b, c] = geometry.triangles[index].map(|v| Vec3::from_array(geometry.positions[v as usize]));
        let textured = record.emission.texture != NONE;
        let (e1, e2) = (b - a, c - a);
        if e1.cross(e2).length_squared() == 0.0 {
            continue;
        }
        let mut flags = flag::VISIBLE;
        if !record.one_sided_emission {
            flags |= flag::TWO_SIDED;
        }
        if geometry.parts.sign[part as usize] < 0.0 {
            flags |= flag::REVERSED;
        }
        if textured {
            flags |= flag::TEXTURED;
        }
        let light = record.emission.factor.into();
        if !textured
            && index + 1 < triangles
            && geometry.triangle_parts[index + 1] == part
            && let Some([corner, e1, e2]) = parallelogram(geometry, index, e1.cross(e2))
        {
            let emitter = push(out, kind::QUAD, flags, row_of(corner, e1, e2, light));
            out.of_primitive[index] = emitter;
            out.of_primitive[index + 1] = emitter;
            continue;
        }
        let row = row_of(a, e1, e2, light);
        let emitter = push(out, kind::TRIANGLE, flags, row);
        out.material[emitter as usize] = material;
        out.primitive[emitter as usize] = index as u32;
        out.of_primitive[index] = emitter;
    }
    for index in 0..spheres {
        let Some(material) = shines(geometry.sphere_parts[index]) else { continue };
        let record = &materials[material as usize];
        if record.emission.texture != NONE {
            continue;
        }
        let [x, y, z, radius] = geometry.spheres[index];
        let mut row = row_of(Vec3::new(x, y, z), Vec3::ZERO, Vec3::ZERO, record.emission.factor.into());
        row[9] = radius;
        out.of_primitive[triangles + index] = push(out, kind::SPHERE, flag::VISIBLE, row);
    }
}
