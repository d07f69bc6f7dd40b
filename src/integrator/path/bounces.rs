//! Counters of a path's bounces by kind, packed into one integer, and their limits.
//!
//! The kind of a bounce is that of the drawn lobe. Counters saturate at [`MOST`].

use crate::simd::{Float, Int, Mask};
use crate::world::DepthLimits;

/// Bits of a counter.
const BITS: u32 = 9;
/// The largest count.
pub const MOST: u32 = (1 << BITS) - 1;
/// Flag of paths that have exceeded a limit: the last ray only finds emitters.
const SPENT: u32 = 1 << 31;

/// Flag of paths that have been scattered within a body or have passed a surface without a boundary: no bounces.
pub const FREE_EVENT: u32 = 1 << 30;

/// Flag of paths one of whose directions was drawn with a density, at a surface or within a body.
pub const BLURRED: u32 = 1 << 29;

/// Flag of paths that a shadow catcher has caught: the light that they find is its light.
pub const CAUGHT: u32 = 1 << 28;

/// Flag of paths whose direction was drawn at a shadow catcher, as long as they go straight on.
pub const FROM_CATCHER: u32 = 1 << 27;

const _: () = assert!(3 * BITS <= 27, "counters and flags share an integer");

const _: () = assert!(DepthLimits::MOST < MOST, "a counter must go beyond every limit");

/// The kind of a lobe: its effect on light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LobeKind {
    /// Scatters light widely, to either side.
    Diffuse,
    /// Reflects light like a mirror, however blurred.
    Glossy,
    /// Transmits light like glass, however rough.
    Transmission,
}

impl LobeKind {
    /// All kinds, in the order of the counters.
    pub const ALL: [LobeKind; 3] = [LobeKind::Diffuse, LobeKind::Glossy, LobeKind::Transmission];

    /// The kind of a drawn direction.
    pub fn of(wide: bool, through: bool) -> Self {
        match (wide, through) {
            (true, _) => LobeKind::Diffuse,
            (false, true) => LobeKind::Transmission,
            (false, false) => LobeKind::Glossy,
        }
    }

    /// The name in lower case.
    pub fn name(self) -> &'static str {
        ["diffuse", "glossy", "transmission"][self as usize]
    }

    fn shift(self) -> u32 {
        self as u32 * BITS
    }
}

/// The limits on bounces of each kind, in the order of [`LobeKind::ALL`]; [`MOST`] is no limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BounceLimits([u32; 3]);

impl BounceLimits {
    /// Creates the limits; none if no limit is stricter than `max_depth`.
    pub fn new(limits: DepthLimits, max_depth: u32) -> Option<Self> {
        let DepthLimits { diffuse, glossy, transmission } = limits;
        let counts = |limit: Option<u32>| limit.filter(|most| *most < max_depth).unwrap_or(MOST);
        let limits = [diffuse, glossy, transmission].map(counts);
        (limits != [MOST; 3]).then_some(Self(limits.map(|limit| limit.min(MOST))))
    }

    /// The kind whose limit has ended a path, if any.
    pub fn reached(&self, bounces: u32) -> Option<LobeKind> {
        let counts = counts(bounces);
        LobeKind::ALL.into_iter().find(|kind| counts[*kind as usize] > self.0[*kind as usize])
    }
}

/// The counters after one more bounce, which led through the surface or was drawn from a wide lobe.
#[inline(always)]
pub fn counted<F: Float>(bounces: F::Int, wide: F::Mask, through: F::Mask) -> F::Int {
    let [diffuse, glossy, transmission] = [
        F::Int::splat(1 << LobeKind::Diffuse.shift()),
        F::Int::splat(1 << LobeKind::Glossy.shift()),
        F::Int::splat(1 << LobeKind::Transmission.shift()),
    ];
    let narrow = F::Int::select(through, transmission, glossy);
    let one = F::Int::select(wide, diffuse, narrow);
    let field = one * F::Int::splat(MOST);
    F::Int::select((bounces & field).eq(field), bounces, bounces + one)
}

