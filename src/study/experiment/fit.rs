//! Means with confidence intervals, and the order of growth of y with x.

/// A mean with its 95 % confidence interval by Student's t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean of the measurements.
    pub mean: f64,
    /// Half the width of the interval; none for a single measurement.
    pub margin: Option<f64>,
}

impl Estimate {
    /// Computes the estimate; none without measurements.
    pub fn of(values: &[f64]) -> Option<Estimate> {
        let n = values.len() as f64;
        if values.is_empty() {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
        let margin = (n > 1.0).then(|| student(values.len() - 1) * (squares / (n - 1.0) / n).sqrt());
        Some(Estimate { mean, margin })
    }
}

/// y = factor · x^order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// The exponent, with a 95 % confidence interval.
    pub order: Estimate,
    /// y at x = 1.
    pub factor: f64,
}

impl Fit {
    /// Fits a power by least squares in logarithms; none without two different x among points with positive x and y.
    pub fn of(points: &[(f64, f64)]) -> Option<Fit> {
        let logs: Vec<(f64, f64)> = points
            .iter()
            .filter(|(x, y)| *x > 0.0 && *y > 0.0)
            .map(|(x, y)| (libm::log(*x), libm::log(*y)))
            .collect();
        let n = logs.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
        let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
        let xx: f64 = logs.iter().map(|(x, _)| (x - mx) * (x - mx)).sum();
        // NaN if no points are left.
        if xx.is_nan() || xx <= 0.0 {
            return None;
        }
        let order = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum::<f64>() / xx;
        let offset = my - order * mx;
        let residual: f64 =
            logs.iter().map(|(x, y)| (y - offset - order * x) * (y - offset - order * x)).sum();
        let margin = (logs.len() > 2).then(|| student(logs.len() - 2) * (residual / (n - 2.0) / xx).sqrt());
        Some(Fit { order: Estimate { mean: order, margin }, factor: libm::exp(offset) })
    }

    /// Returns y at some x.
    pub fn at(&self, x: f64) -> f64 {
        self.factor * libm::pow(x, self.order.mean)
    }
}

/// The 97.5 % quantile of Student's t distribution: from a table, then by the expansion about the normal quantile
/// (Abramowitz and Stegun 26.7.5).
fn student(freedom: usize) -> f64 {
    const TABLE: [f64; 10] = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228];
    if let Some(value) = freedom.checked_sub(1).and_then(|i| TABLE.get(i)) {
        return *value;
    }
    let (z, n) = (1.959_964_f64, freedom.max(1) as f64);
    let (z3, z5) = (z.powi(3), z.powi(5));
    z + (z3 + z) / (4.0 * n) + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n * n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_have_means_and_margins_by_student_t() {
        assert_eq!(Estimate::of(&[]), None);
        assert_eq!(Estimate::of(&[2.0]), Some(Estimate { mean: 2.0, margin: None }));
        let two = Estimate::of(&[1.0, 3.0]).unwrap();
        assert!((two.mean - 2.0).abs() < 1e-12 && (two.margin.unwrap() - 12.706).abs() < 1e-9);
        assert!((student(11) - 2.201).abs() < 3e-3 && (student(60) - 2.000).abs() < 1e-3);
    }

    #[test]
    fn fit_recovers_order_and_factor_of_powers() {
        let exact: Vec<_> = (1..20).map(|x| (f64::from(x), 3.0 * f64::from(x).powf(-1.5))).collect();
        let fit = Fit::of(&exact).unwrap();
        assert!((fit.order.mean + 1.5).abs() < 1e-12 && (fit.factor - 3.0).abs() < 1e-9);
        assert!(fit.order.margin.unwrap() < 1e-9 && (fit.at(4.0) - 3.0 / 8.0).abs() < 1e-9);
        let noisy: Vec<_> = exact.iter().enumerate().map(|(i, (x, y))| (*x, y * [0.9, 1.1][i % 2])).collect();
        let Estimate { mean, margin } = Fit::of(&noisy).unwrap().order;
        assert!((mean + 1.5).abs() < margin.unwrap() && margin.unwrap() < 0.1);
        assert_eq!(Fit::of(&[(2.0, 1.0), (2.0, 3.0)]), None);
    }
}
