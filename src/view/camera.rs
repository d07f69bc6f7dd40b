//! The camera of the page: where it is, what it is focused on, and how it is moved by hand.

use super::scene::{LiveScene, SceneError, camera_entity};
use crate::film::Region;
use crate::formats::{self, Edits};
use crate::math::{DVec3, Vec3};
use crate::render::{Options, Session};
use crate::world::names::is_same_name;
use crate::world::{Camera, FocusAt, FocusOn, LookAtFault, Name, OrbitCamera, Parent, Stereo, World};

impl LiveScene {
    /// The orbit camera. At first its pivot is the surface in the centre of the image.
    pub fn rig(&self) -> OrbitCamera {
        let mut rig = self.rig.clone().unwrap_or_else(|| self.authored_rig());
        // A focus on an entity or a pixel replaces the camera's own.
        let entity = camera_entity(&self.world, self.camera.as_deref());
        let is_focused = |entity| self.world.entities.satisfies::<hecs::Or<&FocusOn, &FocusAt>>(entity);
        if entity.is_some_and(is_focused)
            && let Some(own) = rig.camera.focus_distance_m()
            && let Some(focused) = self.compiled.scene.camera.focus_distance_m()
        {
            *own = focused;
        }
        rig
    }

    /// The camera as its files put it.
    fn authored_rig(&self) -> OrbitCamera {
        let scene = &self.compiled.scene;
        let bounds = scene.bounds;
        let to_middle = (bounds.center() - scene.camera.origin).dot(scene.camera.forward);
        let [width, height] = self.world.settings.size;
        let ahead = self.depth([width / 2, height / 2]).map(|(depth, _)| depth);
        let size = bounds.size().length().max(1e-3);
        let usual = if to_middle > 0.01 * size { to_middle } else { size };
        let axes = [scene.camera.right, scene.camera.up, scene.camera.forward].map(|axis| axis.as_dvec3());
        let camera = self.authored.camera.unwrap_or(Camera::Pinhole { vertical_fov: 1.0 });
        OrbitCamera::new(scene.in_world(scene.camera.origin), axes, camera, f64::from(ahead.unwrap_or(usual)))
    }

    /// The camera's entity as a line of a scene file, which gives the same image.
    pub fn camera_line(&self, rig: &OrbitCamera) -> Result<String, SceneError> {
        let [camera, look_at] = self.camera_texts(rig, &self.path)?;
        let mut keys =
            vec![("name", format!("{:?}", self.camera_name().unwrap_or_default())), ("camera", camera)];
        // A camera that was not moved stays where its file puts it, to the last bit.
        let is_in_place = self.rig.is_none() && !self.authored.depends;
        keys.extend((!is_in_place).then_some(("transform", look_at)));
        keys.extend(self.other_keys(is_in_place));
        let keys: Vec<_> = keys.into_iter().map(|(key, text)| format!("{key}: {text}")).collect();
        Ok(format!("({})", keys.join(", ")))
    }

    /// The other keys of the camera's entity in a scene file: its own transform if `is_in_place`, its stereo pair, and the
    /// entity in focus.
    fn other_keys(&self, is_in_place: bool) -> Vec<(&'static str, String)> {
        let entity = camera_entity(&self.world, self.camera.as_deref());
        let stereo = entity.and_then(|entity| self.world.entities.get::<&Stereo>(entity).ok().map(|it| *it));
        let mut alone = World::default();
        let own = alone.entities.spawn(());
        let focused = self.focus_name().map(|name| FocusOn(alone.entities.spawn((Name(name),))));
        // The entity is there.
        let _ = self.authored.transform.filter(|_| is_in_place).map(|it| alone.entities.insert_one(own, it));
        let _ = stereo.map(|it| alone.entities.insert_one(own, it));
        let _ = focused.map(|it| alone.entities.insert_one(own, it));
        formats::ron::portrait(&alone, &self.path)
            .entities
            .into_iter()
            .next()
            .map_or_else(Vec::new, |(_, keys)| keys)
    }

    /// The name of the entity in focus, if no other has it: a scene file may refer to it.
    pub(super) fn focus_name(&self) -> Option<String> {
        let name = self.focused()?;
        let all = self.world.in_order().into_iter();
        let count = all.filter(|entity| is_same_name(&self.world.name_of(*entity), &name)).count();
        (count == 1).then_some(name)
    }

    /// Removes the options that place the camera and choose its lens, which statements do instead. A focus on an entity
    /// stays if the camera has one.
    pub(super) fn forget_camera_options(&self, edits: &mut Edits) {
        let focuses = self.focused().is_some() && self.rig().camera.focus_distance_m().is_some();
        let focus = edits.focus.take().filter(|_| focuses);
        edits.forget_camera();
        edits.focus = focus;
    }

    /// The depth of the first hit in a pixel along the camera's axis, and its position; none if nothing is hit.
    pub fn depth(&self, [x, y]: [u32; 2]) -> Option<(f32, DVec3)> {
        let region = Region { x0: x, y0: y, x1: x + 1, y1: y + 1 };
        let options = Options { region: Some(region), ..Options::default() };
        let features = Session::of(self.setup(), 1, options).features();
        let first = features.first().filter(|features| features.coverage > 0.0)?;
        Some((first.depth_m, self.compiled.scene.in_world(Vec3::from_array(first.position))))
    }

    /// The name of the entity on which the camera stays focused, if there is one.
    pub fn focused(&self) -> Option<String> {
        let camera = camera_entity(&self.world, self.camera.as_deref())?;
        let focused = self.world.entities.get::<&FocusOn>(camera).ok()?.0;
        Some(self.world.name_of(focused))
    }

    /// Moves the camera; it counts as moved by hand.
    pub fn place(&mut self, rig: OrbitCamera) -> Result<(), SceneError> {
        let no_camera = || SceneError::Refused("the scene has no camera".into());
        let entity = camera_entity(&self.world, self.camera.as_deref()).ok_or_else(no_camera)?;
        let transform = rig.transform().map_err(|fault| {
            SceneError::Refused(match fault {
                LookAtFault::SamePoint => "the camera is as near as it can be".into(),
                LookAtFault::NoUp | LookAtFault::Parallel => {
                    "the camera would look straight up or down: turn it a little".into()
                }
            })
        })?;
        // In world space: its parent no longer moves it.
        let before = self.rig();
        let old = (before.transform().unwrap_or_default(), before.camera);
        let _ = self.world.entities.remove_one::<Parent>(entity);
        // What was at that pixel stays in focus, or what is clicked on now.
        let _ = self.world.entities.remove_one::<FocusAt>(entity);
        let _ = self.world.entities.insert(entity, (transform, rig.camera));
        let moved = self.compile();
        match moved {
            Ok(()) => self.rig = Some(rig),
            // The scene does not compile: undo the movement.
            Err(_) => drop(self.world.entities.insert(entity, old)),
        }
        moved
    }
}
