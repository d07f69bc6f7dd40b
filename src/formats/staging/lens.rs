//! The lens of cameras, as the options choose it: angle of view, focal length, f-number and focus.

use crate::error::{LoadError, did_you_mean};
use crate::formats::Edits;
use crate::world::bounds::check_form;
use crate::world::names::is_same_name;
use crate::world::{Camera, FocusAt, FocusOn, World};

/// The longer side of full frame, in mm: the sensor of a pinhole that becomes a photographer's camera.
const FULL_FRAME_MM: f64 = 36.0;

/// A focus of lenses.
enum Focus {
    Entity(hecs::Entity),
    Seen(FocusAt),
}

/// Changes the lenses of all cameras that have one, or could have. The world must have the size of its image.
pub(super) fn change(world: &mut World, edits: &Edits) -> Result<(), LoadError> {
    let Edits { fov_degrees, focal_length_mm, f_stop, focus, .. } = edits;
    let wanted = [
        ("fov_degrees", fov_degrees.is_some()),
        ("focal_length_mm", focal_length_mm.is_some()),
        ("f_stop", f_stop.is_some()),
        ("focus", focus.is_some()),
    ];
    let Some((first, _)) = wanted.into_iter().find(|(_, is_given)| *is_given) else { return Ok(()) };
    if fov_degrees.is_some() && focal_length_mm.is_some() {
        let reason = "a focal length is an angle of view: give one of them";
        return Err(LoadError::option("fov_degrees", reason));
    }
    edits.check_lens()?;
    let focus = focus.as_ref().map(|text| focus_of(world, text)).transpose()?;
    let size = world.settings.size.map(f64::from);
    let mut changed = Vec::new();
    for (entity, camera) in &mut world.entities.query::<(hecs::Entity, &mut Camera)>() {
        let was_sharp = camera.focus_distance_m().is_none();
        if !edits.change(camera, size)? {
            continue;
        }
        check_form(&mut camera.clone()).map_err(|reason| LoadError::option(first, reason))?;
        changed.push((entity, was_sharp, camera.focus_distance_m().is_some()));
    }
    if changed.is_empty() {
        let reason = "no camera of the scene is a Pinhole, ThinLens or Photographic one, which have a lens";
        return Err(LoadError::option(first, reason));
    }
    if focus.is_some() && changed.iter().all(|(.., focuses)| !focuses) {
        let reason = "everything is sharp, because the camera has no opening: add an f-number, such as 2.8";
        return Err(LoadError::option("focus", reason));
    }
    for (entity, was_sharp, focuses) in changed {
        // Like the autofocus of a camera.
        let focus = match &focus {
            Some(focus) => focus,
            None if was_sharp => &Focus::Seen(FocusAt::Middle),
            None => continue,
        };
        // A camera need not have either.
        let _ = world.entities.remove_one::<FocusOn>(entity);
        let _ = world.entities.remove_one::<FocusAt>(entity);
        if focuses {
            // The entity is known to exist.
            let _ = match *focus {
                Focus::Entity(on) => world.entities.insert_one(entity, FocusOn(on)),
                Focus::Seen(at) => world.entities.insert_one(entity, at),
            };
        }
    }
    Ok(())
}

/// Reads a pixel (`X,Y`) or the name of an entity.
fn focus_of(world: &World, text: &str) -> Result<Focus, LoadError> {
    let numbers = text.split_once(',').map(|(x, y)| [x, y].map(|number| number.trim().parse::<u32>().ok()));
    if let Some([Some(x), Some(y)]) = numbers {
        let [width, height] = world.settings.size;
        if x >= width || y >= height {
            let reason = format!("{x},{y} is no pixel of an image of {width} x {height}, counted from 0,0");
            return Err(LoadError::option("focus", reason));
        }
        let place = |pixel: u32, side: u32| (f64::from(pixel) + 0.5) / f64::from(side);
        let place = [place(x, width) as f32, place(y, height) as f32];
        return Ok(Focus::Seen(FocusAt::Place(place)));
    }
    // Queries have names in quotes.
    let text = text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).unwrap_or(text);
    let order = world.in_order();
    if let Some(entity) = order.iter().find(|entity| is_same_name(&world.name_of(**entity), text)) {
        return Ok(Focus::Entity(*entity));
    }
    let names: Vec<String> = order.iter().map(|entity| world.name_of(*entity)).collect();
    let hint = did_you_mean(text, names.iter().map(String::as_str));
    let reason = format!("there is no entity \"{text}\"{hint}: a pixel is X,Y");
    Err(LoadError::option("focus", reason))
}

