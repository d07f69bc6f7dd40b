//! The requests of the page.

use serde::Deserialize;

use super::scene::{ChangedSettings, LiveScene, SceneError};
use super::viewer::RenderWork;
use crate::integrator::Schedule;
use crate::world::{Sampler, Transport};

/// A request and its number.
pub struct NumberedRequest {
    /// Identifies its outcome.
    pub number: u64,
    /// The action to carry out.
    pub request: ViewRequest,
}

/// An action, in the form in which the page sends it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ViewRequest {
    /// Rotates the camera by a pointer movement in image heights, to the right and down.
    Orbit([f64; 2]),
    /// Moves the camera parallel to the image.
    Pan([f64; 2]),
    /// Moves the camera nearer by a factor.
    Zoom(f64),
    /// Focuses on the surface in a pixel, which becomes the pivot.
    Focus([u32; 2]),
    /// Sets the vertical angle of view, in degrees.
    FovDeg(f64),
    /// Sets the radius of the lens, in metres.
    LensRadiusM(f64),
    /// Switches to another camera of the scene.
    Camera(String),
    /// Resets the camera to what the scene's file gives.
    Reset(bool),
    /// Changes settings.
    Settings(SettingsChange),
    /// Pauses or continues.
    Pause(bool),
    /// Restarts with the first sample.
    Restart(bool),
    /// Writes the camera into the scene's file.
    SaveCamera(bool),
    /// Changes a value by a statement.
    Set(String),
    /// Lists the things that have a form.
    Forms(bool),
    /// Returns the form of a thing.
    Form(String),
    /// Writes the changed values into the scene's file.
    SaveEdits(bool),
    /// Takes back the last changed value, or all.
    Undo(Undo),
    /// Reads the scene as it is at a time in seconds.
    TimeS(f32),
}

/// The statements to take back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Undo {
    /// The last one.
    Last,
    /// All.
    All,
}

/// A change of settings.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SettingsChange {
    schedule: Option<String>,
    transport: Option<String>,
    sampler: Option<String>,
    wave: Option<u32>,
    depth: Option<u32>,
    spp: Option<u32>,
    sharing: Option<bool>,
}

/// The outcome of a request.
pub struct RequestOutcome {
    /// A human-readable message.
    pub said: String,
    /// True if the image must be rendered again.
    pub changes: bool,
}

impl ViewRequest {
    /// True for requests of which many follow each other while a mouse button is down: only small images are rendered
    /// between them.
    pub fn is_movement(&self) -> bool {
        use ViewRequest::{FovDeg, LensRadiusM, Orbit, Pan, Set, TimeS, Zoom};
        matches!(self, Orbit(_) | Pan(_) | Zoom(_) | FovDeg(_) | LensRadiusM(_) | Set(_) | TimeS(_))
    }

    /// Carries out the request.
    pub fn carry_out(
        self,
        scene: &mut LiveScene,
        work: &mut RenderWork,
        paused: &mut bool,
    ) -> Result<RequestOutcome, SceneError> {
        let done = |said: &str, changes: bool| Ok(RequestOutcome { said: said.into(), changes });
        let mut rig = scene.rig();
        match self {
            ViewRequest::Orbit(way) => rig.orbit(finite(way)?),
            ViewRequest::Pan(way) => {
                let [width, height] = scene.settings().size.map(f64::from);
                rig.pan(finite(way)?, width / height);
            }
            ViewRequest::Zoom(factor) if factor <= 0.0 => return refuse("zoom must be above 0".into()),
            ViewRequest::Zoom(factor) => rig.zoom(finite([factor])?[0]),
            ViewRequest::FovDeg(degrees) if !(0.0..180.0).contains(&degrees) || degrees == 0.0 => {
                return refuse(format!(
                    "an angle of view lies between 0 and 180 degrees, {degrees} does not"
                ));
            }
            ViewRequest::FovDeg(degrees) => rig.set_fov(finite([degrees])?[0]),
            ViewRequest::LensRadiusM(radius) if radius < 0.0 => {
                return refuse("a lens's radius is not below 0".into());
            }
            ViewRequest::LensRadiusM(radius) => rig.set_lens(finite([radius])?[0]),
            ViewRequest::Focus(pixel) => {
                let [x, y] = pixel;
                let [width, height] = scene.settings().size;
                if x >= width || y >= height {
                    return refuse(format!("there is no pixel {x},{y} in an image of {width}x{height}"));
                }
                let Some((depth, point)) = scene.depth(pixel) else {
                    return refuse("there is nothing at that pixel to focus on".into());
                };
                if let Some(name) = scene.focused() {
                    return refuse(format!("the camera stays focused on \"{name}\", as its focus_on says"));
                }
                rig.focus(point);
                scene.place(rig)?;
                return done(&format!("in focus: what is {depth:.3} m away"), true);
            }
            ViewRequest::Camera(name) => {
                scene.look_through(&name)?;
                return done("", true);
            }
            ViewRequest::Reset(_) => {
                scene.reset()?;
                return done("", true);
            }
            ViewRequest::Settings(changes) => {
                changes.apply(scene, work)?;
                return done("", true);
            }
            ViewRequest::Pause(pause) => {
                *paused = pause;
                return done("", false);
            }
            ViewRequest::Restart(_) => return done("", true),
            ViewRequest::SaveCamera(_) => {
                let said = scene.save_camera()?;
                return done(&said, true);
            }
            ViewRequest::Set(statement) => {
                scene.set(&statement)?;
                return done("", true);
            }
            ViewRequest::Forms(_) => return done(&scene.forms().to_string(), false),
            ViewRequest::Form(target) => return done(&scene.form(&target)?.to_string(), false),
            ViewRequest::SaveEdits(_) => {
                let said = scene.save_edits()?;
                return done(&said, true);
            }
            ViewRequest::Undo(which) => {
                scene.undo(which == Undo::All)?;
                return done("", true);
            }
            ViewRequest::TimeS(time_s) => {
                scene.look_at_time(finite([f64::from(time_s)])?[0] as f32)?;
                return done("", true);
            }
        }
        scene.place(rig)?;
        done("", true)
    }
}

