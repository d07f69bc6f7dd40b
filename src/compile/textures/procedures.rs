//! Compiles procedural textures to programs.

use std::num::Wrapping;

use crate::error::CompileError;
use crate::math::hash::{mix, to_unit};
use crate::math::{Rgb, Vector};
use crate::scene::Textures;
use crate::scene::procedures::{
    DEEPEST, NoiseKind, Octaves, Operation, PatternFunction, PatternStep, Ramp, RampStop, TextureStep,
    VoronoiKind,
};
use crate::scene::textures::SampledTexture;
use crate::shading::texture_lookup::{Coordinates, texel};
use crate::world::assets::{Assets, ProcedureId, Texture, TextureId, TextureSource, Wrap};
use crate::world::{
    ColorInput, Combination, NoiseSum, PatternPlacement, PatternTexture, Procedure, ScalarInput,
    TexturePattern, TextureSpace, VertexChannel, VoronoiValue,
};

/// The most steps of one program.
const LONGEST: usize = 1000;
/// The number of points from which a texture's levels are estimated.
const PROBES: u32 = 512;
/// Octaves of the noise in wood and marble halve their strength and double their fineness.
const HALVES: f32 = 0.5;

/// Adds a computed texture.
pub(super) fn push(
    out: &mut Textures,
    assets: &Assets,
    texture: &Texture,
    id: ProcedureId,
) -> Result<(), CompileError> {
    let first = out.steps.len();
    let mut program = Program { out, assets, first, depth: 0 };
    program.procedure(id)?;
    let program = [first as u32, out.steps.len() as u32];
    let factor = texture.factor.to_array();
    let mut sampled = SampledTexture { program, factor, ..NO_IMAGE };
    sampled.levels = levels(out, &sampled);
    out.sampled.push(sampled);
    Ok(())
}

const NO_IMAGE: SampledTexture = SampledTexture {
    matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    uv_set: 0,
    factor: [1.0; 3],
    blends: false,
    srgb: false,
    float: true,
    wrap: [0; 2],
    first_level: 0,
    smaller_levels: 0,
    program: [0; 2],
    levels: [0.0; 2],
};

/// The largest component and the mean of the largest components of a texture, from points of it.
fn levels(textures: &Textures, sampled: &SampledTexture) -> [f32; 2] {
    let (mut most, mut sum) = (0.0f32, 0.0);
    for point in 0..PROBES {
        let random = |salt: u32| to_unit::<f32>(mix(Wrapping(4 * point + salt)));
        let uv = (random(0), random(1));
        // A few metres around the object's origin.
        let object = Vector::new(random(1), random(2), random(3)) * 4.0 - Vector::new(2.0, 2.0, 2.0);
        let at = Coordinates { object, ..Coordinates::point([uv; 2]) };
        let color = Rgb::from(texel(textures, sampled, &at, true).color) * Rgb::from(sampled.factor);
        most = most.max(color.max_component());
        sum += color.max_component();
    }
    // The points may have missed the brightest colours.
    let [first, end] = sampled.program.map(|step| step as usize);
    let brightest = textures.steps[first..end].iter().map(|step| match step {
        TextureStep::Constant(color) => Rgb::from(*color).max_component(),
        TextureStep::Pattern(PatternStep { ramp, .. }) | TextureStep::Ramp(ramp) => {
            let stops = &textures.stops[ramp.first as usize..][..ramp.count as usize];
            stops.iter().map(|stop| Rgb::from(stop.color).max_component()).fold(0.0, f32::max)
        }
        TextureStep::Image(image) => textures.brightness(&textures.sampled[*image as usize]).0,
        // No mesh is known here, and colours go from 0 to 1.
        TextureStep::Vertex | TextureStep::VertexChannel(_) => 1.0,
        TextureStep::Mix { .. } | TextureStep::Combine(_) => 0.0,
    });
    let factor = sampled.factor.into_iter().fold(0.0, f32::max);
    [most.max(brightest.fold(0.0, f32::max) * factor), sum / PROBES as f32]
}

struct Program<'a> {
    out: &'a mut Textures,
    assets: &'a Assets,
    first: usize,
    /// The number of texels on the stack.
    depth: usize,
}

