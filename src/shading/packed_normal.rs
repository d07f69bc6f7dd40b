//! The orientation of a surface for light selection: its normal in one word. A path carries it to compute the
//! probability with which a light that it hits would have been chosen.

use super::light_tree::Angle;
use crate::math::{NONE, Vector};
use crate::simd::{Float, Int};

/// Steps of the square's first coordinate: 16 bits, whose last value is reserved for [`NONE`].
const STEPS_X: f32 = 65_534.0;
/// Steps of the square's second coordinate: 15 bits.
const STEPS_Y: f32 = 32_767.0;
/// The bit of surfaces that transmit light.
const BOTH: u32 = 1 << 31;

/// A decoded orientation.
pub(super) struct Facing<F: Float> {
    normal: Vector<F>,
    /// The surface is lit from both sides.
    both: F::Mask,
    /// There is no surface.
    none: F::Mask,
}

/// Maps a unit vector to the square from −1 to 1 by unfolding an octahedron (Cigolle and others, "A survey of efficient
/// representations for independent unit vectors", 2014).
#[inline(always)]
pub fn to_square<F: Float>(v: Vector<F>) -> (F, F) {
    let (zero, one) = (F::zero(), F::one());
    let scale = one / (v.x.abs() + v.y.abs() + v.z.abs()).max(F::splat(f32::MIN_POSITIVE));
    let (x, y) = (v.x * scale, v.y * scale);
    let below = v.z.lt(zero);
    let x = F::select(below, signed(one - v.y.abs() * scale, x), x);
    let y = F::select(below, signed(one - v.x.abs() * scale, v.y), y);
    (x, y)
}

/// The inverse of [`to_square`].
#[inline(always)]
pub fn from_square<F: Float>(x: F, y: F) -> Vector<F> {
    let z = F::one() - x.abs() - y.abs();
    let folded = (-z).max(F::zero());
    let v = Vector::new(x - signed(folded, x), y - signed(folded, y), z);
    v * (F::one() / v.dot(v).sqrt())
}

/// Encodes a unit normal in one word. If `both` is set, light from behind counts too.
#[inline(always)]
pub fn packed_normal<F: Float>(normal: Vector<F>, both: bool) -> F::Int {
    let half = F::splat(0.5);
    let (x, y) = to_square(normal);
    let x = ((x * half + half) * F::splat(STEPS_X) + half).clamp(0.0, STEPS_X).to_int();
    let y = ((y * half + half) * F::splat(STEPS_Y) + half).clamp(0.0, STEPS_Y).to_int();
    x | y.shl::<16>() | F::Int::splat(if both { BOTH } else { 0 })
}

/// `size` with the sign of `of`.
#[inline(always)]
fn signed<F: Float>(size: F, of: F) -> F {
    F::select(of.lt(F::zero()), -size, size)
}

impl<F: Float> Facing<F> {
    /// Decodes a word of [`packed_normal`]; [`NONE`] is no surface.
    #[inline(always)]
    pub fn new(word: F::Int) -> Self {
        let one = F::one();
        let x = (word & F::Int::splat(0xffff)).to_float() * F::splat(2.0 / STEPS_X) - one;
        let y = (word.shr::<16>() & F::Int::splat(0x7fff)).to_float() * F::splat(2.0 / STEPS_Y) - one;
        let both = !(word & F::Int::splat(BOTH)).eq(F::Int::splat(0));
        Self { normal: from_square(x, y), both, none: word.eq(F::Int::splat(NONE)) }
    }

    /// The largest signed distance of a box in front of the surface, in metres, from the vector to its centre and half
    /// its size; infinite if light from all sides counts.
    #[inline(always)]
    pub fn reach(&self, way: Vector<F>, half: Vector<F>) -> F {
        let n = self.normal;
        let reach = way.dot(n) + half.x * n.x.abs() + half.y * n.y.abs() + half.z * n.z.abs();
        F::select(self.none | self.both, F::splat(f32::INFINITY), reach)
    }

    /// The cosine of the angle between the normal and the nearest direction to a light, whose directions are within the
    /// angle `seen` of `to_light`. 1 if there is no surface.
    #[inline(always)]
    pub fn cos(&self, to_light: Vector<F>, seen: &Angle<F>) -> F {
        let cos = to_light.dot(self.normal);
        let off = Angle::of(F::select(self.both, cos.abs(), cos)).less(seen);
        F::select(self.none, F::one(), off.cos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::sampling::Stream;
    use rand::RngExt;

    #[test]
    fn normals_survive_encoding_and_decoding() {
        let mut stream = Stream::new(2);
        let mut axes = vec![Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
        axes.extend((0..20_000).map(|_| Vec3::from_array([0; 3].map(|_| stream.random_range(-1.0..1.0)))));
        for axis in axes {
            let normal = axis.normalize();
            let word = packed_normal::<f32>(Vector::splat(normal), false);
            let back = Facing::<f32>::new(word);
            let n = back.normal;
            let off = (Vec3::new(n.x, n.y, n.z) - normal).length();
            assert!(off < 1.5e-4 && !back.both && !back.none, "{normal} {off}");
            let both = Facing::<f32>::new(packed_normal::<f32>(Vector::splat(normal), true));
            assert!(both.both && !both.none);
        }
        assert!(Facing::<f32>::new(std::num::Wrapping(NONE)).none);
    }
}
