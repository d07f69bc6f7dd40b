//! Shadow catchers under the path transport: the light of paths that they catch, and the light that these would find
//! without other things. Lamps are found by light samples alone, and the surroundings by both techniques, so that the
//! latter takes no further rays. See `film/catcher.rs`.

use super::path_tracing::{limited, surroundings};
use crate::film::Caught;
use crate::integrator::RenderSetup;
use crate::integrator::path::Path;
use crate::integrator::path::bounces::{self, FROM_CATCHER};
use crate::integrator::path::light_groups::GroupQueue;
use crate::math::Color;
use crate::scene::MaterialRecord;
use crate::simd::{Float, Int, Mask, Outlined};

/// The lanes that a surface catches: those whose path has only gone straight on or through smooth glass.
#[inline(always)]
pub(super) fn caught<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    record: &MaterialRecord,
    mask: F::Mask,
    found: &mut GroupQueue,
) -> F::Mask {
    if !(setup.catches && record.shadow_catcher) {
        return F::Mask::from_bits(0);
    }
    let caught = mask & bounces::only_transmitted::<F>(path.bounce_counts);
    F::outlined(ShowBehind { setup, path, caught, found });
    caught
}

/// Counts the light behind a shadow catcher that paths would see without it.
struct ShowBehind<'a, F: Float> {
    setup: &'a RenderSetup,
    path: &'a Path<F>,
    caught: F::Mask,
    found: &'a mut GroupQueue,
}

impl<F: Float> Outlined for ShowBehind<'_, F> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { setup, path, caught, found } = self;
        let one = F::splat(setup.unit.one());
        let behind = match setup.transparent {
            // The film divides by its scale.
            true => Color::new(one, one, one),
            false => surroundings(setup, None, path, caught).0,
        };
        let group = F::Int::splat(setup.groups().caught(Caught::Behind));
        found.add(path, group, path.throughput * behind, false, caught);
    }
}

/// Counts the surroundings' light in directions that were drawn at a shadow catcher, whatever they have hit. Returns
/// their lanes.
#[inline(always)]
pub(super) fn light_without_things<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    mask: F::Mask,
    found: &mut GroupQueue,
) -> F::Mask {
    if !setup.catches {
        return F::Mask::from_bits(0);
    }
    let drawn = mask & bounces::is_set::<F>(path.bounce_counts, FROM_CATCHER);
    if drawn.any() {
        F::outlined(Unblocked { setup, path, drawn, found });
    }
    drawn
}

struct Unblocked<'a, F: Float> {
    setup: &'a RenderSetup,
    path: &'a Path<F>,
    drawn: F::Mask,
    found: &'a mut GroupQueue,
}

impl<F: Float> Outlined for Unblocked<'_, F> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { setup, path, drawn, found } = self;
        let (light, _) = surroundings(setup, None, path, drawn);
        let light = limited(setup, path, path.throughput * light);
        let group = F::Int::splat(setup.groups().caught(Caught::Unblocked));
        found.add(path, group, light, false, drawn);
    }
}
