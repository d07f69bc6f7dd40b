//! Meshes: the primitives of one become one mesh of ours with a material for each triangle.

use std::collections::HashMap;

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{self, Accessor, Index};

use super::Import;
use super::accessor::{self, Rule};
use crate::error::LoadError;
use crate::math::{Rgb, Vec2, Vec3};
use crate::world::{Mesh, MeshId};

const FRACTIONS: &[ComponentType] = &[ComponentType::F32, ComponentType::U8, ComponentType::U16];
/// Integers as KHR_mesh_quantization has them.
const QUANTIZED: &[ComponentType] =
    &[ComponentType::F32, ComponentType::I8, ComponentType::U8, ComponentType::I16, ComponentType::U16];
const POSITION: Rule = Rule { types: &[Type::Vec3], components: QUANTIZED, always_normalized: false };
const NORMAL: Rule = Rule {
    types: &[Type::Vec3],
    components: &[ComponentType::F32, ComponentType::I8, ComponentType::I16],
    always_normalized: true,
};
const TEXCOORD: Rule = Rule { types: &[Type::Vec2], components: QUANTIZED, always_normalized: false };
const COLOR: Rule = Rule { types: &[Type::Vec3, Type::Vec4], components: FRACTIONS, always_normalized: true };

/// The accessors of a primitive's vertices, in the order of [`NAMES`].
type Attributes = [Option<Index<Accessor>>; 4];

/// What becomes of a file's mesh.
#[derive(Default)]
struct Merged {
    mesh: Mesh,
    /// The first vertex and the number of those that some accessors have given.
    known: HashMap<[Option<usize>; 4], (u32, usize)>,
}

impl Import<'_> {
    /// The mesh of a node; none if it has no triangles.
    pub(super) fn mesh(
        &mut self,
        index: Index<json::Mesh>,
        place: &str,
    ) -> Result<Option<MeshId>, LoadError> {
        if let Some(known) = self.meshes.get(&index.value()) {
            return Ok(*known);
        }
        let document = self.document;
        let source = document.get(&document.root.meshes, index, place, "mesh")?;
        let mut merged = Merged::default();
        for (number, primitive) in source.primitives.iter().enumerate() {
            self.primitive(
                primitive,
                &format!("/meshes/{}/primitives/{number}", index.value()),
                &mut merged,
            )?;
        }
        let mut mesh = merged.mesh;
        mesh.name = source.name.clone().unwrap_or_else(|| format!("mesh {}", index.value()));
        mesh.source = Some(document.path.to_owned());
        let id = (!mesh.triangles.is_empty()).then(|| self.assets.add_mesh(mesh));
        self.meshes.insert(index.value(), id);
        Ok(id)
    }

    fn primitive(&mut self, primitive: &Primitive, at: &str, merged: &mut Merged) -> Result<(), LoadError> {
        let document = self.document;
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            Checked::Valid(_) => {
                self.losses.points_and_lines += 1;
                return Ok(());
            }
            Checked::Invalid => return Err(document.error(format!("{at}/mode"), "there is no such mode")),
        };
        if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
            self.losses.morph_targets = true;
        }
        let material = self.material(primitive.material, &format!("{at}/material"))?;
        let of = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let Some(positions) = of(Semantic::Positions) else {
            // The specification leaves these to extensions.
            self.losses.points_and_lines += 1;
            return Ok(());
        };
        let set = material.set.unwrap_or(0);
        let uvs = of(Semantic::TexCoords(set));
        let attributes = [Some(positions), of(Semantic::Normals), uvs, of(Semantic::Colors(0))];
        let (first, count) = self.vertices(attributes, set, at, merged)?;
        let corners = match primitive.indices {
            Some(indices) => accessor::indices(document, indices, count, format_args!("{at}/indices"))?,
            None => {
                document.charge(count as u64 * 4, at)?;
                (0..count as u32).collect()
            }
        };
        if mode == Mode::Triangles && corners.len() % 3 != 0 {
            let count = corners.len();
            let lost = document.warning(format_args!("{at}: {count} vertices make no whole triangles"));
            self.warnings.push(lost);
        }
        document.charge(corners.len() as u64 * 16, at)?;
        let mesh = &mut merged.mesh;
        each_triangle(mode, &corners, |triangle| mesh.triangles.push(triangle.map(|corner| corner + first)));
        mesh.triangle_materials.resize(mesh.triangles.len(), material.id);
        Ok(())
    }

    /// Adds vertices, or finds them again; gives the first one's number and how many there are.
    fn vertices(
        &mut self,
        attributes: Attributes,
        set: u32,
        at: &str,
        merged: &mut Merged,
    ) -> Result<(u32, usize), LoadError> {
        let document = self.document;
        let key = attributes.map(|attribute| attribute.map(|index| index.value()));
        if let Some(known) = merged.known.get(&key) {
            return Ok(*known);
        }
        let [positions, normals, uvs, colors] = attributes;
        let place = |name: &str| format!("{at}/attributes/{name}");
        let Some(positions) = positions else { return Ok((0, 0)) };
        let positions = accessor::floats::<3>(document, positions, &POSITION, place("POSITION"))?;
        let count = positions.len();
        let same_count = |length: usize, place: &dyn Fn() -> String| {
            if length == count {
                return Ok(());
            }
            let reason = format!("there are {length} of these for {count} positions");
            Err(document.error(place(), reason))
        };
        let mesh = &mut merged.mesh;
        let first = mesh.positions.len();
        let Ok(base) = u32::try_from(first + count).map(|_| first as u32) else {
            return Err(document.error(at, "the mesh has more vertices than 32-bit indices can name"));
        };
        mesh.positions.extend(positions.into_iter().map(Vec3::from_array));
        if let Some(normals) = normals {
            let place = || place("NORMAL");
            let normals = accessor::floats::<3>(document, normals, &NORMAL, place())?;
            same_count(normals.len(), &place)?;
            mesh.normals.resize(first, Vec3::ZERO);
            mesh.normals.extend(normals.into_iter().map(Vec3::from_array));
        }
        if let Some(uvs) = uvs {
            let place = || place(&format!("TEXCOORD_{set}"));
            let uvs = accessor::floats::<2>(document, uvs, &TEXCOORD, place())?;
            same_count(uvs.len(), &place)?;
            mesh.uvs.resize(first, Vec2::ZERO);
            mesh.uvs.extend(uvs.into_iter().map(Vec2::from_array));
        }
        if let Some(colors) = colors {
            let place = || place("COLOR_0");
            let colors = accessor::floats::<3>(document, colors, &COLOR, place())?;
            same_count(colors.len(), &place)?;
            mesh.colors.resize(first, Rgb::WHITE);
            mesh.colors.extend(colors.into_iter().map(|color| Rgb::from(color).map(|c| c.max(0.0))));
        }
        fill(mesh);
        merged.known.insert(key, (base, count));
        Ok((base, count))
    }
}

