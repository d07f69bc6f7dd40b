//! Light transport: what happens to light at one vertex ([`whitted`], [`path_tracing`]), written
//! once over lanes, and two schedules that move rays through it: [`recursive`], depth first and
//! pixel by pixel, and [`wavefront`], breadth first and queue by queue.

mod around;
pub mod begin;
pub mod bounces;
pub mod decision;
mod ends;
pub mod medium;
mod mis;
pub mod observe;
pub mod path;
pub mod path_tracing;
pub mod presence;
pub mod recursive;
pub mod shadow;
pub mod sharing;
pub mod statistics;
pub mod stop;
pub mod straight;
pub mod wavefront;
pub mod whitted;
mod within;

use std::ops::Range;
use std::sync::Arc;

use crate::film::{Film, Region, Unit};
use crate::math::NONE;
use crate::sampling::filter::FilterTable;
use crate::sampling::pattern::Grid;
use crate::scene::{CompiledScene, Material, Projection};
use crate::shading::principled::tables::LobeTables;
use crate::simd::Level;
use crate::world::{Adaptive, Pattern, Sampler, Settings, Sharing, Transport};
use observe::{Nobody, Observer};
use sharing::{Grouping, pilot::Pilot};
pub use statistics::{RayCounts, Stage, Statistics};
pub use stop::Stop;
use stop::Watch;

/// Everything that transport reads: the scene and how it is to be rendered.
#[derive(Clone)]
pub struct Frame {
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
    pub limits: Option<bounces::Limits>,
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
    pub sharing: Option<Grouping>,
    /// Whether samples go where they lessen the error most.
    pub adaptive: Adaptive,
    /// What is rendered beforehand, if blocks of pixels choose how many of them share.
    pub pilot: Option<Arc<Pilot>>,
    /// Albedos of the lobes that its materials have under the path transport.
    pub lobes: LobeTables,
    /// The unit in which radiance is counted.
    pub unit: Unit,
    /// The material of the body that the camera is in (path transport), or [`NONE`] if that does nothing to light.
    pub around: u32,
    /// n² of that body: see [`crate::scene::Material::index_square`].
    pub around_square: f32,
}

impl Frame {
    /// The same in a small image, whose longer side has at most so many pixels: for a first look.
    pub fn small(&self, longer_side: u32) -> Self {
        let [width, height] = self.size;
        let by = width.max(height).div_ceil(longer_side).max(1);
        let size = [width.div_ceil(by), height.div_ceil(by)];
        Self { size, sharing: None, pilot: None, adaptive: Adaptive::Off, ..self.clone() }
    }

    /// A scene with the settings to render it by.
    pub fn new(scene: impl Into<Arc<CompiledScene>>, settings: &Settings) -> Self {
        let scene = scene.into();
        let lobes = match settings.transport {
            Transport::Whitted => LobeTables::NONE,
            Transport::Path => LobeTables::of(&scene.materials),
        };
        let size = settings.size.map(|side| side.clamp(1, Settings::MOST_PIXELS_A_SIDE));
        let around = match settings.transport {
            Transport::Whitted => NONE,
            Transport::Path => around::the_camera(&scene, size),
        };
        // Ways through a body take from what is lent.
        let sharing = Grouping::of(&scene.materials, settings).filter(|_| around == NONE);
        let around_square: f32 = scene.materials.get(around as usize).map_or(1.0, Material::index_square);
        // A camera in a body sees more light than there is outside.
        let (brightest, usual) = scene.levels();
        let unit = Unit::new(brightest * around_square.max(1.0), usual * around_square.max(1.0));
        let mut frame = Self {
            scene,
            size,
            samples: Grid::new(settings.samples),
            pattern: settings.pixel_pattern,
            filter: FilterTable::new(settings.filter),
            seed: settings.seed,
            max_depth: settings.max_depth,
            limits: bounces::Limits::new(settings.depth_limits, settings.max_depth),
            min_throughput: settings.min_throughput,
            transport: settings.transport,
            sampler: settings.sampler,
            roulette_depth: settings.roulette_depth,
            clamp: settings.clamp,
            sharing,
            adaptive: settings.adaptive,
            pilot: None,
            unit,
            lobes,
            around_square,
            around,
        };
        if settings.sharing == Sharing::Auto && frame.sharing.is_some() {
            frame.pilot = Some(Arc::new(Pilot::new(&frame)));
        }
        frame
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

/// In which order rays are traced. The image does not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Schedule {
    /// Breadth first: waves of many paths go through one stage after another.
    #[default]
    Wavefront,
    /// Depth first: one path after another is followed to its end.
    Recursive,
}

/// In which order the wavefront schedule shades a wave's hits under the path transport. The image
/// does not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sorting {
    /// Material by material: all lanes are used.
    #[default]
    ByMaterial,
    /// As they come: the hits in a register are shaded once for each material among them.
    Unsorted,
}

/// A worker's buffers, made once and used for tile after tile.
pub enum Worker {
    /// For [`Schedule::Wavefront`].
    Wavefront(Box<wavefront::Wave>),
    /// For [`Schedule::Recursive`].
    Recursive(Box<recursive::Recursion>),
}

impl Worker {
    /// Buffers for waves of `wave` paths, or for single paths.
    pub fn new(frame: &Frame, schedule: Schedule, wave: usize, sorting: Sorting) -> Self {
        match schedule {
            Schedule::Wavefront => Worker::Wavefront(Box::new(wavefront::Wave::new(frame, wave, sorting))),
            Schedule::Recursive => Worker::Recursive(Box::new(recursive::Recursion::new(frame))),
        }
    }

    /// Renders a range of samples of a tile into a film of its own.
    pub fn render(
        &mut self,
        frame: &Frame,
        level: Level,
        tile: Region,
        samples: Range<u32>,
        statistics: &mut Statistics,
    ) -> Film {
        self.observe(frame, level, tile, samples, statistics, &mut Nobody)
    }

    /// The same; none if it is stopped before the tile is whole.
    pub fn render_until(
        &mut self,
        frame: &Frame,
        level: Level,
        (tile, samples): (Region, Range<u32>),
        statistics: &mut Statistics,
        stop: &Stop,
    ) -> Option<Film> {
        let mut watch = Watch::new(stop);
        let film = self.observe(frame, level, tile, samples, statistics, &mut watch);
        (!watch.stopped).then_some(film)
    }

    /// The same with an observer.
    pub fn observe(
        &mut self,
        frame: &Frame,
        level: Level,
        tile: Region,
        samples: Range<u32>,
        statistics: &mut Statistics,
        observer: &mut dyn Observer,
    ) -> Film {
        let mut film = Film::new(tile, frame.unit);
        match self {
            Worker::Wavefront(wave) => wave.render(frame, level, &mut film, samples, statistics, observer),
            Worker::Recursive(recursion) => {
                recursion.render(frame, level, &mut film, samples, statistics, observer);
            }
        }
        film
    }
}
