//! Whether a primitive is there for a ray: from which side it is, and whom to ask if the side does not settle it.
//!
//! This is asked at the leaf, only of hits that would count. So a ray goes on behind what is not there in the order
//! of (t, primitive): a second surface at the same place is met, and where any hit will do, the first that is there
//! ends the search.

use super::layout::SPHERE;
use crate::math::Hit;

/// From which side a primitive is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Presence {
    /// From everywhere.
    #[default]
    Always = 0,
    /// From where a triangle's corners go around counter-clockwise; from outside a sphere.
    Front = 1,
    /// From the other side.
    Back = 2,
    /// That is for [`Surfaces`] to say.
    Asked = 3,
}

impl Presence {
    const ALL: [Presence; 4] = [Presence::Always, Presence::Front, Presence::Back, Presence::Asked];
}

/// The sides of primitives that rays meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// The ones that are there.
    There,
    /// The ones that are there for a ray the other way along the same line.
    Opposite,
    /// Both, if one is there.
    Both,
}

impl Sides {
    /// The presence of a primitive for such rays.
    #[inline(always)]
    pub(super) fn of(self, presence: Presence) -> Presence {
        match (presence, self) {
            (Presence::Always | Presence::Asked, _) | (_, Sides::There) => presence,
            (_, Sides::Both) => Presence::Always,
            (Presence::Front, Sides::Opposite) => Presence::Back,
            (Presence::Back, Sides::Opposite) => Presence::Front,
        }
    }
}

/// A ray that goes through a primitive.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Where.
    pub hit: Hit,
    /// Whether it comes from the front (see [`Presence::Front`]).
    pub front: bool,
}

/// Says of primitives that are [`Presence::Asked`] whether they are there.
pub trait Surfaces: Sync {
    /// Whether the ray of that number meets something there. The same question has the same answer,
    /// however often and in whatever order it is asked.
    fn is_there(&self, ray: usize, crossing: &Crossing) -> bool;
}

/// All that is hit is there.
struct AllPresent;

impl Surfaces for AllPresent {
    fn is_there(&self, _: usize, _: &Crossing) -> bool {
        true
    }
}

/// A ray that can ask.
#[derive(Clone, Copy)]
pub struct Asker<'a> {
    surfaces: &'a dyn Surfaces,
    ray: usize,
    sides: Sides,
}

impl<'a> Asker<'a> {
    /// For whom everything is there.
    pub const CREDULOUS: Asker<'static> = Asker { surfaces: &AllPresent, ray: 0, sides: Sides::There };

    /// The ray of a number.
    pub fn new(surfaces: &'a dyn Surfaces, ray: usize) -> Self {
        Self { surfaces, ray, sides: Sides::There }
    }

    /// Sets the sides that the ray meets; at first the ones that are there.
    pub fn meeting(self, sides: Sides) -> Self {
        Self { sides, ..self }
    }

    /// The sides that the ray meets, and all rays that are traced with it.
    #[inline(always)]
    pub(super) fn sides(&self) -> Sides {
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
    pub(super) fn meets(&self, hit: &Hit, front: bool) -> bool {
        self.surfaces.is_there(self.ray, &Crossing { hit: *hit, front })
    }
}

/// The number of a block's primitive without [`SPHERE`], and in the two high bits its [`Presence`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word(pub u32);

impl Word {
    /// The place of a block is not used.
    pub const UNUSED: Word = Word(u32::MAX);
    /// Shift of the presence.
    pub const SHIFT: i32 = 30;
    /// The largest number of a primitive.
    pub const MAX_NUMBER: u32 = (1 << Self::SHIFT) - 2;

    /// A word from its parts; of a sphere's id the flag is left out.
    pub fn new(id: u32, presence: Presence) -> Self {
        let number = id & !SPHERE;
        assert!(number <= Self::MAX_NUMBER, "more than 2^30 primitives");
        Self(number | (presence as u32) << Self::SHIFT)
    }

    /// The number.
    #[inline(always)]
    pub fn number(self) -> u32 {
        self.0 & ((1 << Self::SHIFT) - 1)
    }

    /// From which side it is there.
    #[inline(always)]
    pub fn presence(self) -> Presence {
        Presence::ALL[(self.0 >> Self::SHIFT) as usize & 3]
    }

    /// Whether there is a primitive.
    #[inline(always)]
    pub fn is_used(self) -> bool {
        self != Self::UNUSED
    }
}

/// A primitive that a ray may meet.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    pub id: u32,
    pub presence: Presence,
}

impl Candidate {
    /// A triangle in the world.
    #[inline(always)]
    pub fn triangle(word: Word) -> Self {
        Self { id: word.number(), presence: word.presence() }
    }

    /// A sphere in the world.
    #[inline(always)]
    pub fn sphere(word: Word) -> Self {
        Self { id: word.number() | SPHERE, presence: word.presence() }
    }
}
