//! The stages of the wave, a kernel each. Every one is a loop over the lanes of its input queue; the light transport in
//! it is in [`crate::integrator::transport::whitted`].

use super::queue::{HitQueue, PathQueue};
use super::shadow_queue::ShadowQueue;
use super::vertices::VertexQueue;
use crate::integrator::RenderSetup;
use crate::integrator::observe::{self, Observer};
use crate::integrator::path::camera_path;
use crate::integrator::path::light_groups::GroupQueue;
use crate::integrator::photons::PhotonMaps;
use crate::integrator::reuse::Sink;
use crate::integrator::transport::{path_tracing, whitted};
use crate::math::{Color, NONE, Rgb};
use crate::shading::surface::material_of;
use crate::simd::{Float, Int, Kernel, Lanes, Mask};
use crate::world::Transport;

/// The mask of the first `count` lanes, at most all.
#[inline(always)]
pub(super) fn lanes<F: Float>(count: usize) -> F::Mask {
    F::Mask::first(count.min(F::WIDTH))
}

/// The numbers `first`, `first + 1`, …
#[inline(always)]
pub(super) fn numbered<I: Int>(first: usize) -> I {
    const STEPS: [u32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
    I::load(&STEPS) + I::splat(first as u32)
}

/// Generates camera paths for pixels and samples, at the end of `out`.
pub struct GenerateStage<'a> {
    /// The render setup.
    pub setup: &'a RenderSetup,
    /// Packed pixels, padded.
    pub pixels: &'a [u32],
    /// Samples, padded.
    pub samples: &'a [u32],
    /// The number of paths.
    pub count: usize,
    /// The queue for the paths.
    pub out: &'a mut PathQueue,
}

impl Kernel for GenerateStage<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let width = L::Queue::WIDTH;
        for at in (0..self.count).step_by(width) {
            let pixel = <L::Queue as Float>::Int::load(&self.pixels[at..]);
            let sample = <L::Queue as Float>::Int::load(&self.samples[at..]);
            let path = camera_path::generate::<L::Queue>(self.setup, pixel, sample);
            self.out.append(lanes::<L::Queue>(self.count - at), &path, Int::splat(NONE));
        }
    }
}

/// Moves misses to the film, and compacts hits at the front of both queues.
pub struct RetireStage<'a, 's> {
    /// The render setup.
    pub setup: &'a RenderSetup,
    /// The photons of the paths' samples.
    pub photons: Option<PhotonMaps<'a>>,
    /// Paths, in and out.
    pub paths: &'a mut PathQueue,
    /// Their hits, in and out.
    pub hits: &'a mut HitQueue,
    /// The receiver of the misses' radiance, if it is of use.
    pub sink: Option<&'a mut (dyn Sink + 's)>,
    /// The observer of ended paths.
    pub observer: &'a mut dyn Observer,
    /// Room for the misses' light by group, empty.
    pub found: &'a mut GroupQueue,
}

impl Kernel for RetireStage<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let (width, count) = (L::Queue::WIDTH, self.paths.columns.len());
        let mut kept = 0;
        for at in (0..count).step_by(width) {
            let valid = lanes::<L::Queue>(count - at);
            let path = self.paths.load::<L::Queue>(at);
            let hit = self.hits.load::<L::Queue>(at);
            let missed = hit.primitive.eq(Int::splat(NONE)) & valid;
            if missed.any()
                && let Some(sink) = &mut self.sink
            {
                let (setup, found) = (self.setup, &mut *self.found);
                let light = match setup.transport {
                    Transport::Whitted => whitted::miss(setup, &path, missed, found),
                    Transport::Path => path_tracing::miss(setup, self.photons, &path, missed, found),
                };
                let radiance = path.radiance + light;
                sink.take_groups(found);
                let (mut r, mut g, mut b) = ([0.0; 16], [0.0; 16], [0.0; 16]);
                let (mut pixel, mut sample) = ([0; 16], [0; 16]);
                radiance.r.store(&mut r);
                radiance.g.store(&mut g);
                radiance.b.store(&mut b);
                path.pixel.store(&mut pixel);
                path.sample.store(&mut sample);
                let mut bits = missed.bits();
                while bits != 0 {
                    let lane = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    sink.deposit(pixel[lane], sample[lane], Rgb::new(r[lane], g[lane], b[lane]));
                    if self.observer.is_active() {
                        let path = self.paths.load::<f32>(at + lane);
                        let radiance = Color::new(r[lane], g[lane], b[lane]);
                        self.observer.report(&observe::end(&path, radiance));
                    }
                }
            }
            let stays = valid & !missed;
            // In place: writes never overtake reads.
            self.paths.store(kept, stays, &path, Int::splat(NONE));
            let material = match self.setup.transport {
                Transport::Whitted => Int::splat(NONE),
                Transport::Path => material_of(&self.setup.scene.geometry, &hit, stays),
            };
            self.hits.store(kept, stays, &hit, material);
            kept += stays.count();
        }
        self.paths.columns.set_len(kept);
    }
}

