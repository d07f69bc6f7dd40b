//! Glass that does not bound a body: with holes, inside out, or sharing surfaces with other glass.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::probes::{ProbeTracer, directions};
use super::{Checked, finding};
use crate::bvh::Sidedness;
use crate::compile::thin_sheets;
use crate::error::{Diagnostic, words};
use crate::math::{Aabb, Vec3};
use crate::scene::material::Medium;
use crate::world::boundary::{JoinedSurfaces, MeshEdges, area, inside, is_crack, joined, six_volumes};
use crate::world::shapes::Fineness;
use crate::world::{MaterialId, Shape, transforms};

/// The most triangles of glass that are tested before rendering, and by a full check.
const MOST: [usize; 2] = [1 << 18, 1 << 20];
/// Bodies have a mean winding number above this, however many holes they have: see `compile/open_surfaces.rs`.
const BODY: f64 = 0.75;
/// The fraction of rays behind a sheet that must hit nothing within reach of light for the space behind it not to be a
/// body.
const LOST: f32 = 0.5;
/// The optical depth at which hardly any light is left.
const DARK: f32 = 5.0;
/// The number of points of a body that are tested for shared surfaces, and the fraction of them that must be shared.
const POINTS: usize = 256;
const SHARED: f32 = 0.01;
/// The largest distance between shared surfaces, relative to the size of the body.
const NEAR: f32 = 1e-5;

/// The surfaces of an entity that bound bodies, in world space, with front sides facing out.
struct Glass {
    entity: u32,
    triangles: Vec<[Vec3; 3]>,
    edges: usize,
    open: Vec<[Vec3; 2]>,
    bounds: Aabb,
    /// The distance after which hardly any light is left in any colour.
    reach: f32,
}

pub(super) fn check(checked: &Checked, all: bool, findings: &mut Vec<Diagnostic>) {
    let scene = checked.scene;
    if !scene.materials.iter().any(|material| material.encloses) {
        return;
    }
    let Some(glass) = glass(checked, MOST[usize::from(all)]) else { return };
    let rims: Vec<&[[Vec3; 2]]> = glass.iter().map(|one| &one.open[..]).collect();
    let groups = joined(&rims);
    let mut inwards = Vec::new();
    for JoinedSurfaces { members, rim, .. } in &groups {
        let members: Vec<&Glass> = members.iter().map(|member| &glass[*member]).collect();
        let edges: usize = members.iter().map(|member| member.edges).sum();
        let triangles: Vec<[Vec3; 3]> =
            members.iter().flat_map(|member| member.triangles.iter().copied()).collect();
        if !is_crack(rim.len(), edges) {
            findings.extend(holes(checked, &members, &triangles, rim.len(), edges));
        } else if is_inside_out(&members, &triangles, &glass) {
            inwards.push(members[0].entity);
        }
    }
    for entity in inwards {
        findings.push(finding(
            "inward-glass",
            Some(checked.subject(entity)),
            "its faces are wound inwards, so that its glass is all around it and not in it",
            "turn its triangles around: Recalculate Outside in Blender",
        ));
    }
    shared(checked, &glass, &groups, findings);
}

