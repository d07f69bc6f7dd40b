//! Materials.

use super::Written;
use super::assets::AssetPaths;
use super::texture::WrittenTextures;
use crate::world::fields::Fields;
use crate::world::{Assets, Material};

pub(super) fn material(material: &Material, assets: &Assets, paths: &AssetPaths) -> Written {
    let textures = WrittenTextures { assets, paths };
    let mut material = material.clone();
    let part: &mut dyn Fields = match &mut material {
        Material::BlinnPhong(material) => material,
        Material::Principled(material) => &mut **material,
    };
    Ok(textures.structure(part)?.finish(part.what()))
}
