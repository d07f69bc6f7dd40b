//! The light of photons at the vertices of paths, and the weights that divide light between photons and paths.

use super::map::PhotonsAround;
use super::{PhotonMaps, PhotonPlan};
use crate::integrator::path::Path;
use crate::integrator::path::bounces::{self, LobeKind};
use crate::integrator::path::mis::{balance_heuristic, own_part};
use crate::math::{Color, NONE, Vector};
use crate::shading::emitter;
use crate::shading::principled::bsdf::Bsdf;
use crate::shading::surface::{HitLanes, Surface};
use crate::simd::{Float, Int, Mask};
use crate::world::Transport;

const PI: f32 = std::f32::consts::PI;

/// The largest number of photons of a cell that a vertex visits behind a diffuse bounce. There the noise of paths hides
/// that of photons, and bright caustics hold thousands.
const INDIRECT: u32 = 64;

/// A surface that gathers photons.
pub trait Receiver<F: Float> {
    /// BSDF value · |cos| towards the viewer for light that comes from a direction, and the density with which the path
    /// would have drawn that direction; 0 if it never does.
    fn receive(&self, from: Vector<F>, mask: F::Mask) -> (Color<F>, F);
    /// The diffuse lobe's fraction of that value, for path reuse.
    fn diffuse_part(&self, from: Vector<F>, value: Color<F>, mask: F::Mask) -> Color<F>;
}

/// The photons that a vertex gathers.
#[derive(Clone, Copy)]
pub struct PhotonsWanted {
    /// The largest number of bounces of a path with its photons.
    pub max_depth: u32,
    /// True if the diffuse part is wanted.
    pub diffuse: bool,
    /// The light group whose photons are wanted, or those of all lights.
    pub group: Option<u32>,
}

/// The light of photons that leaves a vertex towards the viewer.
#[derive(Clone, Copy)]
pub struct GatheredLight<F: Float> {
    /// All light.
    pub light: Color<F>,
    /// The part that leaves by the diffuse lobe; black unless paths are reused.
    pub diffuse: Color<F>,
}

impl<F: Float> GatheredLight<F> {
    /// No light.
    #[inline(always)]
    pub fn nothing() -> Self {
        Self { light: Color::black(), diffuse: Color::black() }
    }
}

impl<F: Float> Receiver<F> for Bsdf<F> {
    #[inline(always)]
    fn receive(&self, from: Vector<F>, mask: F::Mask) -> (Color<F>, F) {
        self.evaluate(from, mask)
    }

    #[inline(always)]
    fn diffuse_part(&self, from: Vector<F>, value: Color<F>, mask: F::Mask) -> Color<F> {
        Bsdf::diffuse_part(self, from, value, mask)
    }
}

/// Flag of [`Path::landing`]: the path has met something that makes caustics.
const BEHIND: u32 = 1 << 15;
/// Flag of [`Path::landing`]: the camera sees directly the surface that the path left, so that photons are drawn there.
pub(in crate::integrator) const DRAWN: u32 = 1 << 31;

/// Packs the first radius and the density of the direction, per unit of its cosine, into one word: the upper halves of
/// two floats, which are never negative.
#[inline(always)]
fn packed<F: Float>(radius: F, density: F) -> F::Int {
    (radius.to_bits() & F::Int::splat(0xffff_0000)) | density.to_bits().shr::<16>()
}

/// The first radius at a path's vertices, 0 until it meets a surface where photons end.
#[inline(always)]
fn stored_radius<F: Float>(landing: F::Int) -> F {
    (landing & F::Int::splat(0x7fff_0000)).reinterpret()
}

/// The density of the direction in which the path left a surface where photons end, per unit of its cosine.
#[inline(always)]
fn direction_density<F: Float>(landing: F::Int) -> F {
    (landing & F::Int::splat(0x7fff)).shl::<16>().reinterpret()
}

/// The word of a path that goes on in a direction of density `pdf` from a surface where photons end.
#[inline(always)]
pub(in crate::integrator) fn leaving<F: Float>(
    surface: &Surface<F>,
    radius: F,
    direction: Vector<F>,
    pdf: F,
) -> F::Int {
    let cosine = surface.geometric_normal.dot(direction).abs().max(F::splat(1e-6));
    let density = F::select(pdf.gt(F::zero()), pdf / cosine, F::splat(f32::INFINITY));
    packed(radius, density)
}

/// The word of a path that was scattered within a body, where photons do not end: what it finds next is its own.
#[inline(always)]
pub(in crate::integrator) fn elsewhere<F: Float>(landing: F::Int) -> F::Int {
    packed(stored_radius::<F>(landing), F::splat(f32::INFINITY))
}

/// The word of a path that goes on behind something that makes caustics.
#[inline(always)]
pub(in crate::integrator) fn behind<F: Float>(landing: F::Int) -> F::Int {
    let met = !landing.eq(F::Int::splat(0));
    F::Int::select(met, landing | F::Int::splat(BEHIND), landing)
}

