//! The render setup: a scene with the settings to render it by.

pub mod reuse_groups;

use std::sync::Arc;

use crate::film::{Film, FilmScale, GroupKinds, Region};
use crate::integrator::path::bounces::BounceLimits;
use crate::sampling::filter::FilterTable;
use crate::sampling::pattern::Grid;
use crate::scene::bodies::Body;
use crate::scene::{CompiledScene, MaterialRecord, Projection};
use crate::shading::camera::CameraImage;
use crate::world::{Adaptive, Caustics, Pattern, Sampler, Settings, Transport};
use reuse_groups::ReuseGroups;

/// The value of [`RenderSetup::splitting`]. With 8, noise × time of smooth light is that of 1 (a drink of 40 surfaces:
/// 0.93; a room with a glass ball: 1.01), and that of bright spots in faint mirror images falls to a fifth; 16 makes
/// the drink a tenth worse.
const SPLITTING: f32 = 8.0;

/// A render setup: a scene with the plain settings that the transport reads.
#[derive(Clone)]
pub struct RenderSetup {
    /// The scene.
    pub scene: Arc<CompiledScene>,
    /// Width and height of the whole image in pixels.
    pub size: [u32; 2],
    /// The grid over which a pixel's samples are spread.
    pub samples: Grid,
    /// The pattern of the samples within a pixel, before the filter.
    pub pattern: Pattern,
    /// The pixel filter.
    pub filter: FilterTable,
    /// The seed of all random numbers.
    pub seed: u64,
    /// The largest number of bounces after the camera ray.
    pub max_depth: u32,
    /// The limits on bounces of each kind within these, if any (path transport).
    pub limits: Option<BounceLimits>,
    /// The throughput threshold: a branch ends when no component is above it.
    pub min_throughput: f32,
    /// The light transport algorithm.
    pub transport: Transport,
    /// The sampler of the path transport.
    pub sampler: Sampler,
    /// The bounce at which Russian roulette begins, if it is used.
    pub roulette_depth: Option<u32>,
    /// The largest radiance that a path may add after its first bounce, if limited.
    pub clamp: Option<f32>,
    /// The least roughness of mirror lobes after a diffuse bounce (path transport).
    pub filter_glossy: f32,
    /// The grouping of pixels for path reuse, if paths are reused.
    pub sharing: Option<ReuseGroups>,
    /// The mode of adaptive sampling.
    pub adaptive: Adaptive,
    /// Photons per pixel and sample and the first radius in pixel widths, or the reason why there are none.
    pub photons: Result<(f32, f32), NoPhotons>,
    /// True if the number of photons is chosen automatically, and photons are left out where they would only make
    /// isolated dots.
    pub chooses_photons: bool,
    /// True if rays travel in the direction of light instead of from the camera to the light.
    pub follows_light: bool,
    /// The approximate number of paths into which one may split at smooth glass (path transport).
    pub splitting: f32,
    /// True if the film counts what pixels show of the things behind the scene.
    pub transparent: bool,
    /// True if the film counts the light of shadow catchers.
    pub catches: bool,
    /// The names of the light groups by bounce; none if the film does not count the light of bounces.
    pub bounce_groups: Vec<String>,
    /// The film scale: the unit in which radiance is counted.
    pub unit: FilmScale,
    /// The bodies that the camera is in ([`crate::scene::Bodies`]).
    pub around: u32,
    /// n² of the one that fills the camera's position, under the path transport: see
    /// [`crate::scene::MaterialRecord::index_square`].
    pub around_square: f32,
}

/// The largest number of light groups by bounce.
const MOST_BOUNCE_GROUPS: u32 = 8;

/// The names of the light groups by bounce; the last one may stand for several bounces.
fn bounce_groups(settings: &Settings) -> Vec<String> {
    let bounces = settings.max_depth.saturating_add(2);
    let count = bounces.min(MOST_BOUNCE_GROUPS);
    let name = |bounce: u32| {
        let more = if bounce + 1 == count && bounces > count { " and more" } else { "" };
        format!("bounce {bounce}{more}")
    };
    (0..count).map(name).collect()
}

impl RenderSetup {
    /// Returns the setup for a small preview whose longer side has at most `longer_side` pixels.
    pub fn small(&self, longer_side: u32) -> Self {
        let [width, height] = self.size;
        let by = width.max(height).div_ceil(longer_side).max(1);
        let size = [width.div_ceil(by), height.div_ceil(by)];
        Self { size, sharing: None, adaptive: Adaptive::Off, ..self.clone() }
    }

