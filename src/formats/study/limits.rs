//! Limits on the values in a study, beyond those of the `ron` format.

use super::{Axis, Experiment, Measurement, SettingsOverride, StudyFile, StudyScene};
use crate::world::{Caustics, Settings, Sharing};

/// Checks a study. Errors name the experiment and what to change in it.
pub(super) fn check(study: &StudyFile) -> Result<(), String> {
    if study.experiments.is_empty() {
        return Err("there is no experiment: add one to experiments".into());
    }
    let mut names = std::collections::HashSet::new();
    for experiment in &study.experiments {
        let name = &experiment.name;
        let fits = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if name.is_empty() || !name.chars().all(fits) {
            return Err(format!("experiment \"{name}\": a name is made of letters, digits and underscores"));
        }
        if !names.insert(name) {
            return Err(format!("experiment \"{name}\": another one has this name too"));
        }
        check_experiment(experiment).map_err(|reason| format!("experiment \"{name}\": {reason}"))?;
    }
    Ok(())
}

/// The most renderings of an experiment.
const MOST_JOBS: u64 = 100_000;
/// The most rays of a study of queries.
const MOST_RAYS: u32 = 1 << 24;

fn check_experiment(experiment: &Experiment) -> Result<(), String> {
    let x = experiment.x.values();
    if experiment.scenes.is_empty() || experiment.series.is_empty() || x.is_empty() {
        return Err("it needs at least one scene, one series and one value of x".into());
    }
    let made_up = experiment.scenes.iter().any(|scene| !matches!(scene, StudyScene::File(_)));
    if made_up && !matches!(experiment.x, Axis::Triangles(_)) {
        return Err("Ball and Cloud need x: Triangles([…])".into());
    }
    if experiment.seeds == 0 {
        return Err("seeds has to be at least 1".into());
    }
    let series = experiment.series.len() as u64 * experiment.scenes.len() as u64;
    let jobs = series.saturating_mul(x.len() as u64).saturating_mul(u64::from(experiment.seeds));
    if jobs > MOST_JOBS {
        return Err(format!(
            "these are {jobs} renderings, and more than {MOST_JOBS} are never done: use fewer seeds"
        ));
    }
    let (least, most) = match experiment.x {
        Axis::Depth(_) => (0, Settings::MOST_DEPTH),
        Axis::Samples(_) | Axis::LightSamples(_) | Axis::LensSamples(_) => (1, Settings::MOST_SAMPLES),
        Axis::Wave(_) => (1, 1_048_576),
        Axis::Threads(_) => (1, 1024),
        Axis::Lanes(_) => (1, 16),
        Axis::Photons(_) => (1, Caustics::MOST_PHOTONS as u32),
        Axis::PhotonRadius(_) => (1, Caustics::LARGEST_RADIUS as u32),
        Axis::Triangles(_) => (1, 100_000_000),
    };
    if let Some(value) = x.iter().find(|value| !(least..=most).contains(*value)) {
        return Err(format!("x has to be from {least} to {most}, not {value}"));
    }
    if let Axis::Lanes(values) = &experiment.x {
        values.iter().try_for_each(|value| check_lanes("x", Some(*value)))?;
    }
    let errors = [Measurement::Mse, Measurement::RelativeMse, Measurement::Flip, Measurement::SquaredBias];
    let measures_error = experiment.plots.iter().any(|plot| errors.contains(&plot.y));
    if measures_error && experiment.reference.is_none() {
        return Err("an error is plotted, but there is no reference: (…) to measure it against".into());
    }
    let changes = experiment.series.iter().map(|series| &series.with).chain([&experiment.with]);
    changes.chain(&experiment.reference).try_for_each(check_change)
}

fn check_change(change: &SettingsOverride) -> Result<(), String> {
    let within = |what: &str, value: Option<u32>, least: u32, most: u32| match value {
        Some(value) if !(least..=most).contains(&value) => {
            Err(format!("{what} has to be from {least} to {most}, not {value}"))
        }
        _ => Ok(()),
    };
    within("size", change.size.map(|size| size.0), 1, Settings::MOST_PIXELS_A_SIDE)?;
    within("size", change.size.map(|size| size.1), 1, Settings::MOST_PIXELS_A_SIDE)?;
    within("rays", change.rays, 1, MOST_RAYS)?;
    within("samples", change.samples, 1, Settings::MOST_SAMPLES)?;
    within("light_samples", change.light_samples, 1, Settings::MOST_SAMPLES)?;
    if let Some(pixels) = change.sharing.filter(|pixels| *pixels != 1 && !Sharing::SIZES.contains(pixels)) {
        return Err(format!("sharing has to be 1 (none), 2, 4, 8, 16, 32 or 64 pixels, not {pixels}"));
    }
    within("max_depth", change.max_depth, 0, Settings::MOST_DEPTH)?;
    within("wave", change.wave, 1, 1_048_576)?;
    within("threads", change.threads, 1, 1024)?;
    check_lanes("lanes", change.lanes)?;
    check_lanes("shading_lanes", change.shading_lanes)?;
    above_zero("photons", change.photons, Caustics::MOST_PHOTONS)?;
    above_zero("photon_radius", change.photon_radius, Caustics::LARGEST_RADIUS)?;
    within("rays", change.rays, 1, 100_000_000)
}

fn check_lanes(what: &str, value: Option<u32>) -> Result<(), String> {
    match value {
        Some(value) if ![1, 8, 16].contains(&value) => {
            Err(format!("{what} has to be 1, 8 or 16 lanes, not {value}"))
        }
        _ => Ok(()),
    }
}

fn above_zero(what: &str, value: Option<f32>, most: f32) -> Result<(), String> {
    match value {
        Some(value) if value.is_nan() || value <= 0.0 || value > most => {
            Err(format!("{what} has to be above 0 and at most {most}, not {value}"))
        }
        _ => Ok(()),
    }
}
