//! Bodies, and which of them a path is in where they lie within each other or overlap (Schmidt and Budge, "Simple
//! nested dielectrics in ray traced images", 2002).

use std::collections::HashMap;

use super::Material;
use super::material::Medium;

/// What light meets within a body. Bodies that do the same to light are of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// A material that encloses such bodies.
    pub material: u32,
    /// Which of several bodies fills a place that they have in common: that of the highest priority; of these, the one
    /// that a path entered last.
    pub priority: i32,
    /// Index of refraction.
    pub index: f32,
    /// As [`Material::dispersion`].
    pub dispersion: f32,
    /// As [`Material::straight`].
    pub straight: bool,
}

/// All kinds of bodies of a scene. A path's bodies are a stack in one integer: kinds plus 1 in groups of bits, the body
/// that fills the place lowest, 0 where there is none.
#[derive(Clone, Debug)]
pub struct Bodies {
    kinds: Vec<Body>,
    /// Bits of a level.
    bits: u32,
    /// Whether some of them have another index than air.
    bend: bool,
}

/// What lies on both sides of a surface that encloses a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BodySides {
    /// The bodies behind it.
    pub far: u32,
    /// The number of the one outside the surface's own body, or 0.
    pub outside: u32,
    /// Whether another body fills both sides, so that there is no boundary.
    pub gone: bool,
}

/// The most kinds that can be told apart.
const MOST: u32 = u16::MAX as u32;

/// What paths in no body are in.
pub const NOWHERE: u32 = 0;

impl Bodies {
    /// Gives every material that encloses a body the number of its kind ([`Material::body`]), if there is a kind.
    pub fn number(materials: &mut [Material], body: impl Fn(&Material) -> Option<Body>) -> Self {
        let (mut kinds, mut numbers) = (Vec::new(), HashMap::new());
        for (at, material) in materials.iter_mut().enumerate() {
            let Some(body) = body(material) else { continue };
            let Medium { extinction, albedo, anisotropy } = material.medium;
            let within = [extinction, albedo, [anisotropy, body.index, body.dispersion]];
            let number = *numbers
                .entry((within.map(|row| row.map(f32::to_bits)), body.priority, body.straight))
                .or_insert_with(|| {
                    kinds.push(Body { material: at as u32, ..body });
                    kinds.len() as u32
                });
            material.body = if number <= MOST { number } else { 0 };
        }
        let bend = kinds.iter().any(|body| body.index != 1.0);
        Self { bits: bits_for(kinds.len()), kinds, bend }
    }

    /// Whether the scene has none.
    #[inline(always)]
    pub fn are_none(&self) -> bool {
        self.kinds.is_empty()
    }

    /// Whether some bodies have another index than air.
    #[inline(always)]
    pub fn bend(&self) -> bool {
        self.bend
    }

    /// How many bodies a path can be in.
    pub fn levels(&self) -> u32 {
        u32::BITS / self.bits
    }

    /// The bits of a stack that say which body fills the place.
    #[inline(always)]
    pub fn top_mask(&self) -> u32 {
        (1 << self.bits) - 1
    }

    /// The body with that number, if there is one.
    #[inline(always)]
    pub fn numbered(&self, number: u32) -> Option<&Body> {
        self.kinds.get(number.wrapping_sub(1) as usize)
    }

    /// The body that fills a place where a path is in these, if there is one.
    #[inline(always)]
    pub fn filling(&self, bodies: u32) -> Option<&Body> {
        self.numbered(bodies & self.top_mask())
    }

    /// All bodies of a stack, the one that fills the place first.
    pub fn all(&self, bodies: u32) -> impl Iterator<Item = &Body> {
        (0..self.levels()).map_while(move |level| self.filling(bodies >> (level * self.bits)))
    }

    /// How many levels lie above the first one that `is` holds for, if there is one.
    fn place(&self, bodies: u32, is: impl Fn(u32) -> bool) -> Option<u32> {
        let number = |level: u32| bodies >> (level * self.bits) & self.top_mask();
        (0..self.levels()).take_while(|level| number(*level) != 0).find(|level| is(number(*level)))
    }

