//! The transforms of nodes, as given by the file or by an animation.

use gltf::json;

use super::Import;
use super::container::Placement;
use super::document::Document;
use crate::error::LoadError;
use crate::math::{DAffine3, DMat4, DQuat, DVec3, Vec3};
use crate::world::Transform;

/// A transform is flat if |determinant| over the product of the axes' lengths is below this.
const FLAT: f64 = 1e-8;
/// The largest difference from 0 0 0 1 in the last row of a matrix that counts as rounding.
const MOST_ROUNDED: f64 = 1e-4;

/// The animated properties of a node, which replace its own.
#[derive(Clone, Debug, Default)]
pub(super) struct Moved {
    pub translation: Option<DVec3>,
    /// A quaternion of any length.
    pub rotation: Option<[f32; 4]>,
    pub scale: Option<Vec3>,
    /// Weights of the mesh's morph targets.
    pub weights: Option<Vec<f32>>,
}

impl Moved {
    fn is_moved(&self) -> bool {
        self.translation.is_some() || self.rotation.is_some() || self.scale.is_some()
    }
}

impl Import<'_> {
    /// A node's own transform, also as a matrix.
    pub(super) fn local(&self, number: usize) -> Result<(Transform, DAffine3), LoadError> {
        let Some(node) = self.document.root.nodes.get(number) else {
            return Ok((Transform::IDENTITY, DAffine3::IDENTITY));
        };
        transform(
            self.document,
            node,
            self.document.placements.get(number),
            self.moved.get(&number),
            &format!("/nodes/{number}"),
        )
    }

    /// The transform from a node's space to the scene's.
    pub(super) fn global(&mut self, number: usize) -> Result<DAffine3, LoadError> {
        // Walk up to a root or to a node whose transform is known, and down again.
        let (mut path, mut at) = (Vec::new(), Some(number));
        while let Some(node) = at.filter(|node| !self.globals.contains_key(node)) {
            path.push(node);
            at = self.parents.get(node).copied().flatten();
        }
        let mut above = at.and_then(|node| self.globals.get(&node)).copied().unwrap_or(DAffine3::IDENTITY);
        for node in path.into_iter().rev() {
            above *= self.local(node)?.1;
            self.globals.insert(node, above);
        }
        Ok(above)
    }
}

fn transform(
    document: &Document,
    node: &json::Node,
    precise: Option<&Placement>,
    moved: Option<&Moved>,
    at: &str,
) -> Result<(Transform, DAffine3), LoadError> {
    let too_large = |key: &str| document.error(format_args!("{at}/{key}"), "a number is too large");
    let moved = moved.cloned().unwrap_or_default();
    if let Some(columns) = node.matrix.filter(|_| !moved.is_moved()) {
        let columns = precise.and_then(|place| place.matrix).unwrap_or(columns.map(f64::from));
        let matrix = DMat4::from_cols_array(&columns);
        if !matrix.as_mat4().is_finite() {
            return Err(too_large("matrix"));
        }
        let Some(matrix) = affine(matrix) else {
            let reason = "the matrix is not affine: its last row must be 0 0 0 1";
            return Err(document.error(format_args!("{at}/matrix"), reason));
        };
        let matrix = DAffine3::from_mat4(matrix);
        return Ok((Transform::Matrix(matrix), matrix));
    }
    let translation = precise.and_then(|place| place.translation);
    let translation = translation.unwrap_or(node.translation.unwrap_or_default().map(f64::from));
    let translation = moved.translation.unwrap_or(DVec3::from_array(translation));
    let scale = moved.scale.unwrap_or(Vec3::from_array(node.scale.unwrap_or([1.0; 3])));
    if !translation.as_vec3().is_finite() {
        return Err(too_large("translation"));
    }
    if !scale.is_finite() {
        return Err(too_large("scale"));
    }
    let turned = moved.rotation.unwrap_or(node.rotation.unwrap_or_default().0);
    let turned = rotation(document, turned, &format!("{at}/rotation"));
    let rotation = (turned / turned.length()).as_quat();
    let local = DAffine3::from_scale_rotation_translation(
        scale.as_dvec3(),
        rotation.as_dquat().normalize(),
        translation,
    );
    Ok((Transform::Trs { translation, rotation, scale }, local))
}

/// A quaternion, of any length; the identity, which is recorded, if it has no direction.
pub(super) fn rotation(document: &Document, numbers: [f32; 4], at: &str) -> DQuat {
    let rotation = DQuat::from_array(numbers.map(f64::from));
    let length = rotation.length();
    if length > 1e-6 && length.is_finite() {
        return rotation;
    }
    document.mend(at, "a rotation is a quaternion of length 1: this one turns nothing");
    DQuat::IDENTITY
}

/// A matrix whose last row is 0 0 0 1 but for rounding errors, or but for its scale, with exactly this row.
fn affine(matrix: DMat4) -> Option<DMat4> {
    let [x, y, z, w] = matrix.row(3).to_array();
    if [x, y, z, w] == [0.0, 0.0, 0.0, 1.0] {
        return Some(matrix);
    }
    let largest = [x, y, z].into_iter().fold(0.0f64, |largest, number| largest.max(number.abs()));
    let is_rounded = w > 0.0 && largest <= MOST_ROUNDED * w;
    // A transform by homogeneous coordinates divides by w.
    let scale = if (w - 1.0).abs() <= MOST_ROUNDED { 1.0 } else { 1.0 / w };
    let columns =
        [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| (axis.truncate() * scale).extend(0.0));
    let [x_axis, y_axis, z_axis] = columns;
    let whole = DMat4::from_cols(x_axis, y_axis, z_axis, (matrix.w_axis.truncate() * scale).extend(1.0));
    (is_rounded && whole.as_mat4().is_finite()).then_some(whole)
}

/// True if a transform leaves no volume: files hide objects with a scale of 0.
pub(super) fn is_flat(matrix: &DAffine3) -> bool {
    let axes = matrix.matrix3;
    let length = |axis: DVec3| axis.length();
    let lengths = length(axes.x_axis) * length(axes.y_axis) * length(axes.z_axis);
    let volume = axes.determinant().abs();
    volume == 0.0 || volume < FLAT * lengths
}
