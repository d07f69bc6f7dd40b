//! Procedural textures: programs for a stack of texels.

/// The most texels on the stack.
pub const DEEPEST: usize = 8;

/// A step of a program. All lanes that are shaded together have the same material, so they take the same steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureStep {
    /// Pushes a colour.
    Constant([f32; 3]),
    /// Pushes the texel of an image: an index into [`Textures::sampled`](super::Textures::sampled).
    Image(u32),
    /// Pushes what is at the mesh's vertices.
    Vertex,
    /// Pushes a channel of it: red, green, blue, alpha.
    VertexChannel(u32),
    /// Pushes the colour that a ramp gives a pattern.
    Pattern(PatternStep),
    /// Replaces the texel on top by the colour that a ramp gives its red.
    Ramp(Ramp),
    /// Replaces a, b and w on top by a + (b − a) w, where w is a channel times a factor.
    Mix {
        /// The channel: red, green, blue, alpha.
        channel: u32,
        /// The factor.
        factor: f32,
    },
    /// Replaces a and b on top by one texel.
    Combine(Operation),
}

/// A pattern in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatternStep {
    /// The pattern.
    pub pattern: PatternFunction,
    /// The rows of the affine map from coordinates to the pattern's; the translation is last.
    pub matrix: [[f32; 4]; 3],
    /// The coordinates: 0 and 1 for the mesh's sets of texture coordinates, 2 for positions in the object's space.
    pub space: u32,
    /// The colours.
    pub ramp: Ramp,
}

/// A pattern: a number at each point of its space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PatternFunction {
    /// 0 and 1 in turn in the cubes of a unit grid.
    Checker,
    /// The coordinate x.
    Gradient,
    /// 1 in bricks of height 1, 0 in the mortar.
    Bricks {
        /// The length of a brick.
        length: f32,
        /// The width of the mortar.
        mortar: f32,
    },
    /// Gradient noise.
    Noise(NoiseKind, Octaves),
    /// The cells nearest to scattered points.
    Voronoi(VoronoiKind, f32),
    /// The distance from the z axis, and turbulence.
    Wood(f32, Octaves),
    /// Twice the coordinate x, and turbulence.
    Marble(f32, Octaves),
}

impl PatternFunction {
    /// The frequency of the finest detail.
    pub fn fineness(&self) -> f32 {
        match self {
            PatternFunction::Noise(_, octaves)
            | PatternFunction::Wood(_, octaves)
            | PatternFunction::Marble(_, octaves) => {
                (1..octaves.count).fold(1.0, |frequency, _| frequency * octaves.lacunarity)
            }
            _ => 1.0,
        }
    }
}

/// A sum of noise at several frequencies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Octaves {
    /// The number of octaves, at least 1.
    pub count: u32,
    /// The amplitude of each relative to the one before.
    pub roughness: f32,
    /// The frequency of each relative to the one before.
    pub lacunarity: f32,
}

/// A shape of each octave of noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseKind {
    /// The noise.
    Fractal,
    /// Its absolute value.
    Turbulence,
    /// The square of 1 minus its absolute value.
    Ridged,
}

/// A number at each point of a Voronoi diagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoronoiKind {
    /// The distance to the nearest point.
    Distance,
    /// A random number for each cell.
    Cells,
    /// The difference of the distances to the nearest two points.
    Edges,
}

/// A combination of two colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// a + b.
    Add,
    /// a − b.
    Subtract,
    /// a b.
    Multiply,
    /// The smaller one.
    Min,
    /// The larger one.
    Max,
}

/// Colours for numbers: a range of [`Textures::stops`](super::Textures::stops).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// The index of the first stop.
    pub first: u32,
    /// The number of stops, at least 1.
    pub count: u32,
    /// The colours beyond 0 and 1: the ramp again (0), its ends (1), its mirror image (2).
    pub wrap: u32,
}

/// A stop of a ramp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RampStop {
    /// The number, from 0 to 1.
    pub at: f32,
    /// Its colour.
    pub color: [f32; 3],
    /// The integral of the ramp from 0 to there.
    pub integral: [f32; 3],
}

impl RampStop {
    /// The stops of a ramp, given by their numbers in order and their colours.
    pub fn chain(stops: &[(f32, [f32; 3])]) -> Vec<RampStop> {
        let mut all: Vec<RampStop> = Vec::with_capacity(stops.len());
        for (at, color) in stops {
            let integral = match all.last() {
                None => color.map(|c| c * at),
                Some(before) => std::array::from_fn(|k| {
                    before.integral[k] + 0.5 * (color[k] + before.color[k]) * (at - before.at)
                }),
            };
            all.push(RampStop { at: *at, color: *color, integral });
        }
        all
    }
}
