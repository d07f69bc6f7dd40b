//! Writes the components of an entity.

use super::Written;
use super::assets::AssetPaths;
use super::number::{Keys, same, tuple, uniform_or_tuple};
use super::texture::WrittenTextures;
use crate::math::{DAffine3, DVec3, Vec3};
use crate::world::fields::{Fields, Forms};
use crate::world::{Array, ArrayRow, Transform};

/// A transform; none for the identity, which need not be written.
pub(super) fn transform(transform: &Transform) -> Written<Option<String>> {
    match transform {
        Transform::Matrix(matrix) => affine(matrix).map(Some),
        Transform::Trs { translation, rotation, scale } => {
            let (translation, scale) = (translation.to_array(), scale.to_array());
            let rotation = rotation.to_array();
            let mut keys = Keys::default();
            keys.push_unless(same(&translation, &[0.0; 3]), "translate", || tuple(&translation))?;
            let is_default = same(&rotation, &[0.0, 0.0, 0.0, 1.0]);
            keys.push_unless(is_default, "rotate_quaternion", || tuple(&rotation))?;
            keys.push_unless(same(&scale, &[1.0; 3]), "scale", || uniform_or_tuple(&scale))?;
            let written = keys.finish("");
            Ok((written != "()").then_some(written))
        }
    }
}

pub(super) fn look_at(from: DVec3, to: DVec3, up: Vec3) -> Written {
    let mut keys = Keys::default();
    keys.push("from", tuple(&from.to_array())?);
    keys.push("to", tuple(&to.to_array())?);
    keys.push_unless(same(&up.to_array(), &Vec3::Y.to_array()), "up", || tuple(&up.to_array()))?;
    Ok(keys.finish("LookAt"))
}

fn affine(matrix: &DAffine3) -> Written {
    let columns = matrix.to_cols_array_2d();
    let row = |index: usize| tuple(&columns.map(|column| column[index]));
    Ok(format!("Matrix(({}, {}, {}))", row(0)?, row(1)?, row(2)?))
}

/// A shape, a light or a camera.
pub(super) fn form(form: &(impl Forms + Clone), paths: &AssetPaths) -> Written {
    WrittenTextures::new(paths).form(&mut form.clone())
}

/// A structure.
pub(super) fn part(part: &mut dyn Fields, paths: &AssetPaths) -> Written {
    Ok(WrittenTextures::new(paths).structure(part)?.finish(""))
}

/// The rows of an array.
pub(super) fn array(array: &Array) -> Written {
    let row = |row: &ArrayRow| {
        let step = transform(&row.step)?.unwrap_or_else(|| "()".to_owned());
        Ok(format!("(count: {}, step: {step})", row.count))
    };
    let rows: Vec<String> = array.0.iter().map(row).collect::<Written<_>>()?;
    Ok(match &rows[..] {
        [row] => row.clone(),
        rows => format!("[{}]", rows.join(", ")),
    })
}
