//! Bodies, and the stack of bodies that a path is in if they are nested or overlap (Schmidt and Budge, "Simple nested
//! dielectrics in ray traced images", 2002).

use std::collections::HashMap;

use super::MaterialRecord;
use super::material::Medium;

/// The optical properties of a body. Bodies with equal properties are of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// A material that encloses such bodies.
    pub material: u32,
    /// Priority where several bodies overlap: the one of the highest priority fills the place; of equal ones, the one
    /// that the path entered last.
    pub priority: i32,
    /// Index of refraction.
    pub index: f32,
    /// See [`MaterialRecord::dispersion`].
    pub dispersion: f32,
    /// See [`MaterialRecord::passes_shadow_rays`].
    pub passes_shadow_rays: bool,
}

/// All kinds of bodies of a scene. A path's stack of bodies is one integer: kinds plus 1 in groups of bits, the body
/// that fills the place in the lowest bits, 0 for an empty level.
#[derive(Clone, Debug)]
pub struct Bodies {
    kinds: Vec<Body>,
    /// Bits per level of the stack.
    bits: u32,
    /// True if some bodies have another index than air.
    bend: bool,
}

/// The media on both sides of a surface that encloses a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BodySides {
    /// The stack of bodies behind the surface.
    pub far: u32,
    /// The number of the body outside the surface's own body, or 0.
    pub outside: u32,
    /// True if another body fills both sides, so that there is no boundary.
    pub gone: bool,
}

/// The largest number of kinds.
const MOST: u32 = u16::MAX as u32;

/// The empty stack: a path in no body.
pub const NOWHERE: u32 = 0;

impl Bodies {
    /// Assigns the number of its kind ([`MaterialRecord::body`]) to every material that encloses a body, if there is a kind.
    pub fn number(materials: &mut [MaterialRecord], body: impl Fn(&MaterialRecord) -> Option<Body>) -> Self {
        let (mut kinds, mut numbers) = (Vec::new(), HashMap::new());
        for (at, material) in materials.iter_mut().enumerate() {
            let Some(body) = body(material) else { continue };
            let Medium { extinction, albedo, anisotropy } = material.medium;
            let within = [extinction, albedo, [anisotropy, body.index, body.dispersion]];
            let number = *numbers
                .entry((within.map(|row| row.map(f32::to_bits)), body.priority, body.passes_shadow_rays))
                .or_insert_with(|| {
                    kinds.push(Body { material: at as u32, ..body });
                    kinds.len() as u32
                });
            material.body = if number <= MOST { number } else { 0 };
        }
        let bend = kinds.iter().any(|body| body.index != 1.0);
        Self { bits: bits_for(kinds.len()), kinds, bend }
    }

    /// True if the scene has no bodies.
    #[inline(always)]
    pub fn are_none(&self) -> bool {
        self.kinds.is_empty()
    }

    /// True if some bodies have another index than air.
    #[inline(always)]
    pub fn bend(&self) -> bool {
        self.bend
    }

    /// The largest number of bodies on a stack.
    pub fn levels(&self) -> u32 {
        u32::BITS / self.bits
    }

    /// The bits of a stack that hold the body that fills the place.
    #[inline(always)]
    pub fn top_mask(&self) -> u32 {
        (1 << self.bits) - 1
    }

    /// The body with a number, if there is one.
    #[inline(always)]
    pub fn numbered(&self, number: u32) -> Option<&Body> {
        self.kinds.get(number.wrapping_sub(1) as usize)
    }

    /// The body that fills the place of a path with this stack, if there is one.
    #[inline(always)]
    pub fn filling(&self, bodies: u32) -> Option<&Body> {
        self.numbered(bodies & self.top_mask())
    }

    /// All bodies of a stack, starting with the one that fills the place.
    pub fn all(&self, bodies: u32) -> impl Iterator<Item = &Body> {
        (0..self.levels()).map_while(move |level| self.filling(bodies >> (level * self.bits)))
    }

    /// The first level for whose body `is` returns true, if there is one.
    fn place(&self, bodies: u32, is: impl Fn(u32) -> bool) -> Option<u32> {
        let number = |level: u32| bodies >> (level * self.bits) & self.top_mask();
        (0..self.levels()).take_while(|level| number(*level) != 0).find(|level| is(number(*level)))
    }

    /// Splits a stack before level `place`: the levels above it in place, and those from it on, shifted to the lowest
    /// bits.
    fn split(&self, bodies: u32, place: u32) -> (u32, u32) {
        let shift = place * self.bits;
        let below = bodies.checked_shr(shift).unwrap_or(0);
        (bodies ^ below.checked_shl(shift).unwrap_or(0), below)
    }

    fn priority(&self, number: u32) -> i32 {
        self.numbered(number).map_or(0, |body| body.priority)
    }

