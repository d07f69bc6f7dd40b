//! Animations evaluated at a given time. If several animate the same property of a node and none is chosen, the first
//! one counts.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{Interpolation as Between, Property, Sampler};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Animation, Index, Root};

use super::accessor::{self, Rule};
use super::choice::Choice;
use super::document::Document;
use super::pose::Moved;
use crate::error::{Diagnostic, LoadError, words};
use crate::formats::track::{Interpolation, Track};
use crate::math::DVec3;

const F32: &[ComponentType] = &[ComponentType::F32];
const FRACTIONS: &[ComponentType] =
    &[ComponentType::F32, ComponentType::I8, ComponentType::U8, ComponentType::I16, ComponentType::U16];
const TIMES: Rule = Rule { types: &[Type::Scalar], components: F32, always_normalized: false };
const VECTORS: Rule = Rule { types: &[Type::Vec3], components: F32, always_normalized: false };
const ROTATIONS: Rule = Rule { types: &[Type::Vec4], components: FRACTIONS, always_normalized: true };
const WEIGHTS: Rule = Rule { types: &[Type::Scalar], components: FRACTIONS, always_normalized: true };
/// The consequence of a fault in a channel.
const LEFT_OUT: &str = "the channel is left out";

/// The animations of a file, as they are chosen by name or number.
pub(super) fn choice(root: &Root) -> Choice {
    Choice::of("animation", root.animations.iter().map(|animation| animation.name.as_deref()))
}

/// The time of an animation's last key; none if there is none.
pub(super) fn end(document: &Document, animation: &Animation) -> Option<f32> {
    let mut inputs: Vec<_> = animation.samplers.iter().map(|sampler| sampler.input).collect();
    inputs.sort_unstable_by_key(|input| input.value());
    inputs.dedup();
    let end = |input: &Index<Accessor>| {
        // Files should give it beside the keys.
        let given = document.root.accessors.get(input.value())?.max.as_ref();
        let given = given.and_then(|max| max.get(0)?.as_f64()).map(|end| end as f32);
        given.or_else(|| {
            let times = accessor::floats::<1>(document, *input, &TIMES, "").ok()?;
            times.as_flattened().iter().copied().filter(|time| time.is_finite()).reduce(f32::max)
        })
    };
    inputs.iter().filter_map(end).reduce(f32::max)
}

