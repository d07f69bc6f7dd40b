//! Whether a primitive is there for a ray: from which side it is, and whom to ask if the side does not settle it.
//!
//! This is asked at the leaf, only of hits that would count. So a ray goes on behind what is not there in the order
//! of (t, primitive): a second surface at the same place is met, and where any hit will do, the first that is there
//! ends the search.

use super::layout::SPHERE;
use crate::math::Hit;

/// From which side a primitive is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sidedness {
    /// From everywhere.
    #[default]
    Always = 0,
    /// From where a triangle's corners go around counter-clockwise; from outside a sphere.
    Front = 1,
    /// From the other side.
    Back = 2,
    /// That is for [`HitPredicate`] to say.
    Filtered = 3,
}

impl Sidedness {
    const ALL: [Sidedness; 4] = [Sidedness::Always, Sidedness::Front, Sidedness::Back, Sidedness::Filtered];
}

/// The sides of primitives that rays meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceCulling {
    /// The ones that are there.
    AsBuilt,
    /// The ones that are there for a ray the other way along the same line.
    Opposite,
    /// Both, if one is there.
    Off,
}

impl FaceCulling {
    /// The presence of a primitive for such rays.
    #[inline(always)]
    pub(super) fn of(self, sidedness: Sidedness) -> Sidedness {
        match (sidedness, self) {
            (Sidedness::Always | Sidedness::Filtered, _) | (_, FaceCulling::AsBuilt) => sidedness,
            (_, FaceCulling::Off) => Sidedness::Always,
            (Sidedness::Front, FaceCulling::Opposite) => Sidedness::Back,
            (Sidedness::Back, FaceCulling::Opposite) => Sidedness::Front,
        }
    }
}

/// A ray that goes through a primitive.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Where.
    pub hit: Hit,
    /// Whether it comes from the front (see [`Sidedness::Front`]).
    pub front: bool,
}

/// Says of primitives that are [`Sidedness::Filtered`] whether they are there.
pub trait HitPredicate: Sync {
    /// Whether the ray of that number meets something there. The same question has the same answer,
    /// however often and in whatever order it is asked.
    fn accepts(&self, ray: usize, crossing: &Crossing) -> bool;
}

/// All that is hit is there.
struct AcceptAll;

impl HitPredicate for AcceptAll {
    fn accepts(&self, _: usize, _: &Crossing) -> bool {
        true
    }
}

/// A ray that can ask.
#[derive(Clone, Copy)]
pub struct AnyHitFilter<'a> {
    predicate: &'a dyn HitPredicate,
    ray: usize,
    sides: FaceCulling,
}

impl<'a> AnyHitFilter<'a> {
    /// For whom everything is there.
    pub const ACCEPT_ALL: AnyHitFilter<'static> =
        AnyHitFilter { predicate: &AcceptAll, ray: 0, sides: FaceCulling::AsBuilt };

    /// The ray of a number.
    pub fn new(surfaces: &'a dyn HitPredicate, ray: usize) -> Self {
        Self { predicate: surfaces, ray, sides: FaceCulling::AsBuilt }
    }

    /// Sets the sides that the ray meets; at first the ones that are there.
    pub fn with_culling(self, sides: FaceCulling) -> Self {
        Self { sides, ..self }
    }

    /// The sides that the ray meets, and all rays that are traced with it.
    #[inline(always)]
    pub(super) fn culling(&self) -> FaceCulling {
        self.sides
    }

    /// A ray some places behind this one.
    #[inline(always)]
    pub(super) fn after(&self, places: usize) -> Self {
        Self { ray: self.ray + places, ..*self }
    }

    /// Whether the ray meets something at a crossing.
    #[cold]
    #[inline(never)]
    pub(super) fn accepts(&self, hit: &Hit, front: bool) -> bool {
        self.predicate.accepts(self.ray, &Crossing { hit: *hit, front })
    }
}

/// The number of a block's primitive without [`SPHERE`], and in the two high bits its [`Sidedness`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveRef(pub u32);

impl PrimitiveRef {
    /// The place of a block is not used.
    pub const UNUSED: PrimitiveRef = PrimitiveRef(u32::MAX);
    /// Shift of the presence.
    pub const SHIFT: i32 = 30;
    /// The largest number of a primitive.
    pub const MAX_NUMBER: u32 = (1 << Self::SHIFT) - 2;

    /// A word from its parts; of a sphere's id the flag is left out.
    pub fn new(id: u32, sidedness: Sidedness) -> Self {
        let number = id & !SPHERE;
        assert!(number <= Self::MAX_NUMBER, "more than 2^30 primitives");
        Self(number | (sidedness as u32) << Self::SHIFT)
    }

    /// The number.
    #[inline(always)]
    pub fn number(self) -> u32 {
        self.0 & ((1 << Self::SHIFT) - 1)
    }

    /// From which side it is there.
    #[inline(always)]
    pub fn sidedness(self) -> Sidedness {
        Sidedness::ALL[(self.0 >> Self::SHIFT) as usize & 3]
    }

    /// Whether there is a primitive.
    #[inline(always)]
    pub fn is_used(self) -> bool {
        self != Self::UNUSED
    }
}

/// A primitive that a ray may meet.
#[derive(Clone, Copy)]
pub(super) struct PrimitiveCandidate {
    pub id: u32,
    pub sidedness: Sidedness,
}

impl PrimitiveCandidate {
    /// A triangle in the world.
    #[inline(always)]
    pub fn triangle(word: PrimitiveRef) -> Self {
        Self { id: word.number(), sidedness: word.sidedness() }
    }

    /// A sphere in the world.
    #[inline(always)]
    pub fn sphere(word: PrimitiveRef) -> Self {
        Self { id: word.number() | SPHERE, sidedness: word.sidedness() }
    }
}
