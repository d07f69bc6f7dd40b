//! Meshes: the primitives of a glTF mesh become one mesh with a material per triangle.

use std::collections::HashMap;

use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};

use super::extensions::variants::Mappings;
use super::material::Lowered;
use super::skin::Joints;
use super::vertex::Vertices;
use super::{Import, accessor, draco, tangent, vertex};
use crate::error::LoadError;
use crate::math::{DVec3, Rgb, Vec2, Vec3, Vec4};
use crate::world::{MaterialId, Mesh, MeshId};

/// The deformation of a mesh by the node that instantiates it.
#[derive(Clone, Copy, Default)]
pub(super) struct Shaping<'s> {
    /// Weights of the morph targets; none for those of the mesh.
    pub weights: Option<&'s [f32]>,
    /// The node and its joints if it has a skin.
    pub joints: Option<(usize, &'s Joints)>,
    /// The point that vertices with joints are relative to; none until the mesh has some.
    pub origin: Option<DVec3>,
}

/// A mesh as placed by a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedMesh {
    pub id: MeshId,
    /// Overrides the mesh's own material.
    pub material: Option<MaterialId>,
}

/// A key that is equal for meshes of one primitive with the same triangles, whatever their material.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct ShapeKey {
    accessors: Vec<Option<usize>>,
    indices: Option<usize>,
    /// A [`Mode`].
    mode: u32,
    /// The set of texture coordinates that tangents follow.
    tangents: Option<u32>,
    /// The weights of the morph targets, as bits.
    weights: Option<Vec<u32>>,
    /// The node that has a skin.
    skinned: Option<usize>,
}

/// A key that is equal for glTF meshes that become the same mesh: the mesh's number, the weights' bits, the node with a
/// skin.
pub(super) type MeshKey = (usize, Option<Vec<u32>>, Option<usize>);

/// Maps accessor numbers to the first vertex and the number of vertices made from them.
type KnownVertices = HashMap<Vec<Option<usize>>, (u32, usize)>;

