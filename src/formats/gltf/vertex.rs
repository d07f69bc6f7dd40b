//! The vertices of a primitive: attributes, morph targets, skins.

use std::cell::RefCell;

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};

use super::accessor::{self, Rule};
use super::document::Document;
use super::draco::Decoded;
use super::mesh::Shaping;
use crate::error::LoadError;
use crate::math::{DVec3, Rgb, Vec2, Vec3, Vec4};
use crate::world::normals::smooth_normals;
use crate::world::{Mesh, origin};

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

/// The vertices of a primitive. Positions need not be finite: some may not be used.
#[derive(Default)]
pub(super) struct Vertices {
    pub mesh: Mesh,
    /// The names of attributes with vertices at which they are not finite. Their normals are zero, and their tangents
    /// are still to be made; all others have a default.
    not_finite: Vec<(String, Vec<u32>)>,
    /// True if an attribute was left out.
    lacks: bool,
}

impl Vertices {
    /// True if all attributes are as the file has them.
    pub(super) fn are_whole(&self) -> bool {
        self.not_finite.is_empty() && !self.lacks
    }

    /// Reports what was not finite, if triangles use it, and makes normals from the triangles where they were not.
    pub(super) fn mend(&mut self, document: &Document, at: &str) {
        if self.not_finite.is_empty() {
            return;
        }
        let mut is_used = vec![false; self.mesh.positions.len()];
        self.mesh.triangles.as_flattened().iter().for_each(|vertex| is_used[*vertex as usize] = true);
        for (name, vertices) in &self.not_finite {
            let used = vertices.iter().filter(|vertex| is_used[**vertex as usize]);
            let (Some(first), count) = (used.clone().next(), used.count()) else { continue };
            let instead = match &name[..] {
                "NORMAL" => "made anew from the triangles around",
                "TANGENT" => "all tangents are made anew",
                "COLOR_0" => "white is taken",
                _ => "0 is taken",
            };
            let of = if name.starts_with("target") { "" } else { "attributes/" };
            let what = match count {
                1 => format!("that of vertex {first} is not finite: {instead}"),
                _ => format!("{count} of these are not finite, the first is of vertex {first}: {instead}"),
            };
            document.mend(format_args!("{at}/{of}{name}"), what);
            if name == "NORMAL" {
                let made = smooth_normals(&self.mesh.positions, self.mesh.triangles.iter().copied());
                vertices.iter().map(|vertex| *vertex as usize).for_each(|vertex| {
                    self.mesh.normals[vertex] = made[vertex];
                });
            }
        }
    }
}

/// Fails if a triangle uses a position that is not finite. `triangles` refer to `positions`.
pub(super) fn check_positions(
    document: &Document,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    at: &str,
) -> Result<(), LoadError> {
    let is_wrong = |vertex: &&u32| !positions[**vertex as usize].is_finite();
    match triangles.as_flattened().iter().find(is_wrong) {
        None => Ok(()),
        Some(vertex) => {
            let reason = format!("vertex {vertex} is not finite, and a triangle uses it");
            Err(document.error(format_args!("{at}/attributes/POSITION"), reason))
        }
    }
}

