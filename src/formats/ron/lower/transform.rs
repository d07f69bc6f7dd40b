//! Reads `transform`. Everything is computed in f64, with the same bits on every platform (`libm`, square roots), and
//! rounded once.

use crate::error::LoadError;
use crate::formats::ron::source::{Raw, SceneText, VariantText};
use crate::math::{DAffine3, DMat3, DQuat, DVec3, Quat, Vec3};
use crate::world::{LookAtFault, Transform};

/// The largest difference of |q|² from 1 for which a quaternion is kept as it is. Rounding to f32 causes less, so saved
/// quaternions read back bit by bit.
const UNIT: f64 = 1e-6;
/// The largest difference of |q|² from 1 for which a quaternion, as typed by hand, is normalised.
const NEARLY_UNIT: f64 = 1e-2;
/// A matrix is singular if |determinant| over the product of the columns' lengths is below this.
const FLAT: f64 = 1e-8;

pub(super) fn transform<'a>(source: &SceneText<'a>, raw: Raw<'a>) -> Result<Transform, LoadError> {
    match source.variant(raw) {
        Some(variant) if variant.name == "LookAt" => look_at(source, variant),
        Some(variant) if variant.name == "Matrix" => matrix(source, variant),
        Some(variant) if variant.name == "OpenCv" => open_cv(source, variant),
        Some(VariantText { name: "Keys", .. }) => {
            let reason = "keys are for single values, as (translate: Keys([(0, (0, 0, 0)), (2, (1, 0, 0))]))";
            Err(source.error(raw.0, reason))
        }
        Some(VariantText { name, body: Some(_) }) => {
            Err(source.unknown(name, "transform", &["LookAt", "Matrix", "OpenCv", "(translate: …)"]))
        }
        _ if raw.0.starts_with('(') => translate_rotate_scale(source, raw),
        _ => Err(source.expected(raw, "a transform, as (translate: …), LookAt(…) or Matrix(…)")),
    }
}

fn translate_rotate_scale<'a>(source: &SceneText<'a>, raw: Raw<'a>) -> Result<Transform, LoadError> {
    let keys = ["translate", "rotate_degrees", "rotate_quaternion", "scale"];
    let [translate, degrees, quaternion, factors] = source.keys(raw, "a transform", 0, keys)?;
    let rotation = match (degrees, quaternion) {
        (None, None) => Quat::IDENTITY,
        (Some(degrees), None) => {
            let angles = source.keyed(degrees, |raw| {
                let [x, y, z] = source.tuple(raw, "(x, y, z)")?;
                Ok([source.number(x)?, source.number(y)?, source.number(z)?])
            });
            from_degrees(angles?)
        }
        (None, Some(quaternion)) => source.keyed(quaternion, |raw| unit_quaternion(source, raw))?,
        (Some(degrees), Some(_)) => {
            return Err(source.error(degrees.0, "give rotate_degrees or rotate_quaternion, not both"));
        }
    };
    Ok(Transform::Trs {
        translation: translate.map_or(Ok(DVec3::ZERO), |raw| source.point(raw))?,
        rotation,
        scale: factors.map_or(Ok(Vec3::ONE), |raw| scale(source, raw))?,
    })
}

fn scale<'a>(source: &SceneText<'a>, raw: Raw<'a>) -> Result<Vec3, LoadError> {
    let flat = "a scale of 0 makes things flat: it must have an inverse";
    let invertible = |factor: f32| factor.recip().is_finite();
    let factor = |raw: Raw<'a>| -> Result<f32, LoadError> {
        let factor = source.number(raw)?;
        if invertible(factor) { Ok(factor) } else { Err(source.error(raw.0, flat)) }
    };
    let scale = source.keyed(raw, |raw| {
        if !raw.0.starts_with('(') {
            return factor(raw).map(Vec3::splat);
        }
        let [x, y, z] = source.tuple(raw, "(x, y, z)")?;
        Ok(Vec3::new(factor(x)?, factor(y)?, factor(z)?))
    })?;
    // Interpolation between two keys of opposite sign can also give 0.
    if scale.to_array().into_iter().all(invertible) { Ok(scale) } else { Err(source.error(raw.0, flat)) }
}

/// The rotation by three angles in degrees, about the fixed X axis first, then Y, then Z.
pub fn from_degrees(degrees: [f64; 3]) -> Quat {
    let about = |axis: DVec3, degrees: f64| {
        let half = degrees.to_radians() / 2.0;
        let vector = axis * libm::sin(half);
        DQuat::from_xyzw(vector.x, vector.y, vector.z, libm::cos(half))
    };
    let [x, y, z] = degrees;
    (about(DVec3::Z, z) * about(DVec3::Y, y) * about(DVec3::X, x)).as_quat()
}

