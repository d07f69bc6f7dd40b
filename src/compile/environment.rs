//! Compiles the environment: light from infinitely far away.

use glam::{DMat3, DVec3};
use hecs::Entity;

use super::memo::{ByPtr, DebugText, debug_text};
use super::sky::{self, Air};
use crate::film::texels::linear_colors;
use crate::math::Rgb;
use crate::memory::{self, Shortage};
use crate::sampling::table::Distribution2d;
use crate::scene::Environment;
use crate::scene::environment::Panorama;
use crate::world::assets::Image;
use crate::world::transforms::WorldTransforms;
use crate::world::{Background, Light, World};

/// All inputs of the environment.
#[derive(PartialEq)]
pub(super) struct EnvironmentInputs {
    text: DebugText,
    background: Background,
    backdrop: Option<Background>,
    /// The first environment or sky light, its image and its matrix.
    light: Option<(Light, Option<ByPtr<Image>>, DMat3)>,
}

impl EnvironmentInputs {
    /// The first environment or sky light, and the background.
    pub(super) fn new(world: &World, order: &[Entity], transforms: &WorldTransforms) -> EnvironmentInputs {
        let around = |entity: &Entity| {
            let light = (*world.entities.get::<&Light>(*entity).ok()?).clone();
            let image = match &light {
                Light::Environment { image, .. } => *image,
                Light::Sky { .. } => None,
                _ => return None,
            };
            let image = image.map(|id| ByPtr(world.assets.images[id.0 as usize].clone()));
            Some((light, image, transforms[entity].matrix3))
        };
        let (background, light) = (world.settings.background, order.iter().find_map(around));
        let backdrop = world.settings.backdrop;
        let text =
            debug_text(&(&background, &backdrop, light.as_ref().map(|(light, _, matrix)| (light, matrix))));
        EnvironmentInputs { text, background, backdrop, light }
    }
}

pub(super) fn compile(inputs: &EnvironmentInputs) -> Result<Environment, Shortage> {
    let EnvironmentInputs { background, backdrop, light, .. } = inputs;
    let texels = light
        .iter()
        .filter_map(|(_, image, _)| image.as_ref())
        .map(|image| image.0.width as u64 * image.0.height as u64);
    let _claim = memory::reserve("the environment", 12 * texels.sum::<u64>())?;
    let panorama = light.as_ref().and_then(|(light, image, m)| {
        Some(match light {
            Light::Environment { radiance, .. } => {
                let image = &image.as_ref()?.0;
                panorama(
                    linear_colors(&image.texels).into_owned(),
                    [image.width, image.height],
                    *radiance,
                    *m,
                )
            }
            Light::Sky { elevation, azimuth, haze, radiance, .. } => {
                let texels = Air::new(*haze).panorama(f64::from(*elevation));
                let size = sky::SIZE.map(|side| side as u32);
                panorama(texels, size, *radiance, *m * DMat3::from_rotation_y(-f64::from(*azimuth)))
            }
            _ => return None,
        })
    });
    let background = match light {
        Some((Light::Environment { radiance, image: None }, ..)) => Background::Constant(*radiance),
        _ => *background,
    };
    Ok(Environment { background, panorama, backdrop: *backdrop })
}

/// A panorama turned by a rotation.
fn panorama(texels: Vec<[f32; 3]>, [width, height]: [u32; 2], factor: Rgb, rotation: DMat3) -> Panorama {
    // The columns of a rotation are the rows of its inverse.
    let axis = |v: DVec3| v.normalize_or_zero().as_vec3();
    let (table, irradiance) = importance(&texels, width as usize, height as usize);
    let to_local = [axis(rotation.x_axis), axis(rotation.y_axis), axis(rotation.z_axis)];
    Panorama { width, height, table, irradiance, texels, factor, to_local }
}

/// The most columns of the grid from which directions are sampled; it has half as many rows.
const FINEST: usize = 1024;

/// The sampling weights of directions: luminance times the sine of the polar angle. A node is a texel or, in a larger
/// image, the mean of several with their neighbours: lookups interpolate between texels, and nothing that emits may
/// have a probability of zero. Also returns an estimate of the irradiance.
fn importance(texels: &[[f32; 3]], width: usize, height: usize) -> (Distribution2d, f32) {
    let (columns, rows) = (width.min(FINEST), height.min(FINEST / 2));
    let luminance = |x: usize, y: usize| Rgb::from(texels[y * width + x]).luminance() as f64;
    let (beside, above) = (usize::from(columns < width), usize::from(rows < height));
    let mut weights = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        let (top, bottom) = (row * height / rows, ((row + 1) * height).div_ceil(rows));
        let angle = std::f64::consts::PI * (row as f64 + 0.5) / rows as f64;
        for column in 0..columns {
            let (left, right) = (column * width / columns, ((column + 1) * width).div_ceil(columns));
            let (mut sum, mut count) = (0.0, 0.0);
            for y in top.saturating_sub(above)..(bottom + above).min(height) {
                for x in left + width - beside..right + width + beside {
                    sum += luminance(x % width, y);
                    count += 1.0;
                }
            }
            weights.push((sum / count * libm::sin(angle)) as f32);
        }
    }
    less_their_mean(&mut weights, columns);
    let whole: f64 = weights.iter().map(|weight| f64::from(*weight)).sum();
    let per_cell = 2.0 * std::f64::consts::PI.powi(2) / (columns * rows) as f64;
    // The cosine takes half of the light from all around, less of light from one place.
    (Distribution2d::new(&weights, columns), (0.5 * whole * per_cell) as f32)
}

/// Subtracts the mean radiance from the weights: BSDF samples already find what is about as bright as everything else,
/// so light samples go to brighter places (Karlík and others, "MIS compensation", 2019). An environment of uniform
/// brightness keeps its weights.
fn less_their_mean(weights: &mut [f32], columns: usize) {
    let rows = weights.len() / columns;
    let sine = |at: usize| libm::sin(std::f64::consts::PI * ((at / columns) as f64 + 0.5) / rows as f64);
    let all: f64 = weights.iter().map(|weight| f64::from(*weight)).sum();
    let mean = all / (0..weights.len()).map(sine).sum::<f64>();
    let less = |at: usize, weight: f32| (f64::from(weight) - mean * sine(at)).max(0.0) as f32;
    let left: f64 = weights.iter().enumerate().map(|(at, weight)| f64::from(less(at, *weight))).sum();
    if left > 0.01 * all {
        weights.iter_mut().enumerate().for_each(|(at, weight)| *weight = less(at, *weight));
    }
}