impl Edits {
    /// Fails for numbers out of their ranges.
    fn check_lens(&self) -> Result<(), LoadError> {
        let Edits { fov_degrees, focal_length_mm, f_stop, .. } = *self;
        let wrong = |name, range: &str, value: f64| {
            Err(LoadError::option(name, format!("it must be {range}, not {value}")))
        };
        match (fov_degrees, focal_length_mm, f_stop) {
            (Some(degrees), ..) if !(degrees > 0.0 && degrees < 180.0) => {
                wrong("fov_degrees", "between 0 and 180 degrees", degrees)
            }
            (_, Some(length), _) if !Edits::FOCAL_LENGTHS_MM.contains(&length) => {
                wrong("focal_length_mm", "0.1 to 100,000", length)
            }
            (.., Some(number)) if !Edits::F_STOPS.contains(&number) => {
                wrong("f_stop", "0.01 to 1000", number)
            }
            _ => Ok(()),
        }
    }

    /// Changes a camera for an image of a size. False if it has no lens: parallel rays, panoramas, fisheyes, and those that
    /// data sets describe.
    fn change(&self, camera: &mut Camera, size: [f64; 2]) -> Result<bool, LoadError> {
        let is_one = |camera: &Camera| {
            matches!(camera, Camera::Pinhole { .. } | Camera::ThinLens { .. } | Camera::Photographic { .. })
        };
        if !is_one(camera) {
            return Ok(false);
        }
        if let Some(degrees) = self.fov_degrees {
            let half = libm::tan(0.5 * degrees.to_radians());
            match camera {
                Camera::Pinhole { vertical_fov } | Camera::ThinLens { vertical_fov, .. } => {
                    *vertical_fov = degrees.to_radians() as f32;
                }
                Camera::Photographic { focal_length_mm, sensor_width_mm, .. } => {
                    *focal_length_mm = focal_length(half, f64::from(*sensor_width_mm), size) as f32;
                }
                _ => {}
            }
        }
        if self.focal_length_mm.is_some() || self.f_stop.is_some() {
            *camera = photographic(*camera, size);
        }
        if let Camera::Photographic { focal_length_mm, f_stop, .. } = camera {
            *focal_length_mm = self.focal_length_mm.map_or(*focal_length_mm, |it| it as f32);
            *f_stop = self.f_stop.map(|it| it as f32).or(*f_stop);
        }
        Ok(true)
    }
}

/// The focal length in mm with which the image's height is seen at an angle, half of which has the tangent `half`.
fn focal_length(half: f64, sensor_mm: f64, [width, height]: [f64; 2]) -> f64 {
    // The sensor's side lies along the longer side.
    0.5 * sensor_mm / (half * (width / height).max(1.0))
}

