//! Closed meshes that may not be meant as the file says.

use std::collections::HashMap;

use super::Import;
use crate::math::Vec3;
use crate::world::{AlphaMode, Material, MaterialId, Mesh, Principled};

/// Larger meshes are not tested for being closed, since all their edges would have to be kept in memory.
const MOST_LOOKED_AT: usize = 1 << 20;
/// Up to one open edge in this many is a crack that nobody sees. Sheets of up to `MOST_LOOKED_AT` triangles have more
/// open edges at their rims.
const EDGES_FOR_A_CRACK: usize = 1000;

impl Import<'_> {
    /// Whether a mesh, or the transparent part of it, is closed and of glass that has no inside. Only Blender's files
    /// are tested: they are like that unless their authors took pains. Other programs' files mean sheets.
    pub(super) fn is_hollow_body(&self, mesh: &Mesh) -> bool {
        if !self.document.is_of_blender() {
            return false;
        }
        let sheets = self.materials_of(mesh, |m| m.volume.is_none() && m.transmission.factor > 0.0);
        is_closed(mesh, &sheets)
    }

    /// Whether a mesh, or the part of it that can be seen from one side only, is closed and faces inwards: from
    /// outside one sees only the far inner sides.
    pub(super) fn is_inside_out(&self, mesh: &Mesh) -> bool {
        let one_sided = self.materials_of(mesh, |m| {
            !m.double_sided && m.volume.is_none() && m.alpha_mode == AlphaMode::Opaque && !m.unlit
        });
        can_be_looked_at(mesh, &one_sided)
            && six_volumes(mesh, &one_sided) < 0.0
            && is_closed(mesh, &one_sided)
    }

    /// The materials of a mesh for which `holds` is true.
    fn materials_of(&self, mesh: &Mesh, holds: impl Fn(&Principled) -> bool) -> Vec<MaterialId> {
        let mut ids = mesh.triangle_materials.clone();
        // Merges runs of one material first, so that little is left to sort.
        ids.dedup();
        ids.sort_unstable();
        ids.dedup();
        ids.retain(|id| match self.assets.materials.get(id.0 as usize).map(|named| &named.material) {
            Some(Material::Principled(material)) => holds(material),
            _ => false,
        });
        ids
    }
}

/// The corners of the triangles of some materials.
fn triangles_of(mesh: &Mesh, materials: &[MaterialId]) -> impl Iterator<Item = [Vec3; 3]> {
    let pairs = mesh.triangles.iter().zip(&mesh.triangle_materials);
    let those = pairs.filter(|(_, material)| materials.contains(material));
    those.map(|(triangle, _)| triangle.map(|vertex| mesh.positions[vertex as usize]))
}

fn can_be_looked_at(mesh: &Mesh, materials: &[MaterialId]) -> bool {
    !materials.is_empty() && mesh.triangles.len() <= MOST_LOOKED_AT
}

/// Six times the volume that triangles enclose, if they are closed: negative if they face inwards.
fn six_volumes(mesh: &Mesh, materials: &[MaterialId]) -> f64 {
    let middle = mesh.positions.first().copied().unwrap_or_default().as_dvec3();
    let volume = |[a, b, c]: [Vec3; 3]| {
        let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3() - middle);
        a.dot(b.cross(c))
    };
    triangles_of(mesh, materials).map(volume).sum()
}

/// Whether the triangles of some materials are closed, and few enough to be tested.
fn is_closed(mesh: &Mesh, materials: &[MaterialId]) -> bool {
    if !can_be_looked_at(mesh, materials) {
        return false;
    }
    // How often each edge is traversed in one direction, less how often in the other. Vertices are told apart by
    // position, whatever they are split for.
    let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    let place = |corner: Vec3| (corner + Vec3::ZERO).to_array().map(f32::to_bits);
    for corners in triangles_of(mesh, materials) {
        let [a, b, c] = corners.map(place);
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let (edge, sense) = if from < to { ([from, to], 1) } else { ([to, from], -1) };
            *edges.entry(edge).or_default() += sense;
        }
    }
    // A mesh that rounding has cut open here and there counts as closed.
    let open = edges.values().filter(|balance| **balance != 0).count();
    open <= edges.len() / EDGES_FOR_A_CRACK
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A torus of rings and sectors, whose triangles have vertices of their own.
    fn torus(rings: u32, sectors: u32) -> Mesh {
        let place = |ring: u32, sector: u32| {
            let turn = |i: u32, of: u32| std::f64::consts::TAU * f64::from(i % of) / f64::from(of);
            let (a, b) = (turn(ring, rings), turn(sector, sectors));
            let out = 2.0 + libm::cos(b);
            Vec3::new((out * libm::cos(a)) as f32, (out * libm::sin(a)) as f32, libm::sin(b) as f32)
        };
        let mut mesh = Mesh::default();
        for (i, j) in (0..rings).flat_map(|i| (0..sectors).map(move |j| (i, j))) {
            let [a, b, c, d] = [place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)];
            for corners in [[a, b, c], [a, c, d]] {
                let first = mesh.positions.len() as u32;
                mesh.positions.extend(corners);
                mesh.triangles.push([first, first + 1, first + 2]);
                mesh.triangle_materials.push(MaterialId(1));
            }
        }
        mesh
    }

    #[test]
    fn cracks_do_not_open_a_body_and_holes_do() {
        let material = [MaterialId(1)];
        let mut mesh = torus(80, 40);
        assert!(is_closed(&mesh, &material) && six_volumes(&mesh, &material) > 0.0);
        mesh.positions[600].x += 1e-5;
        assert!(is_closed(&mesh, &material), "a crack");
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        assert!(is_closed(&mesh, &material) && six_volumes(&mesh, &material) < 0.0);
        mesh.triangles.truncate(80 * 39 * 2);
        mesh.triangle_materials.truncate(80 * 39 * 2);
        assert!(!is_closed(&mesh, &material), "a hole");
        assert!(!is_closed(&torus(80, 40), &[]), "nothing");
    }
}