    /// Creates the setup of a scene with the settings to render it by, and the bodies that its camera is in.
    pub fn new(scene: Arc<CompiledScene>, settings: &Settings, around: u32) -> Self {
        let size = settings.size.map(|side| side.clamp(1, Settings::MOST_PIXELS_A_SIDE));
        // Bodies attenuate the light that vertices give on its way to other vertices.
        let acts = |body: &Body| scene.materials[body.material as usize].has_active_medium();
        let catches = settings.transport == Transport::Path
            && scene.materials.iter().any(|material| material.shadow_catcher);
        // What neighbours give would have to be counted as theirs.
        let sharing = ReuseGroups::of(&scene.materials, settings)
            .filter(|_| !catches && !scene.bodies.all(around).any(acts));
        let around_square = match settings.transport {
            Transport::Whitted => 1.0,
            Transport::Path => index_square(&scene, around),
        };
        let photons = if catches { Err(NoPhotons::Catcher) } else { photons(&scene, settings) };
        // Radiance is higher within a body than outside.
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
            filter_glossy: settings.filter_glossy,
            sharing,
            adaptive: settings.adaptive,
            unit,
            chooses_photons: settings.caustics == Caustics::Auto,
            photons,
            follows_light: false,
            splitting: SPLITTING,
            transparent: settings.counts_opacity(),
            catches,
            bounce_groups: if settings.light_by_bounce { bounce_groups(settings) } else { Vec::new() },
            around_square,
            around,
        }
    }

    /// The number of light groups.
    #[inline(always)]
    pub fn light_groups(&self) -> usize {
        self.light_group_names().len()
    }

    /// The names of the light groups: those of bounces, if there are any, or of lamps; none with shadow catchers, whose
    /// light is counted by itself.
    pub fn light_group_names(&self) -> &[String] {
        match self.bounce_groups.as_slice() {
            _ if self.catches => &[],
            [] => &self.scene.light_groups,
            bounces => bounces,
        }
    }

    /// True if the path that finds light chooses its group, and not the lamp.
    #[inline(always)]
    pub fn groups_by_path(&self) -> bool {
        self.catches || !self.bounce_groups.is_empty()
    }

    /// The number of light groups of lamps.
    #[inline(always)]
    pub fn lamp_groups(&self) -> usize {
        if self.groups_by_path() { 0 } else { self.light_groups() }
    }

    /// The groups that films hold.
    pub fn groups(&self) -> GroupKinds {
        GroupKinds {
            lights: self.light_groups(),
            has_transparency: self.transparent,
            has_catcher: self.catches,
        }
    }

    /// An empty film for a region.
    pub fn film(&self, region: Region) -> Film {
        Film::new(region, self.unit).with_groups(self.groups())
    }

    /// The camera with the size of the image.
    #[inline(always)]
    pub fn image(&self) -> CameraImage<'_> {
        CameraImage::new(&self.scene.camera, self.size)
    }

    /// n² of the body that fills the camera's position.
    pub fn index_square_around(&self) -> f32 {
        index_square(&self.scene, self.around)
    }

    /// True if some material lets a path go on in two directions.
    pub fn may_fork(&self) -> bool {
        self.splitting > 1.0 && self.scene.materials.iter().any(|material| !material.transmission.is_zero())
    }

    /// Checks that rendered samples stay valid if more are to follow; the error is the reason why they do not.
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
            _ => None,
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

/// Returns the photons per pixel and the first radius, if scene and settings allow for photons.
fn photons(scene: &CompiledScene, settings: &Settings) -> Result<(f32, f32), NoPhotons> {
    let numbers = settings.caustics.numbers().ok_or(NoPhotons::Off)?;
    let makes_caustics = |material: &MaterialRecord| material.makes_caustics_under(settings.transport);
    if !settings.wants_photons() {
        // Whitted images have no noise; photons, which add some, must be requested explicitly.
        let asks = settings.transport == Transport::Path || settings.caustics != Caustics::Auto;
        Err(if asks { NoPhotons::NoBounces } else { NoPhotons::Whitted })
    } else if !scene.materials.iter().any(makes_caustics) {
        Err(NoPhotons::NoCaustics)
    } else if scene.emitters.is_empty() {
        Err(NoPhotons::NoLamp)
    } else {
        Ok(numbers)
    }
}

/// The reason why a render has no photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPhotons {
    /// The settings turn photons off.
    Off,
    /// The Whitted transport has photons only if the settings specify them.
    Whitted,
    /// Paths end at the first surface.
    NoBounces,
    /// No material makes caustics.
    NoCaustics,
    /// No light reaches objects that make caustics.
    NoLamp,
    /// The camera sees no surface where photons could end.
    NotSeen,
    /// No trial photon ended on a surface.
    NoneLands,
    /// Light that photons bring to shadow catchers would count as light that nothing blocks.
    Catcher,
    /// Photons would lie so far apart that they would be isolated bright dots.
    Dots,
}

impl NoPhotons {
    /// The reason, human-readable: the end of a sentence.
    pub fn text(self) -> &'static str {
        match self {
            Self::Off => "caustics are off",
            Self::Whitted => "under Whitted's transport there are some only if asked for (--caustics 1)",
            Self::NoBounces => "paths have no bounces (--depth 1 or more gives them some)",
            Self::NoCaustics => "no material throws light onto other things, as glass and mirrors do",
            Self::NoLamp => "no lamp lights what would throw light onto other things",
            Self::NotSeen => "the camera sees no surface where photons could end",
            Self::Catcher => "beside shadow catchers photons would count as light that nothing blocks",
            Self::NoneLands => "none of those that were tried ended on a surface",
            Self::Dots => "they would make only single bright dots (--caustics 1 insists)",
        }
    }
}
