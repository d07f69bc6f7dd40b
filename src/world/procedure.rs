//! Procedural textures: patterns in texture coordinates or in an object's space, and combinations of textures.

use crate::math::{DAffine3, DMat3, Rgb, Vec3};

use super::assets::{ColorSpace, TextureFilter, TextureId, Wrap};
use super::fields::{Fields, Forms, Range, fields, forms, names};
use super::material::{Channel, ColorInput, ScalarInput};

/// A texture that is computed. Its inputs are textures with smaller numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Procedure {
    /// A pattern with colours.
    Pattern(Box<PatternTexture>),
    /// Colours and alphas at the vertices of a mesh, or a combination of other textures.
    Combination(Combination),
}

impl Procedure {
    /// True if the texture itself depends on positions in the object's space.
    pub(crate) fn is_in_object_space(&self) -> bool {
        matches!(self, Procedure::Pattern(texture) if texture.placement.space == TextureSpace::Object)
    }

    /// True if the texture itself is what is at a mesh's vertices.
    pub(crate) fn is_at_vertices(&self) -> bool {
        matches!(self, Procedure::Combination(Combination::Vertex { .. }))
    }

    /// Calls a function with each texture that this one uses.
    pub(crate) fn for_each_input(&self, found: &mut dyn FnMut(TextureId)) {
        let mut note = |fields: Vec<super::fields::Field>| {
            fields.into_iter().for_each(|field| super::fields::textures(field, &mut |id, _| found(id)));
        };
        match self.clone() {
            Procedure::Pattern(mut texture) => note(texture.placement.fields()),
            Procedure::Combination(mut combination) => note(combination.fields()),
        }
    }
}

/// A pattern with its colours, in its place.
#[derive(Clone, Debug, PartialEq)]
pub struct PatternTexture {
    /// The pattern.
    pub pattern: TexturePattern,
    /// Its place and colours.
    pub placement: PatternPlacement,
}

impl PatternTexture {
    /// A pattern in its usual place and colours.
    pub fn new(pattern: TexturePattern) -> PatternTexture {
        let mut placement = PatternPlacement::default();
        let mut colors = |a: [f32; 3], b: [f32; 3]| {
            (placement.a, placement.b) = (ColorInput::Constant(a.into()), ColorInput::Constant(b.into()));
        };
        match pattern {
            TexturePattern::Bricks { .. } => colors([0.45, 0.43, 0.4], [0.32, 0.09, 0.05]),
            TexturePattern::Wood { .. } => colors([0.42, 0.22, 0.09], [0.2, 0.09, 0.03]),
            TexturePattern::Marble { .. } => colors([0.85, 0.83, 0.8], [0.2, 0.19, 0.2]),
            _ => {}
        }
        if matches!(pattern, TexturePattern::Noise { .. } | TexturePattern::Voronoi { .. })
            || matches!(pattern, TexturePattern::Wood { .. } | TexturePattern::Marble { .. })
        {
            placement.space = TextureSpace::Object;
        }
        placement.wrap = match pattern {
            TexturePattern::Wood { .. } => Wrap::Repeat,
            TexturePattern::Marble { .. } => Wrap::Mirror,
            _ => Wrap::Clamp,
        };
        PatternTexture { pattern, placement }
    }
}

