//! Vectors and colours in lanes: the generic counterparts of `Vec3` and `Rgb`.

use std::ops::{Add, Mul, Neg, Sub};

use super::{Rgb, Vec3};
use crate::simd::{Float, Int};

/// A vector in each lane.
#[derive(Clone, Copy)]
pub struct Vector<F> {
    /// The X component.
    pub x: F,
    /// The Y component.
    pub y: F,
    /// The Z component.
    pub z: F,
}

impl From<Vector<f32>> for Vec3 {
    #[inline(always)]
    fn from(v: Vector<f32>) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl<F: Float> Vector<F> {
    /// A vector from its components.
    #[inline(always)]
    pub fn new(x: F, y: F, z: F) -> Self {
        Self { x, y, z }
    }
    /// Broadcasts a vector to all lanes.
    #[inline(always)]
    pub fn splat(v: Vec3) -> Self {
        Self::new(F::splat(v.x), F::splat(v.y), F::splat(v.z))
    }
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat(Vec3::ZERO)
    }
    /// Loads entry `index` of a table of vectors.
    #[inline(always)]
    pub fn gather(table: &[[f32; 3]], index: F::Int, mask: F::Mask) -> Self {
        Self::gather_flat(table.as_flattened(), index * F::Int::splat(3), mask)
    }
    /// Loads three consecutive floats of a table, starting at `first`.
    #[inline(always)]
    pub fn gather_flat(table: &[f32], first: F::Int, mask: F::Mask) -> Self {
        let [x, y, z] = F::gather_three(table, first, mask);
        Self::new(x, y, z)
    }
    /// The dot product a · b, summed in the order x, y, z.
    #[inline(always)]
    pub fn dot(self, other: Self) -> F {
        self.x * other.x + self.y * other.y + self.z * other.z
    }
    /// The cross product a × b.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }
    /// The length |v|.
    #[inline(always)]
    pub fn length(self) -> F {
        self.dot(self).sqrt()
    }
    /// The unit vector v / |v|; NaN for a zero vector.
    #[inline(always)]
    pub fn normalize(self) -> Self {
        self * (F::one() / self.length())
    }
    /// The absolute value of each component.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self::new(self.x.abs(), self.y.abs(), self.z.abs())
    }
    /// `yes` where `mask` is set, `no` elsewhere.
    #[inline(always)]
    pub fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        Self::new(F::select(mask, yes.x, no.x), F::select(mask, yes.y, no.y), F::select(mask, yes.z, no.z))
    }
}

impl<F: Float> Add for Vector<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<F: Float> Sub for Vector<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<F: Float> Mul<F> for Vector<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: F) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

impl<F: Float> Neg for Vector<F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

/// A linear colour in each lane.
#[derive(Clone, Copy)]
pub struct Color<F> {
    /// Red.
    pub r: F,
    /// Green.
    pub g: F,
    /// Blue.
    pub b: F,
}

impl From<Color<f32>> for Rgb {
    #[inline(always)]
    fn from(c: Color<f32>) -> Self {
        Self::new(c.r, c.g, c.b)
    }
}

impl<F: Float> Color<F> {
    /// A colour from its components.
    #[inline(always)]
    pub fn new(r: F, g: F, b: F) -> Self {
        Self { r, g, b }
    }
    /// Broadcasts a colour to all lanes.
    #[inline(always)]
    pub fn splat(c: Rgb) -> Self {
        Self::new(F::splat(c.r), F::splat(c.g), F::splat(c.b))
    }
    /// Black.
    #[inline(always)]
    pub fn black() -> Self {
        Self::splat(Rgb::BLACK)
    }
    /// Loads entry `index` of a table of colours.
    #[inline(always)]
    pub fn gather(table: &[[f32; 3]], index: F::Int, mask: F::Mask) -> Self {
        let v = Vector::gather(table, index, mask);
        Self::new(v.x, v.y, v.z)
    }
    /// The largest component.
    #[inline(always)]
    pub fn max_component(self) -> F {
        self.r.max(self.g).max(self.b)
    }
    /// `yes` where `mask` is set, `no` elsewhere.
    #[inline(always)]
    pub fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        Self::new(F::select(mask, yes.r, no.r), F::select(mask, yes.g, no.g), F::select(mask, yes.b, no.b))
    }
}

impl<F: Float> Color<F> {
    /// Relative luminance (Rec. 709 weights).
    #[inline(always)]
    pub fn luminance(self) -> F {
        self.r * F::splat(0.2126) + self.g * F::splat(0.7152) + self.b * F::splat(0.0722)
    }
    /// 1 − c for each component.
    #[inline(always)]
    pub fn complement(self) -> Self {
        Self::new(F::one() - self.r, F::one() - self.g, F::one() - self.b)
    }
    /// Clamps each component to the range from `low` to `high`.
    #[inline(always)]
    pub fn clamp(self, low: f32, high: f32) -> Self {
        Self::new(self.r.clamp(low, high), self.g.clamp(low, high), self.b.clamp(low, high))
    }
    /// The component-wise quotient `self` / `other`.
    #[inline(always)]
    pub fn over(self, other: Self) -> Self {
        Self::new(self.r / other.r, self.g / other.g, self.b / other.b)
    }
    /// A grey with `value` in every component.
    #[inline(always)]
    pub fn grey(value: F) -> Self {
        Self::new(value, value, value)
    }
    /// Interpolates linearly: `self` where `weight` is 0, `other` where it is 1.
    #[inline(always)]
    pub fn mix(self, other: Self, weight: F) -> Self {
        self * (F::one() - weight) + other * weight
    }
}

impl<F: Float> Add for Color<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.r + other.r, self.g + other.g, self.b + other.b)
    }
}

impl<F: Float> Sub for Color<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, rhs: Self) -> Self {
        Self { r: self.r - rhs.r, g: self.g - rhs.g, b: self.b - rhs.b }
    }
}

impl<F: Float> Mul for Color<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::new(self.r * other.r, self.g * other.g, self.b * other.b)
    }
}

impl<F: Float> Mul<F> for Color<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: F) -> Self {
        Self::new(self.r * factor, self.g * factor, self.b * factor)
    }
}