impl Program<'_> {
    /// Adds a step after which the stack has `more` texels.
    fn step(&mut self, step: TextureStep, more: isize) -> Result<(), CompileError> {
        self.depth = self.depth.saturating_add_signed(more);
        self.out.steps.push(step);
        if self.depth > DEEPEST || self.out.steps.len() - self.first > LONGEST {
            let what = format!(
                "a texture is made of too many others: at most {LONGEST}, nested at most {DEEPEST} times"
            );
            return Err(CompileError::TooLarge(what));
        }
        Ok(())
    }

    /// Pushes the texel of a procedure.
    fn procedure(&mut self, id: ProcedureId) -> Result<(), CompileError> {
        let assets = self.assets;
        match &assets.procedures[id.0 as usize] {
            Procedure::Pattern(texture) => self.pattern(texture),
            Procedure::Combination(Combination::Vertex { channel }) => {
                let step = match channel {
                    VertexChannel::All => TextureStep::Vertex,
                    VertexChannel::Red => TextureStep::VertexChannel(0),
                    VertexChannel::Green => TextureStep::VertexChannel(1),
                    VertexChannel::Blue => TextureStep::VertexChannel(2),
                    VertexChannel::Alpha => TextureStep::VertexChannel(3),
                };
                self.step(step, 1)
            }
            Procedure::Combination(Combination::Mix { a, b, by }) => {
                self.color(a)?;
                self.color(b)?;
                self.mix(by)
            }
            Procedure::Combination(Combination::Curve { of, stops }) => {
                self.color(of)?;
                let stops: Vec<_> = stops.iter().map(|(at, color)| (*at, color.to_array())).collect();
                let ramp = self.ramp(&stops, Wrap::Clamp);
                self.step(TextureStep::Ramp(ramp), 0)
            }
            Procedure::Combination(Combination::Add { a, b }) => self.combine(Operation::Add, a, b),
            Procedure::Combination(Combination::Subtract { a, b }) => self.combine(Operation::Subtract, a, b),
            Procedure::Combination(Combination::Multiply { a, b }) => self.combine(Operation::Multiply, a, b),
            Procedure::Combination(Combination::Min { a, b }) => self.combine(Operation::Min, a, b),
            Procedure::Combination(Combination::Max { a, b }) => self.combine(Operation::Max, a, b),
        }
    }

    fn combine(&mut self, operation: Operation, a: &ColorInput, b: &ColorInput) -> Result<(), CompileError> {
        self.color(a)?;
        self.color(b)?;
        self.step(TextureStep::Combine(operation), -1)
    }

    fn mix(&mut self, by: &ScalarInput) -> Result<(), CompileError> {
        let Some((texture, channel)) = by.texture else {
            self.step(TextureStep::Constant([by.factor; 3]), 1)?;
            return self.step(TextureStep::Mix { channel: 0, factor: 1.0 }, -2);
        };
        self.texture(texture)?;
        self.step(TextureStep::Mix { channel: channel.index(), factor: by.factor }, -2)
    }

    /// Pushes a colour.
    fn color(&mut self, input: &ColorInput) -> Result<(), CompileError> {
        match input {
            ColorInput::Constant(color) => self.step(TextureStep::Constant(color.to_array()), 1),
            ColorInput::Texture(id) => self.texture(*id),
        }
    }

    /// Pushes the texel of a texture.
    fn texture(&mut self, id: TextureId) -> Result<(), CompileError> {
        match self.assets.textures[id.0 as usize].source {
            TextureSource::Image(_) => self.step(TextureStep::Image(id.0), 1),
            TextureSource::Procedure(procedure) => self.procedure(procedure),
        }
    }

    fn pattern(
        &mut self,
        PatternTexture { pattern, placement }: &PatternTexture,
    ) -> Result<(), CompileError> {
        let constants = match (&placement.a, &placement.b) {
            _ if !placement.stops.is_empty() => {
                Some(placement.stops.iter().map(|(at, color)| (*at, color.to_array())).collect())
            }
            (ColorInput::Constant(a), ColorInput::Constant(b)) => {
                Some(vec![(0.0, a.to_array()), (1.0, b.to_array())])
            }
            _ => None,
        };
        if constants.is_none() {
            self.color(&placement.a)?;
            self.color(&placement.b)?;
        }
        let ramp = constants.as_deref().unwrap_or(&[(0.0, [0.0; 3]), (1.0, [1.0; 3])]);
        let ramp = self.ramp(ramp, placement.wrap);
        let step = PatternStep {
            pattern: compiled(pattern),
            matrix: rows(placement),
            space: space(placement),
            ramp,
        };
        self.step(TextureStep::Pattern(step), 1)?;
        if constants.is_none() {
            self.step(TextureStep::Mix { channel: 0, factor: 1.0 }, -2)?;
        }
        Ok(())
    }

    fn ramp(&mut self, stops: &[(f32, [f32; 3])], wrap: Wrap) -> Ramp {
        let first = self.out.stops.len() as u32;
        self.out.stops.extend(RampStop::chain(stops));
        Ramp { first, count: stops.len() as u32, wrap: wrap.number() }
    }
}

fn compiled(pattern: &TexturePattern) -> PatternFunction {
    let halves = |count: u32| Octaves { count, roughness: HALVES, lacunarity: 1.0 / HALVES };
    match *pattern {
        TexturePattern::Checker => PatternFunction::Checker,
        TexturePattern::Gradient => PatternFunction::Gradient,
        TexturePattern::Bricks { length, mortar } => {
            PatternFunction::Bricks { length, mortar: mortar.min(length) }
        }
        TexturePattern::Noise { kind, octaves, roughness, lacunarity } => {
            let kind = match kind {
                NoiseSum::Fractal => NoiseKind::Fractal,
                NoiseSum::Turbulence => NoiseKind::Turbulence,
                NoiseSum::Ridged => NoiseKind::Ridged,
            };
            PatternFunction::Noise(kind, Octaves { count: octaves, roughness, lacunarity })
        }
        TexturePattern::Voronoi { kind, randomness } => {
            let kind = match kind {
                VoronoiValue::Distance => VoronoiKind::Distance,
                VoronoiValue::Cells => VoronoiKind::Cells,
                VoronoiValue::Edges => VoronoiKind::Edges,
            };
            PatternFunction::Voronoi(kind, randomness)
        }
        TexturePattern::Wood { turbulence, octaves } => PatternFunction::Wood(turbulence, halves(octaves)),
        TexturePattern::Marble { turbulence, octaves } => {
            PatternFunction::Marble(turbulence, halves(octaves))
        }
    }
}

fn space(placement: &PatternPlacement) -> u32 {
    match placement.space {
        TextureSpace::Uv => 0,
        TextureSpace::Uv1 => 1,
        TextureSpace::Object => 2,
    }
}

fn rows(placement: &PatternPlacement) -> [[f32; 4]; 3] {
    let matrix = placement.matrix();
    let (m, t) = (matrix.matrix3, matrix.translation);
    [0, 1, 2].map(|row| [m.row(row).x, m.row(row).y, m.row(row).z, t[row]].map(|number| number as f32))
}
