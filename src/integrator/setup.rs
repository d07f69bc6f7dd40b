//! A scene and how it is to be rendered.

use std::sync::Arc;

use super::bounces::BounceLimits;
use super::photons::NoPhotons;
use super::reuse::ReuseGroups;
use crate::film::FilmScale;
use crate::sampling::filter::FilterTable;
use crate::sampling::pattern::Grid;
use crate::scene::bodies::Body;
use crate::scene::{CompiledScene, Material, Projection};
use crate::shading::principled::tables::LobeTables;
use crate::world::{Adaptive, Caustics, Pattern, Sampler, Settings, Transport};

/// See [`RenderSetup::splitting`]. With 8, noise × time of smooth light is that of 1 (a drink of 40 surfaces: 0.93; a room with
/// a ball of glass: 1.01), and that of bright spots in faint mirror images falls to a fifth; 16 costs a drink a tenth.
const SPLITTING: f32 = 8.0;

/// A scene and how it is to be rendered: plain settings, which transport reads.
#[derive(Clone)]
pub struct RenderSetup {
    /// The scene.
    pub scene: Arc<CompiledScene>,
    /// Width and height of the whole image in pixels.
    pub size: [u32; 2],
    /// The grid over which a pixel's samples are spread.
    pub samples: Grid,
    /// Where in a pixel samples go, before the filter.
    pub pattern: Pattern,
    /// What a pixel gathers.
    pub filter: FilterTable,
    /// Which random numbers.
    pub seed: u64,
    /// Bounces after the camera ray.
    pub max_depth: u32,
    /// Bounces of each kind, if there are limits within these (path transport).
    pub limits: Option<BounceLimits>,
    /// A branch ends when no component of its throughput is above this.
    pub min_throughput: f32,
    /// What happens to light at a vertex.
    pub transport: Transport,
    /// Which numbers the path transport draws.
    pub sampler: Sampler,
    /// The bounce at which its Russian roulette begins.
    pub roulette_depth: Option<u32>,
    /// What a path may add after its first bounce.
    pub clamp: Option<f32>,
    /// How paths are shared, if they are.
    pub sharing: Option<ReuseGroups>,
    /// Whether samples go where they lessen the error most.
    pub adaptive: Adaptive,
    /// Photons for each pixel in each sample, and the first radius in widths of a pixel, if there may be any.
    pub photons: Result<(f32, f32), NoPhotons>,
    /// True if photons are left out where they would only make single dots, and their number is chosen.
    pub chooses_photons: bool,
    /// True if rays go the way that light goes, and not from the camera to the light.
    pub follows_light: bool,
    /// About how many paths may come of one at smooth glass (path transport).
    pub splitting: f32,
    /// Albedos of the lobes that its materials have under the path transport.
    pub lobes: LobeTables,
    /// The unit in which radiance is counted.
    pub unit: FilmScale,
    /// The bodies that the camera is in ([`crate::scene::Bodies`]).
    pub around: u32,
    /// n² of the one that fills its place, under the path transport: see [`crate::scene::Material::index_square`].
    pub around_square: f32,
}

impl RenderSetup {
    /// The same in a small image, whose longer side has at most so many pixels: for a first look.
    pub fn small(&self, longer_side: u32) -> Self {
        let [width, height] = self.size;
        let by = width.max(height).div_ceil(longer_side).max(1);
        let size = [width.div_ceil(by), height.div_ceil(by)];
        Self { size, sharing: None, adaptive: Adaptive::Off, ..self.clone() }
    }

