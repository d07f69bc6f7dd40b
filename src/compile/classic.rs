//! Physically based surfaces under the Whitted transport, where every light is a point and only mirrors show the
//! surroundings.
//!
//! With the base colour b, metalness m, roughness r and α = r²:
//!
//! - *diffuse* b · (1 − m + m α) / π. The second part is the metal's: the wider its lobe, the less it depends on
//!   direction, and at r = 1 it is all but Lambertian. In the lobe itself 1 − α of the metal is left.
//! - *shininess* s = 2/α² − 2, by which Blinn-Phong's distribution is as wide as Beckmann's and GGX's of that α.
//! - *specular* F₀ · (s + 2)/8π. A microfacet lobe is D F V with D = (s + 2)/2π · (n·h)ˢ and V = 1/4 for light and
//!   viewer near the normal. F₀ = 0.04 (1 − m) + b m (1 − α).
//! - *kr* b m (1 − r/0.3) for metals smoother than that: their lobe is a mirror image.
//! - Textures of metalness, roughness and transmission count by their means: the model has one exponent.
//! - *Transmission* t lets b t through and leaves 1 − t of the diffuse part. Only materials with a volume refract; a
//!   thin wall (an ior of 1) neither refracts nor reflects.
//! - *Unlit* surfaces reflect no light.

use std::f32::consts::PI;

use super::materials::color;
use crate::math::Rgb;
use crate::scene::material::{ColorParam, WhittedParams};
use crate::world::assets::Assets;
use crate::world::{ColorInput, Principled, ScalarInput};

/// The least roughness of a highlight, as if lights had a size: a perfect mirror would never reflect a point light.
const SMOOTHEST: f32 = 0.15;
/// The roughness from which metals are no mirrors.
const DULL: f32 = 0.3;
/// F₀ of dielectrics.
const DIELECTRIC: f32 = 0.04;

pub(super) fn from_principled(m: &Principled, assets: &Assets) -> WhittedParams {
    let black = ColorParam::constant([0.0; 3]);
    let plain = WhittedParams {
        diffuse: black,
        specular: black,
        shininess: 0.0,
        phong: false,
        kr: black,
        kt: [0.0; 3],
        ior: 0.0,
    };
    if m.unlit {
        return plain;
    }
    let mean = |input: ScalarInput| input.factor * channel_mean(input, assets);
    let (metallic, roughness) = (mean(m.metallic).clamp(0.0, 1.0), mean(m.roughness).clamp(0.0, 1.0));
    let through = mean(m.transmission).clamp(0.0, 1.0) * (1.0 - metallic);
    let alpha = roughness.max(SMOOTHEST) * roughness.max(SMOOTHEST);
    let shininess = (2.0 / (alpha * alpha) - 2.0).max(0.0);
    let peak = (shininess + 2.0) / (8.0 * PI);
    let mirror = metallic * (1.0 - alpha);
    // A texture takes one factor: surfaces that are mostly not metal get grey, mostly metallic ones their colour.
    let tint = if metallic > 0.5 { m.base_color } else { ColorInput::Constant(Rgb::WHITE) };
    let image = metallic * (1.0 - roughness / DULL).max(0.0);
    let weighed = |input: ColorInput, weight: f32| {
        let param = color(input);
        ColorParam { factor: param.factor.map(|c| c * weight), ..param }
    };
    let white = ColorInput::Constant(Rgb::WHITE);
    let glass = through > 0.0;
    WhittedParams {
        diffuse: weighed(m.base_color, ((1.0 - metallic) * (1.0 - through) + metallic * alpha) / PI),
        specular: weighed(tint, (mirror + DIELECTRIC * (1.0 - metallic)) * peak),
        shininess,
        kr: if glass { color(white) } else { weighed(m.base_color, image) },
        kt: match m.base_color {
            ColorInput::Constant(color) => color * through,
            ColorInput::Texture(_) => Rgb::splat(through),
        }
        .to_array(),
        ior: match (glass, m.volume) {
            (false, _) => 0.0,
            (true, Some(_)) if m.ior > 0.0 => m.ior,
            _ => 1.0,
        },
        ..plain
    }
}

/// The most texels that are read along each axis of an image.
const PROBES: u32 = 64;

/// The mean of a channel's stored values over its image; 1 if there is none, a half of a computed texture.
fn channel_mean(input: ScalarInput, assets: &Assets) -> f32 {
    let Some((texture, channel)) = input.texture else { return 1.0 };
    let Some(image) = assets.image_of(texture) else { return 0.5 };
    let place = channel.index() as usize;
    let (columns, rows) = (image.width.min(PROBES), image.height.min(PROBES));
    let mut sum = 0.0f64;
    for row in 0..rows as usize {
        for column in 0..columns as usize {
            let y = row * image.height as usize / rows as usize;
            let x = column * image.width as usize / columns as usize;
            let at = y * image.width as usize + x;
            sum += image.texels.stored(at)[place];
        }
    }
    (sum / f64::from(columns * rows)) as f32
}
