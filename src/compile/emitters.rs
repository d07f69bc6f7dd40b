//! Compiles everything that lights surfaces to the columns that both transports sample.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::emitter_bounds::bounds;
use super::light_tree::{self, LightBounds};
use super::lights::{SpotCone, WorldLight, WorldLights};
use super::memo::{ByPtr, DebugText, debug_text};
use super::parallelogram::parallelogram;
use super::textured_emission::EmissionAverages;
use crate::math::{NONE, Rgb, Vec3};
use crate::sampling::pattern::Grid;
use crate::scene::emitter_rows::{
    AnyRow, ConeRow, DirectionalRow, EmitterRow, PhotometricRow, PlanarRow, PointRow, SphereRow,
};
use crate::scene::emitters::{Emitters, UnseenLamps, flag, kind};
use crate::scene::environment::Environment;
use crate::scene::material::{Coverage, MaterialRecord};
use crate::scene::{Geometry, Textures, WhittedLight};
use crate::world::{ConeEdge, Outline, Pattern};

/// The most emitters of meshes that are placed several times. Each takes about 200 bytes, with its place in the light
/// tree.
pub(super) const MOST_PLACED: usize = 1 << 20;

/// Surfaces that can be hit and may emit light.
pub(super) struct EmittingSurfaces<'a> {
    pub geometry: &'a Geometry,
    pub materials: &'a [MaterialRecord],
    pub textures: &'a Textures,
    /// The triangles of each instance.
    pub placed: &'a [Range<u32>],
    /// The triangles of each copy.
    pub copies: &'a [Range<u32>],
}

/// All inputs of emitters.
#[derive(PartialEq)]
pub(super) struct EmitterInputs {
    geometry: ByPtr<Geometry>,
    textures: ByPtr<Textures>,
    environment: ByPtr<Environment>,
    lamps: DebugText,
    /// Materials that emit, by their numbers.
    shining: DebugText,
}

impl EmitterInputs {
    pub(super) fn new(
        geometry: &Arc<Geometry>,
        textures: &Arc<Textures>,
        environment: &Arc<Environment>,
        materials: &[MaterialRecord],
        lamps: &WorldLights,
    ) -> EmitterInputs {
        let shining: Vec<_> = materials.iter().enumerate().filter(|(_, material)| material.emits()).collect();
        EmitterInputs {
            geometry: ByPtr(geometry.clone()),
            textures: ByPtr(textures.clone()),
            environment: ByPtr(environment.clone()),
            lamps: debug_text(&lamps),
            shining: debug_text(&shining),
        }
    }
}

/// The compiled emitters.
#[derive(Clone)]
pub(super) struct CompiledEmitters {
    pub emitters: Arc<Emitters>,
    pub lights: Vec<WhittedLight>,
    /// The number of instances and copies left out because they would be too many emitters.
    pub left_out: usize,
}

