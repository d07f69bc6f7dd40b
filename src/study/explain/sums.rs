//! Sums of light, up to their rounding.

use crate::integrator::observe::Components;

/// The sum of both.
pub(super) fn add(a: Components, b: Components) -> Components {
    [0, 1, 2].map(|channel| a[channel] + b[channel])
}

/// All less a part; 0 if that is but the rounding of a sum.
pub(super) fn rest(all: Components, part: Components, sum: Components) -> Components {
    let rest = [0, 1, 2].map(|channel| all[channel] - part[channel]);
    let is_rounding = (0..3).all(|channel| rest[channel].abs() <= 2e-6 * sum[channel].abs());
    if is_rounding { [0.0; 3] } else { rest }
}

/// True if both are equal up to rounding.
pub(super) fn near(a: Components, b: Components) -> bool {
    (0..3).all(|channel| (a[channel] - b[channel]).abs() <= 1e-6 * a[channel].abs())
}