/// Reads vertices and deforms them. Attributes in `decoded` are not read from accessors.
pub(super) fn read(
    document: &Document,
    primitive: &Primitive,
    decoded: Option<&Decoded>,
    shaping: Shaping,
    at: &str,
) -> Result<Vertices, LoadError> {
    let made = RefCell::default();
    let mut reader = VertexReader { document, primitive, decoded, at, count: 0, made };
    let Some(positions) = reader.attribute::<3>(Semantic::Positions, "POSITION", &POSITION)? else {
        return Ok(Vertices::default());
    };
    reader.count = positions.len();
    let mut mesh = Mesh { positions: vectors(positions), ..Mesh::default() };
    if let Some(normals) = reader.optional::<3>(Semantic::Normals, "NORMAL", &NORMAL, [0.0; 3])? {
        mesh.normals = vectors(normals);
        // A mesh without normals is flat-shaded, and tangents for other normals are useless.
        let tangents = reader.optional::<4>(Semantic::Tangents, "TANGENT", &TANGENT, [0.0; 4])?;
        mesh.tangents = tangents.into_iter().flatten().map(Vec4::from_array).collect();
    }
    let pairs = |uvs: Vec<[f32; 2]>| uvs.into_iter().map(Vec2::from_array).collect();
    let uvs = |set: u32| {
        let read =
            reader.optional(Semantic::TexCoords(set), &format!("TEXCOORD_{set}"), &TEXCOORD, [0.0; 2])?;
        Ok(read.map_or_else(Vec::new, pairs))
    };
    (mesh.uvs, mesh.uvs1) = (uvs(0)?, uvs(1)?);
    reader.colors(&mut mesh)?;
    reader.morph(&mut mesh, shaping)?;
    reader.bend(&mut mesh, shaping)?;
    // Targets and joints can make vectors infinite.
    let finite = |vector: &Vec3| vector.is_finite();
    reader.replace(&mut mesh.normals, "NORMAL", finite, Vec3::ZERO);
    reader.replace(&mut mesh.tangents, "TANGENT", |tangent| tangent.is_finite(), Vec4::ZERO);
    let mut vertices = reader.made.into_inner();
    if vertices.not_finite.iter().any(|(name, _)| name == "TANGENT") {
        mesh.tangents.clear();
    }
    mesh.tangents.iter_mut().zip(&mesh.normals).for_each(|(tangent, normal)| tidy(tangent, *normal));
    vertices.mesh = mesh;
    Ok(vertices)
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
    /// Collects what is left out or replaced.
    made: RefCell<Vertices>,
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

    /// Reads an attribute that the image can do without: it is left out if it is not as expected, and elements that are
    /// not finite are replaced.
    fn optional<const N: usize>(
        &self,
        semantic: Semantic,
        name: &str,
        rule: &Rule,
        instead: [f32; N],
    ) -> Result<Option<Vec<[f32; N]>>, LoadError> {
        let Some(index) = self.primitive.attributes.get(&Checked::Valid(semantic.clone())) else {
            return Ok(None);
        };
        let is_decoded = self.decoded.is_some_and(|decoded| decoded.columns.contains_key(name));
        if !is_decoded && !self.is_fit(*index, rule, &format!("attributes/{name}")) {
            return Ok(None);
        }
        let mut read = self.attribute(semantic, name, rule)?;
        if let Some(elements) = &mut read {
            self.replace(elements, name, accessor::is_finite, instead);
        }
        Ok(read)
    }

    /// True if an accessor follows the rule and has an element for each vertex; otherwise it is left out.
    fn is_fit(&self, index: Index<Accessor>, rule: &Rule, name: &str) -> bool {
        let reason = match accessor::count_of(self.document, index, rule) {
            Ok(count) if count == self.count => return true,
            Ok(length) => format!("there are {length} of these for {} positions", self.count),
            Err(reason) => reason,
        };
        self.document.mend(format_args!("{}/{name}", self.at), format_args!("{reason}: it is left out"));
        self.made.borrow_mut().lacks = true;
        false
    }

    /// Replaces elements that are not finite, and remembers their vertices.
    fn replace<T: Clone>(&self, elements: &mut [T], name: &str, is_finite: impl Fn(&T) -> bool, instead: T) {
        if elements.iter().all(&is_finite) {
            return;
        }
        let mut vertices = Vec::new();
        for (vertex, element) in elements.iter_mut().enumerate().filter(|(_, element)| !is_finite(element)) {
            vertices.push(vertex as u32);
            *element = instead.clone();
        }
        let not_finite = &mut self.made.borrow_mut().not_finite;
        match not_finite.iter_mut().find(|(known, _)| known == name) {
            Some((_, known)) => known.extend(vertices),
            None => not_finite.push((name.to_owned(), vertices)),
        }
    }

    /// Reads colours and, if they have a fourth component, alphas.
    fn colors(&self, mesh: &mut Mesh) -> Result<(), LoadError> {
        let Some(index) = self.primitive.attributes.get(&Checked::Valid(Semantic::Colors(0))) else {
            return Ok(());
        };
        let colors = self.optional::<4>(Semantic::Colors(0), "COLOR_0", &COLOR, [1.0; 4])?;
        let Some(colors) = colors else { return Ok(()) };
        let kind = self.document.root.accessors.get(index.value()).map(|accessor| accessor.type_);
        if kind == Some(Checked::Valid(Type::Vec4)) {
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
            if !weight.is_finite() {
                let place = format_args!("{}/targets/{number}", self.at);
                self.document.mend(place, "its weight is not finite: it is left out");
            }
            if *weight == 0.0 || !weight.is_finite() {
                continue;
            }
            let moves = target.positions.map(|index| {
                let place = format!("{}/targets/{number}/POSITION", self.at);
                self.floats::<3>(index, &POSITION_TARGET, &place)
            });
            displace(mesh.positions.iter_mut(), moves.transpose()?, *weight);
            let turns = self.turns(target.normals, &format!("targets/{number}/NORMAL"))?;
            displace(mesh.normals.iter_mut(), turns, *weight);
            if let Some(moves) = self.turns(target.tangents, &format!("targets/{number}/TANGENT"))? {
                for (tangent, by) in mesh.tangents.iter_mut().zip(moves) {
                    *tangent += (Vec3::from_array(by) * *weight).extend(0.0);
                }
            }
        }
        Ok(())
    }

    /// Reads a target's changes of normals or tangents, which the image can do without.
    fn turns(&self, index: Option<Index<Accessor>>, name: &str) -> Result<Option<Vec<[f32; 3]>>, LoadError> {
        let Some(index) = index.filter(|index| self.is_fit(*index, &POSITION_TARGET, name)) else {
            return Ok(None);
        };
        let mut turns = self.floats::<3>(index, &POSITION_TARGET, &format!("{}/{name}", self.at))?;
        self.replace(&mut turns, name, accessor::is_finite, [0.0; 3]);
        Ok(Some(turns))
    }

    /// Moves the vertices with their joints.
    fn bend(&self, mesh: &mut Mesh, shaping: Shaping) -> Result<(), LoadError> {
        let Some((_, joints)) = shaping.joints else { return Ok(()) };
        let mut sets = Vec::new();
        for set in joint_sets(self.primitive) {
            let numbers = self.attribute::<4>(Semantic::Joints(set), &format!("JOINTS_{set}"), &JOINTS)?;
            let name = format!("WEIGHTS_{set}");
            let mut weights = self.attribute::<4>(Semantic::Weights(set), &name, &WEIGHTS)?;
            if let Some(weights) = &mut weights {
                self.replace(weights, &name, accessor::is_finite, [0.0; 4]);
            }
            sets.extend(numbers.zip(weights));
        }
        self.document.charge((mesh.positions.len() * size_of::<DVec3>()) as u64, self.at)?;
        let mut places = Vec::with_capacity(mesh.positions.len());
        for vertex in 0..mesh.positions.len() {
            // Vertices without joint attributes stay where they are.
            if sets.is_empty() {
                places.push(mesh.positions[vertex].as_dvec3());
                continue;
            }
            let influences = sets.iter().flat_map(|(numbers, weights)| {
                numbers[vertex].iter().map(|number| *number as usize).zip(weights[vertex])
            });
            let matrix = joints.blend(influences).map_err(|number| {
                let reason = format!("vertex {vertex} follows joint {number}, which the skin has not");
                self.document.error(format_args!("{}/attributes/JOINTS_0", self.at), reason)
            })?;
            places.push(matrix.point(mesh.positions[vertex]));
            if let Some(normal) = mesh.normals.get_mut(vertex) {
                *normal = matrix.normal(*normal);
            }
            if let Some(tangent) = mesh.tangents.get_mut(vertex) {
                *tangent = matrix.direction(tangent.truncate()).extend(tangent.w);
            }
        }
        mesh.origin = shaping.origin.unwrap_or_else(|| origin::split(&places).0);
        mesh.positions = places.into_iter().map(|place| (place - mesh.origin).as_vec3()).collect();
        Ok(())
    }
}

/// The rule for displacements of positions, normals and tangents.
const POSITION_TARGET: Rule = Rule { types: &[Type::Vec3], components: QUANTIZED, always_normalized: false };

fn displace<'v>(vectors: impl Iterator<Item = &'v mut Vec3>, by: Option<Vec<[f32; 3]>>, weight: f32) {
    for (vector, by) in vectors.zip(by.into_iter().flatten()) {
        *vector += Vec3::from_array(by) * weight;
    }
}
