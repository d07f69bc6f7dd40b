//! Detection of closed meshes that are probably not meant as the file describes them.

use super::Import;
use crate::world::boundary::{MOST_TESTED, MeshEdges, six_volumes};
use crate::world::{AlphaMode, Material, MaterialId, Mesh, Principled};

impl Import<'_> {
    /// True if a mesh, or its transparent part, is closed and of glass without a volume. Only Blender's files are
    /// tested: they are like that unless their authors took pains. Files of other programs mean thin sheets.
    pub(super) fn is_hollow_body(&self, mesh: &Mesh) -> bool {
        if !self.document.is_of_blender() {
            return false;
        }
        let sheets = self.materials_of(mesh, |m| m.volume.is_none() && m.transmission.factor > 0.0);
        is_closed(mesh, &sheets)
    }

    /// True if a mesh, or its single-sided part, is closed and faces inwards: from outside, only the far inner sides
    /// are visible.
    pub(super) fn is_inside_out(&self, mesh: &Mesh) -> bool {
        let one_sided = self.materials_of(mesh, |m| {
            !m.double_sided && m.volume.is_none() && m.alpha_mode == AlphaMode::Opaque && !m.unlit
        });
        let from = mesh.positions.first().copied().unwrap_or_default();
        let corners = |[a, b, c]: [u32; 3]| [a, b, c].map(|vertex| mesh.positions[vertex as usize]);
        six_volumes(from, triangles_of(mesh, &one_sided).map(corners)) < 0.0 && is_closed(mesh, &one_sided)
    }

    /// The materials of a mesh for which `holds` is true.
    fn materials_of(&self, mesh: &Mesh, holds: impl Fn(&Principled) -> bool) -> Vec<MaterialId> {
        let mut ids = mesh.triangle_materials.clone();
        // Merges runs of one material first, so that few are left to sort.
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

/// The triangles whose material is one of `materials`.
fn triangles_of(mesh: &Mesh, materials: &[MaterialId]) -> impl Iterator<Item = [u32; 3]> {
    let pairs = mesh.triangles.iter().zip(&mesh.triangle_materials);
    pairs.filter(|(_, material)| materials.contains(material)).map(|(triangle, _)| *triangle)
}

/// True if the triangles of some materials form a closed surface, and the mesh is small enough to be tested.
fn is_closed(mesh: &Mesh, materials: &[MaterialId]) -> bool {
    let can_be_tested = !materials.is_empty() && mesh.triangles.len() <= MOST_TESTED;
    can_be_tested && MeshEdges::of(&mesh.positions, triangles_of(mesh, materials)).are_closed()
}
