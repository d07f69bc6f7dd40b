//! Photometric profiles by direction.

use super::emitter::lane;
use super::texture_lookup::{Coordinates, texel};
use crate::math::elementary::{acos_turns, atan2_turns};
use crate::math::{Color, Vector};
use crate::scene::Textures;
use crate::simd::{Float, Int, Mask};

/// The profile of a light in the direction away from it, relative to its mean; one profile at a time.
#[inline(always)]
pub fn profile_towards<F: Float>(
    textures: &Textures,
    profile: F::Int,
    [axis, across]: [Vector<F>; 2],
    to_lamp: Vector<F>,
    mask: F::Mask,
) -> Color<F> {
    let away = -to_lamp;
    let side = across.cross(axis);
    let turns = atan2_turns(away.dot(side), away.dot(across));
    let around = turns - turns.floor();
    let down = acos_turns(away.dot(axis).max(-F::one()).min(F::one())) * F::splat(2.0);
    let mut part = Color::black();
    let mut todo = mask;
    while todo.any() {
        let first = lane(profile, todo);
        let same = profile.eq(F::Int::splat(first)) & todo;
        let sampled = &textures.sampled[first as usize];
        // The first column lies at azimuth 0, the first row straight ahead and the last one straight back.
        let (columns, rows) = textures.size(sampled);
        let u = around + F::splat(0.5 / columns);
        let v = (down * F::splat(rows - 1.0) + F::splat(0.5)) * F::splat(1.0 / rows);
        let at = Coordinates::point([(u, v); 2]);
        let found = texel(textures, sampled, &at, same).color;
        part = Color::select(same, found, part);
        todo = todo & !same;
    }
    part
}
