//! Animations at one moment. Where two of them move the same part of a node the first counts.

use std::collections::{HashMap, HashSet};

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{Interpolation, Property, Sampler};
use gltf::json::validation::Checked;

use super::accessor::{self, Rule};
use super::document::Document;
use super::pose::Moved;
use crate::error::LoadError;
use crate::math::Vec3;

const F32: &[ComponentType] = &[ComponentType::F32];
const FRACTIONS: &[ComponentType] =
    &[ComponentType::F32, ComponentType::I8, ComponentType::U8, ComponentType::I16, ComponentType::U16];
const TIMES: Rule = Rule { types: &[Type::Scalar], components: F32, always_normalized: false };
const VECTORS: Rule = Rule { types: &[Type::Vec3], components: F32, always_normalized: false };
const ROTATIONS: Rule = Rule { types: &[Type::Vec4], components: FRACTIONS, always_normalized: true };
const WEIGHTS: Rule = Rule { types: &[Type::Scalar], components: FRACTIONS, always_normalized: true };

/// What all animations of a file make of its nodes at `time` seconds.
pub(super) fn at_time(document: &Document, time: f32) -> Result<HashMap<usize, Moved>, LoadError> {
    let mut moved: HashMap<usize, Moved> = HashMap::new();
    let mut taken = HashSet::new();
    for (number, animation) in document.root.animations.iter().enumerate() {
        for (place, channel) in animation.channels.iter().enumerate() {
            let at = format!("/animations/{number}/channels/{place}");
            let node = channel.target.node;
            document.get(&document.root.nodes, node, format_args!("{at}/target/node"), "node")?;
            let Checked::Valid(property) = channel.target.path else {
                return Err(document.error(format_args!("{at}/target/path"), "there is no such property"));
            };
            if !taken.insert((node.value(), property as u32)) {
                continue;
            }
            let sampler = document.get(&animation.samplers, channel.sampler, &at, "sampler")?;
            let place = format!("/animations/{number}/samplers/{}", channel.sampler.value());
            let track = Track::read(document, sampler, property, &place)?;
            let value = track.value(time, property == Property::Rotation);
            let moved = moved.entry(node.value()).or_default();
            match (property, &value[..]) {
                (Property::Translation, &[x, y, z]) => moved.translation = Some(Vec3::new(x, y, z)),
                (Property::Scale, &[x, y, z]) => moved.scale = Some(Vec3::new(x, y, z)),
                (Property::Rotation, &[x, y, z, w]) => moved.rotation = Some([x, y, z, w]),
                (Property::MorphTargetWeights, weights) => moved.weights = Some(weights.to_vec()),
                _ => {}
            }
        }
    }
    Ok(moved)
}

/// Values over time.
struct Track {
    times: Vec<f32>,
    /// For each time `width` values; with tangents, three times as many: in, value, out.
    values: Vec<f32>,
    width: usize,
    interpolation: Interpolation,
}

