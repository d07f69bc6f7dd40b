//! The hierarchy of nodes.

use gltf::json::{self, Index, Root};

use super::document::Document;
use super::{Import, Node};
use crate::error::LoadError;
use crate::math::{Aabb, DAffine3, DMat4, DQuat, DVec3, Mat4, Vec3};
use crate::world::{MeshId, Transform};

/// |determinant| over the product of the axes' lengths, below which a transform is flat.
const FLAT: f64 = 1e-8;

impl Import<'_> {
    /// The nodes of the default scene, each after its parent, and the box around their meshes.
    pub(super) fn nodes(&mut self) -> Result<(Vec<Node>, Aabb), LoadError> {
        let document = self.document;
        let all = &document.root.nodes;
        let parents = parents(document)?;
        let mut found: Vec<Node> = Vec::new();
        let mut bounds = Aabb::EMPTY;
        // A stack of our own: files may be deeper than the machine's.
        let roots = roots(document, &parents)?;
        let mut stack: Vec<_> =
            roots.into_iter().rev().map(|root| (root, None, DAffine3::IDENTITY)).collect();
        while let Some((number, parent, above)) = stack.pop() {
            let Some(source) = all.get(number) else { continue };
            let at = format!("/nodes/{number}");
            let (transform, local) = transform(document, source, &at)?;
            if is_flat(&local) {
                self.losses.flat_nodes += 1;
                continue;
            }
            let node = self.node(source, &at, parent, transform)?;
            let matrix = above * local;
            if let Some(id) = node.mesh {
                bounds = bounds.union(self.bounds_of(id, &matrix));
            }
            let place = found.len();
            found.push(node);
            let children = source.children.as_deref().unwrap_or_default();
            stack.extend(children.iter().rev().map(|child| (child.value(), Some(place), matrix)));
        }
        Ok((found, bounds))
    }

    fn node(
        &mut self,
        source: &json::Node,
        at: &str,
        parent: Option<usize>,
        transform: Transform,
    ) -> Result<Node, LoadError> {
        let camera = source.camera.map(|index| self.camera(index, &format!("{at}/camera"))).transpose()?;
        let light = self.light(source, at)?;
        let mesh = match source.mesh {
            Some(index) => self.mesh(index, &format!("{at}/mesh"))?,
            None => None,
        };
        self.losses.skins |= source.skin.is_some();
        let own = source.name.clone().filter(|name| !name.is_empty());
        let (camera, camera_name) = camera.unzip();
        let (light, light_name) = light.unzip();
        let name = own.or(camera_name.flatten()).or(light_name.flatten());
        Ok(Node { parent, name, transform, mesh, light, camera })
    }

    /// The box around a placed mesh's own box.
    fn bounds_of(&self, id: MeshId, matrix: &DAffine3) -> Aabb {
        let Some(mesh) = self.assets.meshes.get(id.0 as usize) else { return Aabb::EMPTY };
        let corners = mesh.triangles.as_flattened().iter();
        let own = Aabb::around(corners.filter_map(|vertex| mesh.positions.get(*vertex as usize)).copied());
        let corner = |index: u32| {
            let pick = |axis: usize| if index >> axis & 1 == 0 { own.min[axis] } else { own.max[axis] };
            matrix.transform_point3(Vec3::new(pick(0), pick(1), pick(2)).as_dvec3()).as_vec3()
        };
        Aabb::around((0..8).map(corner))
    }
}