/// Returns all glass made of triangles, without thin sheets; none if it has more than `most` triangles.
fn glass(checked: &Checked, most: usize) -> Option<Vec<Glass>> {
    let Checked { world, scene, .. } = checked;
    let order = world.in_order();
    let mut transforms = transforms::to_world(world, &order).ok()?;
    transforms::relative_to(&mut transforms, scene.origin);
    let sheets = thin_sheets(world, &order, &transforms);
    let reach = |id: MaterialId| {
        let medium = scene.materials.get(id.0 as usize).map_or(Medium::CLEAR, |record| record.medium);
        DARK / medium.extinction.into_iter().fold(f32::INFINITY, f32::min)
    };
    let encloses = |id: &MaterialId| scene.materials.get(id.0 as usize).is_some_and(|record| record.encloses);
    let (mut all, mut left) = (Vec::new(), most);
    for entity in order.into_iter().filter(|entity| !sheets.contains(&entity.id())) {
        let Ok(shape) = world.entities.get::<&Shape>(entity) else { continue };
        let given = world.entities.get::<&MaterialId>(entity).ok().map(|id| *id);
        let id = given.unwrap_or(MaterialId::DEFAULT);
        let mut farthest = reach(id);
        let made = || shape.to_mesh(&world.assets, Fineness::DEFAULT)?.ok();
        let made = if encloses(&id) { made() } else { None };
        let mesh = match &*shape {
            Shape::Mesh(mesh) => Some(&**world.assets.meshes.get(mesh.0 as usize)?),
            _ => made.as_ref(),
        };
        let (positions, triangles): (Cow<[Vec3]>, Vec<[u32; 3]>) = match mesh {
            Some(mesh) => {
                let own = |at: usize| given.or(mesh.triangle_materials.get(at).copied()).unwrap_or(id);
                let all = mesh.triangle_materials.iter().filter(|own| given.is_none() && encloses(own));
                farthest = all.map(|own| reach(*own)).reduce(f32::max).unwrap_or(farthest);
                let those = mesh.triangles.iter().enumerate().filter(|(at, _)| encloses(&own(*at)));
                (Cow::Borrowed(&mesh.positions[..]), those.map(|(_, triangle)| *triangle).collect())
            }
            None => {
                let Some((_, corners)) = shape.flat_corners() else { continue };
                let triangles = Shape::fan(corners.len()).collect();
                (Cow::Owned(corners), triangles)
            }
        };
        if triangles.is_empty() || !(matches!(*shape, Shape::Mesh(_)) || encloses(&id)) {
            continue;
        }
        left = left.checked_sub(triangles.len())?;
        let matrix = &transforms::placement(world, &shape, &transforms[&entity]);
        let mirrored = matrix.matrix3.determinant() < 0.0;
        let place = |vertex: u32| transforms::point(matrix, positions[vertex as usize]);
        let edges = MeshEdges::of(&positions, triangles.iter().copied());
        let in_world = triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(place);
            if mirrored { [a, c, b] } else { [a, b, c] }
        });
        let triangles: Vec<[Vec3; 3]> = in_world.collect();
        all.push(Glass {
            entity: entity.id(),
            edges: edges.count,
            open: edges.open.iter().map(|edge| edge.map(|end| transforms::point(matrix, end))).collect(),
            bounds: Aabb::around(triangles.as_flattened().iter().copied()),
            triangles,
            reach: farthest,
        });
    }
    Some(all)
}

/// Returns the finding about glass with open edges.
fn holes(
    checked: &Checked,
    members: &[&Glass],
    triangles: &[[Vec3; 3]],
    open: usize,
    edges: usize,
) -> Option<Diagnostic> {
    let subject = checked.subject(members[0].entity);
    if inside(triangles) >= BODY {
        let what = format!(
            "it has holes: {open} of its {edges} edges belong to only one triangle, and light that leaves through them counts as still within its glass"
        );
        return Some(finding("open-glass", Some(subject), what, "close it: Fill Holes in Blender"));
    }
    let mut tracer = ProbeTracer::new(checked.scene);
    let (mut rays, mut lost) = (0, 0);
    let reach = members.iter().map(|member| member.reach).fold(0.0, f32::max);
    for (at, normal) in points(triangles) {
        for way in directions(8).filter(|way| way.dot(normal) < -0.3) {
            rays += 1;
            lost += u32::from(tracer.first(at, way, reach).is_none());
        }
    }
    // A water surface above its ground is open, too.
    (lost as f32 > LOST * rays as f32).then(|| {
        let what = format!(
            "it encloses nothing ({open} of its {edges} edges are open), so that all that lies behind it is within its glass"
        );
        let remedy = "close it; or make it a thin sheet: thickness_m: 0.01 in its volume, or no volume (or ior) at all";
        finding("open-glass", Some(subject), what, remedy)
    })
}

/// True if closed glass has its outside within.
fn is_inside_out(members: &[&Glass], triangles: &[[Vec3; 3]], all: &[Glass]) -> bool {
    let bounds = members.iter().fold(Aabb::EMPTY, |bounds, member| bounds.union(member.bounds));
    let size = f64::from(bounds.size().length());
    if six_volumes(bounds.center(), triangles.iter().copied()) >= -1e-6 * size.powi(3) {
        return false;
    }
    // The wall of a cavity in other glass faces inwards correctly.
    let holds =
        |other: &Glass| other.bounds.min.cmplt(bounds.min).all() && other.bounds.max.cmpgt(bounds.max).all();
    !all.iter().any(holds)
}

