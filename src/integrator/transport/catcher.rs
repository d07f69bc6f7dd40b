//! Shadow catchers under the path transport: the light of paths that they catch, and the light that these would find
//! without other things. Lamps are found by light samples alone, and the surroundings by both techniques, so that the
//! latter takes no further rays. See `film/catcher.rs`.

use super::path_tracing::{limited, surroundings};
use crate::film::Caught;
use crate::integrator::RenderSetup;
use crate::integrator::path::Path;
use crate::integrator::path::bounces::{self, FROM_CATCHER};
use crate::integrator::path::light_groups::GroupQueue;
use crate::scene::MaterialRecord;
use crate::simd::{Float, Int, Mask, Outlined};

/// The lanes that a surface catches: those whose path has only gone straight on or through smooth glass.
#[inline(always)]
pub(super) fn caught<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    record: &MaterialRecord,
    mask: F::Mask,
) -> F::Mask {
    if !(setup.catches && record.shadow_catcher) {
        return F::Mask::from_bits(0);
    }
    mask & bounces::only_transmitted::<F>(path.bounce_counts)
}

/// Counts the light behind the surfaces that catch paths.
#[inline(always)]
pub(super) fn count_behind<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    mask: F::Mask,
    found: &mut GroupQueue,
) {
    if mask.any() {
        F::outlined(CountSurroundings { setup, path, part: Caught::Behind, mask, found });
    }
}

/// Counts the surroundings' light in directions that were drawn at a shadow catcher, whatever such paths have hit.
#[inline(always)]
pub(super) fn count_unblocked<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    mask: F::Mask,
    found: &mut GroupQueue,
) {
    if !setup.catches {
        return;
    }
    // Counted once: surfaces that the path goes straight through are other things, too.
    let drawn = bounces::is_set::<F>(path.bounce_counts, FROM_CATCHER) & path.travelled.eq(F::zero());
    let mask = mask & drawn;
    if mask.any() {
        F::outlined(CountSurroundings { setup, path, part: Caught::Unblocked, mask, found });
    }
}

/// Counts the light of the surroundings in the direction of paths.
struct CountSurroundings<'a, F: Float> {
    setup: &'a RenderSetup,
    path: &'a Path<F>,
    part: Caught,
    mask: F::Mask,
    found: &'a mut GroupQueue,
}

impl<F: Float> Outlined for CountSurroundings<'_, F> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { setup, path, part, mask, found } = self;
        let light = if part == Caught::Behind && setup.transparent {
            // The film divides by its scale.
            path.throughput * F::splat(setup.unit.one())
        } else {
            limited(setup, path, path.throughput * surroundings(setup, None, path, mask).0)
        };
        found.add(path, F::Int::splat(setup.groups().caught(part)), light, false, mask);
    }
}
