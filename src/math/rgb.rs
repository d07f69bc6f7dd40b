//! Linear colour.

use std::ops::{Add, AddAssign, Mul};

/// Three linear components with Rec. 709 (sRGB) primaries: a reflectance, a radiance in W m⁻² sr⁻¹ or a power in W,
/// depending on the use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "render", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Rgb {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
}

impl Rgb {
    /// Zero in every component.
    pub const BLACK: Rgb = Rgb::splat(0.0);
    /// One in every component.
    pub const WHITE: Rgb = Rgb::splat(1.0);

    /// A colour from its three components.
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self { r, g, b }
    }

    /// A grey with `value` in every component.
    pub const fn splat(value: f32) -> Self {
        Self::new(value, value, value)
    }

    /// The components as an array, red first.
    pub const fn to_array(self) -> [f32; 3] {
        [self.r, self.g, self.b]
    }

    /// The largest of the three components.
    pub fn max_component(self) -> f32 {
        self.r.max(self.g).max(self.b)
    }

    /// Relative luminance with the weights of Rec. 709: 0.2126 r + 0.7152 g + 0.0722 b.
    pub fn luminance(self) -> f32 {
        0.2126 * self.r + 0.7152 * self.g + 0.0722 * self.b
    }

    /// True if no component is infinite or NaN.
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }

    /// True if every component is exactly zero.
    pub fn is_black(self) -> bool {
        self == Self::BLACK
    }

    /// Applies `f` to each component.
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self::new(f(self.r), f(self.g), f(self.b))
    }
}

impl From<[f32; 3]> for Rgb {
    fn from([r, g, b]: [f32; 3]) -> Self {
        Self::new(r, g, b)
    }
}

impl Add for Rgb {
    type Output = Rgb;
    fn add(self, other: Rgb) -> Rgb {
        Rgb::new(self.r + other.r, self.g + other.g, self.b + other.b)
    }
}

impl AddAssign for Rgb {
    fn add_assign(&mut self, other: Rgb) {
        *self = *self + other;
    }
}

impl Mul for Rgb {
    type Output = Rgb;
    fn mul(self, other: Rgb) -> Rgb {
        Rgb::new(self.r * other.r, self.g * other.g, self.b * other.b)
    }
}

impl Mul<f32> for Rgb {
    type Output = Rgb;
    fn mul(self, factor: f32) -> Rgb {
        self.map(|c| c * factor)
    }
}
