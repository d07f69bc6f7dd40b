//! Bodies that touch: two coincident triangles, each the boundary of one body, become one boundary between both.
//! Otherwise a path that leaves one body through one of them would miss the other, which is not behind it.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use crate::scene::material::Coverage;
use crate::scene::{Geometry, MaterialRecord};

/// Material records to which variants are added, with their names and, for each added record, its original material.
pub(super) struct Records<'a> {
    pub materials: &'a mut Vec<MaterialRecord>,
    pub names: &'a mut Vec<String>,
    pub added: &'a mut Vec<u32>,
}

/// Merges triangles that coincide and face opposite ways: one of each pair stands for both. Meshes with instances are
/// left out.
pub(super) fn join(geometry: Arc<Geometry>, records: Records) -> Arc<Geometry> {
    let of_part = |part: u32| &records.materials[geometry.parts.material[part as usize] as usize];
    let is_boundary = |part: &u32| {
        let material = of_part(*part);
        material.body != 0 && material.coverage == Coverage::Whole && !material.emits() && !material.unlit
    };
    if (0..geometry.parts.material.len() as u32).filter(is_boundary).take(2).count() < 2 {
        return geometry;
    }
    let (mut alone, mut pairs) = (HashMap::new(), Vec::new());
    for triangle in 0..geometry.world_triangles {
        let part = geometry.triangle_parts[triangle as usize];
        if !is_boundary(&part) {
            continue;
        }
        let (place, faces) = place(&geometry, triangle, part);
        match alone.entry((place, !faces)) {
            Entry::Occupied(other) => pairs.push((other.remove(), triangle)),
            Entry::Vacant(_) => {
                alone.insert((place, faces), triangle);
            }
        }
    }
    if pairs.is_empty() {
        return geometry;
    }
    let mut joined =
        ContactRecords { geometry: Arc::unwrap_or_clone(geometry), records, parts: HashMap::new() };
    for (kept, other) in pairs {
        let number = joined.material(other).body;
        joined.change(kept, number);
        joined.change(other, HIDDEN);
    }
    Arc::new(joined.geometry)
}

/// In place of a body's number: the triangle is hidden.
const HIDDEN: u32 = u32::MAX;

/// A triangle's corners in an order that does not depend on the first one, and its winding.
fn place(geometry: &Geometry, triangle: u32, part: u32) -> ([[u32; 3]; 3], bool) {
    // Turns −0 into +0.
    let corner = |vertex: u32| geometry.positions[vertex as usize].map(|c| (c + 0.0).to_bits());
    let mut corners = geometry.triangles[triangle as usize].map(corner);
    let first = (0..3).min_by_key(|place| corners[*place]).unwrap_or(0);
    corners.rotate_left(first);
    let is_sorted = corners[1] <= corners[2];
    if !is_sorted {
        corners.swap(1, 2);
    }
    (corners, is_sorted != (geometry.parts.sign[part as usize] < 0.0))
}

/// A geometry in which some triangles get other materials.
struct ContactRecords<'a> {
    geometry: Geometry,
    records: Records<'a>,
    /// New parts, by the old part and the number of the body on its other side.
    parts: HashMap<(u32, u32), u32>,
}

impl ContactRecords<'_> {
    fn material(&self, triangle: u32) -> &MaterialRecord {
        let part = self.geometry.triangle_parts[triangle as usize];
        &self.records.materials[self.geometry.parts.material[part as usize] as usize]
    }

    /// Gives a triangle a material that borders on a body, or hides it.
    fn change(&mut self, triangle: u32, beside: u32) {
        let old = self.geometry.triangle_parts[triangle as usize];
        let material = *self.material(triangle);
        let Self { geometry, records, parts } = self;
        let new = *parts.entry((old, beside)).or_insert_with(|| {
            let part = geometry.part(old);
            let changed = if beside == HIDDEN {
                MaterialRecord { hidden: true, ..material }
            } else {
                MaterialRecord { beside, ..material }
            };
            records.materials.push(changed);
            records.names.push(records.names[part.material as usize].clone());
            // Sheets' records are variants of original ones, too.
            let own = records.names.len() - 1 - records.added.len();
            let first =
                (part.material as usize).checked_sub(own).map_or(part.material, |at| records.added[at]);
            records.added.push(first);
            geometry.add_part(crate::scene::Part { material: records.materials.len() as u32 - 1, ..part })
        });
        geometry.triangle_parts[triangle as usize] = new;
    }
}
