//! Errors of the series after equal time. Comparing equal numbers of samples would favour expensive samples.

use super::plot::{Curve, Figure};

/// Errors by time.
#[derive(Debug, PartialEq)]
pub struct EqualTime {
    /// The labels of the columns.
    pub labels: Vec<String>,
    /// Seconds, and each column's error at that time; none before its first and after its last measurement.
    pub rows: Vec<(f64, Vec<Option<f64>>)>,
}

impl EqualTime {
    /// Resamples errors and times over the same x at times that are powers of √2, where at least two series have
    /// values.
    pub fn of(errors: &Figure, times: &Figure) -> Self {
        let reached: Vec<(String, Vec<(f64, f64)>)> = errors
            .curves
            .iter()
            .filter_map(|curve| {
                let time = times.curves.iter().find(|time| time.label == curve.label)?;
                Some((curve.label.clone(), by_time(curve, time)))
            })
            .collect();
        let all = || reached.iter().flat_map(|(_, points)| points.iter().map(|point| point.0));
        let (least, most) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
        let mut rows = Vec::new();
        if least <= most {
            let half_powers = |time| 2.0 * libm::log2(time);
            for power in libm::floor(half_powers(least)) as i32..=libm::ceil(half_powers(most)) as i32 {
                let time = libm::exp2(0.5 * f64::from(power));
                let row: Vec<_> = reached.iter().map(|(_, points)| at(points, time)).collect();
                if row.iter().flatten().count() > 1 {
                    rows.push((time, row));
                }
            }
        }
        Self { labels: reached.into_iter().map(|(label, _)| label).collect(), rows }
    }
}

/// Pairs of time and error, sorted by time; both must be above 0, since their logarithms are taken.
fn by_time(errors: &Curve, times: &Curve) -> Vec<(f64, f64)> {
    let pairs = errors.points.iter().filter_map(|(x, error)| {
        let (_, time) = times.points.iter().find(|(other, _)| other == x)?;
        Some((time.mean, error.mean))
    });
    let mut points: Vec<_> = pairs.filter(|(time, error)| *time > 0.0 && *error > 0.0).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

/// Interpolates between two points by a power of time.
fn at(points: &[(f64, f64)], time: f64) -> Option<f64> {
    points.windows(2).find(|pair| (pair[0].0..=pair[1].0).contains(&time)).map(|pair| {
        let [(t0, e0), (t1, e1)] = [pair[0], pair[1]];
        let part = if t1 > t0 { libm::log(time / t0) / libm::log(t1 / t0) } else { 0.0 };
        e0 * libm::pow(e1 / e0, part)
    })
}

#[cfg(test)]
mod tests {
    use super::super::fit::Estimate;
    use super::*;

    #[test]
    fn errors_are_interpolated_at_equal_times() {
        let figure = |curves: [(&str, &[(f64, f64)]); 3]| Figure {
            title: String::new(),
            x_label: String::new(),
            y: crate::formats::study::Measurement::Mse.into(),
            log: [true; 2],
            curves: curves
                .into_iter()
                .map(|(label, points)| Curve {
                    label: label.into(),
                    scene: 0,
                    points: points.iter().map(|(x, y)| (*x, Estimate { mean: *y, margin: None })).collect(),
                    fit: None,
                })
                .collect(),
        };
        // The second has half the error for the same samples, but takes four times as long. The third one's times are
        // missing.
        let errors = figure([
            ("plain", &[(1.0, 1.0), (4.0, 0.25), (16.0, 0.0625)]),
            ("shared", &[(1.0, 0.5), (4.0, 0.125)]),
            ("third", &[(1.0, 0.1)]),
        ]);
        let times = figure([
            ("shared", &[(1.0, 4.0), (4.0, 16.0)]),
            ("plain", &[(1.0, 1.0), (4.0, 4.0), (16.0, 16.0)]),
            ("other", &[]),
        ]);
        let table = EqualTime::of(&errors, &times);
        assert_eq!(table.labels, ["plain", "shared"]);
        let near = |found: &Option<f64>, wanted: f64| (found.unwrap() - wanted).abs() < 1e-12;
        let times: Vec<_> = table.rows.iter().map(|row| libm::round(10.0 * row.0)).collect();
        assert_eq!(times, [40.0, 57.0, 80.0, 113.0, 160.0]);
        for (time, row) in &table.rows {
            assert!(near(&row[0], 1.0 / time) && near(&row[1], 2.0 / time), "{time}: {row:?}");
        }
        assert_eq!(EqualTime::of(&figure([("", &[]); 3]), &figure([("", &[]); 3])).rows, []);
    }
}
