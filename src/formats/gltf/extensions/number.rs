//! Deserialisation of finite numbers, and the specification's defaults.

use serde::de::{Deserialize, Deserializer, Error};

pub(super) fn one() -> f32 {
    1.0
}

pub(super) fn white() -> [f32; 3] {
    [1.0; 3]
}

/// Deserialises a finite number.
pub(super) fn finite<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    let number = f32::deserialize(deserializer)?;
    if number.is_finite() { Ok(number) } else { Err(D::Error::custom("a number is too large")) }
}

/// Deserialises an array of finite numbers.
pub(super) fn all_finite<'de, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<[f32; N], D::Error>
where
    [f32; N]: Deserialize<'de>,
{
    let numbers = <[f32; N]>::deserialize(deserializer)?;
    if numbers.iter().all(|number| number.is_finite()) {
        Ok(numbers)
    } else {
        Err(D::Error::custom("a number is too large"))
    }
}