/// Gives all vertices what some have: no normal (flat), the picture's corner, white.
fn fill(mesh: &mut Mesh) {
    let count = mesh.positions.len();
    if !mesh.normals.is_empty() {
        mesh.normals.resize(count, Vec3::ZERO);
    }
    if !mesh.uvs.is_empty() {
        mesh.uvs.resize(count, Vec2::ZERO);
    }
    if !mesh.colors.is_empty() {
        mesh.colors.resize(count, Rgb::WHITE);
    }
}

/// The triangles of a list, strip or fan (3.7.2.1), but for those without area.
fn each_triangle(mode: Mode, corners: &[u32], mut add: impl FnMut([u32; 3])) {
    let mut add = |a, b, c| {
        if a != b && b != c && c != a {
            add([a, b, c]);
        }
    };
    match mode {
        Mode::TriangleStrip => {
            for (number, corner) in corners.windows(3).enumerate() {
                let (second, third) = if number % 2 == 0 { (1, 2) } else { (2, 1) };
                add(corner[0], corner[second], corner[third]);
            }
        }
        Mode::TriangleFan => {
            for pair in corners.get(1..).unwrap_or_default().windows(2) {
                add(pair[0], pair[1], corners[0]);
            }
        }
        _ => corners.chunks_exact(3).for_each(|corner| add(corner[0], corner[1], corner[2])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        each_triangle(mode, corners, |triangle| triangles.push(triangle));
        triangles
    }

    #[test]
    fn strips_turn_every_other_triangle_and_fans_share_their_first_corner() {
        let five = [0, 1, 2, 3, 4];
        assert_eq!(triangles(Mode::TriangleStrip, &five), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(triangles(Mode::TriangleFan, &five), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
        assert_eq!(triangles(Mode::Triangles, &five), [[0, 1, 2]]);
        assert_eq!(triangles(Mode::TriangleStrip, &[0, 1, 2, 2, 3]), [[0, 1, 2]], "joints have no area");
        for mode in [Mode::Triangles, Mode::TriangleStrip, Mode::TriangleFan] {
            assert!((0..3).all(|length| triangles(mode, &five[..length]).is_empty()));
        }
    }
}
