//! Cameras and lights of nodes.
//!
//! Lights are photometric: candela and lux. The renderer has no spectra to weight, so a lumen counts as a watt, and a
//! nit as a watt per square metre and steradian. But Blender's exporter multiplies the power of its lights by 683 by
//! default, and does not scale the emission of its materials and its world.

use std::f32::consts::{FRAC_PI_2, PI};

use gltf::json::camera::Type;
use gltf::json::validation::Checked;
use gltf::json::{self, Index};

use super::Import;
use super::document::Document;
use super::extensions::light::{self, LightOfNode};
use crate::error::Diagnostic;
use crate::formats::LightUnits;
use crate::math::Rgb;
use crate::world::quantity::LUMENS_PER_WATT;
use crate::world::{Camera, ConeEdge, Falloff, Light};

/// The largest plausible values in watts for suns (lux) and other lights (candela): a sun in Blender seldom exceeds 10
/// W/m², and 450 W/sr are a light of 5.7 kW, while 450 cd are one of 8 W.
const BRIGHT: [f32; 2] = [100.0, 450.0];
/// The vertical field of view of cameras that lack theirs, in radians.
const USUAL_FOV: f32 = PI / 4.0;

/// The factor for the intensities of a file's lights.
pub(super) fn light_scale(
    document: &Document,
    lights: &[Option<light::GltfLight>],
    units: LightUnits,
    warnings: &mut Vec<Diagnostic>,
) -> f32 {
    match units {
        LightUnits::Candela => 1.0,
        LightUnits::Watt => 1.0 / LUMENS_PER_WATT,
        LightUnits::Auto => {
            if !document.is_of_blender() || !are_lumen(lights) {
                return 1.0;
            }
            warnings.push(document.warning(
                "its lights are as bright as Blender exports them unless told otherwise, in lumen, 683 to a watt, \
                 but not what its materials give off: lights are divided by 683 (`--light-units candela` \
                 takes them as they are)",
            ));
            1.0 / LUMENS_PER_WATT
        }
    }
}

/// True if Blender's lights are too bright to be in watts, judged by the median of its suns, or of its other lights if
/// it has no suns.
fn are_lumen(lights: &[Option<light::GltfLight>]) -> bool {
    let brightness = |suns: bool| {
        let of_kind = lights.iter().flatten().filter(|light| (light.kind == "directional") == suns);
        let mut found: Vec<f32> = of_kind.map(|light| light.intensity).filter(|i| *i > 0.0).collect();
        found.sort_by(f32::total_cmp);
        found.get(found.len() / 2).copied()
    };
    let [sun, lamp] = BRIGHT;
    match (brightness(true), brightness(false)) {
        (Some(found), _) => found > sun,
        (None, Some(found)) => found > lamp,
        (None, None) => false,
    }
}