impl Import<'_> {
    /// Returns the mesh of a node; none if it has no triangles.
    pub(super) fn mesh(
        &mut self,
        index: Index<json::Mesh>,
        shaping: Shaping,
        place: &str,
    ) -> Result<Option<PlacedMesh>, LoadError> {
        let document = self.document;
        let source = document.get(&document.root.meshes, index, place, "mesh")?;
        let morphs = source.primitives.iter().any(|primitive| primitive.targets.is_some());
        // The mesh's own weights are not part of its key: thousands of nodes may share them.
        let weights = shaping.weights.filter(|_| morphs);
        let bits = weights.map(|weights| weights.iter().map(|weight| weight.to_bits()).collect());
        let key: MeshKey = (index.value(), bits, shaping.joints.map(|(node, _)| node));
        if let Some(known) = self.meshes.get(&key) {
            return Ok(*known);
        }
        let weights = weights.or(source.weights.as_deref());
        let shaping = Shaping { weights, ..shaping };
        let shape = self.shape_key(source, shaping, index.value())?;
        let known = shape.as_ref().and_then(|(key, material)| Some((*self.shapes.get(key)?, *material)));
        if let Some((id, material)) = known {
            // Exporters repeat a mesh for each of its materials, with the same accessors.
            let own = self.assets.meshes.get(id.0 as usize).and_then(|mesh| mesh.triangle_materials.first());
            let placed = PlacedMesh { id, material: (own != Some(&material)).then_some(material) };
            self.meshes.insert(key, Some(placed));
            return Ok(Some(placed));
        }
        let (mut mesh, mut known) = (Mesh::default(), KnownVertices::new());
        for (number, primitive) in source.primitives.iter().enumerate() {
            let shaping = Shaping { origin: (!mesh.positions.is_empty()).then_some(mesh.origin), ..shaping };
            let at = format!("/meshes/{}/primitives/{number}", index.value());
            self.primitive(primitive, shaping, &at, &mut mesh, &mut known)?;
        }
        if mesh.alphas.iter().all(|alpha| *alpha == 1.0) {
            mesh.alphas.clear();
        }
        // No triangle uses these.
        mesh.positions.iter_mut().filter(|p| !p.is_finite()).for_each(|position| *position = Vec3::ZERO);
        self.losses.hollow_bodies += usize::from(self.is_hollow_body(&mesh));
        self.losses.inside_out += usize::from(self.is_inside_out(&mesh));
        mesh.name = source.name.clone().unwrap_or_else(|| format!("mesh {}", index.value()));
        mesh.source = Some(document.path.to_owned());
        let id = (!mesh.triangles.is_empty()).then(|| self.assets.add_made_mesh(mesh));
        if let (Some((key, _)), Some(id)) = (shape, id) {
            self.shapes.insert(key, id);
        }
        let placed = id.map(|id| PlacedMesh { id, material: None });
        self.meshes.insert(key, placed);
        Ok(placed)
    }

    /// The key of a mesh's triangles, and its material; none if the triangles cannot be shared.
    fn shape_key(
        &mut self,
        mesh: &json::Mesh,
        shaping: Shaping,
        number: usize,
    ) -> Result<Option<(ShapeKey, MaterialId)>, LoadError> {
        let [primitive] = &mesh.primitives[..] else { return Ok(None) };
        let Checked::Valid(mode) = primitive.mode else { return Ok(None) };
        let others = primitive.extensions.as_ref().map(|extensions| &extensions.others);
        if others.is_some_and(|others| others.contains_key(draco::NAME)) {
            return Ok(None);
        }
        let material = self.material_of(primitive, &format!("/meshes/{number}/primitives/0"))?;
        let weights = shaping.weights.filter(|_| primitive.targets.is_some());
        let key = ShapeKey {
            accessors: vertex::accessors(primitive),
            indices: primitive.indices.map(|index| index.value()),
            mode: mode as u32,
            tangents: material.tangents,
            weights: weights.map(|weights| weights.iter().map(|weight| weight.to_bits()).collect()),
            skinned: shaping.joints.map(|(node, _)| node),
        };
        Ok(Some((key, material.id)))
    }

    fn primitive(
        &mut self,
        primitive: &Primitive,
        shaping: Shaping,
        at: &str,
        mesh: &mut Mesh,
        known: &mut KnownVertices,
    ) -> Result<(), LoadError> {
        let document = self.document;
        let Some(mode) = self.mode_of(primitive, at) else { return Ok(()) };
        let material = self.material_of(primitive, at)?;
        if !primitive.attributes.contains_key(&Checked::Valid(Semantic::Positions)) {
            // The specification leaves primitives without positions to extensions.
            self.losses.points_and_lines += 1;
            return Ok(());
        }
        let mut vertices = Vertices::default();
        let has_tangents = [Semantic::Normals, Semantic::Tangents]
            .iter()
            .all(|semantic| primitive.attributes.contains_key(&Checked::Valid(semantic.clone())));
        let mut generated = material.tangents.filter(|_| !has_tangents);
        let decoded = draco::decode(document, primitive, at)?;
        // Generated tangents split vertices, so these cannot be shared.
        let is_shared = generated.is_none() && decoded.is_none();
        let mut key = is_shared.then(|| vertex::accessors(primitive));
        let found = key.as_ref().and_then(|key| known.get(key)).copied();
        let count = match found {
            Some((_, count)) => count,
            None => {
                vertices = vertex::read(document, primitive, decoded.as_ref(), shaping, at)?;
                if !vertices.are_whole() {
                    // Other triangles of these vertices would give other normals.
                    key = None;
                }
                if vertices.mesh.tangents.is_empty() {
                    generated = material.tangents;
                }
                vertices.mesh.positions.len()
            }
        };
        let mode = if decoded.is_some() { Mode::Triangles } else { mode };
        let corners = match (decoded, primitive.indices) {
            (Some(decoded), _) => decoded.corners,
            (None, Some(indices)) => {
                accessor::indices(document, indices, count, format_args!("{at}/indices"))?
            }
            (None, None) => {
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
        each_triangle(mode, &corners, |triangle| vertices.mesh.triangles.push(triangle));
        let positions = match found {
            Some((first, _)) => &mesh.positions[first as usize..],
            None => &vertices.mesh.positions[..],
        };
        vertex::check_positions(document, positions, &vertices.mesh.triangles, at)?;
        vertices.mend(document, at);
        let mut part = vertices.mesh;
        if let Some(set) = generated {
            tangent::generate(document, &mut part, set, at, &self.assets.files, self.warnings)?;
        }
        let first = match found {
            Some((first, _)) => first,
            None => {
                mesh.origin = part.origin;
                let first = append(mesh, &mut part).ok_or_else(|| {
                    document.error(at, "the mesh has more vertices than 32-bit indices can name")
                })?;
                key.map(|key| known.insert(key, (first, count)));
                first
            }
        };
        let triangles = part.triangles.iter();
        mesh.triangles.extend(triangles.map(|triangle| triangle.map(|corner| corner + first)));
        mesh.triangle_materials.resize(mesh.triangles.len(), material.id);
        Ok(())
    }

    /// The arrangement of a primitive's triangles; none, which is recorded, if it has none.
    fn mode_of(&mut self, primitive: &Primitive, at: &str) -> Option<Mode> {
        match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => Some(mode),
            Checked::Valid(_) => {
                self.losses.points_and_lines += 1;
                None
            }
            Checked::Invalid => {
                let what = "there is no such mode: the primitive is left out";
                self.document.mend(format_args!("{at}/mode"), what);
                None
            }
        }
    }

    /// The material of a primitive in the requested variant.
    fn material_of(&mut self, primitive: &Primitive, at: &str) -> Result<Lowered, LoadError> {
        let index = self.material_index(primitive, at);
        self.material(index, &format!("{at}/material"))
    }

    /// The number of a primitive's material, which may depend on the requested variant.
    pub(super) fn material_index(&self, primitive: &Primitive, at: &str) -> Option<Index<json::Material>> {
        let mut index = primitive.material;
        if let Some(variant) = self.variant {
            let extensions = primitive.extensions.as_ref().map(|extensions| &extensions.others);
            let read: Option<Mappings> = self.document.extension(extensions, "KHR_materials_variants", at);
            let mappings = read.map_or_else(Vec::new, |read| read.mappings);
            let mapping = mappings.into_iter().find(|mapping| mapping.variants.contains(&variant));
            index = mapping.map(|mapping| Index::new(mapping.material)).or(index);
        }
        index
    }
}