pub(super) fn compile(
    surfaces: &EmittingSurfaces,
    lamps: &WorldLights,
    environment: &Environment,
) -> CompiledEmitters {
    let WorldLights { all: lamps, without_caustics, around_without_caustics, groups, around_group } = lamps;
    let mut out = Emitters::default();
    let (mut areas, mut lights) = (HashMap::new(), Vec::new());
    for (index, lamp) in lamps.iter().enumerate() {
        let mut light = WhittedLight { emitter: NONE, samples: 1, grid: None, pattern: Pattern::default() };
        if let Some(emitter) = finite(&mut out, lamp) {
            out.primitive[emitter as usize] = index as u32;
            light.emitter = emitter;
        }
        if let WorldLight::Area { samples, pattern, material, .. } = lamp {
            light = WhittedLight {
                samples: *samples,
                grid: Some(Grid::new(*samples)),
                pattern: *pattern,
                ..light
            };
            areas.extend(material.map(|material| (material, light.emitter)));
        }
        lights.push(light);
    }
    let mut room = MOST_PLACED;
    let mut left_out = in_the_world(&mut out, surfaces, &areas, &mut room);
    left_out += instances(&mut out, surfaces, room);
    for (index, lamp) in lamps.iter().enumerate() {
        if let WorldLight::Directional { to_light, irradiance, angle } = lamp {
            // A surface that faces the middle receives it at a mean cosine of (1 + cos) / 2.
            let cos = libm::cos(*angle as f64 / 2.0);
            let light = *irradiance * (2.0 / (1.0 + cos)) as f32;
            let row = DirectionalRow { to_light: *to_light, spread: (1.0 - cos) as f32, light };
            let flags = if row.spread > 0.0 { flag::UNSEEN } else { 0 };
            let emitter = push(&mut out, kind::DIRECTIONAL, flags, row.row());
            out.primitive[emitter as usize] = index as u32;
            lights[index].emitter = emitter;
        }
    }
    // An environment without a panorama is nearly uniform: BSDF sampling finds its light as well as light sampling.
    if environment.panorama.is_some() && !environment.is_black() {
        let row = AnyRow { light: Rgb::BLACK }.row();
        let flags = if *around_without_caustics { flag::WITHOUT_PHOTONS } else { 0 };
        let emitter = push(&mut out, kind::ENVIRONMENT, flag::VISIBLE | flags, row);
        out.group[emitter as usize] = *around_group;
    }
    for (emitter, group) in out.group.iter_mut().enumerate() {
        if let Some(material) = surfaces.materials.get(out.material[emitter] as usize) {
            *group = material.group;
        }
    }
    for ((light, without), group) in lights.iter().zip(without_caustics).zip(groups) {
        if light.emitter != NONE {
            out.flags[light.emitter as usize] |= if *without { flag::WITHOUT_PHOTONS } else { 0 };
            out.group[light.emitter as usize] = *group;
        }
    }
    let mut glows = EmissionAverages::new(surfaces);
    let bounds: Vec<LightBounds> =
        (0..out.len()).map(|emitter| bounds(&out, emitter, lamps, environment, &mut glows)).collect();
    out.tree = light_tree::build(&bounds);
    out.unseen = unseen(&out, &bounds);
    CompiledEmitters { emitters: Arc::new(out), lights, left_out }
}

/// The lamps that no surface shows.
fn unseen(out: &Emitters, bounds: &[LightBounds]) -> UnseenLamps {
    let all = (0..out.len() as u32).filter(|emitter| out.flags[*emitter as usize] & flag::UNSEEN != 0);
    let (distant, placed): (Vec<u32>, Vec<u32>) = all.partition(|emitter| bounds[*emitter as usize].far);
    let boxes: Vec<LightBounds> = placed.iter().map(|emitter| bounds[*emitter as usize]).collect();
    UnseenLamps { tree: light_tree::build(&boxes), placed, distant }
}

fn push(out: &mut Emitters, kind: u32, flags: u32, row: EmitterRow) -> u32 {
    out.kinds.push(kind);
    out.flags.push(flags);
    out.rows.push(row);
    out.material.push(NONE);
    out.profile.push(NONE);
    out.group.push(NONE);
    out.primitive.push(NONE);
    out.kinds.len() as u32 - 1
}

/// The emitter of a light at a finite place.
fn finite(out: &mut Emitters, lamp: &WorldLight) -> Option<u32> {
    let (kind, flags, mut row) = match lamp {
        WorldLight::Directional { .. } => return None,
        WorldLight::Point { place, intensity, falls, cone } => {
            let kind = if cone.is_some() { kind::SPOT } else { kind::POINT };
            let row = PointRow { position: *place, light: *intensity, falls: f32::from(*falls) };
            (kind, 0, row.row())
        }
        WorldLight::Ball { center, radius, radiance, cone } => {
            let flags = if cone.is_some() { flag::CONE } else { 0 };
            (
                kind::SPHERE,
                flags | flag::UNSEEN,
                SphereRow { center: *center, radius: *radius, light: *radiance }.row(),
            )
        }
        WorldLight::Photometric { place, intensity, scale, axes: [axis, across], .. } => {
            let (position, axis, across) = (*place, *axis, *across);
            let row = PhotometricRow { position, axis, across, scale: *scale, light: *intensity };
            (kind::PHOTOMETRIC, 0, row.row())
        }
        WorldLight::Area { corner, edges: [first, second], outline, radiance, material, .. } => {
            let visible = if material.is_some() { flag::VISIBLE } else { flag::UNSEEN };
            let flags = visible | if *outline == Outline::Disc { flag::ROUND } else { 0 };
            let row = PlanarRow { corner: *corner, e1: *first, e2: *second, light: *radiance };
            (kind::QUAD, flags, row.row())
        }
    };
    if let WorldLight::Point { cone: Some(cone), .. } | WorldLight::Ball { cone: Some(cone), .. } = lamp {
        let SpotCone { axis, cos_outer, scale, edge } = *cone;
        let smoothness = f32::from(u8::from(edge == ConeEdge::Smoothstep));
        ConeRow { axis, cos_outer, scale, smoothness }.write_to(&mut row);
    }
    let emitter = push(out, kind, flags, row);
    if let WorldLight::Photometric { profile, .. } = lamp {
        out.profile[emitter as usize] = profile.0;
    }
    Some(emitter)
}

