//! Sidedness and any-hit filtering: the side from which a primitive can be hit, and the filter that decides if the side
//! does not.
//!
//! Both are applied at the leaf, only to hits that would count. So a ray continues behind a rejected hit in the order
//! of (t, primitive): a second surface at the same place is hit, and an any-hit query ends at the first accepted hit.

use crate::math::Hit;

/// Set in the primitive ids of spheres, clear in those of triangles.
pub const SPHERE: u32 = 1 << 31;

/// The side from which a primitive can be hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sidedness {
    /// Both sides.
    #[default]
    Always = 0,
    /// The side from which a triangle's corners are counter-clockwise; the outside of a sphere.
    Front = 1,
    /// The other side.
    Back = 2,
    /// Decided by the [`HitPredicate`].
    Filtered = 3,
}

impl Sidedness {
    const ALL: [Sidedness; 4] = [Sidedness::Always, Sidedness::Front, Sidedness::Back, Sidedness::Filtered];
}

/// The face culling of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceCulling {
    /// Hits primitives from the side given by their [`Sidedness`].
    AsBuilt,
    /// Hits primitives from the side that a ray in the opposite direction along the same line would hit.
    Opposite,
    /// Hits one-sided primitives from both sides.
    Off,
}

impl FaceCulling {
    /// The effective sidedness of a primitive for such rays.
    #[inline(always)]
    pub(in crate::bvh) fn of(self, sidedness: Sidedness) -> Sidedness {
        match (sidedness, self) {
            (Sidedness::Always | Sidedness::Filtered, _) | (_, FaceCulling::AsBuilt) => sidedness,
            (_, FaceCulling::Off) => Sidedness::Always,
            (Sidedness::Front, FaceCulling::Opposite) => Sidedness::Back,
            (Sidedness::Back, FaceCulling::Opposite) => Sidedness::Front,
        }
    }
}

/// An intersection of a ray with a primitive.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// The hit.
    pub hit: Hit,
    /// True if the ray comes from the front (see [`Sidedness::Front`]).
    pub front: bool,
}

/// Decides about hits of primitives that are [`Sidedness::Filtered`].
pub trait HitPredicate: Sync {
    /// True if the hit counts for ray number `ray`. Must return the same for the same arguments, however often and in
    /// whatever order it is called.
    fn accepts(&self, ray: usize, crossing: &Crossing) -> bool;
}

/// Accepts every hit.
struct AcceptAll;

impl HitPredicate for AcceptAll {
    fn accepts(&self, _: usize, _: &Crossing) -> bool {
        true
    }
}

/// The any-hit filter of a ray.
#[derive(Clone, Copy)]
pub struct AnyHitFilter<'a> {
    predicate: &'a dyn HitPredicate,
    ray: usize,
    sides: FaceCulling,
}

impl<'a> AnyHitFilter<'a> {
    /// The filter that accepts every hit.
    pub const ACCEPT_ALL: AnyHitFilter<'static> =
        AnyHitFilter { predicate: &AcceptAll, ray: 0, sides: FaceCulling::AsBuilt };

    /// Creates the filter of ray number `ray`.
    pub fn new(surfaces: &'a dyn HitPredicate, ray: usize) -> Self {
        Self { predicate: surfaces, ray, sides: FaceCulling::AsBuilt }
    }

    /// Sets the face culling; the default is [`FaceCulling::AsBuilt`].
    pub fn with_culling(self, sides: FaceCulling) -> Self {
        Self { sides, ..self }
    }

    /// The face culling of the ray, and of all rays that are traced with it.
    #[inline(always)]
    pub(in crate::bvh) fn culling(&self) -> FaceCulling {
        self.sides
    }

    /// The filter of the ray some places behind this one.
    #[inline(always)]
    pub(in crate::bvh) fn after(&self, places: usize) -> Self {
        Self { ray: self.ray + places, ..*self }
    }

    /// True if the hit counts for the ray.
    #[cold]
    #[inline(never)]
    pub(in crate::bvh) fn accepts(&self, hit: &Hit, front: bool) -> bool {
        self.predicate.accepts(self.ray, &Crossing { hit: *hit, front })
    }
}

/// A primitive reference: the number of a block's primitive without [`SPHERE`], and in the two high bits its
/// [`Sidedness`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveRef(pub u32);

impl PrimitiveRef {
    /// An unused slot of a block.
    pub const UNUSED: PrimitiveRef = PrimitiveRef(u32::MAX);
    /// The shift of the sidedness.
    pub const SHIFT: i32 = 30;
    /// The largest number of a primitive.
    pub const MAX_NUMBER: u32 = (1 << Self::SHIFT) - 2;

    /// Packs an id and a sidedness; the flag of a sphere's id is dropped.
    pub fn new(id: u32, sidedness: Sidedness) -> Self {
        let number = id & !SPHERE;
        assert!(number <= Self::MAX_NUMBER, "more than 2^30 primitives");
        Self(number | (sidedness as u32) << Self::SHIFT)
    }

    /// The number of the primitive.
    #[inline(always)]
    pub fn number(self) -> u32 {
        self.0 & ((1 << Self::SHIFT) - 1)
    }

    /// The side from which it can be hit.
    #[inline(always)]
    pub fn sidedness(self) -> Sidedness {
        Sidedness::ALL[(self.0 >> Self::SHIFT) as usize & 3]
    }

    /// True if the slot holds a primitive.
    #[inline(always)]
    pub fn is_used(self) -> bool {
        self != Self::UNUSED
    }
}

/// A primitive that a ray may meet.
#[derive(Clone, Copy)]
pub(in crate::bvh) struct PrimitiveCandidate {
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
