//! The vertices of a primitive: attributes, morph targets, skins.

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};

use super::accessor::{self, Rule};
use super::document::Document;
use super::draco::Decoded;
use super::mesh::Shaping;
use crate::error::LoadError;
use crate::math::{Rgb, Vec2, Vec3, Vec4};
use crate::world::Mesh;

const FRACTIONS: &[ComponentType] = &[ComponentType::F32, ComponentType::U8, ComponentType::U16];
/// Component types that KHR_mesh_quantization allows.
const QUANTIZED: &[ComponentType] =
    &[ComponentType::F32, ComponentType::I8, ComponentType::U8, ComponentType::I16, ComponentType::U16];
const SIGNED: &[ComponentType] = &[ComponentType::F32, ComponentType::I8, ComponentType::I16];
const POSITION: Rule = Rule { types: &[Type::Vec3], components: QUANTIZED, always_normalized: false };
const NORMAL: Rule = Rule { types: &[Type::Vec3], components: SIGNED, always_normalized: true };
const TANGENT: Rule = Rule { types: &[Type::Vec4], components: SIGNED, always_normalized: true };
const TEXCOORD: Rule = Rule { types: &[Type::Vec2], components: QUANTIZED, always_normalized: false };
const COLOR: Rule = Rule { types: &[Type::Vec3, Type::Vec4], components: FRACTIONS, always_normalized: true };
const JOINTS: Rule = Rule {
    types: &[Type::Vec4],
    components: &[ComponentType::U8, ComponentType::U16],
    always_normalized: false,
};
const WEIGHTS: Rule = Rule { types: &[Type::Vec4], components: FRACTIONS, always_normalized: true };
/// The largest number of sets of four joints per vertex.
const MOST_JOINT_SETS: u32 = 16;

/// The numbers of all accessors that the vertices are read from.
pub(super) fn accessors(primitive: &Primitive) -> Vec<Option<usize>> {
    let of = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|index| index.value());
    let mut numbers = vec![
        of(Semantic::Positions),
        of(Semantic::Normals),
        of(Semantic::Tangents),
        of(Semantic::TexCoords(0)),
        of(Semantic::TexCoords(1)),
        of(Semantic::Colors(0)),
    ];
    let sets = joint_sets(primitive).flat_map(|set| [Semantic::Joints(set), Semantic::Weights(set)]);
    numbers.extend(sets.map(of));
    for target in primitive.targets.iter().flatten() {
        let of = |index: Option<Index<Accessor>>| index.map(|index| index.value());
        numbers.extend([of(target.positions), of(target.normals), of(target.tangents)]);
    }
    numbers
}

fn joint_sets(primitive: &Primitive) -> impl Iterator<Item = u32> {
    let has = |set: &u32| primitive.attributes.contains_key(&Checked::Valid(Semantic::Joints(*set)));
    (0..MOST_JOINT_SETS).take_while(has)
}

/// Reads vertices and deforms them. Attributes in `decoded` are not read from accessors.
pub(super) fn read(
    document: &Document,
    primitive: &Primitive,
    decoded: Option<&Decoded>,
    shaping: Shaping,
    at: &str,
) -> Result<Mesh, LoadError> {
    let mut reader = VertexReader { document, primitive, decoded, at, count: 0 };
    let Some(positions) = reader.attribute::<3>(Semantic::Positions, "POSITION", &POSITION)? else {
        return Ok(Mesh::default());
    };
    reader.count = positions.len();
    let mut mesh = Mesh { positions: vectors(positions), ..Mesh::default() };
    if let Some(normals) = reader.attribute::<3>(Semantic::Normals, "NORMAL", &NORMAL)? {
        mesh.normals = vectors(normals);
        // A mesh without normals is flat-shaded, and tangents for other normals are useless.
        if let Some(tangents) = reader.attribute::<4>(Semantic::Tangents, "TANGENT", &TANGENT)? {
            mesh.tangents = tangents.into_iter().map(Vec4::from_array).collect();
        }
    }
    let pairs = |uvs: Vec<[f32; 2]>| uvs.into_iter().map(Vec2::from_array).collect();
    mesh.uvs =
        reader.attribute(Semantic::TexCoords(0), "TEXCOORD_0", &TEXCOORD)?.map_or_else(Vec::new, pairs);
    mesh.uvs1 =
        reader.attribute(Semantic::TexCoords(1), "TEXCOORD_1", &TEXCOORD)?.map_or_else(Vec::new, pairs);
    reader.colors(&mut mesh)?;
    reader.morph(&mut mesh, shaping)?;
    reader.bend(&mut mesh, shaping)?;
    mesh.tangents.iter_mut().zip(&mesh.normals).for_each(|(tangent, normal)| tidy(tangent, *normal));
    Ok(mesh)
}