/// The flags that a surface's material gives its emitter.
fn flags_of(material: &MaterialRecord) -> u32 {
    let textured = material.emission.texture != NONE;
    let covered = material.coverage != Coverage::Whole;
    let flags = [
        (true, flag::VISIBLE),
        (!material.one_sided_emission && !material.hides_back, flag::TWO_SIDED),
        (textured, flag::TEXTURED),
        (covered, flag::COVERED),
        (!material.caustics, flag::WITHOUT_PHOTONS),
    ];
    flags.into_iter().filter(|(set, _)| *set).fold(0, |all, (_, flag)| all | flag)
}

/// An emitter of one triangle or two.
#[derive(Clone, Copy)]
struct EmittingPrimitive {
    kind: u32,
    flags: u32,
    row: EmitterRow,
    material: u32,
    primitive: u32,
}

impl EmittingPrimitive {
    /// The emitter of a triangle with an emitting material, together with the next triangle before `end` if both make a
    /// parallelogram.
    fn new(
        surfaces: &EmittingSurfaces,
        index: usize,
        end: usize,
        material: u32,
    ) -> Option<EmittingPrimitive> {
        let EmittingSurfaces { geometry, materials, .. } = surfaces;
        let record = &materials[material as usize];
        let part = geometry.triangle_parts[index];
        let [a, b, c] = geometry.triangles[index].map(|v| Vec3::from_array(geometry.positions[v as usize]));
        let (e1, e2) = (b - a, c - a);
        if e1.cross(e2).length_squared() == 0.0 {
            return None;
        }
        let mut flags = flags_of(record);
        if geometry.parts.sign[part as usize] < 0.0 {
            flags |= flag::REVERSED;
        }
        let light = record.emission.factor.into();
        let even = flags & (flag::TEXTURED | flag::COVERED) == 0;
        let (kind, row) = if even
            && index + 1 < end
            && geometry.triangle_parts[index + 1] == part
            && let Some([corner, e1, e2]) = parallelogram(geometry, index, e1.cross(e2))
        {
            (kind::QUAD, PlanarRow { corner, e1, e2, light })
        } else {
            (kind::TRIANGLE, PlanarRow { corner: a, e1, e2, light })
        };
        Some(EmittingPrimitive { kind, flags, row: row.row(), material, primitive: index as u32 })
    }

    fn triangles(&self) -> usize {
        if self.kind == kind::QUAD { 2 } else { 1 }
    }

    /// The emitter in world space, as an instance places it.
    fn placed(&self, instance: &[f32; 24], sign: f32) -> EmittingPrimitive {
        let rows: [Vec3; 3] = std::array::from_fn(|i| Vec3::from_slice(&instance[4 * i..]));
        let offset = Vec3::new(instance[3], instance[7], instance[11]);
        let turn = |v: Vec3| Vec3::new(rows[0].dot(v), rows[1].dot(v), rows[2].dot(v));
        let PlanarRow { corner, e1, e2, light } = PlanarRow::of(&self.row);
        let row = PlanarRow { corner: turn(corner) + offset, e1: turn(e1), e2: turn(e2), light }.row();
        // A mirroring transform reverses the winding of its edges.
        EmittingPrimitive { row, flags: self.flags | if sign < 0.0 { flag::REVERSED } else { 0 }, ..*self }
    }

