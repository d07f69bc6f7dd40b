//! `settings`.

use super::Written;
use super::assets::AssetPaths;
use super::texture::WrittenTextures;
use crate::world::{Assets, Settings, Transport};

/// `fitting` is the transport, and `fitting_depth` the depth, that a file gets if it does not name one.
pub(super) fn settings(settings: &Settings, fitting: Transport, fitting_depth: u32) -> Written {
    let (mut settings, assets) = (settings.clone(), Assets::default());
    let mut defaults = Settings { transport: fitting, max_depth: fitting_depth, ..Settings::default() };
    let textures = WrittenTextures { paths: &AssetPaths::numbers(&assets) };
    Ok(textures.differences(&mut settings, &mut defaults)?.finish(""))
}