forms! {
    /// A number at each point. Lengths are in units of the pattern: see [`PatternPlacement::scale`].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum TexturePattern, "texture" {
        /// `a` and `b` in turn in the squares of a unit grid, or in its cubes.
        Checker,
        /// From `a` at x = 0 to `b` at x = 1.
        Gradient,
        /// Courses of bricks `b`, of height 1 along y, in mortar `a`.
        Bricks {
            /// of a brick along x
            length: f32 = 2.0, Number(Range::Above0);
            /// width of the mortar
            mortar: f32 = 0.1, Number(Range::UNIT);
        },
        /// Gradient noise (Perlin 2002), one lump a unit.
        Noise {
            /// what is summed over the octaves
            kind: NoiseSum = NoiseSum::Fractal, Form;
            /// number of noises, one finer than the other
            octaves: u32 = 4, Whole(1, 16);
            /// strength of each relative to the one before
            roughness: f32 = 0.5, Number(Range::UNIT);
            /// fineness of each relative to the one before
            lacunarity: f32 = 2.0, Number(Range::FromTo(1.0, 8.0));
        },
        /// The cells around scattered points, one a unit (Worley 1996).
        Voronoi {
            /// distance to the nearest point, a number for each cell, or the difference of the nearest two distances
            kind: VoronoiValue = VoronoiValue::Distance, Form;
            /// from 0, a grid, to 1
            randomness: f32 = 1.0, Number(Range::UNIT);
        },
        /// Rings around the z axis, one a unit, from `a` to `b`.
        Wood {
            /// how far noise moves the rings
            turbulence: f32 = 0.3, Number(Range::From(0.0));
            /// octaves of that noise
            octaves: u32 = 3, Whole(1, 16);
        },
        /// Veins across the x axis, one a unit, from `a` to `b` and back.
        Marble {
            /// how far noise moves the veins
            turbulence: f32 = 1.0, Number(Range::From(0.0));
            /// octaves of that noise
            octaves: u32 = 6, Whole(1, 16);
        },
    }
}

/// A shape of each octave of noise; their sum is the noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NoiseSum {
    /// The noise: clouds.
    #[default]
    Fractal,
    /// Its absolute value: billows with creases.
    Turbulence,
    /// The square of 1 minus its absolute value: ridges.
    Ridged,
}

names!(NoiseSum, "noise", [Fractal, Turbulence, Ridged]);

/// The number at a point of a Voronoi diagram.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VoronoiValue {
    /// The distance to the nearest point.
    #[default]
    Distance,
    /// A random number for each cell.
    Cells,
    /// The difference of the distances to the nearest two points: 0 at the edges of cells.
    Edges,
}

names!(VoronoiValue, "value", [Distance, Cells, Edges]);

/// The coordinates of a pattern.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureSpace {
    /// The mesh's texture coordinates (u, v).
    #[default]
    Uv,
    /// Its second set of texture coordinates.
    Uv1,
    /// The position in the object's space, in metres: the object seems to be cut out of the pattern.
    Object,
}

names!(TextureSpace, "space", [Uv, Uv1, Object]);
names!(Wrap, "wrap", [Repeat, Clamp, Mirror]);
names!(TextureFilter, "filter", [Nearest, Bilinear, Trilinear]);
names!(ColorSpace, "colour space", [Srgb, Linear]);
names!(Channel, "channel", [Red, Green, Blue, Alpha]);

fields! {
    /// The place and colours of a pattern. The pattern is evaluated at rotate(coordinates · scale) + offset.
    #[derive(Clone, Debug, PartialEq)]
    pub struct PatternPlacement, "a texture" {
        /// `Uv`: texture coordinates; `Object`: the position in the object's space, in metres, as if it were cut out of
        /// the pattern; that is the default of `Noise`, `Voronoi`, `Wood` and `Marble`
        space: TextureSpace = TextureSpace::Uv, Form;
        /// units of the pattern per unit of uv or metre: larger numbers make it finer
        scale: Vec3 = Vec3::ONE, Vector(1.0);
        /// rotation about x, then y, then z
        rotate_degrees: Vec3 = Vec3::ZERO, Vector(0.0);
        /// added after the rotation
        offset: Vec3 = Vec3::ZERO, Vector(0.0);
        /// colour, number or texture where the pattern is 0
        a: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::From(0.0));
        /// colour, number or texture where the pattern is 1
        b: ColorInput = ColorInput::Constant(Rgb::WHITE), ColorMap(Range::From(0.0));
        /// colours of more values than 0 and 1, instead of `a` and `b`: `[(0, "black"), (0.3, 0.8), (1, (1, 0, 0))]`
        stops: Vec<(f32, Rgb)> = Vec::new(), Stops;
        /// what is beyond 0 and 1, where `Gradient`, `Wood` and `Marble` go on
        wrap: Wrap = Wrap::Clamp, Form;
    }
}

