//! Writes materials.

use super::Written;
use super::assets::AssetPaths;
use super::texture::WrittenTextures;
use crate::world::Material;

pub(super) fn material(material: &Material, paths: &AssetPaths) -> Written {
    let mut material = material.clone();
    let part = material.part();
    Ok(WrittenTextures::new(paths).structure(part)?.finish(part.what()))
}