/// Appends the vertices of `part` and empties it; returns the number of the first one. None if there are too many.
fn append(mesh: &mut Mesh, part: &mut Mesh) -> Option<u32> {
    /// If only one of the two has values, the other is filled with `filler`; if neither has, both stay empty.
    fn join<T: Clone>(to: &mut Vec<T>, before: usize, from: &mut Vec<T>, count: usize, filler: T) {
        if !(to.is_empty() && from.is_empty()) {
            to.resize(before, filler.clone());
            to.append(from);
            to.resize(before + count, filler);
        }
    }
    let (first, count) = (mesh.positions.len(), part.positions.len());
    u32::try_from(first + count).ok()?;
    mesh.positions.append(&mut part.positions);
    join(&mut mesh.normals, first, &mut part.normals, count, Vec3::ZERO);
    join(&mut mesh.uvs, first, &mut part.uvs, count, Vec2::ZERO);
    join(&mut mesh.uvs1, first, &mut part.uvs1, count, Vec2::ZERO);
    join(&mut mesh.tangents, first, &mut part.tangents, count, Vec4::new(1.0, 0.0, 0.0, 1.0));
    join(&mut mesh.colors, first, &mut part.colors, count, Rgb::WHITE);
    join(&mut mesh.alphas, first, &mut part.alphas, count, 1.0);
    Some(first as u32)
}

/// Calls `add` for the triangles of a list, strip or fan (3.7.2.1), except degenerate ones.
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
    fn strips_flip_every_other_triangle_and_fans_share_their_first_corner() {
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
