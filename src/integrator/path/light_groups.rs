//! Light that paths have found, by group: what is added to a path's radiance is also added to its group's sums.

use super::Path;
use super::bounces::{self, CAUGHT};
use crate::film::Caught;
use crate::integrator::RenderSetup;
use crate::math::{Color, NONE, Rgb};
use crate::simd::{Float, Int, Mask};

/// Light of a group that a sample's path has found.
#[derive(Clone, Copy)]
pub struct GroupLight {
    /// The packed pixel.
    pub pixel: u32,
    /// The sample.
    pub sample: u32,
    /// The light group.
    pub group: u32,
    /// The radiance that reaches the film.
    pub light: Rgb,
}

/// Light by group, until it is added to a film. There is none if the scene has no light groups.
#[derive(Default)]
pub struct GroupQueue {
    /// The light that paths keep.
    pub kept: Vec<GroupLight>,
    /// The light that paths' second vertices give to their neighbours.
    pub given: Vec<GroupLight>,
}

impl GroupQueue {
    /// Adds the light that paths have found, to the group of each lane or, in lanes with [`NONE`], to none.
    #[inline(always)]
    pub fn add<F: Float>(
        &mut self,
        path: &Path<F>,
        group: F::Int,
        light: Color<F>,
        is_given: bool,
        mask: F::Mask,
    ) {
        let mask = mask & !group.eq(F::Int::splat(NONE)) & light.max_component().gt(F::zero());
        if !mask.any() {
            return;
        }
        let (mut pixel, mut sample, mut groups) = ([0; 16], [0; 16], [0; 16]);
        let (mut r, mut g, mut b) = ([0.0; 16], [0.0; 16], [0.0; 16]);
        path.pixel.store(&mut pixel);
        path.sample.store(&mut sample);
        group.store(&mut groups);
        light.r.store(&mut r);
        light.g.store(&mut g);
        light.b.store(&mut b);
        let queue = if is_given { &mut self.given } else { &mut self.kept };
        let mut bits = mask.bits();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let light = Rgb::new(r[lane], g[lane], b[lane]);
            queue.push(GroupLight { pixel: pixel[lane], sample: sample[lane], group: groups[lane], light });
        }
    }
}

/// Adds the environment's light that paths have found (`around`) to that of its group. If the film counts what is seen
/// of the things behind the scene, `seen` paths add their throughput to that, and find no light. Returns the light.
#[inline(always)]
pub fn find_around<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    light: Color<F>,
    [around, seen]: [F::Mask; 2],
    found: &mut GroupQueue,
) -> Color<F> {
    let mut light = light;
    let mut around = around;
    if setup.transparent && seen.any() {
        // The film divides by its scale.
        let one = F::splat(setup.unit.one());
        found.add(path, F::Int::splat(setup.groups().transparency()), path.throughput * one, false, seen);
        light = Color::select(seen, Color::black(), light);
        around = around & !seen;
    }
    let group = group_for(setup, path, F::Int::splat(setup.scene.around_group));
    found.add(path, group, light, false, around);
    light
}

/// The group that counts light which paths find: that of the lamp, of the bounce or, with shadow catchers, of theirs.
#[inline(always)]
pub fn group_for<F: Float>(setup: &RenderSetup, path: &Path<F>, light_group: F::Int) -> F::Int {
    match setup.groups_by_path() {
        true => group_after(setup, path, 0, F::Mask::from_bits(0)),
        false => light_group,
    }
}

/// The group that counts light which arrives where paths are scattered now, in lanes that are `caught` there by a shadow
/// catcher or not; [`NONE`] if lamps choose the group.
#[inline(always)]
pub fn group_of_sample<F: Float>(setup: &RenderSetup, path: &Path<F>, caught: F::Mask) -> F::Int {
    match setup.groups_by_path() {
        true => group_after(setup, path, 1, caught),
        false => F::Int::splat(NONE),
    }
}

#[inline(always)]
fn group_after<F: Float>(setup: &RenderSetup, path: &Path<F>, bounces: u32, caught: F::Mask) -> F::Int {
    if setup.catches {
        return caught_group::<F>(setup, caught | bounces::is_set::<F>(path.bounce_counts, CAUGHT));
    }
    let (bounce, last) =
        (path.depth + F::Int::splat(bounces), F::Int::splat(setup.light_groups() as u32 - 1));
    F::Int::select(bounce.lt(last), bounce, last)
}

/// The group that counts the light of shadow catchers in some lanes, and [`NONE`] in the others.
#[inline(always)]
fn caught_group<F: Float>(setup: &RenderSetup, caught: F::Mask) -> F::Int {
    F::Int::select(caught, F::Int::splat(setup.groups().caught(Caught::Arriving)), F::Int::splat(NONE))
}

/// The light group of an emitter, or [`NONE`].
#[inline(always)]
pub fn group_of(setup: &RenderSetup, emitter: u32) -> u32 {
    setup.scene.emitters.group.get(emitter as usize).copied().unwrap_or(NONE)
}