/// Returns the photographer's camera, on full frame, that sees what a pinhole or a thin lens does.
fn photographic(camera: Camera, size: [f64; 2]) -> Camera {
    let focal_length = |fov: f32| focal_length(libm::tan(0.5 * f64::from(fov)), FULL_FRAME_MM, size);
    let plain = |fov: f32, aperture, pattern| Camera::Photographic {
        focal_length_mm: focal_length(fov) as f32,
        sensor_width_mm: FULL_FRAME_MM as f32,
        f_stop: None,
        focus_distance_m: 1.0,
        shift: Default::default(),
        tilt_degrees: Default::default(),
        aperture,
        pattern,
    };
    match camera {
        Camera::Pinhole { vertical_fov } => plain(vertical_fov, None, Default::default()),
        Camera::ThinLens { vertical_fov, lens_radius_m, focus_distance_m: distance, aperture, pattern } => {
            let mut camera = plain(vertical_fov, aperture, pattern);
            if let Camera::Photographic { f_stop, focus_distance_m, .. } = &mut camera
                && lens_radius_m > 0.0
            {
                *focus_distance_m = distance;
                *f_stop = Some((0.5e-3 * focal_length(vertical_fov) / f64::from(lens_radius_m)) as f32);
            }
            camera
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Shape;

    fn with_camera(camera: Camera) -> (World, hecs::Entity) {
        let mut world = World::default();
        world.settings.size = [300, 200];
        let entity = world.entities.spawn((camera,));
        (world, entity)
    }

    fn changed(camera: Camera, edits: &Edits) -> Result<Camera, String> {
        let (mut world, entity) = with_camera(camera);
        change(&mut world, edits).map_err(|error| error.to_string())?;
        let camera = *world.entities.get::<&Camera>(entity).map_err(|error| error.to_string())?;
        Ok(camera)
    }

    /// Half the height of the image one metre away.
    fn half(camera: &Camera) -> f64 {
        camera.slope(1.5).unwrap_or_default()
    }

    #[test]
    fn angle_of_view_is_the_same_for_all_cameras_with_a_lens() {
        let lens = photographic(Camera::Pinhole { vertical_fov: 1.0 }, [300.0, 200.0]);
        let edits = Edits { fov_degrees: Some(30.0), ..Edits::default() };
        let expected = 15f64.to_radians().tan();
        for camera in [Camera::Pinhole { vertical_fov: 1.0 }, lens] {
            let camera = changed(camera, &edits).unwrap();
            assert!((half(&camera) - expected).abs() < 1e-6, "{camera:?}");
        }
    }

    #[test]
    fn an_f_number_keeps_the_angle_and_focuses_on_the_middle() {
        let edits = Edits { f_stop: Some(2.0), ..Edits::default() };
        let (mut world, entity) = with_camera(Camera::Pinhole { vertical_fov: 0.7 });
        change(&mut world, &edits).unwrap();
        let camera = *world.entities.get::<&Camera>(entity).unwrap();
        assert!((half(&camera) - 0.35f64.tan()).abs() < 1e-6);
        assert!(matches!(camera, Camera::Photographic { f_stop: Some(2.0), .. }));
        assert_eq!(*world.entities.get::<&FocusAt>(entity).unwrap(), FocusAt::Middle);
    }

    #[test]
    fn a_thin_lens_keeps_its_opening_and_its_focus() {
        let camera = Camera::ThinLens {
            vertical_fov: 0.7,
            lens_radius_m: 0.01,
            focus_distance_m: 3.0,
            aperture: None,
            pattern: Default::default(),
        };
        let Camera::Photographic { focal_length_mm, f_stop: Some(f_stop), focus_distance_m, .. } =
            photographic(camera, [300.0, 200.0])
        else {
            panic!("it has an opening")
        };
        assert!((0.5e-3 * focal_length_mm / f_stop - 0.01).abs() < 1e-6);
        assert_eq!(focus_distance_m, 3.0);
        let edits = Edits { focal_length_mm: Some(85.0), ..Edits::default() };
        let (mut world, entity) = with_camera(camera);
        change(&mut world, &edits).unwrap();
        assert!(world.entities.get::<&FocusAt>(entity).is_err(), "it stays focused where it was");
    }

    #[test]
    fn focus_is_an_entity_or_a_pixel() {
        let (mut world, entity) = with_camera(Camera::Pinhole { vertical_fov: 0.7 });
        let ball =
            world.entities.spawn((crate::world::Name("a ball".into()), Shape::Sphere { radius_m: 1.0 }));
        let focused = |world: &mut World, focus: &str| {
            let edits = Edits { f_stop: Some(4.0), focus: Some(focus.into()), ..Edits::default() };
            change(world, &edits).map_err(|error| error.to_string())
        };
        focused(&mut world, "a ball").unwrap();
        assert_eq!(*world.entities.get::<&FocusOn>(entity).unwrap(), FocusOn(ball));
        focused(&mut world, "0, 199").unwrap();
        assert!(world.entities.get::<&FocusOn>(entity).is_err());
        let FocusAt::Place([x, y]) = *world.entities.get::<&FocusAt>(entity).unwrap() else { panic!() };
        assert!((x - 0.5 / 300.0).abs() < 1e-7 && (y - 199.5 / 200.0).abs() < 1e-7);
        assert!(focused(&mut world, "300,5").unwrap_err().contains("300 x 200"));
        assert!(focused(&mut world, "a bal").unwrap_err().contains("did you mean \"a ball\""));
    }

    #[test]
    fn impossible_lenses_are_refused() {
        let pinhole = Camera::Pinhole { vertical_fov: 0.7 };
        let refused = |camera, edits: Edits| changed(camera, &edits).unwrap_err();
        let none = Edits::default();
        let both = Edits { fov_degrees: Some(30.0), focal_length_mm: Some(50.0), ..none.clone() };
        assert!(refused(pinhole, both).contains("give one of them"));
        let wide = Edits { fov_degrees: Some(180.0), ..none.clone() };
        assert!(refused(pinhole, wide.clone()).contains("between 0 and 180"));
        let sharp = Edits { focus: Some("5,5".into()), ..none.clone() };
        assert!(refused(pinhole, sharp).contains("add an f-number"));
        let flat = Camera::Orthographic { height_m: 1.0 };
        assert!(refused(flat, Edits { fov_degrees: Some(20.0), ..none.clone() }).contains("no camera"));
        assert!(refused(pinhole, Edits { f_stop: Some(0.0), ..none }).contains("f_stop"));
    }
}
