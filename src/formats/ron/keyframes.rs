//! Values that change with time: `Keys([(time_s, value), …])` in place of a single value.
//!
//! A scene is read at one time: keys are evaluated while it is read, and no later stage handles them.

use std::cell::Cell;

use super::source::{Raw, SceneText};
use crate::error::LoadError;
use crate::formats::track::{Interpolation, Track};
use crate::math::{DQuat, DVec3, Quat, Rgb, Vec2, Vec3};

const NAME: &str = "Keys";
const FORM: &str = "Keys([(seconds, value), …])";
const BETWEEN: &[(&str, Between)] =
    &[("Linear", Between::Linear), ("Smooth", Between::Smooth), ("Step", Between::Step)];

/// The interpolation between two keys.
#[derive(Clone, Copy)]
enum Between {
    Linear,
    Smooth,
    Step,
}

/// The time at which a scene is read, and the state of reading its keys.
#[derive(Debug, Default)]
pub(super) struct Clock {
    /// The time in seconds.
    pub time_s: f32,
    /// The reason if keys are not allowed here.
    pub refused: Cell<Option<&'static str>>,
    /// True if any keys have been read.
    pub asked: Cell<bool>,
    /// The time of the last of them in seconds.
    pub end_s: Cell<Option<f32>>,
}

/// Values that can be interpolated.
pub(super) trait Keyed: Sized {
    /// True for unit quaternions.
    const TURNS: bool = false;

    /// The value as numbers, always the same count for a type.
    fn numbers(self) -> Vec<f64>;

    /// The value from such numbers.
    fn of(numbers: &[f64]) -> Self;
}

impl Keyed for f32 {
    fn numbers(self) -> Vec<f64> {
        vec![f64::from(self)]
    }

    fn of(numbers: &[f64]) -> Self {
        numbers[0] as f32
    }
}

impl Keyed for f64 {
    fn numbers(self) -> Vec<f64> {
        vec![self]
    }

    fn of(numbers: &[f64]) -> Self {
        numbers[0]
    }
}

impl Keyed for [f64; 3] {
    fn numbers(self) -> Vec<f64> {
        self.to_vec()
    }

    fn of(numbers: &[f64]) -> Self {
        std::array::from_fn(|i| numbers[i])
    }
}

impl Keyed for Vec2 {
    fn numbers(self) -> Vec<f64> {
        self.to_array().map(f64::from).to_vec()
    }

    fn of(numbers: &[f64]) -> Self {
        Vec2::new(numbers[0] as f32, numbers[1] as f32)
    }
}

impl Keyed for Vec3 {
    fn numbers(self) -> Vec<f64> {
        self.as_dvec3().numbers()
    }

    fn of(numbers: &[f64]) -> Self {
        DVec3::of(numbers).as_vec3()
    }
}

impl Keyed for DVec3 {
    fn numbers(self) -> Vec<f64> {
        self.to_array().to_vec()
    }

    fn of(numbers: &[f64]) -> Self {
        DVec3::from_slice(numbers)
    }
}

impl Keyed for Rgb {
    fn numbers(self) -> Vec<f64> {
        self.to_array().map(f64::from).to_vec()
    }

    fn of(numbers: &[f64]) -> Self {
        Rgb::from(Vec3::of(numbers).to_array())
    }
}

impl Keyed for Quat {
    const TURNS: bool = true;

    fn numbers(self) -> Vec<f64> {
        self.to_array().map(f64::from).to_vec()
    }

    /// Normalises an interpolation of unit quaternions; a unit quaternion is kept as it is.
    fn of(numbers: &[f64]) -> Self {
        let precise = DQuat::from_slice(numbers);
        let length = precise.length_squared().sqrt();
        if (length - 1.0).abs() < 1e-7 { precise.as_quat() } else { (precise / length).as_quat() }
    }
}

impl<'a> SceneText<'a> {
    /// Tests if a value has keys.
    pub(super) fn has_keys(&self, raw: Raw<'a>) -> bool {
        raw.0.starts_with(NAME) && self.variant(raw).is_some_and(|variant| variant.name == NAME)
    }

    /// The value, constant or keyed, at the time at which the scene is read. `read` reads a single value.
    pub(super) fn keyed<T: Keyed>(
        &self,
        raw: Raw<'a>,
        read: impl Fn(Raw<'a>) -> Result<T, LoadError>,
    ) -> Result<T, LoadError> {
        if !self.has_keys(raw) {
            return read(raw);
        }
        if let Some(reason) = self.clock().refused.get() {
            return Err(self.error(raw.0, reason));
        }
        self.clock().asked.set(true);
        let body = self.variant(raw).and_then(|variant| variant.body).unwrap_or("()");
        let (keys, between) = match self.values(body).collect::<Vec<_>>()[..] {
            [keys] => (keys, Between::Linear),
            [keys, between] => (keys, self.choice(Raw(between), "interpolation", BETWEEN)?),
            _ => return Err(self.expected(raw, FORM)),
        };
        let (mut times, mut values) = (Vec::new(), Vec::new());
        for key in self.list(Raw(keys), FORM)? {
            let [time, value] = self.tuple(key, "(seconds, value)")?;
            let seconds: f32 = self.number(time)?;
            if times.last().is_some_and(|last| *last >= seconds) {
                return Err(self.error(time.0, "keys must come one after the other in time"));
            }
            if self.has_keys(value) {
                return Err(self.error(value.0, "a key's value cannot have keys itself"));
            }
            times.push(seconds);
            values.push(read(value)?.numbers());
        }
        let Some(first) = values.first() else { return Err(self.error(keys, "there is no key")) };
        let ends = self.clock().end_s.get().into_iter().chain(times.last().copied());
        self.clock().end_s.set(ends.reduce(f32::max));
        let width = first.len();
        if T::TURNS {
            shorter_ways(&mut values);
        }
        let values = values.concat();
        let track = match between {
            Between::Linear => Track { times, values, width, interpolation: Interpolation::Linear },
            Between::Step => Track { times, values, width, interpolation: Interpolation::Step },
            Between::Smooth => Track::smooth(times, &values, width),
        };
        Ok(T::of(&track.value(self.clock().time_s, T::TURNS)))
    }
}

/// Replaces quaternions by their negatives, which are the same rotations, where these are nearer to the previous key.
fn shorter_ways(values: &mut [Vec<f64>]) {
    for key in 1..values.len() {
        let [before, after] = [&values[key - 1], &values[key]];
        let cosine: f64 = before.iter().zip(after).map(|(a, b)| a * b).sum();
        if cosine < 0.0 {
            values[key].iter_mut().for_each(|number| *number = -*number);
        }
    }
}
