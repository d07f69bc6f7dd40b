//! The status of a rendering, sent to the page.

use std::sync::Arc;
use std::time::Duration;

use serde_json::{Value, json};

use super::request::{SAMPLERS, SCHEDULES, TRANSPORTS};
use super::scene::LiveScene;
use super::viewer::{RenderWork, Snapshot};
use crate::error::{Diagnostic, Severity};
use crate::film::Region;
use crate::integrator::setup::NoPhotons;
use crate::integrator::{RenderSetup, Stage};
use crate::render::Options;
use crate::study::profile::flow::{self, Flows};
use crate::world::Camera;

/// The status of a rendering.
pub struct Status {
    /// Incremented whenever the pixels change.
    pub serial: u64,
    /// Incremented whenever the rendering restarts.
    pub generation: u64,
    /// The reason why the scene is not up to date with its files.
    pub error: Option<String>,
    /// True if the rendering is paused.
    pub is_paused: bool,
    /// The scene's part of the status.
    scene: Value,
    /// Width and height of the displayed image.
    shown: [u32; 2],
    samples: f64,
    wanted: u32,
    noise: Option<f64>,
    rays: u64,
    elapsed: Duration,
    is_done: bool,
    /// The number of photons per sample, or why there are none; none until that is known.
    photons: Option<Result<u32, NoPhotons>>,
    /// The queue statistics of the last measurement.
    pub queues: Option<Flows>,
}

/// A diagnostic as a JSON object.
pub fn json_of(diagnostic: &Diagnostic) -> Value {
    let Diagnostic { code, severity, subject, text, remedy } = diagnostic;
    let severity = match severity {
        Severity::Note => "note",
        Severity::Warning => "warning",
    };
    let (subject, commands) = (subject.as_ref(), remedy.as_ref().map(|remedy| remedy.commands()));
    let position = subject.and_then(|subject| subject.position);
    json!({
        "code": code,
        "severity": severity,
        "about": subject.map(|subject| &subject.name),
        "file": subject.and_then(|subject| Some(subject.file.as_ref()?.to_string_lossy())),
        "line": position.map(|[line, _]| line),
        "column": position.map(|[_, column]| column),
        "what": text,
        "remedy": remedy.as_ref().map(ToString::to_string),
        "commands": commands.unwrap_or_default(),
    })
}

/// The scene's part of the status, assembled without holding the lock.
pub struct Described {
    scene: Value,
}

impl Described {
    /// Describes the current scene.
    pub fn new(scene: &LiveScene, work: &RenderWork) -> Described {
        let (settings, rig) = (scene.settings(), scene.rig());
        let (pose, camera, is_moved) = (rig.pose(), &rig.camera, scene.is_moved());
        let findings: Vec<Value> = scene.findings().map(json_of).collect();
        let (fov, lens) = match *camera {
            Camera::Pinhole { vertical_fov } => (Some(vertical_fov), None),
            Camera::ThinLens { vertical_fov, lens_radius_m, focus_distance_m, .. } => {
                (Some(vertical_fov), Some((lens_radius_m, focus_distance_m)))
            }
            Camera::Photographic { focal_length_mm, f_stop: Some(f_stop), focus_distance_m, .. } => {
                (None, Some((0.5e-3 * focal_length_mm / f_stop, focus_distance_m)))
            }
            _ => (None, None),
        };
        let scene = json!({
            "name": scene.path().file_name().map(|name| name.to_string_lossy()),
            "can_save": scene.can_save(),
            "cameras": scene.cameras(),
            "light_groups": scene.setup().light_group_names(),
            "size": settings.size,
            "findings": findings,
            "edits": scene.statements(),
            "can_save_edits": scene.can_save_edits(),
            "time": scene.time().map(|(now, end)| json!({"now_s": now, "end_s": end})),
            "exposure_ev": settings.exposure_ev,
            "auto_exposure": settings.auto_exposure,
            "tonemap": format!("{:?}", settings.tonemap),
            "settings": {
                "schedule": name(&SCHEDULES, &work.schedule),
                "transport": name(&TRANSPORTS, &settings.transport),
                "sampler": name(&SAMPLERS, &settings.sampler),
                "wave": work.wave,
                "depth": settings.max_depth,
                "spp": settings.samples,
                "sampler_without_effect": scene.reason_of_setting("sampler"),
            },
            "camera": {
                "name": scene.camera_name(),
                "origin": pose.from.to_array(),
                "target": pose.to.to_array(),
                "fov_deg": fov.map(f32::to_degrees),
                "focus_m": lens.map(|(_, focus)| focus),
                "lens_radius_m": lens.map(|(radius, _)| radius),
                "line": scene.camera_line(&rig).ok(),
                "is_moved": is_moved,
            },
        });
        Described { scene }
    }
}

/// The pixels' part of the status. Computing it takes seconds for tens of millions of pixels.
pub struct Pixels {
    size: [u32; 2],
    wanted: u32,
    samples: f64,
    noise: Option<f64>,
    photons: Option<Result<u32, NoPhotons>>,
}

