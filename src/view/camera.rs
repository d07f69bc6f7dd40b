//! The camera of the page: where it is, what it is focused on, and how it is moved by hand.

use super::scene::{LiveScene, SceneError, camera_entity};
use crate::film::Region;
use crate::math::{DVec3, Vec3};
use crate::render::{Options, Session};
use crate::world::{Camera, FocusAt, FocusOn, LookAtFault, OrbitCamera, Parent};

impl LiveScene {
    /// The orbit camera. At first its pivot is the surface in the centre of the image.
    pub fn rig(&self) -> OrbitCamera {
        if let Some(rig) = &self.rig {
            return rig.clone();
        }
        let scene = &self.compiled.scene;
        let bounds = scene.bounds;
        let to_middle = (bounds.center() - scene.camera.origin).dot(scene.camera.forward);
        let [width, height] = self.world.settings.size;
        let ahead = self.depth([width / 2, height / 2]).map(|(depth, _)| depth);
        let size = bounds.size().length().max(1e-3);
        let usual = if to_middle > 0.01 * size { to_middle } else { size };
        let axes = [scene.camera.right, scene.camera.up, scene.camera.forward].map(|axis| axis.as_dvec3());
        let mut camera = self.authored.camera.unwrap_or(Camera::Pinhole { vertical_fov: 1.0 });
        // A focus on a pixel replaces the camera's own.
        let entity = camera_entity(&self.world, self.camera.as_deref());
        if entity.is_some_and(|entity| self.world.entities.satisfies::<&FocusAt>(entity))
            && let (Some(own), Some(focused)) = (camera.focus_distance_m(), scene.camera.focus_distance_m())
        {
            *own = focused;
        }
        OrbitCamera::new(scene.in_world(scene.camera.origin), axes, camera, f64::from(ahead.unwrap_or(usual)))
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