/// Returns the numbers if they are in the range of meaningful movements.
fn finite<const N: usize>(numbers: [f64; N]) -> Result<[f64; N], SceneError> {
    match numbers.iter().all(|number| number.is_finite() && number.abs() <= 1e6) {
        true => Ok(numbers),
        false => refuse("this movement is out of range".into()),
    }
}

fn refuse<T>(reason: String) -> Result<T, SceneError> {
    Err(SceneError::Refused(reason))
}

/// Looks up a value by its name.
fn named<T: Copy>(name: &Option<String>, what: &str, known: &[(&str, T)]) -> Result<Option<T>, SceneError> {
    let Some(name) = name else { return Ok(None) };
    match known.iter().find(|(known, _)| known == name) {
        Some((_, value)) => Ok(Some(*value)),
        None => {
            let known: Vec<_> = known.iter().map(|(known, _)| *known).collect();
            refuse(format!("there is no {what} {name:?}: there are {}", known.join(", ")))
        }
    }
}

/// Checks that a number lies within its range.
fn within(number: Option<u32>, what: &str, least: u32, most: u32) -> Result<Option<u32>, SceneError> {
    match number {
        Some(number) if !(least..=most).contains(&number) => {
            refuse(format!("{what} is from {least} to {most}, not {number}"))
        }
        _ => Ok(number),
    }
}

/// The schedules and their names.
pub(super) const SCHEDULES: [(&str, Schedule); 2] =
    [("wavefront", Schedule::Wavefront), ("recursive", Schedule::Recursive)];
/// The transports and their names.
pub(super) const TRANSPORTS: [(&str, Transport); 2] =
    [("path", Transport::Path), ("whitted", Transport::Whitted)];
/// The samplers and their names.
pub(super) const SAMPLERS: [(&str, Sampler); 3] =
    [("sobol", Sampler::Sobol), ("jittered", Sampler::Jittered), ("independent", Sampler::Independent)];

impl SettingsChange {
    fn apply(&self, scene: &mut LiveScene, work: &mut RenderWork) -> Result<(), SceneError> {
        let schedule = named(&self.schedule, "schedule", &SCHEDULES)?;
        let transport = named(&self.transport, "transport", &TRANSPORTS)?;
        let sampler = named(&self.sampler, "sampler", &SAMPLERS)?;
        let wave = within(self.wave, "a wave's number of paths", 1, 1 << 20)?;
        let depth = within(self.depth, "the depth", 0, 65_535)?;
        let samples = within(self.spp, "the number of samples", 1, 1 << 22)?;
        work.schedule = schedule.unwrap_or(work.schedule);
        work.wave = wave.map_or(work.wave, |wave| wave as usize);
        let shares = self.sharing;
        scene.change_settings(ChangedSettings { transport, sampler, max_depth: depth, samples, shares })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn view_requests_are_parsed_from_json() {
        let read = |text: &str| serde_json::from_str::<ViewRequest>(text);
        assert_eq!(read(r#"{"orbit":[0.1,-0.2]}"#).unwrap(), ViewRequest::Orbit([0.1, -0.2]));
        assert_eq!(read(r#"{"save_camera":true}"#).unwrap(), ViewRequest::SaveCamera(true));
        let ViewRequest::Settings(changes) =
            read(r#"{"settings":{"schedule":"recursive","depth":3}}"#).unwrap()
        else {
            panic!("settings")
        };
        assert_eq!((changes.schedule.as_deref(), changes.depth), (Some("recursive"), Some(3)));
        for wrong in [r#"{"orbit":[1]}"#, r#"{"delete":"/"}"#, r#"{"settings":{"path":"a"}}"#, "[]", ""] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
