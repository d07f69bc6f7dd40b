//! A short version of a study: the same experiments with at most a sixteenth of the work.

use crate::formats::study::{Axis, SettingsOverride, StudyFile};

/// The divisor of everything that costs time.
const PART: u32 = 16;
/// Repetitions: the fewest that give confidence intervals.
const SEEDS: u32 = 2;
/// At least this many values of x are left, to distinguish a line from a curve.
const VALUES: usize = 3;

/// Removes the expensive part of a study. Values of x that count samples, photons or triangles end at a sixteenth of
/// the largest. References get a sixteenth of their samples, which keeps their accuracy relative to the measurements.
/// The title says that it is short.
pub fn shorten(study: &mut StudyFile) {
    study.title.push_str(" (short: a sixteenth of the work)");
    for experiment in &mut study.experiments {
        experiment.seeds = experiment.seeds.min(SEEDS);
        if let Axis::Samples(x)
        | Axis::LightSamples(x)
        | Axis::LensSamples(x)
        | Axis::Photons(x)
        | Axis::Triangles(x) = &mut experiment.x
        {
            let mut sorted = x.clone();
            sorted.sort_unstable();
            sorted.dedup();
            let most = sorted.last().copied().unwrap_or(0);
            let limit = sorted.get(VALUES - 1).map_or(most, |least| (most / PART).max(*least));
            x.retain(|x| *x <= limit);
        }
        if let Some(reference) = &mut experiment.reference {
            for samples in [&mut reference.samples, &mut reference.light_samples].into_iter().flatten() {
                *samples = (*samples / PART).max(1);
            }
        }
        let of_all = std::iter::once(&mut experiment.with);
        of_all.chain(experiment.series.iter_mut().map(|series| &mut series.with)).for_each(fewer_rays);
    }
}

fn fewer_rays(change: &mut SettingsOverride) {
    if let Some(rays) = &mut change.rays {
        *rays = (*rays / PART).max(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::study::parse;

    #[test]
    fn shorten_keeps_a_sixteenth_of_the_work_and_three_values() {
        let text = "(title: \"t\", experiments: [
            (name: \"a\", scenes: [File(\"s.ron\")], x: Samples([1, 4, 16, 64, 256]), series: [(label: \"l\")],
             seeds: 8, reference: (samples: 4096)),
            (name: \"b\", scenes: [Ball], with: (rays: 1600), x: Triangles([10, 100, 100000, 1000000]),
             series: [(label: \"l\", with: (rays: 32)), (label: \"m\")]),
            (name: \"c\", scenes: [File(\"s.ron\")], x: Threads([1, 2, 4]), series: [(label: \"l\")]),
        ])";
        let mut study = parse(text, "s.ron".as_ref()).unwrap();
        shorten(&mut study);
        let [a, b, c] = &study.experiments[..] else { panic!("three experiments") };
        assert_eq!((a.x.values(), a.seeds), (&[1, 4, 16][..], 2));
        assert_eq!(a.reference.as_ref().unwrap().samples, Some(256));
        assert_eq!(b.x.values(), [10, 100, 100_000], "three are left, however dear");
        assert_eq!((b.seeds, b.with.rays, b.series[0].with.rays), (1, Some(100), Some(2)));
        assert_eq!(c.x.values(), [1, 2, 4]);
    }
}