/// The animated properties of all nodes at `time` seconds, in the animation of the given number or in all of them.
pub(super) fn at_time(
    document: &Document,
    time: f32,
    chosen: Option<usize>,
    warnings: &mut Vec<Diagnostic>,
) -> Result<HashMap<usize, Moved>, LoadError> {
    let mut moved: HashMap<usize, Moved> = HashMap::new();
    // The animation that moves each property of a node.
    let mut taken: HashMap<(usize, u32), usize> = HashMap::new();
    let mut rivals: Vec<[usize; 2]> = Vec::new();
    let animations = document.root.animations.iter().enumerate();
    for (number, animation) in animations.filter(|(number, _)| chosen.is_none_or(|chosen| chosen == *number))
    {
        for (place, channel) in animation.channels.iter().enumerate() {
            let at = format!("/animations/{number}/channels/{place}");
            let node = channel.target.node;
            let of_node = format_args!("{at}/target/node");
            if document.find(&document.root.nodes, node, of_node, "node", LEFT_OUT).is_none() {
                continue;
            }
            let Checked::Valid(property) = channel.target.path else {
                document.mend(
                    format_args!("{at}/target/path"),
                    format_args!("there is no such property: {LEFT_OUT}"),
                );
                continue;
            };
            let free = match taken.entry((node.value(), property as u32)) {
                Entry::Vacant(free) => free,
                Entry::Occupied(by) => {
                    let pair = [*by.get(), number];
                    if pair[0] != number && rivals.last() != Some(&pair) {
                        rivals.push(pair);
                    }
                    continue;
                }
            };
            let of_sampler = format_args!("{at}/sampler");
            let samplers = &animation.samplers;
            let sampler = document.find(samplers, channel.sampler, of_sampler, "sampler", LEFT_OUT);
            let Some(sampler) = sampler else { continue };
            let place = format!("/animations/{number}/samplers/{}", channel.sampler.value());
            let Some(track) = read(document, sampler, property, &place)? else { continue };
            free.insert(number);
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
    warnings.extend(rivalry(document, &rivals));
    Ok(moved)
}

/// The warning about animations that move the same property of a node.
fn rivalry(document: &Document, rivals: &[[usize; 2]]) -> Option<Diagnostic> {
    let [counts, ignored] = *rivals.first()?;
    let mut others: Vec<usize> = rivals.iter().map(|[_, ignored]| *ignored).collect();
    others.sort_unstable();
    others.dedup();
    let more = match others.len() - 1 {
        0 => String::new(),
        more => format!(" (and {more} more)"),
    };
    let choice = choice(&document.root);
    let [first, second] = [counts, ignored].map(|number| words(&choice.called(number)));
    let remedy = choice.option("--animation", ignored);
    let remedy = remedy.map_or_else(String::new, |option| format!(" (`{option}` shows the other)"));
    let what = format!(
        "the animations \"{first}\" and \"{second}\"{more} move the same nodes: \"{first}\" counts{remedy}"
    );
    Some(Diagnostic { code: "several-animations", ..document.warning(what) })
}

/// Reads a sampler's keys; none if they are not as expected, which is recorded.
fn read(
    document: &Document,
    sampler: &Sampler,
    property: Property,
    at: &str,
) -> Result<Option<Track>, LoadError> {
    let interpolation = match sampler.interpolation {
        Checked::Valid(Between::Step) => Interpolation::Step,
        Checked::Valid(Between::Linear) => Interpolation::Linear,
        Checked::Valid(Between::CubicSpline) => Interpolation::Cubic,
        Checked::Invalid => {
            let what = "there is no such interpolation: LINEAR is taken";
            document.mend(format_args!("{at}/interpolation"), what);
            Interpolation::Linear
        }
    };
    let (input, output) = (format!("{at}/input"), format!("{at}/output"));
    let rule = match property {
        Property::Translation | Property::Scale => VECTORS,
        Property::Rotation => ROTATIONS,
        Property::MorphTargetWeights => WEIGHTS,
    };
    for (index, rule, place) in [(sampler.input, &TIMES, &input), (sampler.output, &rule, &output)] {
        if let Err(reason) = accessor::count_of(document, index, rule) {
            document.mend(place, format_args!("{reason}: {LEFT_OUT}"));
            return Ok(None);
        }
    }
    let times = accessor::floats::<1>(document, sampler.input, &TIMES, &input)?.as_flattened().to_vec();
    let values = match property {
        Property::Translation | Property::Scale => {
            accessor::floats::<3>(document, sampler.output, &rule, &output)?.as_flattened().to_vec()
        }
        Property::Rotation => {
            accessor::floats::<4>(document, sampler.output, &rule, &output)?.as_flattened().to_vec()
        }
        Property::MorphTargetWeights => {
            accessor::floats::<1>(document, sampler.output, &rule, &output)?.as_flattened().to_vec()
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
        document.mend(output, format_args!("{values} numbers do not fit {times} times: {LEFT_OUT}"));
        return Ok(None);
    }
    let values = values.into_iter().map(f64::from).collect();
    let track = Track { times, values, width, interpolation };
    let track = with_fit_keys(track, parts * width, |fault| match fault {
        KeyFault::NotFinite => document.mend(at, "a key is not finite: it is left out"),
        KeyFault::Unsorted => document.mend(&input, "times do not grow from key to key: the keys are sorted"),
        KeyFault::Equal => {
            document.mend(&input, "two keys have the same time: from then on, the later one counts");
        }
    });
    if track.times.is_empty() {
        document.mend(at, format_args!("no key is finite: {LEFT_OUT}"));
        return Ok(None);
    }
    Ok(Some(track))
}

/// A fault in the keys of a track.
enum KeyFault {
    NotFinite,
    Unsorted,
    Equal,
}

/// Leaves out the keys of a track that are not finite, and sorts the others by their times. Of keys with the same time
/// the former ends what is before, and the latter begins what is after. Each key has `stride` values.
fn with_fit_keys(track: Track, stride: usize, mut report: impl FnMut(KeyFault)) -> Track {
    let Track { times, values, width, interpolation } = track;
    let value = |key: usize| &values[key * stride..(key + 1) * stride];
    let is_finite =
        |key: &usize| times[*key].is_finite() && value(*key).iter().all(|value| value.is_finite());
    let mut order: Vec<usize> = (0..times.len()).filter(is_finite).collect();
    let is_whole = order.len() == times.len();
    if !is_whole {
        report(KeyFault::NotFinite);
    }
    let is_sorted = order.is_sorted_by(|a, b| times[*a] <= times[*b]);
    if !is_sorted {
        report(KeyFault::Unsorted);
        order.sort_by(|a, b| times[*a].total_cmp(&times[*b]));
    }
    if order.windows(2).any(|pair| times[pair[0]] == times[pair[1]]) {
        report(KeyFault::Equal);
    }
    if is_whole && is_sorted {
        return Track { times, values, width, interpolation };
    }
    let sorted = order.iter().flat_map(|key| value(*key)).copied().collect();
    Track { times: order.iter().map(|key| times[*key]).collect(), values: sorted, width, interpolation }
}
