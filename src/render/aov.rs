//! Arbitrary output variables of a render, as channels of an image file.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use rayon::prelude::*;

use super::costs::cost_channels;
use super::{RenderState, Session};
use crate::denoise::{Denoised, Noisy, denoise};
use crate::film::{Features, Film, FilmChannel, SampleRanges, Values};
use crate::integrator::schedule::wavefront::first_hits::FirstHits;
use crate::math::{Rgb, Vec3};
use crate::scene::CompiledScene;
use crate::world::Aov;

impl Session {
    /// Returns the first hits of the samples that all pixels have, averaged per pixel, row by row. Traces camera rays
    /// again. Before the first sample is finished, these are the hits of that sample.
    #[doc(hidden)]
    pub fn features(&self) -> Vec<Features> {
        let [all] = self.features_apart();
        all
    }

    /// Returns the denoised film (see [`Denoised`]); `None` until every pixel has both even and odd samples. Traces
    /// camera rays again.
    pub fn denoised(&self) -> Option<Denoised> {
        let [even, odd] = self.features_apart();
        denoise(self.options.isa, &Noisy { film: self.film(), features: [&even, &odd] })
    }

    /// [`Session::features`] of every Nth sample, beginning with each of the first N.
    fn features_apart<const N: usize>(&self) -> [Vec<Features>; N] {
        let (setup, options, samples) = (&self.setup, &self.options, self.samples_of_layers());
        let wave = options.wave(setup);
        let look = |worker: &mut FirstHits, tile| {
            (tile, worker.trace_by_parity::<N>(setup, options.isa, tile, &samples))
        };
        let tiles = self.tiles().into_par_iter();
        let tiles: Vec<_> = tiles.map_init(|| FirstHits::new(setup, wave), look).collect();
        let region = self.film().region();
        let mut features = [(); N].map(|()| vec![Features::NOTHING; region.area()]);
        for (tile, found) in tiles {
            let width = tile.width() as usize;
            for (features, found) in features.iter_mut().zip(&found) {
                for (y, row) in (tile.y0..tile.y1).zip(found.chunks(width.max(1))) {
                    let start = region.index(tile.x0, y);
                    features[start..start + width].copy_from_slice(row);
                }
            }
        }
        features
    }

    /// Returns the samples that all pixels have; before the first one is finished, this one.
    pub(super) fn samples_of_layers(&self) -> SampleRanges {
        let mut samples = self.gathered.samples.clone();
        if samples.count() == 0 {
            samples.insert(self.wanted.start..self.wanted.start + 1);
        }
        samples
    }

    /// Returns the channels of some variables in their order: one for a number, three for a colour or a vector. Values
    /// go row by row from the top of the film's region. [`Aov::Variance`] needs [`super::Options::variance`], and is
    /// infinite without. [`Aov::Nodes`], [`Aov::Tests`] and [`Aov::PathLength`] render all samples again, with each ray
    /// traced by itself, and [`Aov::Time`] renders them twice, path by path; the others, without [`Aov::Samples`] and
    /// [`Aov::Variance`], trace camera rays again.
    pub fn channels(&self, aovs: &[Aov]) -> Vec<FilmChannel> {
        let geometric = aovs.iter().any(|aov| !aov.is_of_film() && !aov.is_cost());
        let features = if geometric { self.features() } else { Vec::new() };
        let is_counted = |aov: &Aov| aov.is_cost() && *aov != Aov::Time;
        let costs = if aovs.iter().any(is_counted) { self.costs() } else { Vec::new() };
        let channels = |aov: &Aov| match aov {
            Aov::Time => {
                vec![FilmChannel { name: "time".into(), values: Values::Float(self.microseconds()) }]
            }
            _ if aov.is_cost() => cost_channels(*aov, &costs, self.samples_of_layers().count()),
            _ => self.channels_of(*aov, &features),
        };
        aovs.iter().flat_map(channels).collect()
    }

    /// The mean position of hits in world space; 0 without hits.
    fn place(&self, features: &Features) -> [f32; 3] {
        let position = Vec3::from_array(features.position);
        let is_hit = features.coverage > 0.0;
        if is_hit { self.scene().in_world(position).as_vec3().to_array() } else { features.position }
    }