impl PatternPlacement {
    /// The map from coordinates to those of the pattern.
    pub(crate) fn matrix(&self) -> DAffine3 {
        let [x, y, z] = self.rotate_degrees.to_array().map(|degrees| f64::from(degrees) / 360.0);
        let about = |turns: f64, [a, b]: [usize; 2]| {
            let (sin, cos) =
                (libm::sin(turns * std::f64::consts::TAU), libm::cos(turns * std::f64::consts::TAU));
            let mut matrix = DMat3::IDENTITY;
            (matrix.col_mut(a)[a], matrix.col_mut(a)[b]) = (cos, sin);
            (matrix.col_mut(b)[a], matrix.col_mut(b)[b]) = (-sin, cos);
            matrix
        };
        let rotation = about(z, [0, 1]) * about(y, [2, 0]) * about(x, [1, 2]);
        let scale = DMat3::from_diagonal(self.scale.as_dvec3());
        DAffine3 { matrix3: rotation * scale, translation: self.offset.as_dvec3() }
    }
}

/// A part of the colour and alpha at a mesh's vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VertexChannel {
    /// The colour.
    #[default]
    All,
    /// Its red.
    Red,
    /// Its green.
    Green,
    /// Its blue.
    Blue,
    /// Alpha.
    Alpha,
}

names!(VertexChannel, "channel", [All, Red, Green, Blue, Alpha]);

forms! {
    /// Colours and alphas at the vertices of a mesh, or a combination of other textures, each of them in its own place.
    #[derive(Clone, Debug, PartialEq)]
    pub enum Combination, "texture" {
        /// The colours at the mesh's vertices. In a material that looks them up, they are no factors on its colour and
        /// alpha.
        Vertex {
            /// `All`: the colour; `Red`, `Green`, `Blue` or `Alpha`: one number
            channel: VertexChannel = VertexChannel::All, Form;
        },
        /// `a` where `by` is 0, `b` where it is 1, a mixture between.
        Mix {
            /// colour or texture
            a: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::From(0.0)), required;
            /// colour or texture
            b: ColorInput = ColorInput::Constant(Rgb::WHITE), ColorMap(Range::From(0.0)), required;
            /// part of `b`
            by: ScalarInput = ScalarInput::constant(0.5), NumberMap(Channel::Red), required;
        },
        /// Colours for the numbers of a texture.
        Curve {
            /// texture, of which red counts
            of: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::From(0.0)), required;
            /// colours of numbers from 0 to 1
            stops: Vec<(f32, Rgb)> = Vec::new(), Stops, required;
        },
        /// `a + b`.
        Add {
            /// colour or texture
            a: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::From(0.0)), required;
            /// colour or texture
            b: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::From(0.0)), required;
        },
        /// `a − b`, at least 0.
        Subtract {
            /// colour or texture
            a: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::From(0.0)), required;
            /// colour or texture
            b: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::From(0.0)), required;
        },
        /// `a · b`.
        Multiply {
            /// colour or texture
            a: ColorInput = ColorInput::Constant(Rgb::WHITE), ColorMap(Range::From(0.0)), required;
            /// colour or texture
            b: ColorInput = ColorInput::Constant(Rgb::WHITE), ColorMap(Range::From(0.0)), required;
        },
        /// The smaller one of `a` and `b`.
        Min {
            /// colour or texture
            a: ColorInput = ColorInput::Constant(Rgb::WHITE), ColorMap(Range::From(0.0)), required;
            /// colour or texture
            b: ColorInput = ColorInput::Constant(Rgb::WHITE), ColorMap(Range::From(0.0)), required;
        },
        /// The larger one of `a` and `b`.
        Max {
            /// colour or texture
            a: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::From(0.0)), required;
            /// colour or texture
            b: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::From(0.0)), required;
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;

    #[test]
    fn placement_scales_then_turns_then_moves() {
        let placement = PatternPlacement {
            scale: Vec3::new(2.0, 3.0, 4.0),
            rotate_degrees: Vec3::new(0.0, 0.0, 90.0),
            offset: Vec3::new(0.5, 0.0, 0.0),
            ..PatternPlacement::default()
        };
        let found = placement.matrix().transform_point3(DVec3::new(1.0, 1.0, 1.0));
        assert!((found - DVec3::new(-2.5, 2.0, 4.0)).length() < 1e-12, "{found}");
    }
}