/// Each node's parent. Errors: a child that is not there, has two parents, or is its own ancestor.
fn parents(document: &Document) -> Result<Vec<Option<usize>>, LoadError> {
    let nodes = &document.root.nodes;
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (number, node) in nodes.iter().enumerate() {
        for (place, child) in node.children.iter().flatten().enumerate() {
            let at = || format!("/nodes/{number}/children/{place}");
            document.get(nodes, *child, format_args!("{}", at()), "node")?;
            let child = child.value();
            if let Some(other) = parents[child] {
                return Err(document.error(at(), format!("node {child} already has the parent {other}")));
            }
            parents[child] = Some(number);
        }
    }
    // From every node upwards until an end or a node that was met before.
    let mut met_from = vec![usize::MAX; nodes.len()];
    for start in 0..nodes.len() {
        let mut at = Some(start);
        while let Some(node) = at.filter(|node| met_from[*node] != start) {
            if met_from[node] != usize::MAX {
                break;
            }
            met_from[node] = start;
            at = parents[node];
        }
        if at.is_some_and(|node| met_from[node] == start) {
            return Err(document.error(format!("/nodes/{start}"), "a node cannot be its own ancestor"));
        }
    }
    Ok(parents)
}

/// The nodes that the default scene begins with: those of the scene that the file names or
/// else of its first or, without any scene, all that have no parent.
fn roots(document: &Document, parents: &[Option<usize>]) -> Result<Vec<usize>, LoadError> {
    let Root { scene, scenes, nodes, .. } = &document.root;
    let index = match scene {
        Some(index) => *index,
        None if scenes.is_empty() => {
            return Ok((0..nodes.len()).filter(|node| parents[*node].is_none()).collect());
        }
        None => Index::new(0),
    };
    let scene = document.get(scenes, index, "/scene", "scene")?;
    let mut taken = vec![false; nodes.len()];
    for (place, root) in scene.nodes.iter().enumerate() {
        let at = format!("/scenes/{}/nodes/{place}", index.value());
        document.get(nodes, *root, &at, "node")?;
        let root = root.value();
        if let Some(parent) = parents[root] {
            return Err(document.error(at, format!("node {root} is a child of node {parent}, not a root")));
        }
        if std::mem::replace(&mut taken[root], true) {
            return Err(document.error(at, format!("node {root} is there twice")));
        }
    }
    Ok(scene.nodes.iter().map(|root| root.value()).collect())
}

/// A node's own transform, and the same as a matrix.
fn transform(document: &Document, node: &json::Node, at: &str) -> Result<(Transform, DAffine3), LoadError> {
    let too_large = |key: &str| document.error(format_args!("{at}/{key}"), "a number is too large");
    if let Some(columns) = node.matrix {
        let matrix = Mat4::from_cols_array(&columns);
        if !matrix.is_finite() {
            return Err(too_large("matrix"));
        }
        if matrix.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
            let reason = "the matrix is not affine: its last row must be 0 0 0 1";
            return Err(document.error(format_args!("{at}/matrix"), reason));
        }
        return Ok((Transform::Matrix(matrix), DAffine3::from_mat4(wide(&matrix))));
    }
    let translation = Vec3::from_array(node.translation.unwrap_or_default());
    let scale = Vec3::from_array(node.scale.unwrap_or([1.0; 3]));
    if !translation.is_finite() {
        return Err(too_large("translation"));
    }
    if !scale.is_finite() {
        return Err(too_large("scale"));
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or_default().0.map(f64::from));
    let length = rotation.length();
    if !(length > 1e-6 && length.is_finite()) {
        let reason = "a rotation is a quaternion of length 1";
        return Err(document.error(format_args!("{at}/rotation"), reason));
    }
    let rotation = (rotation / length).as_quat();
    let local = DAffine3::from_scale_rotation_translation(
        scale.as_dvec3(),
        rotation.as_dquat().normalize(),
        translation.as_dvec3(),
    );
    Ok((Transform::Trs { translation, rotation, scale }, local))
}

fn wide(matrix: &Mat4) -> DMat4 {
    DMat4::from_cols_array(&matrix.to_cols_array().map(f64::from))
}

/// Whether a transform leaves no volume: a scale of 0 is how files hide things.
fn is_flat(matrix: &DAffine3) -> bool {
    let axes = matrix.matrix3;
    let length = |axis: DVec3| axis.length();
    let lengths = length(axes.x_axis) * length(axes.y_axis) * length(axes.z_axis);
    let volume = axes.determinant().abs();
    volume == 0.0 || volume < FLAT * lengths
}