    /// The stack of a path that enters another body, and the level at which that body is inserted. If the stack is
    /// full, its last body is dropped.
    fn entered(&self, bodies: u32, number: u32) -> (u32, u32) {
        let own = self.priority(number);
        let nesting = self.all(bodies).count() as u32;
        let place = self.place(bodies, |other| self.priority(other) <= own).unwrap_or(nesting);
        let (above, below) = self.split(bodies, place);
        let moved = (below << self.bits | number).checked_shl(place * self.bits).unwrap_or(0);
        let room = u32::MAX >> (u32::BITS - self.levels() * self.bits);
        ((above | moved) & room, place)
    }

    /// The stack of a path that leaves a body, and whether another body filled the place. If the path never entered
    /// that body, it leaves the one that fills the place: a body's boundary may be of several materials.
    fn left(&self, bodies: u32, number: u32) -> (u32, bool) {
        let place = self.place(bodies, |other| other == number).unwrap_or(0);
        let (above, below) = self.split(bodies, place);
        (above | (below >> self.bits).checked_shl(place * self.bits).unwrap_or(0), place > 0)
    }

    /// The sides of a surface between body `number` and body `beside` (or 0), for a path with stack `bodies` that
    /// reaches the surface from within body `number` (`inside`) or from the other side.
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

/// Bits per level for a number of kinds: the fewer bits, the more levels.
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
        let kind = |(priority, index)| Body {
            material: 0,
            priority,
            index,
            dispersion: 0.0,
            passes_shadow_rays: false,
        };
        let mut kinds: Vec<_> = priorities.into_iter().zip(indices).map(kind).collect();
        kinds.resize(4 + others, kind((0, 2.0)));
        Bodies { bits: bits_for(kinds.len()), kinds, bend: true }
    }

    /// Moves a path through surfaces, from outside (+) or from within (−). Returns for each the index of the body that
    /// fills the place behind it, the index outside it, and whether there is a boundary.
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
    fn nested_body_fills_the_place_until_it_is_left() {
        let [glass, water, ice, fog] = [GLASS, WATER, ICE, FOG].map(|number| number as i32);
        for others in [0, 12, 300, 60_000] {
            let found = walk(&bodies([0; 4], others), &[fog, glass, -glass, -fog]);
            assert_eq!(found, [(1.0, 1.0, true), (1.5, 1.0, true), (1.0, 1.0, true), (1.0, 1.0, true)]);
        }
        let found = walk(&bodies([0; 4], 0), &[fog, water, ice, -ice, -water, -fog]);
        let expected = [(1.0, 1.0), (1.33, 1.0), (1.31, 1.33), (1.33, 1.33), (1.0, 1.0), (1.0, 1.0)];
        assert_eq!(found, expected.map(|(within, outside)| (within, outside, true)));
        // The body entered last fills the overlap until it is left.
        let found = walk(&bodies([0; 4], 0), &[glass, water, -glass, -water]);
        assert_eq!(found, [(1.5, 1.0, true), (1.33, 1.5, true), (1.33, 1.33, false), (1.0, 1.0, true)]);
    }

    #[test]
    fn body_of_the_highest_priority_fills_an_overlap() {
        let [glass, water] = [GLASS, WATER].map(|number| number as i32);
        let bodies = bodies([2, 1, 1, -3], 0);
        // Water that reaches into its glass has no boundary within the glass, and the glass borders on water.
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
    fn touching_bodies_border_on_each_other() {
        let bodies = bodies([0; 4], 0);
        let glass = bodies.sides(NOWHERE, GLASS, 0, false).far;
        let water = bodies.sides(glass, GLASS, WATER, true);
        assert_eq!(water, BodySides { far: WATER, outside: WATER, gone: false });
        assert_eq!(bodies.sides(water.far, GLASS, WATER, false), BodySides { far: GLASS, ..water });
        // Equal bodies on both sides have no boundary, and surrounding fog stays.
        assert_eq!(
            bodies.sides(glass, GLASS, GLASS, true),
            BodySides { far: glass, outside: GLASS, gone: true }
        );
        let in_fog = bodies.sides(FOG, GLASS, WATER, false);
        assert_eq!(bodies.filling(in_fog.far), bodies.numbered(GLASS));
        assert_eq!(bodies.sides(in_fog.far, GLASS, 0, true).far, FOG);
    }

    #[test]
    fn leaving_a_body_never_entered_leaves_the_filling_one() {
        let bodies = bodies([0; 4], 0);
        // As if the path were in no other body.
        assert_eq!(
            bodies.sides(NOWHERE, GLASS, 0, true),
            BodySides { far: NOWHERE, outside: 0, gone: false }
        );
        let water = bodies.sides(NOWHERE, WATER, 0, false).far;
        assert_eq!(bodies.sides(water, GLASS, 0, true), BodySides { far: NOWHERE, outside: 0, gone: false });
    }

    #[test]
    fn full_stack_drops_its_last_body() {
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
        // A body below all others on a full stack is dropped immediately.
        let bodies = bodies([1, 1, 1, 0], 60);
        let stack =
            [GLASS, WATER, ICE, GLASS].iter().fold(NOWHERE, |stack, n| bodies.sides(stack, *n, 0, false).far);
        assert_eq!(bodies.sides(stack, FOG, 0, false), BodySides { far: stack, outside: GLASS, gone: true });
    }
}
