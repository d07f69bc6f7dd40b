//! Values over time, between keys.

/// The interpolation of values between two keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interpolation {
    /// The value of the key before.
    Step,
    /// A straight line; rotations at constant speed.
    Linear,
    /// A cubic polynomial by values and tangents.
    Cubic,
}

/// Values over time.
#[derive(Clone, Debug)]
pub(super) struct Track {
    /// The times of the keys in seconds, ascending; at least one.
    pub times: Vec<f32>,
    /// For each time `width` values; with tangents, three times as many: incoming tangent, value, outgoing tangent.
    pub values: Vec<f64>,
    /// The number of components of a value.
    pub width: usize,
    /// The interpolation between the keys.
    pub interpolation: Interpolation,
}

impl Track {
    /// Makes a track of values without tangents. These are chosen so that a value between two keys never lies beyond
    /// either (Fritsch and Butland 1984, "A method for constructing local monotone piecewise cubic interpolants").
    pub fn smooth(times: Vec<f32>, values: &[f64], width: usize) -> Track {
        let last = times.len() - 1;
        let slope = |key: usize, i: usize| {
            (values[(key + 1) * width + i] - values[key * width + i]) / f64::from(times[key + 1] - times[key])
        };
        let tangent = |key: usize, i: usize| {
            if key == 0 || key == last {
                return 0.0;
            }
            let (before, after) = (slope(key - 1, i), slope(key, i));
            if before * after <= 0.0 {
                return 0.0;
            }
            let [left, right] = [times[key] - times[key - 1], times[key + 1] - times[key]].map(f64::from);
            let weight = (left + 2.0 * right) / (3.0 * (left + right));
            before * after / (weight * after + (1.0 - weight) * before)
        };
        let mut with_tangents = Vec::with_capacity(3 * values.len());
        for key in 0..times.len() {
            with_tangents.extend((0..width).map(|i| tangent(key, i)));
            with_tangents.extend_from_slice(&values[key * width..(key + 1) * width]);
            with_tangents.extend((0..width).map(|i| tangent(key, i)));
        }
        Track { times, values: with_tangents, width, interpolation: Interpolation::Cubic }
    }

    /// The values at a time: before the first key and after the last one, theirs. `turns` is true for rotations.
    pub fn value(&self, time: f32, turns: bool) -> Vec<f64> {
        let cubic = self.interpolation == Interpolation::Cubic;
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
        let [start, end] = [before, after].map(|key| f64::from(self.times[key]));
        let span = end - start;
        let t = (f64::from(time) - start) / span;
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

/// Interpolates between two unit quaternions along the shorter arc, at constant speed.
fn slerp(a: [f64; 4], mut b: [f64; 4], t: f64) -> [f64; 4] {
    let mut cosine: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
    if cosine < 0.0 {
        cosine = -cosine;
        b = b.map(|c| -c);
    }
    // For nearly equal ones the sine would be 0.
    let (from, to) = if cosine > 0.9995 {
        (1.0 - t, t)
    } else {
        let angle = libm::acos(cosine);
        let sine = libm::sin(angle);
        (libm::sin((1.0 - t) * angle) / sine, libm::sin(t * angle) / sine)
    };
    std::array::from_fn(|i| a[i] * from + b[i] * to)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(interpolation: Interpolation, values: &[f64]) -> Track {
        Track { times: vec![1.0, 3.0], values: values.to_vec(), width: 1, interpolation }
    }

    #[test]
    fn values_are_interpolated_between_keys_and_constant_beyond() {
        let line = track(Interpolation::Linear, &[10.0, 20.0]);
        let at = |time: f32| line.value(time, false)[0];
        assert_eq!([at(0.0), at(1.0), at(2.5), at(3.0), at(9.0)], [10.0, 10.0, 17.5, 20.0, 20.0]);
        let step = track(Interpolation::Step, &[10.0, 20.0]);
        assert_eq!([step.value(2.9, false)[0], step.value(3.0, false)[0]], [10.0, 20.0]);
        let smooth = track(Interpolation::Cubic, &[9.0, 10.0, 0.0, 0.0, 20.0, 9.0]);
        assert_eq!(smooth.value(2.0, false)[0], 15.0, "level at both ends");
        assert_eq!([smooth.value(0.0, false)[0], smooth.value(5.0, false)[0]], [10.0, 20.0]);
        let sloped = track(Interpolation::Cubic, &[0.0, 0.0, 1.0, 1.0, 2.0, 0.0]);
        assert!((sloped.value(1.5, false)[0] - 0.5).abs() < 1e-6, "tangents are a unit of time long");
    }

    #[test]
    fn turns_take_the_shorter_way() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let [x, y, z, w] = slerp([0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -half, -half], 0.5);
        let eighth = std::f64::consts::FRAC_PI_8;
        assert!(x == 0.0 && y == 0.0 && (z - eighth.sin()).abs() < 1e-6 && (w - eighth.cos()).abs() < 1e-6);
    }

    #[test]
    fn smooth_values_stay_between_their_keys() {
        let values = [0.0, 1.0, 1.0, 5.0, 4.0];
        let track = Track::smooth(vec![0.0, 1.0, 2.0, 2.5, 4.0], &values, 1);
        for step in 0..=400 {
            let time = step as f32 / 100.0;
            let key = track.times.partition_point(|key| *key <= time).clamp(1, 4);
            let (a, b) = (values[key - 1], values[key]);
            let value = track.value(time, false)[0];
            assert!(value >= a.min(b) - 1e-6 && value <= a.max(b) + 1e-6, "{time}: {value}");
        }
        assert_eq!(Track::smooth(vec![1.0], &[3.0], 1).value(7.0, false), [3.0]);
        // Equal steps of a straight line: only at its ends the slope is 0.
        let line = Track::smooth(vec![0.0, 1.0, 2.0, 3.0], &[0.0, 2.0, 4.0, 6.0], 1);
        assert!((line.value(1.5, false)[0] - 3.0).abs() < 1e-6 && line.value(0.25, false)[0] < 0.5);
    }
}