/// Finds glass that shares its surface with other glass.
fn shared(checked: &Checked, all: &[Glass], groups: &[JoinedSurfaces], findings: &mut Vec<Diagnostic>) {
    let group = |number: usize| groups.iter().position(|group| group.members.contains(&number));
    let number_of = |entity: u32| all.iter().position(|glass| glass.entity == entity);
    let mut told: Vec<[Option<usize>; 2]> = Vec::new();
    let near = |glass: &Glass| NEAR * glass.bounds.size().length();
    let touch = |a: &Glass, b: &Glass| {
        let near = near(a).max(near(b));
        a.entity != b.entity
            && (a.bounds.min - b.bounds.max).max_element().max((b.bounds.min - a.bounds.max).max_element())
                <= near
    };
    let touched = touched(all, all.iter().map(near).fold(0.0, f32::max), &touch);
    if !touched.contains(&true) {
        return;
    }
    // All surfaces call the any-hit filter, which skips the entity's own.
    let mut scene = checked.scene.clone();
    let placed = vec![None; scene.bvh.instances.len()];
    Arc::make_mut(&mut scene.bvh).set_sidedness(|_| Sidedness::Filtered, &placed);
    let mut tracer = ProbeTracer::new(&scene);
    for (number, glass) in all.iter().enumerate() {
        if !touched[number] {
            continue;
        }
        let near = near(glass);
        let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
        for (at, normal) in points(&glass.triangles) {
            if let Some(other) = tracer.body_at(at, normal, near, glass.entity) {
                *counts.entry(other).or_default() += 1;
            }
        }
        for (other, count) in counts {
            let pair = [Some(number), number_of(other)];
            let groups = pair.map(|one| one.and_then(group));
            let known = told.contains(&pair) || told.contains(&[pair[1], pair[0]]);
            let part = count as f32 / POINTS as f32;
            if part < SHARED || known || groups[0] == groups[1] {
                continue;
            }
            told.push(pair);
            let what = format!(
                "{:.0} % of its surface is also that of \"{}\": rounding decides which of both a ray meets first",
                100.0 * part,
                words(&checked.name(other))
            );
            let remedy = "let one reach a little into the other, or leave a gap";
            findings.push(finding("shared-glass", Some(checked.subject(glass.entity)), what, remedy));
        }
    }
}

/// Returns true for each glass that touches another; `near` bounds the distance of glass that touches.
fn touched(all: &[Glass], near: f32, touch: &dyn Fn(&Glass, &Glass) -> bool) -> Vec<bool> {
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|a, b| all[*a].bounds.min.x.total_cmp(&all[*b].bounds.min.x));
    let mut touched = vec![false; all.len()];
    for (at, one) in order.iter().enumerate() {
        let end = all[*one].bounds.max.x + near;
        for other in order[at + 1..].iter().take_while(|other| all[**other].bounds.min.x <= end) {
            if !(touched[*one] && touched[*other]) && touch(&all[*one], &all[*other]) {
                (touched[*one], touched[*other]) = (true, true);
            }
        }
    }
    touched
}

/// Returns points on triangles, evenly distributed by area, with their normals.
fn points(triangles: &[[Vec3; 3]]) -> Vec<(Vec3, Vec3)> {
    let step = triangles.iter().map(|triangle| area(*triangle)).sum::<f64>() / POINTS as f64;
    let (mut points, mut passed) = (Vec::with_capacity(POINTS), 0.0);
    for triangle in triangles {
        passed += area(*triangle);
        let [a, b, c] = *triangle;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        while points.len() < POINTS && passed > (points.len() as f64 + 0.5) * step {
            // Points of the R2 sequence (Roberts 2018) in the unit square, folded into the triangle.
            let [u, v] = [0.754_877_7, 0.569_840_3].map(|step| (0.5 + step * points.len() as f32).fract());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            points.push((a + (b - a) * u + (c - a) * v, normal));
        }
    }
    points
}
