//! Animations evaluated at a given time. If several animate the same property of a node, the first one counts.

use std::collections::{HashMap, HashSet};

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{Interpolation as Between, Property, Sampler};
use gltf::json::validation::Checked;

use super::accessor::{self, Rule};
use super::document::Document;
use super::pose::Moved;
use crate::error::LoadError;
use crate::formats::track::{Interpolation, Track};
use crate::math::DVec3;

const F32: &[ComponentType] = &[ComponentType::F32];
const FRACTIONS: &[ComponentType] =
    &[ComponentType::F32, ComponentType::I8, ComponentType::U8, ComponentType::I16, ComponentType::U16];
const TIMES: Rule = Rule { types: &[Type::Scalar], components: F32, always_normalized: false };
const VECTORS: Rule = Rule { types: &[Type::Vec3], components: F32, always_normalized: false };
const ROTATIONS: Rule = Rule { types: &[Type::Vec4], components: FRACTIONS, always_normalized: true };
const WEIGHTS: Rule = Rule { types: &[Type::Scalar], components: FRACTIONS, always_normalized: true };

/// The animated properties of all nodes at `time` seconds.
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
            let track = read(document, sampler, property, &place)?;
            let value = track.value(time, property == Property::Rotation);
            let moved = moved.entry(node.value()).or_default();
            match (property, &value[..]) {
                (Property::Translation, &[x, y, z]) => moved.translation = Some(DVec3::new(x, y, z)),
                (Property::Scale, &[x, y, z]) => moved.scale = Some(DVec3::new(x, y, z).as_vec3()),
                (Property::Rotation, &[x, y, z, w]) => {
                    moved.rotation = Some([x, y, z, w].map(|part| part as f32))
                }
                (Property::MorphTargetWeights, weights) => {
                    moved.weights = Some(weights.iter().map(|weight| *weight as f32).collect());
                }
                _ => {}
            }
        }
    }
    Ok(moved)
}

/// Reads a sampler's keys.
fn read(document: &Document, sampler: &Sampler, property: Property, at: &str) -> Result<Track, LoadError> {
    let interpolation = match sampler.interpolation {
        Checked::Valid(Between::Step) => Interpolation::Step,
        Checked::Valid(Between::Linear) => Interpolation::Linear,
        Checked::Valid(Between::CubicSpline) => Interpolation::Cubic,
        Checked::Invalid => {
            return Err(document.error(format_args!("{at}/interpolation"), "there is no such interpolation"));
        }
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
    let parts = if interpolation == Interpolation::Cubic { 3 } else { 1 };
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
    let values = values.into_iter().map(f64::from).collect();
    Ok(Track { times, values, width, interpolation })
}