/// The first radius at a vertex where photons end: that of the path's first such vertex, where the radius is `width`
/// metres for light that arrives perpendicularly.
#[inline(always)]
pub(crate) fn first_radius<F: Float>(path: &Path<F>, width: F, surface: &Surface<F>) -> F {
    let own = stored_radius::<F>(path.landing);
    let cosine = path.direction.dot(surface.geometric_normal).abs().max(F::splat(0.1));
    let fresh = width / cosine.sqrt();
    // Rounded as it is stored.
    let fresh = stored_radius::<F>(packed(fresh.max(F::splat(1e-30)), F::zero()));
    F::select(own.gt(F::zero()), own, fresh)
}

#[inline(always)]
fn disc<F: Float>(radius: F) -> F {
    radius * radius * F::splat(PI)
}

/// The area of a pixel's footprint for a first radius.
#[inline(always)]
pub(in crate::integrator) fn footprint_area<F: Float>(plan: &PhotonPlan, first: F) -> F {
    let side = first * F::splat(1.0 / plan.pixels);
    side * side
}

/// The sample of all lanes, if it is the same one.
#[inline(always)]
fn only_one<I: Int>(sample: I, mask: I::Mask) -> Option<u32> {
    let first = emitter::lane(sample, mask);
    (!(mask & !sample.eq(I::splat(first))).any()).then_some(first)
}

impl PhotonMaps<'_> {
    /// The radius at each lane's sample, from its first radius.
    #[inline(always)]
    fn radius<F: Float>(&self, sample: F::Int, first: F, mask: F::Mask) -> F {
        if let Some(sample) = only_one(sample, mask) {
            return self.of(sample).radii.of(first);
        }
        let (mut samples, mut radii) = ([0; 16], [0.0; 16]);
        sample.store(&mut samples);
        first.store(&mut radii);
        for lane in 0..F::WIDTH {
            if mask.bits() >> lane & 1 != 0 {
                radii[lane] = self.of(samples[lane]).radii.of(radii[lane]);
            }
        }
        F::load(&radii)
    }

    /// The weight of a path that has found an emitter of this density against photons: 1 if no photon brings its light.
    /// `is_lit`: the path is on the surface that makes the caustic, and a light sample has found the emitter.
    #[inline(always)]
    pub(in crate::integrator) fn left_to_path<F: Float>(
        &self,
        path: &Path<F>,
        density: F,
        is_lit: bool,
        mask: F::Mask,
    ) -> F {
        let landing = path.landing;
        let own = direction_density::<F>(landing);
        // Infinite for a mirror's only direction, or one from within a body: photons there do not bring its light.
        let mut shares =
            mask & !landing.eq(F::Int::splat(0)) & density.gt(F::zero()) & own.lt(F::splat(f32::INFINITY));
        if !is_lit {
            shares = shares & !(landing & F::Int::splat(BEHIND)).eq(F::Int::splat(0));
        }
        if !shares.any() || !self.plan.is_found_by_paths {
            return F::one();
        }
        if self.samples.is_empty() {
            return F::select(shares, F::zero(), F::one());
        }
        let first = stored_radius(landing);
        let is_drawn = !(landing & F::Int::splat(DRAWN)).eq(F::Int::splat(0));
        let gathered = disc(self.radius(path.sample, first, shares));
        let area = F::select(is_drawn, footprint_area(self.plan, first), gathered);
        F::select(shares, balance_heuristic(own, density * area), F::one())
    }

    /// The weight of a path that has hit an emitter against photons.
    #[inline(always)]
    pub(in crate::integrator) fn left_of_hit<F: Float>(
        &self,
        path: &Path<F>,
        hit: &HitLanes<F>,
        mask: F::Mask,
    ) -> F {
        self.left_of_emitter(path, emitter::of_hit(&self.plan.setup.scene, hit, mask), mask)
    }

    /// The weight against photons of a path that has met an emitter, or [`NONE`].
    #[inline(always)]
    pub(in crate::integrator) fn left_of_emitter<F: Float>(
        &self,
        path: &Path<F>,
        index: F::Int,
        mask: F::Mask,
    ) -> F {
        let found = mask & !index.eq(F::Int::splat(NONE));
        let density = F::gather(self.plan.emission.densities(), index, found);
        self.left_to_path(path, density, false, found)
    }

    /// Returns the light of the photons around a vertex that leaves it towards the viewer. `first` is the first radius.
    #[inline(always)]
    pub(in crate::integrator) fn gather<F: Float>(
        &self,
        wanted: PhotonsWanted,
        path: &Path<F>,
        surface: &Surface<F>,
        receiver: &impl Receiver<F>,
        first: F,
        mask: F::Mask,
    ) -> GatheredLight<F> {
        let mut sum = GatheredLight::nothing();
        if self.samples.is_empty() {
            return sum;
        }
        let radius = self.radius(path.sample, first, mask);
        let mut around = self.around(wanted, path, surface, radius, mask);
        while let Some(photons) = around.next::<F>() {
            let now = F::Mask::from_bits(photons.lanes);
            let from =
                Vector::new(F::load(&photons.from[0]), F::load(&photons.from[1]), F::load(&photons.from[2]));
            let flux =
                Color::new(F::load(&photons.flux[0]), F::load(&photons.flux[1]), F::load(&photons.flux[2]));
            let (value, pdf) = receiver.receive(from, now);
            let cosine = surface.geometric_normal.dot(from).abs().max(F::splat(1e-3));
            let own = if self.plan.is_found_by_paths {
                own_part(F::load(&photons.density), disc(radius), pdf, cosine)
            } else {
                F::one()
            };
            let scale = F::load(&photons.kernel) * own / (cosine * radius * radius * F::splat(PI));
            let light = Color::select(now, value * flux * scale, Color::black());
            sum.light = sum.light + light;
            if wanted.diffuse {
                sum.diffuse = sum.diffuse + light * receiver.diffuse_part(from, value, now);
            }
        }
        sum
    }

    /// The photons around the vertices of all lanes.
    #[inline(always)]
    fn around<F: Float>(
        &self,
        PhotonsWanted { max_depth, group, .. }: PhotonsWanted,
        path: &Path<F>,
        surface: &Surface<F>,
        radius: F,
        mask: F::Mask,
    ) -> AroundLanes<'_> {
        let mut all = AroundLanes { lanes: [const { None }; 16], left: 0, most: [0; 16], group };
        let mut mask = mask;
        if let Some(sample) = only_one(path.sample, mask) {
            mask = self.of(sample).may_hold(surface.position, radius, mask);
        }
        if !mask.any() {
            return all;
        }
        let (mut samples, mut radii) = ([0; 16], [0.0; 16]);
        let (mut place, mut normal) = ([[0.0; 16]; 3], [[0.0; 16]; 3]);
        path.sample.store(&mut samples);
        radius.store(&mut radii);
        let (p, n) = (surface.position, surface.geometric_normal);
        for (column, value) in place.iter_mut().zip([p.x, p.y, p.z]) {
            value.store(column);
        }
        for (column, value) in normal.iter_mut().zip([n.x, n.y, n.z]) {
            value.store(column);
        }
        let (mut depths, mut free, mut bounces) = ([0; 16], [0; 16], [0; 16]);
        path.bounce_counts.store(&mut bounces);
        path.depth.store(&mut depths);
        path.scatterings.store(&mut free);
        for lane in 0..F::WIDTH {
            if mask.bits() >> lane & 1 == 0 {
                continue;
            }
            let place = Vector::new(place[0][lane], place[1][lane], place[2][lane]);
            let normal = Vector::new(normal[0][lane], normal[1][lane], normal[2][lane]);
            let is_path = self.plan.setup.transport == Transport::Path;
            let is_indirect = is_path && bounces::counts(bounces[lane])[LobeKind::Diffuse as usize] > 0;
            let most = if is_indirect { INDIRECT } else { u32::MAX };
            all.lanes[lane] = self.of(samples[lane]).around(place, normal, radii[lane], most);
            all.left |= u32::from(all.lanes[lane].is_some()) << lane;
            all.most[lane] = (max_depth + free[lane]).saturating_sub(depths[lane]);
        }
        all
    }
}