    /// A scene with the settings to render it by, and the bodies that its camera is in.
    pub fn new(scene: Arc<CompiledScene>, settings: &Settings, around: u32) -> Self {
        let lobes = match settings.transport {
            Transport::Whitted => LobeTables::NONE,
            Transport::Path => LobeTables::of(&scene.materials),
        };
        let size = settings.size.map(|side| side.clamp(1, Settings::MOST_PIXELS_A_SIDE));
        // Ways through a body take from what is lent.
        let acts = |body: &Body| scene.materials[body.material as usize].has_active_medium();
        let sharing =
            ReuseGroups::of(&scene.materials, settings).filter(|_| !scene.bodies.all(around).any(acts));
        let around_square = match settings.transport {
            Transport::Whitted => 1.0,
            Transport::Path => index_square(&scene, around),
        };
        let photons = photons(&scene, settings);
        // A camera in a body sees more light than there is outside.
        let (brightest, usual) = scene.levels();
        let unit = FilmScale::new(brightest * around_square.max(1.0), usual * around_square.max(1.0));
        Self {
            scene,
            size,
            samples: Grid::new(settings.samples),
            pattern: settings.pixel_pattern,
            filter: FilterTable::new(settings.filter),
            seed: settings.seed,
            max_depth: settings.max_depth,
            limits: BounceLimits::new(settings.depth_limits, settings.max_depth),
            min_throughput: settings.min_throughput,
            transport: settings.transport,
            sampler: settings.sampler,
            roulette_depth: settings.roulette_depth,
            clamp: settings.clamp,
            sharing,
            adaptive: settings.adaptive,
            unit,
            chooses_photons: settings.caustics == Caustics::Auto,
            photons,
            follows_light: false,
            splitting: SPLITTING,
            lobes,
            around_square,
            around,
        }
    }

    /// n² of the body that fills the camera's place.
    pub fn index_square_around(&self) -> f32 {
        index_square(&self.scene, self.around)
    }

    /// True if there is glass at which a path may go on in two directions.
    pub fn may_fork(&self) -> bool {
        self.splitting > 1.0 && self.scene.materials.iter().any(|material| !material.transmission.is_zero())
    }

    /// Whether rendered samples stay valid if more are to follow; if not, why.
    pub fn extensible(&self) -> Result<(), String> {
        let grid = |what: &str| {
            Err(format!(
                "{what} spread all samples over a grid, so that those of a longer rendering are other ones"
            ))
        };
        if self.adaptive != Adaptive::Off {
            return Err("adaptive samples are given by how many there are on average".into());
        }
        if self.transport == Transport::Path {
            return match self.sampler {
                Sampler::Jittered => grid("jittered samplers"),
                Sampler::Sobol | Sampler::Independent => Ok(()),
            };
        }
        let lens = match self.scene.camera.projection {
            Projection::ThinLens { pattern, .. } => Some(pattern),
            Projection::Pinhole { .. } | Projection::Orthographic { .. } => None,
        };
        let is_grid = |pattern: Pattern| matches!(pattern, Pattern::Jittered | Pattern::Regular);
        let lights = self.scene.lights.iter().any(|light| light.pattern == Pattern::Jittered);
        match is_grid(self.pattern) || lens.is_some_and(is_grid) || lights {
            true => grid("the patterns of pixels, lenses and lights under the Whitted transport"),
            false => Ok(()),
        }
    }
}

fn index_square(scene: &CompiledScene, bodies: u32) -> f32 {
    scene.bodies.filling(bodies).map_or(1.0, |body| body.index * body.index)
}

/// Photons for each pixel and the first radius, as far as scene and settings say that there may be any.
fn photons(scene: &CompiledScene, settings: &Settings) -> Result<(f32, f32), NoPhotons> {
    let numbers = settings.caustics.numbers().ok_or(NoPhotons::Off)?;
    let makes_caustics = |material: &Material| material.makes_caustics_under(settings.transport);
    // A caustic is what paths find behind a diffuse bounce.
    let is_forbidden = settings.transport == Transport::Path && settings.depth_limits.diffuse == Some(0);
    // Whitted's images have no noise, and get none unless it is asked for.
    if settings.transport == Transport::Whitted && settings.caustics == Caustics::Auto {
        Err(NoPhotons::Whitted)
    } else if settings.max_depth == 0 || is_forbidden {
        Err(NoPhotons::NoBounces)
    } else if !scene.materials.iter().any(makes_caustics) {
        Err(NoPhotons::NoCaustics)
    } else if scene.emitters.is_empty() {
        Err(NoPhotons::NoLamp)
    } else {
        Ok(numbers)
    }
}
