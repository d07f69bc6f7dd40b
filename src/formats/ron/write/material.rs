//! Writes materials.

use super::Written;
use super::assets::AssetPaths;
use super::texture::WrittenTextures;
use crate::world::Material;
use crate::world::fields::Fields;

pub(super) fn material(material: &Material, paths: &AssetPaths) -> Written {
    let mut material = material.clone();
    let part: &mut dyn Fields = match &mut material {
        Material::BlinnPhong(material) => material,
        Material::Principled(material) => &mut **material,
    };
    Ok(WrittenTextures { paths }.structure(part)?.finish(part.what()))
}