    /// The levels above a place, and those from there on where the uppermost of them is the filling one.
    fn split(&self, bodies: u32, place: u32) -> (u32, u32) {
        let shift = place * self.bits;
        let below = bodies.checked_shr(shift).unwrap_or(0);
        (bodies ^ below.checked_shl(shift).unwrap_or(0), below)
    }

    fn priority(&self, number: u32) -> i32 {
        self.numbered(number).map_or(0, |body| body.priority)
    }

    /// What a path is in after it has entered one more body, and how many bodies fill the place before that one does.
    /// If there are too many, the one that is hidden most is forgotten.
    fn entered(&self, bodies: u32, number: u32) -> (u32, u32) {
        let own = self.priority(number);
        let nesting = self.all(bodies).count() as u32;
        let place = self.place(bodies, |other| self.priority(other) <= own).unwrap_or(nesting);
        let (above, below) = self.split(bodies, place);
        let moved = (below << self.bits | number).checked_shl(place * self.bits).unwrap_or(0);
        let room = u32::MAX >> (u32::BITS - self.levels() * self.bits);
        ((above | moved) & room, place)
    }

    /// What a path is in after it has left a body, and whether another one fills the place. If it never entered that
    /// one, it leaves the one that fills the place: a body's boundary may be of several materials.
    fn left(&self, bodies: u32, number: u32) -> (u32, bool) {
        let place = self.place(bodies, |other| other == number).unwrap_or(0);
        let (above, below) = self.split(bodies, place);
        (above | (below >> self.bits).checked_shl(place * self.bits).unwrap_or(0), place > 0)
    }

    /// The sides of a surface between the body with that number and the one beside it (or 0), for a path in these bodies
    /// that comes to it from within the first one or not.
    pub fn sides(&self, bodies: u32, number: u32, beside: u32, inside: bool) -> BodySides {
        let top = self.top_mask();
        if beside != 0 {
            let is_in = self.place(bodies, |other| other == beside).is_some();
            let (from, to) = if inside { (number, beside) } else { (beside, number) };
            let (left, hidden) = if inside || is_in { self.left(bodies, from) } else { (bodies, false) };
            let (far, place) = self.entered(left, to);
            let outside = if inside { far & top } else { bodies & top };
            let gone = outside == number || if inside { hidden } else { place > 0 };
            return BodySides { far, outside, gone };
        }
        if inside {
            let (far, gone) = self.left(bodies, number);
            return BodySides { far, outside: far & top, gone };
        }
        let (far, place) = self.entered(bodies, number);
        BodySides { far, outside: bodies & top, gone: place > 0 }
    }
}