    fn channels_of(&self, aov: Aov, features: &[Features]) -> Vec<FilmChannel> {
        let floats = |name: &'static str, of: &dyn Fn(&Features) -> f32| FilmChannel {
            name: name.into(),
            values: Values::Float(features.iter().map(of).collect()),
        };
        let ids = |name: &'static str, of: &dyn Fn(&Features) -> u32| FilmChannel {
            name: name.into(),
            values: Values::Whole(features.iter().map(of).collect()),
        };
        match aov {
            Aov::Depth => vec![floats("depth.Z", &|f| f.depth_m)],
            Aov::Normal => vec![
                floats("normal.X", &|f| f.normal[0]),
                floats("normal.Y", &|f| f.normal[1]),
                floats("normal.Z", &|f| f.normal[2]),
            ],
            Aov::Albedo => vec![
                floats("albedo.R", &|f| f.albedo.r),
                floats("albedo.G", &|f| f.albedo.g),
                floats("albedo.B", &|f| f.albedo.b),
            ],
            Aov::Position => vec![
                floats("position.X", &|f| self.place(f)[0]),
                floats("position.Y", &|f| self.place(f)[1]),
                floats("position.Z", &|f| self.place(f)[2]),
            ],
            Aov::Entity => vec![ids("entity.id", &|f| f.entity)],
            // A material has one id, whichever of its records a surface uses.
            Aov::Material => vec![ids("material.id", &|f| match f.material {
                0 => 0,
                record => self.scene().material_id(record - 1) + 1,
            })],
            Aov::Coverage => vec![floats("coverage.A", &|f| f.coverage)],
            Aov::Samples | Aov::Variance => film_channels(self.state(), &[aov]),
            Aov::Nodes | Aov::Tests | Aov::PathLength | Aov::Time => Vec::new(),
        }
    }
}

/// Returns the names of the ids in a channel; `None` if it holds no ids. `entities` maps the numbers of entities,
/// counted from 0, to names; ids count from 1, and 0 stands for no hit.
pub fn names_of_ids(
    channel: &FilmChannel,
    entities: &HashMap<u32, String>,
    scene: &CompiledScene,
) -> Option<BTreeMap<u32, String>> {
    let Values::Whole(ids) = &channel.values else { return None };
    let name_of: &dyn Fn(u32) -> Option<String> = match &channel.name[..] {
        "entity.id" => &|number| entities.get(&number).cloned(),
        "material.id" => &|number| scene.material_names.get(number as usize).cloned(),
        _ => return None,
    };
    let ids: BTreeSet<u32> = ids.iter().copied().filter(|id| *id > 0).collect();
    Some(ids.into_iter().filter_map(|id| Some((id, name_of(id - 1)?))).collect())
}

/// Returns the channels of those variables that the film holds: the number of samples, and the variance, which needs
/// [`RenderState::moments`] and is infinite without.
pub fn film_channels(gathered: &RenderState, aovs: &[Aov]) -> Vec<FilmChannel> {
    let pixels = gathered.film.pixels();
    let of = |aov: &Aov| match aov {
        Aov::Samples => {
            let counts = pixels.iter().map(|p| p.count[0] + p.count[1]);
            vec![FilmChannel { name: "samples".into(), values: Values::Whole(counts.collect()) }]
        }
        Aov::Variance => {
            let variance = match &gathered.moments {
                Some(moments) => moments.variance_of_mean(&gathered.film),
                None => vec![Rgb::splat(f32::INFINITY); pixels.len()],
            };
            let channel = |(name, c): (&'static str, usize)| {
                let values = variance.iter().map(|v| v.to_array()[c]);
                FilmChannel { name: name.into(), values: Values::Float(values.collect()) }
            };
            [("variance.R", 0), ("variance.G", 1), ("variance.B", 2)].map(channel).into()
        }
        _ => Vec::new(),
    };
    aovs.iter().flat_map(of).collect()
}

/// Returns the light of each light group as channels, `light_NAME.R`, `.G` and `.B`, and what belongs to none as
/// `light_rest`: together they are the image. No channels if the film has no groups.
pub fn light_channels(film: &Film, names: &[String]) -> Vec<FilmChannel> {
    if film.light_groups() == 0 {
        return Vec::new();
    }
    let legible = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
    let mut layers = vec![("rest".to_owned(), film.ungrouped_radiance())];
    for (group, name) in names.iter().enumerate() {
        let mut name: String = name.chars().map(legible).collect();
        while layers.iter().any(|(other, _)| *other == name) {
            name.push('_');
        }
        layers.push((name, film.group_radiance(group)));
    }
    let mut channels = Vec::new();
    for (name, light) in layers {
        for (channel, component) in ["R", "G", "B"].into_iter().enumerate() {
            let values = light.iter().map(|light| light.to_array()[channel]).collect();
            let name = format!("light_{name}.{component}").into();
            channels.push(FilmChannel { name, values: Values::Float(values) });
        }
    }
    channels
}