impl Pixels {
    /// Computes it for a snapshot.
    pub fn of(shown: &Snapshot) -> Pixels {
        let Snapshot { size, wanted, ref gathered, .. } = *shown;
        let is_small = size != shown.setup.size;
        let samples = if is_small { 0.0 } else { gathered.film.samples_per_pixel() };
        let photons = shown.prepared.as_ref().map(|prepared| prepared.photons());
        Pixels { size, wanted, samples, noise: gathered.film.relative_noise(), photons }
    }
}

impl Status {
    /// The status before anything is rendered.
    pub fn of(scene: &LiveScene, work: RenderWork) -> Status {
        let mut status = Status {
            serial: 0,
            generation: 0,
            error: None,
            is_paused: false,
            scene: Value::Null,
            shown: [0; 2],
            samples: 0.0,
            wanted: scene.settings().samples,
            noise: None,
            rays: 0,
            elapsed: Duration::ZERO,
            is_done: false,
            photons: None,
            queues: None,
        };
        status.describe(Described::new(scene, &work));
        status
    }

    /// Stores the scene's part.
    pub fn describe(&mut self, described: Described) {
        self.scene = described.scene;
    }

    /// Resets it for a new rendering.
    pub fn begin(&mut self) {
        self.generation += 1;
        (self.rays, self.is_done, self.noise, self.queues) = (0, false, None, None);
    }

    /// Stores the pixels' part.
    pub fn pixels(&mut self, pixels: Pixels, elapsed: Duration) {
        self.serial += 1;
        (self.shown, self.wanted, self.elapsed) = (pixels.size, pixels.wanted, elapsed);
        (self.samples, self.noise, self.photons) = (pixels.samples, pixels.noise, pixels.photons);
    }

    /// Stores the result of a pass.
    pub fn passed(&mut self, rays: u64, elapsed: Duration, is_done: bool) {
        (self.rays, self.elapsed, self.is_done) = (rays, elapsed, is_done);
    }

    /// The status as JSON, in the form that the page reads.
    pub fn json(&self) -> Value {
        let seconds = self.elapsed.as_secs_f64();
        let left = (self.samples >= 1.0 && !self.is_done)
            .then(|| seconds / self.samples * (f64::from(self.wanted) - self.samples).max(0.0));
        let mut all = json!({
            "serial": self.serial,
            "generation": self.generation,
            "shown": self.shown,
            "samples": (self.samples * 100.0).round() / 100.0,
            "wanted": self.wanted,
            "noise": self.noise,
            "rays": self.rays,
            "rays_per_second": self.rays as f64 / seconds.max(1e-3),
            "seconds": seconds,
            "seconds_left": left,
            "is_done": self.is_done,
            "is_paused": self.is_paused,
            "error": self.error,
            "photons": self.photons.map(|photons| {
                json!({"a_sample": photons.unwrap_or(0), "none": photons.err().map(NoPhotons::text)})
            }),
            "queues": self.queues.as_ref().map(flows_json),
        });
        if let (Some(all), Value::Object(scene)) = (all.as_object_mut(), &self.scene) {
            all.extend(scene.clone());
        }
        all
    }
}

/// The name of a value.
fn name<T: PartialEq>(known: &[(&'static str, T)], value: &T) -> &'static str {
    known.iter().find(|(_, known)| known == value).map_or("", |(name, _)| name)
}

/// Width and height of the region whose queues are measured: a wave of one sample and more.
const LOOKED_AT: u32 = 64;
/// The number of samples rendered for it.
const SAMPLES: u32 = 2;

/// Measures the queues while the centre of the image is rendered.
pub fn queues(setup: &Arc<RenderSetup>, options: Options) -> Flows {
    let [width, height] = setup.size;
    let part = |size: u32| {
        let start = size.saturating_sub(LOOKED_AT) / 2;
        (start, (start + LOOKED_AT).min(size))
    };
    let ((x0, x1), (y0, y1)) = (part(width), part(height));
    flow::of_region(setup, Options { region: Some(Region { x0, y0, x1, y1 }), ..options }, SAMPLES)
}

fn flows_json(flows: &Flows) -> Value {
    let stages: Vec<Value> = Stage::ALL
        .iter()
        .zip(&flows.stages)
        .map(|(stage, flow)| {
            json!({
                "name": stage.name(),
                "calls": flow.calls,
                "entering": flow.entering,
                "leaving": flow.leaving,
                "room": flow.room,
                "lanes": flow.occupied().unwrap_or(0.0),
                "active": flow.active().unwrap_or(0.0),
            })
        })
        .collect();
    let bounces: Vec<Value> = flows
        .bounces
        .iter()
        .enumerate()
        .map(|(number, bounce)| {
            json!({
                "bounce": number,
                "rays": bounce.rays(),
                "hits": bounce.hits,
                "shadow": bounce.shadow,
                "blocked": bounce.blocked,
                "ends": bounce.ends,
            })
        })
        .collect();
    json!({"stages": stages, "bounces": bounces})
}
