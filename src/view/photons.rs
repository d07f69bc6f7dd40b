//! The end points of a sample's photons, as points over the image.

use serde_json::{Value, json};

use super::viewer::Snapshot;
use crate::film::tonemap::{quantise_8_bit, srgb_encode};
use crate::integrator::photons::splat::view;
use crate::integrator::photons::{LandedPhotons, PhotonPlan};
use crate::integrator::{RayStatistics, RenderSetup, Stop, Worker};
use crate::math::Vector;
use crate::render::photons::{self, trace_chunks};

/// The largest number of points sent: those with the lowest numbers. Any part of the photon sequence is as evenly
/// spread as the whole.
const MOST_POINTS: usize = 4_000;

/// The fraction of the points that are not brighter than the displayed white.
const WHITE: f64 = 0.95;

/// The end point of a photon, projected into the image.
#[derive(Clone, Copy)]
struct PhotonPoint {
    column: f32,
    row: f32,
    /// The photon's power in watts.
    flux: [f32; 3],
    /// True if the camera sees the point directly, so that it is splatted; the other photons are gathered.
    is_seen: bool,
}

/// The end points of several photons.
struct Ends {
    /// The number of photons that end on a surface.
    landed: usize,
    /// The photons that lie within the image.
    points: Vec<PhotonPoint>,
}

/// Returns the photons of a sample, or the reason why it has none.
pub fn photons_of(shown: &Snapshot, sample: u32) -> Value {
    let traced;
    let plan = match &shown.prepared {
        Some(prepared) => &prepared.plan,
        None => {
            traced = photons::plan(&shown.setup, &Stop::NEVER);
            &traced
        }
    };
    let sample = sample.min(shown.wanted.saturating_sub(1));
    let found = plan.as_ref().map(|plan| ends(shown, plan, sample));
    let (none, ends) = match found {
        Ok(ends) => (None, ends),
        Err(why) => (Some(why.text()), Ends { landed: 0, points: Vec::new() }),
    };
    let Ends { landed, points } = ends;
    let sent = &points[..points.len().min(MOST_POINTS)];
    let white = white(sent);
    json!({
        "generation": shown.generation,
        "sample": sample,
        "none": none,
        "emitted": plan.as_ref().map_or(0, PhotonPlan::count),
        "landed": landed,
        "in_picture": points.len(),
        "seen": points.iter().filter(|point| point.is_seen).count(),
        "white_w": white,
        "points": sent.iter().map(|point| point.json(white)).collect::<Vec<_>>(),
    })
}

/// Traces the photons of a sample exactly as the renderer does.
fn ends(shown: &Snapshot, plan: &PhotonPlan, sample: u32) -> Ends {
    let (setup, options) = (&shown.setup, &shown.options);
    let with = |trace: &mut dyn FnMut(&mut Worker, &mut RayStatistics)| {
        let mut worker = Worker::new(setup, options.schedule, options.wave, options.sorting);
        trace(&mut worker, &mut RayStatistics::default());
    };
    let chunks =
        trace_chunks(plan, sample..sample + 1, &Stop::NEVER, &with, |landed| in_picture(setup, &landed));
    let mut all = Ends { landed: 0, points: Vec::new() };
    for Ends { landed, points } in chunks {
        all.landed += landed;
        all.points.extend(points);
    }
    all
}

/// Collects the photons that lie within the image, in the order of their numbers. Splatted photons lie where they are
/// splatted, the others where the centre of the lens would see them without occlusion.
fn in_picture(setup: &RenderSetup, landed: &LandedPhotons) -> Ends {
    let mut points: Vec<Option<PhotonPoint>> = landed
        .photons
        .iter()
        .map(|(_, photon)| {
            let [x, y, z] = photon.position;
            let view = view(setup, Vector::new(x, y, z), (0.5, 0.5));
            let (column, row) = (view.column, view.row);
            view.seen.then_some(PhotonPoint { column, row, flux: photon.flux, is_seen: false })
        })
        .collect();
    for (number, splat) in &landed.splats {
        // Under Whitted's transport a photon may end in several places; take the one nearest to the splat.
        let first = landed.photons.partition_point(|(other, _)| other < number);
        let count = landed.photons[first..].iter().take_while(|(other, _)| other == number).count();
        let away = |point: &PhotonPoint| (point.column - splat.column).hypot(point.row - splat.row);
        let own = points[first..first + count].iter_mut().flatten();
        if let Some(point) = own.min_by(|a, b| away(a).total_cmp(&away(b))) {
            *point = PhotonPoint { column: splat.column, row: splat.row, is_seen: true, ..*point };
        }
    }
    let size = setup.size.map(|side| side as f32);
    let is_in =
        |point: &PhotonPoint| (0.0..size[0]).contains(&point.column) && (0.0..size[1]).contains(&point.row);
    Ends { landed: points.len(), points: points.into_iter().flatten().filter(is_in).collect() }
}

/// The power that is displayed as white.
fn white(points: &[PhotonPoint]) -> f32 {
    let mut powers: Vec<f32> =
        points.iter().map(|point| point.flux.into_iter().fold(0.0, f32::max)).collect();
    powers.sort_by(f32::total_cmp);
    powers.get((powers.len() as f64 * WHITE) as usize).copied().unwrap_or(0.0)
}

impl PhotonPoint {
    /// Column, row, red, green and blue from 0 to 255, and 1 if the camera sees the point.
    fn json(&self, white: f32) -> Value {
        let to_hundredths = |place: f32| (f64::from(place) * 100.0).round() / 100.0;
        let [r, g, b] =
            self.flux.map(|watts| quantise_8_bit(srgb_encode(watts / white.max(f32::MIN_POSITIVE))));
        json!([to_hundredths(self.column), to_hundredths(self.row), r, g, b, u8::from(self.is_seen)])
    }
}