fn unit_quaternion<'a>(source: &SceneText<'a>, raw: Raw<'a>) -> Result<Quat, LoadError> {
    let [x, y, z, w] = source.tuple(raw, "(x, y, z, w)")?;
    let rotation =
        Quat::from_xyzw(source.number(x)?, source.number(y)?, source.number(z)?, source.number(w)?);
    let precise = rotation.as_dquat();
    let length_squared = precise.length_squared();
    if (length_squared - 1.0).abs() <= UNIT {
        Ok(rotation)
    } else if (length_squared - 1.0).abs() <= NEARLY_UNIT {
        Ok((precise / length_squared.sqrt()).as_quat())
    } else {
        let length = length_squared.sqrt();
        Err(source.error(raw.0, format!("a rotation is a quaternion of length 1, not {length:.4}")))
    }
}

fn look_at<'a>(source: &SceneText<'a>, variant: VariantText<'a>) -> Result<Transform, LoadError> {
    let [from, to, up] = source.variant_keys(variant, 2, ["from", "to", "up"])?;
    let place = to.map_or(variant.name, |raw| raw.0);
    let up_place = up.map_or(place, |raw| raw.0);
    let [from, to] = [from, to].map(|raw| raw.map_or(Ok(DVec3::ZERO), |raw| source.point(raw)));
    let (from, to, up) = (from?, to?, up.map(|raw| source.vec3(raw)).transpose()?);
    let looking = match (Transform::look_at(from, to, up.unwrap_or(Vec3::Y)), up) {
        // The view is straight down or up, and no `up` is given.
        (Err(LookAtFault::Parallel), None) => Transform::look_at(from, to, Vec3::NEG_Z),
        (looking, _) => looking,
    };
    looking.map_err(|fault| match fault {
        LookAtFault::SamePoint => {
            source.error(place, "LookAt needs two different points in \"from\" and \"to\"")
        }
        LookAtFault::NoUp => source.error(up_place, "\"up\" has no direction"),
        LookAtFault::Parallel => {
            source.error(up_place, "\"up\" is parallel to the direction of view: choose another")
        }
    })
}

fn matrix<'a>(source: &SceneText<'a>, variant: VariantText<'a>) -> Result<Transform, LoadError> {
    const FORM: &str = "Matrix(((a, b, c, d), (e, f, g, h), (i, j, k, l))), three rows of four";
    let body = Raw(variant.body.unwrap_or(variant.name));
    let [inner] = source.tuple(body, FORM)?;
    affine(source, inner, FORM).map(Transform::Matrix)
}

/// The pose of a camera as computer vision gives it: +X to the right, +Y down and +Z into the scene.
fn open_cv<'a>(source: &SceneText<'a>, variant: VariantText<'a>) -> Result<Transform, LoadError> {
    const FORM: &str = "((a, b, c, d), (e, f, g, h), (i, j, k, l)), three rows of four";
    let pose = match source.variant_keys(variant, 0, ["camera_to_world", "world_to_camera"])? {
        [Some(raw), None] => affine(source, raw, FORM)?,
        [None, Some(raw)] => affine(source, raw, FORM)?.inverse(),
        _ => {
            let reason = "OpenCv needs the field \"camera_to_world\" or \"world_to_camera\", one of both";
            return Err(source.error(variant.name, reason));
        }
    };
    let ours = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    Ok(Transform::Matrix(DAffine3::from_mat3_translation(pose.matrix3 * ours, pose.translation)))
}

/// Three rows of an affine matrix that has an inverse.
fn affine<'a>(source: &SceneText<'a>, inner: Raw<'a>, form: &str) -> Result<DAffine3, LoadError> {
    let mut rows = [[0.0_f64; 4]; 3];
    let raw_rows: [Raw; 3] = source.tuple(inner, form)?;
    for (row, raw) in rows.iter_mut().zip(raw_rows) {
        let numbers: [Raw; 4] = source.tuple(raw, "a row (a, b, c, d)")?;
        for (number, raw) in row.iter_mut().zip(numbers) {
            *number = source.number(raw)?;
        }
    }
    let column = |index: usize| DVec3::from_array(rows.map(|row| row[index]));
    let axes = DMat3::from_cols(column(0), column(1), column(2));
    if !is_invertible(axes) {
        return Err(source.error(inner.0, "the matrix has no inverse: it makes things flat"));
    }
    Ok(DAffine3::from_mat3_translation(axes, column(3)))
}

/// Tests if a matrix is invertible, and the inverse within the range of f32.
fn is_invertible(axes: DMat3) -> bool {
    let volume = axes.determinant().abs();
    let lengths = axes.x_axis.length() * axes.y_axis.length() * axes.z_axis.length();
    let in_range = |axis: DVec3| axis.to_array().iter().all(|c| c.abs() <= f64::from(f32::MAX));
    if volume == 0.0 || volume < FLAT * lengths {
        return false;
    }
    let inverse = axes.inverse();
    [inverse.x_axis, inverse.y_axis, inverse.z_axis].into_iter().all(in_range)
}