    fn push(&self, out: &mut Emitters) -> u32 {
        let emitter = push(out, self.kind, self.flags, self.row);
        out.material[emitter as usize] = self.material;
        out.primitive[emitter as usize] = self.primitive;
        emitter
    }
}

/// Adds triangles and spheres in world space whose material emits, and of copies as many as there is room for; returns
/// the number of copies left out.
fn in_the_world(
    out: &mut Emitters,
    surfaces: &EmittingSurfaces,
    areas: &HashMap<u32, u32>,
    room: &mut usize,
) -> usize {
    let EmittingSurfaces { geometry, materials, .. } = surfaces;
    let emits = |part: u32| {
        let material = geometry.parts.material[part as usize];
        materials.get(material as usize)?.emits().then_some(material)
    };
    if !(0..geometry.parts.material.len() as u32).any(|part| emits(part).is_some()) {
        return 0;
    }
    let triangles = geometry.world_triangles as usize;
    let spheres = geometry.world_spheres as usize;
    out.of_primitive = vec![NONE; triangles + spheres];
    let shining = |copy: &&Range<u32>| {
        (copy.start..copy.end).filter(|i| emits(geometry.triangle_parts[*i as usize]).is_some()).count()
    };
    let mut left_out: Vec<&Range<u32>> = Vec::new();
    for copy in surfaces.copies {
        match room.checked_sub(shining(&copy)) {
            Some(rest) => *room = rest,
            None => left_out.push(copy),
        }
    }
    let mut next = left_out.iter().copied().peekable();
    for index in 0..triangles {
        let Some(material) = emits(geometry.triangle_parts[index]) else { continue };
        while next.next_if(|copy| copy.end as usize <= index).is_some() {}
        if next.peek().is_some_and(|copy| copy.start as usize <= index) {
            continue;
        }
        if out.of_primitive[index] != NONE {
            continue;
        }
        if let Some(area) = areas.get(&material) {
            out.of_primitive[index] = *area;
        } else if let Some(lamp) = EmittingPrimitive::new(surfaces, index, triangles, material) {
            let emitter = lamp.push(out);
            out.of_primitive[index..index + lamp.triangles()].fill(emitter);
        }
    }
    for index in 0..spheres {
        let Some(material) = emits(geometry.sphere_parts[index]) else { continue };
        let record = &materials[material as usize];
        let [x, y, z, radius] = geometry.spheres[index];
        let light = record.emission.factor.into();
        let row = SphereRow { center: Vec3::new(x, y, z), radius, light }.row();
        let flags = flags_of(record);
        let primitive = index as u32 | crate::bvh::SPHERE;
        let emitter = EmittingPrimitive { kind: kind::SPHERE, flags, row, material, primitive }.push(out);
        out.of_primitive[triangles + index] = emitter;
    }
    left_out.len()
}

/// The emitters of a mesh with instances, in its own space.
#[derive(Default)]
struct MeshEmitters {
    lamps: Vec<EmittingPrimitive>,
    /// The emitter of each triangle: an index into `lamps`, or [`NONE`].
    of_triangle: Vec<u32>,
    /// The beginning of these in [`Emitters::of_primitive`], once added.
    begin: Option<usize>,
}

impl MeshEmitters {
    /// The emitters of a range of triangles. `given` is the material that replaces the triangles' own, or [`NONE`].
    fn new(surfaces: &EmittingSurfaces, range: Range<u32>, given: u32) -> MeshEmitters {
        let EmittingSurfaces { geometry, materials, .. } = surfaces;
        let (first, end) = (range.start as usize, range.end as usize);
        let mut shared = MeshEmitters { of_triangle: vec![NONE; end - first], ..MeshEmitters::default() };
        for index in first..end {
            let own = geometry.parts.material[geometry.triangle_parts[index] as usize];
            let material = if given == NONE { own } else { given };
            if shared.of_triangle[index - first] != NONE || !materials[material as usize].emits() {
                continue;
            }
            if let Some(lamp) = EmittingPrimitive::new(surfaces, index, end, material) {
                let place = index - first;
                shared.of_triangle[place..place + lamp.triangles()].fill(shared.lamps.len() as u32);
                shared.lamps.push(lamp);
            }
        }
        shared
    }
}