/// Bits of a level, if there are so many kinds: the fewer, the more levels.
fn bits_for(kinds: usize) -> u32 {
    (kinds as u32).checked_ilog2().map_or(0, |most| most + 1).clamp(4, 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GLASS: u32 = 1;
    const WATER: u32 = 2;
    const ICE: u32 = 3;
    const FOG: u32 = 4;

    fn bodies(priorities: [i32; 4], others: usize) -> Bodies {
        let indices = [1.5, 1.33, 1.31, 1.0];
        let kind =
            |(priority, index)| Body { material: 0, priority, index, dispersion: 0.0, straight: false };
        let mut kinds: Vec<_> = priorities.into_iter().zip(indices).map(kind).collect();
        kinds.resize(4 + others, kind((0, 2.0)));
        Bodies { bits: bits_for(kinds.len()), kinds, bend: true }
    }

    /// A path that goes through surfaces, from outside (+) or from within (−): which body fills the place after each,
    /// what lies outside each, and whether it was there.
    fn walk(bodies: &Bodies, surfaces: &[i32]) -> Vec<(f32, f32, bool)> {
        let mut stack = NOWHERE;
        let index = |body: Option<&Body>| body.map_or(1.0, |body| body.index);
        let pass = |surface: &i32| {
            let sides = bodies.sides(stack, surface.unsigned_abs(), 0, *surface < 0);
            stack = sides.far;
            (index(bodies.filling(stack)), index(bodies.numbered(sides.outside)), !sides.gone)
        };
        surfaces.iter().map(pass).collect()
    }

    #[test]
    fn a_body_within_a_body_replaces_it() {
        let [glass, water, ice, fog] = [GLASS, WATER, ICE, FOG].map(|number| number as i32);
        for others in [0, 12, 300, 60_000] {
            let found = walk(&bodies([0; 4], others), &[fog, glass, -glass, -fog]);
            assert_eq!(found, [(1.0, 1.0, true), (1.5, 1.0, true), (1.0, 1.0, true), (1.0, 1.0, true)]);
        }
        let found = walk(&bodies([0; 4], 0), &[fog, water, ice, -ice, -water, -fog]);
        let expected = [(1.0, 1.0), (1.33, 1.0), (1.31, 1.33), (1.33, 1.33), (1.0, 1.0), (1.0, 1.0)];
        assert_eq!(found, expected.map(|(within, outside)| (within, outside, true)));
        // What was entered last fills what they have in common, until it is left.
        let found = walk(&bodies([0; 4], 0), &[glass, water, -glass, -water]);
        assert_eq!(found, [(1.5, 1.0, true), (1.33, 1.5, true), (1.33, 1.33, false), (1.0, 1.0, true)]);
    }

    #[test]
    fn the_body_of_the_highest_priority_fills_what_several_have_in_common() {
        let [glass, water] = [GLASS, WATER].map(|number| number as i32);
        let bodies = bodies([2, 1, 1, -3], 0);
        // Water that reaches into its glass: its surface there is not there, and glass borders on it.
        let found = walk(&bodies, &[glass, water, -glass, glass, -water, -glass]);
        let expected = [
            (1.5, 1.0, true),
            (1.5, 1.5, false),
            (1.33, 1.33, true),
            (1.5, 1.33, true),
            (1.5, 1.5, false),
            (1.0, 1.0, true),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn bodies_that_touch_border_on_each_other() {
        let bodies = bodies([0; 4], 0);
        let glass = bodies.sides(NOWHERE, GLASS, 0, false).far;
        let water = bodies.sides(glass, GLASS, WATER, true);
        assert_eq!(water, BodySides { far: WATER, outside: WATER, gone: false });
        assert_eq!(bodies.sides(water.far, GLASS, WATER, false), BodySides { far: GLASS, ..water });
        // Nothing is between what is the same on both sides, and fog around both stays.
        assert_eq!(
            bodies.sides(glass, GLASS, GLASS, true),
            BodySides { far: glass, outside: GLASS, gone: true }
        );
        let in_fog = bodies.sides(FOG, GLASS, WATER, false);
        assert_eq!(bodies.filling(in_fog.far), bodies.numbered(GLASS));
        assert_eq!(bodies.sides(in_fog.far, GLASS, 0, true).far, FOG);
    }

    #[test]
    fn what_was_never_entered_is_left_all_the_same() {
        let bodies = bodies([0; 4], 0);
        // As if nothing were around it.
        assert_eq!(
            bodies.sides(NOWHERE, GLASS, 0, true),
            BodySides { far: NOWHERE, outside: 0, gone: false }
        );
        let water = bodies.sides(NOWHERE, WATER, 0, false).far;
        assert_eq!(bodies.sides(water, GLASS, 0, true), BodySides { far: NOWHERE, outside: 0, gone: false });
    }

    #[test]
    fn too_many_bodies_are_forgotten_from_below() {
        for (others, levels) in [(0, 8), (11, 8), (12, 6), (60, 4), (300, 3), (3000, 2)] {
            let bodies = bodies([0; 4], others);
            assert_eq!(bodies.levels(), levels);
            let mut stack = NOWHERE;
            for number in [FOG, GLASS, WATER, ICE, FOG, ICE, WATER, WATER, GLASS] {
                stack = bodies.sides(stack, number, 0, false).far;
                assert_eq!(bodies.filling(stack), bodies.numbered(number));
            }
            let all = bodies.all(stack).count();
            assert_eq!(all as u32, levels);
        }
        // One that would be hidden by all others is forgotten at once.
        let bodies = bodies([1, 1, 1, 0], 60);
        let stack =
            [GLASS, WATER, ICE, GLASS].iter().fold(NOWHERE, |stack, n| bodies.sides(stack, *n, 0, false).far);
        assert_eq!(bodies.sides(stack, FOG, 0, false), BodySides { far: stack, outside: GLASS, gone: true });
    }
}