impl Track {
    fn read(document: &Document, sampler: &Sampler, property: Property, at: &str) -> Result<Self, LoadError> {
        let Checked::Valid(interpolation) = sampler.interpolation else {
            return Err(document.error(format_args!("{at}/interpolation"), "there is no such interpolation"));
        };
        let place = format!("{at}/input");
        let times = accessor::floats::<1>(document, sampler.input, &TIMES, &place)?.as_flattened().to_vec();
        if times.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(document.error(place, "times must grow from key to key"));
        }
        let place = format!("{at}/output");
        let values = match property {
            Property::Translation | Property::Scale => {
                accessor::floats::<3>(document, sampler.output, &VECTORS, &place)?.as_flattened().to_vec()
            }
            Property::Rotation => {
                accessor::floats::<4>(document, sampler.output, &ROTATIONS, &place)?.as_flattened().to_vec()
            }
            Property::MorphTargetWeights => {
                accessor::floats::<1>(document, sampler.output, &WEIGHTS, &place)?.as_flattened().to_vec()
            }
        };
        let parts = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let keys = times.len() * parts;
        let width = match property {
            Property::Translation | Property::Scale => 3,
            Property::Rotation => 4,
            Property::MorphTargetWeights => values.len() / keys,
        };
        if width == 0 || values.len() != keys * width {
            let (values, times) = (values.len(), times.len());
            return Err(document.error(place, format!("{values} numbers do not fit {times} times")));
        }
        Ok(Self { times, values, width, interpolation })
    }

    /// The values at a moment; before the first key and after the last one theirs.
    fn value(&self, time: f32, turns: bool) -> Vec<f32> {
        let cubic = self.interpolation == Interpolation::CubicSpline;
        let parts = if cubic { 3 } else { 1 };
        let part = |key: usize, part: usize| {
            let start = (key * parts + part) * self.width;
            &self.values[start..start + self.width]
        };
        let middle = parts / 2;
        let after = self.times.partition_point(|key| *key <= time);
        let last = self.times.len() - 1;
        let Some(before) = after.checked_sub(1) else { return part(0, middle).to_vec() };
        if before == last || self.interpolation == Interpolation::Step {
            return part(before, middle).to_vec();
        }
        let span = self.times[after] - self.times[before];
        let t = (time - self.times[before]) / span;
        let (a, b) = (part(before, middle), part(after, middle));
        if cubic {
            let (leaving, arriving) = (part(before, 2), part(after, 0));
            let (t2, t3) = (t * t, t * t * t);
            let weights = [
                2.0 * t3 - 3.0 * t2 + 1.0,
                span * (t3 - 2.0 * t2 + t),
                3.0 * t2 - 2.0 * t3,
                span * (t3 - t2),
            ];
            let value = |i: usize| {
                a[i] * weights[0] + leaving[i] * weights[1] + b[i] * weights[2] + arriving[i] * weights[3]
            };
            return (0..self.width).map(value).collect();
        }
        match (turns, a, b) {
            (true, &[ax, ay, az, aw], &[bx, by, bz, bw]) => {
                slerp([ax, ay, az, aw], [bx, by, bz, bw], t).to_vec()
            }
            _ => a.iter().zip(b).map(|(a, b)| a + (b - a) * t).collect(),
        }
    }
}

/// Between two unit quaternions on the shorter way round, at constant speed.
fn slerp(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    let [a, mut b] = [a, b].map(|q| q.map(f64::from));
    let mut cosine: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
    if cosine < 0.0 {
        cosine = -cosine;
        b = b.map(|c| -c);
    }
    let t = f64::from(t);
    // Where they are all but equal the sine would be 0.
    let (from, to) = if cosine > 0.9995 {
        (1.0 - t, t)
    } else {
        let angle = libm::acos(cosine);
        let sine = libm::sin(angle);
        (libm::sin((1.0 - t) * angle) / sine, libm::sin(t * angle) / sine)
    };
    std::array::from_fn(|i| (a[i] * from + b[i] * to) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(interpolation: Interpolation, values: &[f32]) -> Track {
        Track { times: vec![1.0, 3.0], values: values.to_vec(), width: 1, interpolation }
    }

    #[test]
    fn values_lie_between_keys_and_stay_beyond_them() {
        let line = track(Interpolation::Linear, &[10.0, 20.0]);
        let at = |time: f32| line.value(time, false)[0];
        assert_eq!([at(0.0), at(1.0), at(2.5), at(3.0), at(9.0)], [10.0, 10.0, 17.5, 20.0, 20.0]);
        let step = track(Interpolation::Step, &[10.0, 20.0]);
        assert_eq!([step.value(2.9, false)[0], step.value(3.0, false)[0]], [10.0, 20.0]);
        let smooth = track(Interpolation::CubicSpline, &[9.0, 10.0, 0.0, 0.0, 20.0, 9.0]);
        assert_eq!(smooth.value(2.0, false)[0], 15.0, "level at both ends");
        assert_eq!([smooth.value(0.0, false)[0], smooth.value(5.0, false)[0]], [10.0, 20.0]);
        let sloped = track(Interpolation::CubicSpline, &[0.0, 0.0, 1.0, 1.0, 2.0, 0.0]);
        assert!((sloped.value(1.5, false)[0] - 0.5).abs() < 1e-6, "tangents are a unit of time long");
    }

    #[test]
    fn turns_take_the_shorter_way() {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let [x, y, z, w] = slerp([0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -half, -half], 0.5);
        let eighth = std::f32::consts::FRAC_PI_8;
        assert!(x == 0.0 && y == 0.0 && (z - eighth.sin()).abs() < 1e-6 && (w - eighth.cos()).abs() < 1e-6);
    }
}
