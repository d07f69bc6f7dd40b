//! A layer as an image of its own, with its colour bar below: the colours of the page, without a page.

use std::sync::Arc;

use super::picture::{ColorBar, Display, Layer, PageImage, picture, session_of};
use super::scene::LiveScene;
use super::viewer::Snapshot;
use crate::render::{Options, Session};
use crate::study::experiment::plot;
use crate::world::Tonemap;

/// The height of the colour bar in pixels.
pub const BAR_ROWS: u32 = 28;

/// Renders a layer of a scene's whole image; returns the size of the image with its bar, and red, green and blue of its
/// pixels, row by row.
pub fn layer_image(scene: &LiveScene, layer: Layer) -> Result<([u32; 2], Vec<u8>), String> {
    let PageImage { size: [width, height], pixels, bar, .. } = finished(scene, layer);
    let mut colors: Vec<u8> = pixels.chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect();
    let Some(ColorBar { unit, low, high, colors: of_bar }) = bar else {
        return Ok(([width, height], colors));
    };
    let ends = [rounded(low), format!("{} {unit}", rounded(high))];
    colors.extend(plot::color_bar([width, BAR_ROWS], &of_bar, ends.each_ref().map(String::as_str))?);
    Ok(([width, height + BAR_ROWS], colors))
}

/// A layer as the page shows it once all samples are rendered. They are not, where it does not depend on them.
fn finished(scene: &LiveScene, layer: Layer) -> PageImage {
    let (setup, options, samples) = (scene.setup(), Options::default(), scene.settings().samples);
    let session = match layer {
        Layer::Light | Layer::Denoised | Layer::Noise | Layer::Samples => {
            let mut session = Session::of(setup.clone(), samples, options);
            session.advance(u32::MAX);
            session
        }
        _ => session_of(&setup, options, samples),
    };
    let shown = Snapshot::new(scene, setup, session.state().clone(), options, Arc::default());
    picture(&shown, layer, Display { exposure_ev: Some(0.0), tonemap: Tonemap::default() }, &[])
}

/// Formats a number with up to four digits that count.
fn rounded(value: f32) -> String {
    format!("{value:.3e}").parse::<f32>().unwrap_or(value).to_string()
}
