//! Numbers that read back as the same bits, and tuples, colours and structures of them.

use super::Written;
use crate::math::{Rgb, Vec2};
use crate::world::fields::radians;

/// A number of single or double precision.
pub(super) trait Decimal: Copy + std::fmt::Debug + Into<f64> {}

impl Decimal for f32 {}

impl Decimal for f64 {}

/// The shortest decimal that reads back as `value`.
pub(super) fn number(value: impl Decimal) -> Written {
    if !value.into().is_finite() {
        return Err(format!("{value:?} cannot be written: a scene's numbers are finite"));
    }
    let digits = format!("{value:?}");
    Ok(digits.strip_suffix(".0").map_or(digits.clone(), str::to_owned))
}

/// The angle in degrees, as the shortest decimal that reads back as these radians.
pub(super) fn degrees(angle: f32) -> Written {
    if !angle.is_finite() {
        return Err(format!("{angle} cannot be written: a scene's angles are finite"));
    }
    let exact = f64::from(angle).to_degrees();
    let leads_back = |digits: &String| {
        digits.parse().is_ok_and(|degrees: f64| radians(degrees).to_bits() == angle.to_bits())
    };
    let rounded = (0..17).map(|places| format!("{exact:.places$}")).find(leads_back);
    Ok(rounded.unwrap_or_else(|| format!("{exact:?}")))
}

/// A tuple, `(1, 2, 3)`.
pub(super) fn tuple(values: &[impl Decimal]) -> Written {
    let numbers: Vec<String> = values.iter().map(|value| number(*value)).collect::<Written<_>>()?;
    Ok(format!("({})", numbers.join(", ")))
}

/// One number if all components are bitwise equal, otherwise a tuple.
pub(super) fn uniform_or_tuple(values: &[f32]) -> Written {
    match values {
        [first, rest @ ..] if rest.iter().all(|value| value.to_bits() == first.to_bits()) => number(*first),
        _ => tuple(values),
    }
}

/// A colour or a grey.
pub(super) fn color(color: Rgb) -> Written {
    uniform_or_tuple(&color.to_array())
}

/// A list, `[…, …]`.
pub(super) fn list(items: impl Iterator<Item = Written>) -> Written {
    Ok(format!("[{}]", items.collect::<Written<Vec<String>>>()?.join(", ")))
}

/// A tuple of vectors, `((x, y, z), …)`.
pub(super) fn vectors<F: Decimal>(vectors: impl IntoIterator<Item = [F; 3]>) -> Written {
    let written: Vec<String> = vectors.into_iter().map(|v| tuple(&v)).collect::<Written<_>>()?;
    Ok(format!("({})", written.join(", ")))
}

/// A tuple of pairs, `((u, v), …)`.
pub(super) fn pairs(pairs: &[Vec2]) -> Written {
    let written: Vec<String> = pairs.iter().map(|v| tuple(&v.to_array())).collect::<Written<_>>()?;
    Ok(format!("({})", written.join(", ")))
}

/// Tests for bitwise equality, which tells 0 from −0.
pub(super) fn same<F: Decimal>(a: &[F], b: &[F]) -> bool {
    let bits = |value: &F| -> u64 { (*value).into().to_bits() };
    a.len() == b.len() && a.iter().map(bits).eq(b.iter().map(bits))
}

/// The keys of a structure, as text.
#[derive(Default)]
pub(super) struct Keys(Vec<String>);

impl Keys {
    pub(super) fn push(&mut self, key: &str, value: impl std::fmt::Display) {
        self.0.push(format!("{key}: {value}"));
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds `key` unless `is_default`.
    pub(super) fn push_unless(
        &mut self,
        is_default: bool,
        key: &str,
        value: impl FnOnce() -> Written,
    ) -> Written<()> {
        if !is_default {
            self.push(key, value()?);
        }
        Ok(())
    }

    /// Returns `Name(key: value, …)`.
    pub(super) fn finish(self, name: &str) -> String {
        format!("{name}({})", self.0.join(", "))
    }
}