/// Sets the flag of counters that exceed a limit.
#[inline(always)]
pub fn limited<F: Float>(limits: &BounceLimits, bounces: F::Int) -> F::Int {
    let mut beyond = F::Mask::from_bits(0);
    for (kind, limit) in LobeKind::ALL.into_iter().zip(limits.0) {
        let count = bounces & F::Int::splat(MOST << kind.shift());
        beyond = beyond | F::Int::splat(limit << kind.shift()).lt(count);
    }
    F::Int::select(beyond, bounces | F::Int::splat(SPENT), bounces)
}

/// The lanes whose path has only gone straight on or through smooth glass: what it meets is seen through these.
#[inline(always)]
pub fn only_transmitted<F: Float>(bounces: F::Int) -> F::Mask {
    (bounces & F::Int::splat(MOST << LobeKind::Glossy.shift() | BLURRED)).eq(F::Int::splat(0))
}

/// The lanes whose path has bounced or was scattered within a body, so that its ray is no longer the camera's.
#[inline(always)]
pub fn has_bounced<F: Float>(bounces: F::Int) -> F::Mask {
    const COUNTERS: u32 = (1 << (3 * BITS)) - 1;
    is_set::<F>(bounces, COUNTERS | BLURRED)
}

/// The lanes whose path has had a bounce of a kind.
#[inline(always)]
pub fn has_counted<F: Float>(bounces: F::Int, kind: LobeKind) -> F::Mask {
    is_set::<F>(bounces, MOST << kind.shift())
}

/// The lanes that have one of these flags.
#[inline(always)]
pub fn is_set<F: Float>(bounces: F::Int, flags: u32) -> F::Mask {
    !(bounces & F::Int::splat(flags)).eq(F::Int::splat(0))
}

/// The lanes in which a limit has been exceeded.
#[inline(always)]
pub fn spent<F: Float>(bounces: F::Int) -> F::Mask {
    is_set::<F>(bounces, SPENT)
}

/// Unpacks the counters of a path.
pub fn counts(bounces: u32) -> [u32; 3] {
    LobeKind::ALL.map(|kind| bounces >> kind.shift() & MOST)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::Wrapping;

    fn after(kinds: &[LobeKind]) -> Wrapping<u32> {
        kinds.iter().fold(Wrapping(0), |bounces, kind| {
            let (wide, through) = (*kind == LobeKind::Diffuse, *kind == LobeKind::Transmission);
            assert_eq!(LobeKind::of(wide, through), *kind);
            counted::<f32>(bounces, wide, through)
        })
    }

    #[test]
    fn kinds_are_counted_separately_and_counters_saturate() {
        use LobeKind::{Diffuse, Glossy, Transmission};
        assert_eq!(counts(after(&[Glossy, Diffuse, Glossy, Transmission, Glossy]).0), [1, 3, 1]);
        for kind in LobeKind::ALL {
            let found = counts(after(&vec![kind; 2000]).0);
            assert_eq!(found, LobeKind::ALL.map(|other| if other == kind { MOST } else { 0 }));
        }
    }

    #[test]
    fn limit_is_exceeded_by_the_bounce_after_it() {
        let limits = |diffuse, glossy, transmission, depth| {
            BounceLimits::new(DepthLimits { diffuse, glossy, transmission }, depth)
        };
        assert_eq!(limits(None, None, None, 8), None);
        assert_eq!(limits(Some(8), Some(9), None, 8), None, "max_depth is reached first");
        let two = limits(None, Some(2), None, 8).unwrap();
        let is_spent =
            |limits: &BounceLimits, kinds: &[LobeKind]| spent::<f32>(limited::<f32>(limits, after(kinds)));
        assert!(!is_spent(&two, &[LobeKind::Glossy; 2]) && is_spent(&two, &[LobeKind::Glossy; 3]));
        assert!(!is_spent(&two, &[LobeKind::Diffuse; 7]) && !is_spent(&two, &[LobeKind::Transmission; 2000]));
        let none = limits(Some(0), None, Some(0), 8).unwrap();
        assert_eq!(
            none.reached(after(&[LobeKind::Glossy, LobeKind::Transmission]).0),
            Some(LobeKind::Transmission)
        );
        assert_eq!(none.reached(after(&[LobeKind::Glossy]).0), None);
        assert!(is_spent(&none, &[LobeKind::Diffuse]) && is_spent(&none, &[LobeKind::Transmission]));
        assert!(!is_spent(&none, &[]));
    }
}