fn vectors(numbers: Vec<[f32; 3]>) -> Vec<Vec3> {
    numbers.into_iter().map(Vec3::from_array).collect()
}

/// Normalises a tangent and its sign.
fn tidy(tangent: &mut Vec4, normal: Vec3) {
    let sign = if tangent.w < 0.0 { -1.0 } else { 1.0 };
    let direction = tangent.truncate().try_normalize();
    let direction = direction.unwrap_or_else(|| across(normal));
    *tangent = direction.extend(sign);
}

/// A unit vector orthogonal to `normal`, which may be 0.
pub(super) fn across(normal: Vec3) -> Vec3 {
    normal.try_normalize().map_or(Vec3::X, Vec3::any_orthonormal_vector)
}

struct VertexReader<'r> {
    document: &'r Document<'r>,
    primitive: &'r Primitive,
    decoded: Option<&'r Decoded>,
    at: &'r str,
    /// The number of vertices; 0 until it is known.
    count: usize,
}

impl VertexReader<'_> {
    fn attribute<const N: usize>(
        &self,
        semantic: Semantic,
        name: &str,
        rule: &Rule,
    ) -> Result<Option<Vec<[f32; N]>>, LoadError> {
        let Some(index) = self.primitive.attributes.get(&Checked::Valid(semantic)) else { return Ok(None) };
        let place = format!("{}/attributes/{name}", self.at);
        if let Some(column) = self.decoded.and_then(|decoded| decoded.columns.get(name)) {
            let document = self.document;
            let accessor = document.get(&document.root.accessors, *index, &place, "accessor")?;
            return Ok(Some(column.elements(accessor.normalized || rule.always_normalized)));
        }
        self.floats(*index, rule, &place).map(Some)
    }

    fn floats<const N: usize>(
        &self,
        index: Index<Accessor>,
        rule: &Rule,
        place: &str,
    ) -> Result<Vec<[f32; N]>, LoadError> {
        let numbers = accessor::floats::<N>(self.document, index, rule, place)?;
        let (length, count) = (numbers.len(), self.count);
        if count != 0 && length != count {
            let reason = format!("there are {length} of these for {count} positions");
            return Err(self.document.error(place, reason));
        }
        Ok(numbers)
    }

    /// Reads colours and, if they have a fourth component, alphas.
    fn colors(&self, mesh: &mut Mesh) -> Result<(), LoadError> {
        let Some(index) = self.primitive.attributes.get(&Checked::Valid(Semantic::Colors(0))) else {
            return Ok(());
        };
        let document = self.document;
        let place = format!("{}/attributes/COLOR_0", self.at);
        let accessor = document.get(&document.root.accessors, *index, &place, "accessor")?;
        let colors = self.attribute::<4>(Semantic::Colors(0), "COLOR_0", &COLOR)?.unwrap_or_default();
        if accessor.type_ == Checked::Valid(Type::Vec4) {
            mesh.alphas = colors.iter().map(|color| color[3].clamp(0.0, 1.0)).collect();
        }
        let color = |[r, g, b, _]: [f32; 4]| Rgb::new(r, g, b).map(|c| c.max(0.0));
        mesh.colors = colors.into_iter().map(color).collect();
        Ok(())
    }

    /// Adds the morph targets, scaled by their weights.
    fn morph(&self, mesh: &mut Mesh, shaping: Shaping) -> Result<(), LoadError> {
        let targets = self.primitive.targets.as_deref().unwrap_or_default();
        let weights = shaping.weights.unwrap_or_default();
        for (number, (target, weight)) in targets.iter().zip(weights).enumerate() {
            if *weight == 0.0 {
                continue;
            }
            let add = |index: Option<Index<Accessor>>, name: &str| {
                let place = format!("{}/targets/{number}/{name}", self.at);
                index.map(|index| self.floats::<3>(index, &POSITION_TARGET, &place)).transpose()
            };
            let moves = add(target.positions, "POSITION")?;
            displace(mesh.positions.iter_mut(), moves, *weight);
            let turns = add(target.normals, "NORMAL")?;
            displace(mesh.normals.iter_mut(), turns, *weight);
            if let Some(moves) = add(target.tangents, "TANGENT")? {
                for (tangent, by) in mesh.tangents.iter_mut().zip(moves) {
                    *tangent += (Vec3::from_array(by) * *weight).extend(0.0);
                }
            }
        }
        self.check(mesh)
    }

    /// Moves the vertices with their joints.
    fn bend(&self, mesh: &mut Mesh, shaping: Shaping) -> Result<(), LoadError> {
        let Some((_, joints)) = shaping.joints else { return Ok(()) };
        let mut sets = Vec::new();
        for set in joint_sets(self.primitive) {
            let numbers = self.attribute::<4>(Semantic::Joints(set), &format!("JOINTS_{set}"), &JOINTS)?;
            let weights = self.attribute::<4>(Semantic::Weights(set), &format!("WEIGHTS_{set}"), &WEIGHTS)?;
            sets.extend(numbers.zip(weights));
        }
        // A mesh without joint attributes stays where it is.
        if sets.is_empty() {
            return Ok(());
        }
        for vertex in 0..mesh.positions.len() {
            let influences = sets.iter().flat_map(|(numbers, weights)| {
                numbers[vertex].iter().map(|number| *number as usize).zip(weights[vertex])
            });
            let matrix = joints.blend(influences).map_err(|number| {
                let reason = format!("vertex {vertex} follows joint {number}, which the skin has not");
                self.document.error(format_args!("{}/attributes/JOINTS_0", self.at), reason)
            })?;
            mesh.positions[vertex] = matrix.point(mesh.positions[vertex]);
            if let Some(normal) = mesh.normals.get_mut(vertex) {
                *normal = matrix.normal(*normal);
            }
            if let Some(tangent) = mesh.tangents.get_mut(vertex) {
                *tangent = matrix.direction(tangent.truncate()).extend(tangent.w);
            }
        }
        self.check(mesh)
    }

    fn check(&self, mesh: &Mesh) -> Result<(), LoadError> {
        let finite = mesh.positions.iter().chain(&mesh.normals).all(|vector| vector.is_finite());
        match finite && mesh.tangents.iter().all(|tangent| tangent.is_finite()) {
            true => Ok(()),
            false => Err(self.document.error(self.at, "morph targets or joints move a vertex to infinity")),
        }
    }
}

/// The rule for displacements of positions, normals and tangents.
const POSITION_TARGET: Rule = Rule { types: &[Type::Vec3], components: QUANTIZED, always_normalized: false };

fn displace<'v>(vectors: impl Iterator<Item = &'v mut Vec3>, by: Option<Vec<[f32; 3]>>, weight: f32) {
    for (vector, by) in vectors.zip(by.into_iter().flatten()) {
        *vector += Vec3::from_array(by) * weight;
    }
}