/// Turns hits into vertices and reflected and refracted rays.
pub struct ShadeStage<'a> {
    /// The render setup.
    pub setup: &'a RenderSetup,
    /// The photons of the paths' samples.
    pub photons: Option<PhotonMaps<'a>>,
    /// Paths that have hit something; the surfaces' emission is added to their radiance.
    pub paths: &'a mut PathQueue,
    /// Their hits.
    pub hits: &'a HitQueue,
    /// Vertices for the lights, in the order of the paths.
    pub vertices: &'a mut VertexQueue,
    /// 1 for each path that goes on, else 0.
    pub goes_on: &'a mut [u32],
    /// Reflected paths.
    pub reflect: &'a mut PathQueue,
    /// Refracted paths.
    pub refract: &'a mut PathQueue,
    /// The light that paths find, by group.
    pub found: &'a mut GroupQueue,
}

impl Kernel for ShadeStage<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (width, count) = (L::Queue::WIDTH, self.paths.columns.len());
        for at in (0..count).step_by(width) {
            let valid = lanes::<L::Queue>(count - at);
            let path = self.paths.load::<L::Queue>(at);
            let hit = self.hits.load::<L::Queue>(at);
            let (vertex, scatter, radiance) =
                whitted::hit(self.setup, self.photons, &path, &hit, valid, self.found);
            self.vertices.store(at, &vertex);
            put_radiance(self.paths, radiance, at);
            let source = numbered::<<L::Queue as Float>::Int>(at);
            let none = <L::Queue as Float>::Int::splat(NONE);
            if scatter.reflects.any() {
                self.reflect.append(scatter.reflects, &scatter.reflected(&path, &vertex), source);
            }
            if scatter.refracts.any() {
                let source = Int::select(scatter.forks(), none, source);
                self.refract.append(scatter.refracts, &scatter.refracted(&path, &vertex), source);
            }
            let goes_on = scatter.reflects | scatter.refracts;
            let flags: <L::Queue as Float>::Int = Int::select(goes_on, Int::splat(1), Int::splat(0));
            flags.store(&mut self.goes_on[at..]);
        }
    }
}

/// Stores the radiance of paths from `at` on.
#[inline(always)]
pub(super) fn put_radiance<F: Float>(paths: &mut PathQueue, radiance: Color<F>, at: usize) {
    let [r, g, b] = paths.radiance_mut();
    put(radiance.r, r, at);
    put(radiance.g, g, at);
    put(radiance.b, b, at);
}

/// Stores as many lanes as the column still has room for.
#[inline(always)]
fn put<F: Float>(value: F, column: &mut [f32], at: usize) {
    if column.len() - at >= F::WIDTH {
        value.store(&mut column[at..]);
    } else {
        let mut lanes = [0.0; 16];
        value.store(&mut lanes);
        let rest = column.len() - at;
        column[at..].copy_from_slice(&lanes[..rest]);
    }
}

/// Turns vertices into shadow rays to one sample of a light, at the end of `out`.
pub struct LightStage<'a> {
    /// The render setup.
    pub setup: &'a RenderSetup,
    /// Paths at their hits.
    pub paths: &'a PathQueue,
    /// Their vertices.
    pub vertices: &'a VertexQueue,
    /// The number of the light.
    pub light: usize,
    /// The number of its sample.
    pub which: u32,
    /// The queue for the rays.
    pub out: &'a mut ShadowQueue,
}

impl Kernel for LightStage<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (width, count) = (L::Queue::WIDTH, self.paths.columns.len());
        for at in (0..count).step_by(width) {
            let path = self.paths.load::<L::Queue>(at);
            let vertex = self.vertices.load::<L::Queue>(at);
            let valid = lanes::<L::Queue>(count - at);
            let shadow = whitted::light_ray(self.setup, &path, &vertex, self.light, self.which, valid);
            self.out.append(&shadow, numbered(at));
        }
    }
}