/// The photons around the vertices of some lanes.
struct AroundLanes<'a> {
    lanes: [Option<PhotonsAround<'a>>; 16],
    /// The lanes that may have more photons.
    left: u32,
    /// The largest number of bounces that they may have.
    most: [u32; 16],
    /// Their light group, or all.
    group: Option<u32>,
}

/// One photon in each of some lanes.
struct PhotonLanes {
    lanes: u32,
    from: [[f32; 16]; 3],
    flux: [[f32; 16]; 3],
    kernel: [f32; 16],
    density: [f32; 16],
}

impl AroundLanes<'_> {
    /// The next photon of each lane that has one; none if no lane has.
    #[inline(always)]
    fn next<F: Float>(&mut self) -> Option<PhotonLanes> {
        if self.left == 0 {
            return None;
        }
        let nothing = [[0.0; 16]; 3];
        let mut found =
            PhotonLanes { lanes: 0, from: nothing, flux: nothing, kernel: [0.0; 16], density: [1.0; 16] };
        for lane in 0..F::WIDTH {
            if self.left >> lane & 1 == 0 {
                continue;
            }
            let most = self.most[lane];
            let group = self.group;
            let next = self.lanes[lane].as_mut().and_then(|around| around.next_within(most, group));
            let Some((photon, kernel)) = next else {
                self.left &= !(1 << lane);
                continue;
            };
            found.lanes |= 1 << lane;
            let direction = photon.from();
            for (axis, value) in [direction.x, direction.y, direction.z].into_iter().enumerate() {
                found.from[axis][lane] = value;
                found.flux[axis][lane] = photon.flux[axis];
            }
            found.kernel[lane] = kernel;
            found.density[lane] = photon.density();
        }
        (found.lanes != 0).then_some(found)
    }
}
