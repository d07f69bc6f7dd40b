//! Writes `settings`.

use super::Written;
use super::assets::AssetPaths;
use super::texture::WrittenTextures;
use crate::world::{Assets, Settings, Transport};

/// The settings that differ from the defaults; `fitting` and `fitting_depth` are the transport and depth of a file that
/// names none.
pub(super) fn settings(settings: &Settings, fitting: Transport, fitting_depth: u32) -> Written {
    let (mut settings, assets) = (settings.clone(), Assets::default());
    let mut defaults = Settings { transport: fitting, max_depth: fitting_depth, ..Settings::default() };
    let paths = AssetPaths::numbers(&assets);
    let textures = WrittenTextures::new(&paths);
    Ok(textures.differences(&mut settings, &mut defaults)?.finish(""))
}
