//! Transforms as texts with one field for each part, so that statements can change a part.

use crate::formats::ron::lower::from_degrees;
use crate::formats::ron::scan;
use crate::formats::ron::tree::BracketTree;
use crate::math::{DMat3, DQuat, DVec3};
use crate::world::{Transform, transforms};

/// The fields of a transform in parts.
pub(super) const PARTS: [&str; 4] = ["translate", "rotate_degrees", "rotate_quaternion", "scale"];
/// The largest cosine between axes that count as perpendicular.
const SKEW: f64 = 1e-4;

/// Returns a transform's text in a form that has or may get the field `name`: parts in place of a `Matrix` or `LookAt`,
/// and angles in place of a quaternion. Other fields leave it as it is. Errors: a matrix that shears.
pub(super) fn in_parts(old: String, transform: &Transform, name: &str) -> Result<String, String> {
    if !PARTS.contains(&name) {
        return Ok(old);
    }
    let old = if old.starts_with('(') { old } else { parts(transform, name)? };
    if name != "rotate_degrees" {
        return Ok(old);
    }
    let tree = BracketTree::new(&old);
    let quaternion = tree
        .values(&old, &old)
        .find(|item| scan::key_and_value(item).is_some_and(|(key, _)| key == "rotate_quaternion"));
    let rotation = match transform {
        Transform::Trs { rotation, .. } => rotation.as_dquat(),
        Transform::Matrix(_) => DQuat::IDENTITY,
    };
    Ok(match quaternion.and_then(|item| Some((scan::offset_of(&old, item)?, item.trim_end().len()))) {
        Some((start, length)) if matches!(transform, Transform::Trs { .. }) => {
            let [x, y, z] = degrees(DMat3::from_quat(rotation));
            format!("{}rotate_degrees: ({x}, {y}, {z}){}", &old[..start], &old[start + length..])
        }
        _ => old,
    })
}

/// The translation in metres, the angles in degrees and the scale of a transform; none of one that shears. The angles
/// have no more digits than their rotation needs.
pub fn transform_parts(transform: &Transform) -> Option<[[f64; 3]; 3]> {
    let (translation, turn, scale) = match transform {
        Transform::Trs { translation, rotation, scale } => {
            (*translation, DMat3::from_quat(rotation.as_dquat()), scale.as_dvec3().to_array())
        }
        Transform::Matrix(_) => split(transform)?,
    };
    let exact = degrees(turn);
    let rotation = from_degrees(exact);
    let is_same = |angles: [f64; 3]| {
        let other = from_degrees(angles);
        other == rotation || -other == rotation
    };
    let rounded = |digits: i32| exact.map(|angle| (angle * 10f64.powi(digits)).round() / 10f64.powi(digits));
    let angles = (0..9).map(rounded).find(|angles| is_same(*angles)).unwrap_or(exact);
    // No negative zeros.
    Some([translation.to_array(), angles.map(|angle| angle + 0.0), scale])
}

/// The text of a transform in parts, with a quaternion only if it is the field `name`.
fn parts(transform: &Transform, name: &str) -> Result<String, String> {
    let shears = "its transform is a Matrix that shears: set all of it, as .transform = (…)";
    let (translation, turn, scale) = split(transform).ok_or(shears)?;
    let rotation = match name {
        "rotate_quaternion" => {
            let [x, y, z, w] = DQuat::from_mat3(&turn).normalize().to_array();
            format!("rotate_quaternion: ({x}, {y}, {z}, {w})")
        }
        _ => {
            let [x, y, z] = degrees(turn);
            format!("rotate_degrees: ({x}, {y}, {z})")
        }
    };
    let [a, b, c] = translation.to_array();
    let [x, y, z] = scale.map(|factor| factor as f32);
    Ok(format!("(translate: ({a}, {b}, {c}), {rotation}, scale: ({x}, {y}, {z}))"))
}

/// The translation, the rotation and the scale of a transform; none of one that shears.
fn split(transform: &Transform) -> Option<(DVec3, DMat3, [f64; 3])> {
    let matrix = transforms::to_matrix(transform);
    let axes = [matrix.matrix3.x_axis, matrix.matrix3.y_axis, matrix.matrix3.z_axis];
    let [mut x, y, z] = axes.map(|axis| axis.length());
    if matrix.matrix3.determinant() < 0.0 {
        x = -x;
    }
    let [i, j, k] = [axes[0] / x, axes[1] / y, axes[2] / z];
    if [i.dot(j), j.dot(k), k.dot(i)].into_iter().any(|cosine| cosine.is_nan() || cosine.abs() > SKEW) {
        return None;
    }
    Some((matrix.translation, DMat3::from_cols(i, j, k), [x, y, z]))
}

/// The angles in degrees about the fixed X axis first, then Y, then Z, of a rotation.
fn degrees(m: DMat3) -> [f64; 3] {
    let sine = (-m.x_axis.z).clamp(-1.0, 1.0);
    let turns = match sine.abs() > 1.0 - 1e-12 {
        // X and Z turn about one axis.
        true => [libm::atan2(-m.z_axis.y, m.y_axis.y), libm::asin(sine), 0.0],
        false => [libm::atan2(m.y_axis.z, m.z_axis.z), libm::asin(sine), libm::atan2(m.x_axis.y, m.x_axis.x)],
    };
    // Twelve digits are more than single precision needs.
    turns.map(|turn| (turn.to_degrees() * 1e9).round() / 1e9)
}