/// Adds the triangles of instances, at most `most` emitters; returns the number of instances left out. Only rays that
/// are not light samples find ellipsoids.
fn instances(out: &mut Emitters, surfaces: &EmittingSurfaces, most: usize) -> usize {
    let (mut meshes, mut room, mut left_out) = (HashMap::new(), most, 0);
    let count = surfaces.placed.len();
    for (instance, range) in surfaces.placed.iter().enumerate() {
        let given = surfaces.geometry.instance_materials[instance];
        let shared = meshes
            .entry((range.start, range.end, given))
            .or_insert_with(|| MeshEmitters::new(surfaces, range.clone(), given));
        if shared.lamps.is_empty() {
            continue;
        }
        if shared.lamps.len() > room {
            left_out += 1;
            continue;
        }
        room -= shared.lamps.len();
        let begin = *shared.begin.get_or_insert_with(|| {
            if out.of_primitive.is_empty() {
                let world = surfaces.geometry.world_triangles + surfaces.geometry.world_spheres;
                out.of_primitive.resize(world as usize, NONE);
            }
            out.of_primitive.extend_from_slice(&shared.of_triangle);
            out.of_primitive.len() - shared.of_triangle.len()
        });
        out.instance_places.resize(count, 0);
        out.instance_first.resize(count, NONE);
        out.instance_places[instance] = (begin as u32).wrapping_sub(range.start);
        out.instance_first[instance] = out.len() as u32;
        for lamp in &shared.lamps {
            lamp.placed(&surfaces.geometry.instances[instance], surfaces.geometry.instance_signs[instance])
                .push(out);
        }
    }
    left_out
}

#[cfg(test)]
mod tests {
    use super::super::shape_meshes::ShapeMeshes;
    use super::super::{copies, geometry, materials};
    use super::*;
    use crate::world::transforms;
    use crate::world::{self, BlinnPhong, ColorInput, Mesh, Shape, Transform, World};

    #[test]
    fn copies_become_emitters_while_there_is_room() {
        let mut world = World::default();
        let bright = BlinnPhong { emission: ColorInput::Constant(Rgb::WHITE), ..BlinnPhong::default() };
        let material = world.assets.add_material(None, world::Material::BlinnPhong(bright));
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 2, 3]];
        let mesh = world.assets.add_mesh(Mesh { positions, triangles, ..Mesh::default() });
        for _ in 0..3 {
            world.entities.spawn((Shape::Mesh(mesh), material, Transform::IDENTITY));
        }
        let order = world.in_order();
        let placed = transforms::to_world(&world, &order).expect("transforms");
        let (mut records, mut names) = materials::compile(&world.assets, world.settings.transport);
        let sheets =
            &mut materials::TwoSidedVariants::new(&mut records, &mut names, world.settings.transport);
        let shapes = ShapeMeshes::new(&world, &order, &placed, None, None).expect("meshes");
        let (open, copies) = (HashMap::new(), copies::Copies::default());
        let placed = geometry::PlacedWorld {
            world: &world,
            order: &order,
            transforms: &placed,
            copies: &copies,
            shapes: &shapes,
            groups: &super::super::light_groups::LightGroups::default(),
        };
        let inputs = geometry::GeometryInputs::new(&placed, Vec::new(), &open, sheets);
        let inputs = inputs.expect("shapes");
        let (compiled, _) = geometry::compile(&inputs, None).expect("triangles");
        let surfaces = EmittingSurfaces {
            geometry: &compiled.geometry,
            materials: &records,
            textures: &Textures::default(),
            placed: &compiled.placed,
            copies: &compiled.copies,
        };
        for (room, left_out) in [(12, 0), (11, 1), (4, 2), (3, 3)] {
            let (mut out, mut rest) = (Emitters::default(), room);
            assert_eq!(in_the_world(&mut out, &surfaces, &HashMap::new(), &mut rest), left_out);
            assert_eq!((out.len(), rest), (12 - 4 * left_out, room - out.len()));
            let lamps = out.of_primitive.iter().filter(|emitter| **emitter != NONE).count();
            assert_eq!(lamps, out.len());
        }
    }
}