impl Import<'_> {
    /// Returns the camera of the node at `place`, and its name; none if there is no such camera. One whose lens is not as
    /// expected gets a usual one: its place is worth keeping.
    pub(super) fn camera(&self, index: Index<json::Camera>, place: &str) -> Option<(Camera, Option<String>)> {
        let document = self.document;
        let camera = document.find(&document.root.cameras, index, place, "camera", "it is left out")?;
        let at = format!("/cameras/{}", index.value());
        let usual = |at: &str, reason: &str| {
            let degrees = USUAL_FOV.to_degrees();
            document.mend(at, format_args!("{reason}: it gets a vertical field of view of {degrees}°"));
            Camera::Pinhole { vertical_fov: USUAL_FOV }
        };
        let is_orthographic = match (camera.type_, &camera.perspective, &camera.orthographic) {
            (Checked::Valid(Type::Perspective), Some(_), _) => Some(false),
            (Checked::Valid(Type::Orthographic), _, Some(_)) => Some(true),
            (_, perspective, orthographic) => match (perspective.is_some(), orthographic.is_some()) {
                (true, true) | (false, false) => None,
                (_, is_orthographic) => {
                    let kind = if is_orthographic { "orthographic" } else { "perspective" };
                    document.mend(&at, format_args!("it has no type that fits its lens: it is {kind}"));
                    Some(is_orthographic)
                }
            },
        };
        let camera_of = match (is_orthographic, &camera.perspective, &camera.orthographic) {
            (Some(false), Some(perspective), _) => match perspective.yfov {
                vertical_fov if vertical_fov > 0.0 && vertical_fov < PI => Camera::Pinhole { vertical_fov },
                other => {
                    let reason = format!("the angle {other} is not between 0 and π");
                    usual(&format!("{at}/perspective/yfov"), &reason)
                }
            },
            // Negative values occur; they would flip the image, which is never intended.
            (Some(true), _, Some(orthographic)) => match orthographic.ymag.abs() * 2.0 {
                height_m if height_m > 0.0 && height_m.is_finite() => Camera::Orthographic { height_m },
                _ => usual(&format!("{at}/orthographic/ymag"), "it must not be 0"),
            },
            _ => usual(
                &at,
                "a camera needs its type, \"perspective\" or \"orthographic\", and what goes with it",
            ),
        };
        Some((camera_of, camera.name.clone()))
    }

    /// Width over height of a camera's image, if the file gives a usable one.
    pub(super) fn aspect_of(&self, index: Index<json::Camera>) -> Option<f32> {
        let camera = self.document.root.cameras.get(index.value())?;
        let aspect = match (&camera.perspective, &camera.orthographic) {
            (Some(perspective), _) => perspective.aspect_ratio?,
            (None, Some(orthographic)) => (orthographic.xmag / orthographic.ymag).abs(),
            (None, None) => return None,
        };
        (0.01..=100.0).contains(&aspect).then_some(aspect)
    }

    /// Returns the light of the node at `place`, if it has one, and its name.
    pub(super) fn light(&self, node: &json::Node, place: &str) -> Option<(Light, Option<String>)> {
        let document = self.document;
        let extensions = node.extensions.as_ref().map(|extensions| &extensions.others);
        let read: LightOfNode = document.extension(extensions, "KHR_lights_punctual", place)?;
        let index = Index::new(read.light);
        let light = document.find(&self.lights, index, place, "light", "it is left out")?.as_ref()?;
        let at = format!("/extensions/KHR_lights_punctual/lights/{}", read.light);
        Some((self.punctual(light, &at)?, light.name.clone()))
    }

    fn punctual(&self, light: &light::GltfLight, at: &str) -> Option<Light> {
        let document = self.document;
        if light.intensity < 0.0 || light.color.iter().any(|c| *c < 0.0) {
            document.mend(at, "light cannot be negative: 0 is taken");
        }
        let flux = Rgb::from(light.color).map(|c| c.max(0.0)) * (light.intensity.max(0.0) * self.light_scale);
        // A point light of power Φ has the intensity Φ/4π.
        let power_w = flux * (4.0 * PI);
        if !power_w.is_finite() {
            document.mend(at, "the light is too bright for a number: it is left out");
            return None;
        }
        let falloff = Falloff::InverseSquare;
        match &light.kind[..] {
            "point" => Some(Light::Point { power_w, falloff, radius_m: 0.0 }),
            "directional" => Some(Light::Directional { irradiance: flux, angle: 0.0 }),
            "spot" => {
                let [inner_angle, outer_angle] = self.cone(light.spot, at);
                let edge = ConeEdge::Squared;
                Some(Light::Spot { power_w, inner_angle, outer_angle, edge, falloff, radius_m: 0.0 })
            }
            other => {
                let other: String = other.chars().take(40).flat_map(char::escape_debug).collect();
                let what = format!(
                    "unknown type \"{other}\": the light is left out (types: directional, point, spot)"
                );
                document.mend(format_args!("{at}/type"), what);
                None
            }
        }
    }

    /// The inner and outer angle of a spotlight's cone, with 0 ≤ inner ≤ outer ≤ π/2. Equal ones make a hard edge.
    fn cone(&self, spot: Option<light::GltfSpot>, at: &str) -> [f32; 2] {
        let at = format!("{at}/spot");
        if spot.is_none() {
            self.document.mend(&at, "a spotlight needs its cone: one of 45° is taken");
        }
        let light::GltfSpot { inner_cone_angle: inner, outer_cone_angle: outer } = spot.unwrap_or_default();
        // Accepts π/2 as rounded up by another program's arithmetic.
        if !(inner >= 0.0 && inner <= outer && outer <= FRAC_PI_2 + 1e-5) {
            let what =
                format!("the cone from {inner} to {outer} is not 0 ≤ inner ≤ outer ≤ π/2: it is clamped");
            self.document.mend(&at, what);
        }
        let outer = outer.clamp(0.0, FRAC_PI_2);
        [inner.clamp(0.0, outer), outer]
    }
}
