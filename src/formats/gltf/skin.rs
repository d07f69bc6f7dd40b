//! Skins: vertices that follow joints.

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::{self, Index};

use super::Import;
use super::accessor::{self, Rule};
use crate::error::LoadError;
use crate::math::{DMat4, DVec3, Vec3};

const MATRIX: Rule =
    Rule { types: &[Type::Mat4], components: &[ComponentType::F32], always_normalized: false };

/// The matrices of the joints, from the mesh's space to the scene's.
pub(super) struct Joints(Vec<DMat4>);

impl Import<'_> {
    /// The joints of a skin, with the current transforms of their nodes; none if there is no such skin.
    pub(super) fn joints(
        &mut self,
        index: Index<json::Skin>,
        place: &str,
    ) -> Result<Option<Joints>, LoadError> {
        let document = self.document;
        let consequence = "the mesh stands at its node";
        let skin = document.find(&document.root.skins, index, place, "skin", consequence);
        let Some(skin) = skin.filter(|skin| !skin.joints.is_empty()) else { return Ok(None) };
        let at = format!("/skins/{}", index.value());
        let inverses = match skin.inverse_bind_matrices {
            None => Vec::new(),
            Some(index) => {
                let at = format!("{at}/inverseBindMatrices");
                let matrices = accessor::finite_floats::<16>(document, index, &MATRIX, &at)?;
                let (joints, count) = (skin.joints.len(), matrices.len());
                if count < joints {
                    let reason = format!("there are {count} of these for {joints} joints");
                    return Err(document.error(at, reason));
                }
                matrices
            }
        };
        document.charge(skin.joints.len() as u64 * size_of::<DMat4>() as u64, &at)?;
        let mut joints = Vec::with_capacity(skin.joints.len());
        for (number, joint) in skin.joints.iter().enumerate() {
            let at = format!("{at}/joints/{number}");
            document.get(&document.root.nodes, *joint, &at, "node")?;
            let inverse = inverses.get(number).map(|matrix| matrix.map(f64::from));
            let inverse = inverse.map_or(DMat4::IDENTITY, |matrix| DMat4::from_cols_array(&matrix));
            joints.push(DMat4::from(self.global(joint.value())?) * inverse);
        }
        Ok(Some(Joints(joints)))
    }
}

impl Joints {
    /// Blends the joints' matrices by their weights; the error is the number of a joint that does not exist.
    pub(super) fn blend(&self, influences: impl Iterator<Item = (usize, f32)>) -> Result<Blend, usize> {
        let (mut sum, mut whole) = (DMat4::ZERO, 0.0);
        for (joint, weight) in influences.filter(|(_, weight)| *weight != 0.0) {
            let weight = f64::from(weight);
            sum += *self.0.get(joint).ok_or(joint)? * weight;
            whole += weight;
        }
        Ok(Blend(if whole > 0.0 { sum * (1.0 / whole) } else { DMat4::IDENTITY }))
    }
}

/// The transform of one vertex.
pub(super) struct Blend(DMat4);

impl Blend {
    pub(super) fn point(&self, point: Vec3) -> DVec3 {
        self.0.transform_point3(point.as_dvec3())
    }

    pub(super) fn direction(&self, direction: Vec3) -> Vec3 {
        self.0.transform_vector3(direction.as_dvec3()).as_vec3()
    }

    /// Transforms by the cofactor matrix: no division, and a flat transform still gives a normal.
    pub(super) fn normal(&self, normal: Vec3) -> Vec3 {
        let [x, y, z] = [self.0.x_axis, self.0.y_axis, self.0.z_axis].map(|axis| axis.truncate());
        let turned = |normal: DVec3| y.cross(z) * normal.x + z.cross(x) * normal.y + x.cross(y) * normal.z;
        let sign = if x.cross(y).dot(z) < 0.0 { -1.0 } else { 1.0 };
        (turned(normal.as_dvec3()).normalize_or_zero() * sign).as_vec3()
    }
}
