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
use crate::error::{Diagnostic, LoadError};
use crate::formats::LightUnits;
use crate::math::Rgb;
use crate::world::{Camera, Falloff, Light};

/// Lumens per watt at 555 nm, a ratio that exporters apply to all light.
const LUMEN_TO_WATT: f32 = 683.0;
/// The largest plausible values in watts for suns (lux) and other lights (candela): a sun in Blender seldom exceeds 10
/// W/m², and 450 W/sr are a light of 5.7 kW, while 450 cd are one of 8 W.
const BRIGHT: [f32; 2] = [100.0, 450.0];

/// The factor for the intensities of a file's lights.
pub(super) fn light_scale(
    document: &Document,
    lights: &[light::GltfLight],
    units: LightUnits,
    warnings: &mut Vec<Diagnostic>,
) -> f32 {
    match units {
        LightUnits::Candela => 1.0,
        LightUnits::Watt => 1.0 / LUMEN_TO_WATT,
        LightUnits::Auto => {
            if !document.is_of_blender() || !are_lumen(lights) {
                return 1.0;
            }
            warnings.push(document.warning(
                "its lights are as bright as Blender exports them unless told otherwise, in lumen, 683 to a watt, \
                 but not what its materials give off: lights are divided by 683 (`--light-units candela` \
                 takes them as they are)",
            ));
            1.0 / LUMEN_TO_WATT
        }
    }
}

/// True if Blender's lights are too bright to be in watts, judged by the median of its suns, or of its other lights if
/// it has no suns.
fn are_lumen(lights: &[light::GltfLight]) -> bool {
    let brightness = |suns: bool| {
        let of_kind = lights.iter().filter(|light| (light.kind == "directional") == suns);
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
    /// Returns the camera of the node at `place`, and its name.
    pub(super) fn camera(
        &self,
        index: Index<json::Camera>,
        place: &str,
    ) -> Result<(Camera, Option<String>), LoadError> {
        let document = self.document;
        let camera = document.get(&document.root.cameras, index, place, "camera")?;
        let at = format!("/cameras/{}", index.value());
        let camera_of = match (camera.type_, &camera.perspective, &camera.orthographic) {
            (Checked::Valid(Type::Perspective), Some(perspective), _) => {
                let vertical_fov = perspective.yfov;
                if !(vertical_fov > 0.0 && vertical_fov < PI) {
                    let reason = format!("the angle {vertical_fov} is not between 0 and π");
                    return Err(document.error(format!("{at}/perspective/yfov"), reason));
                }
                Camera::Pinhole { vertical_fov }
            }
            (Checked::Valid(Type::Orthographic), _, Some(orthographic)) => {
                // Negative values occur; they would flip the image, which is never intended.
                let height_m = orthographic.ymag.abs() * 2.0;
                if height_m == 0.0 || !height_m.is_finite() {
                    return Err(document.error(format!("{at}/orthographic/ymag"), "it must not be 0"));
                }
                Camera::Orthographic { height_m }
            }
            _ => {
                let reason =
                    "a camera needs its type, \"perspective\" or \"orthographic\", and what goes with it";
                return Err(document.error(at, reason));
            }
        };
        Ok((camera_of, camera.name.clone()))
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
    pub(super) fn light(
        &self,
        node: &json::Node,
        place: &str,
    ) -> Result<Option<(Light, Option<String>)>, LoadError> {
        let document = self.document;
        let extensions = node.extensions.as_ref().map(|extensions| &extensions.others);
        let read: Option<LightOfNode> = document.extension(extensions, "KHR_lights_punctual", place)?;
        let Some(LightOfNode { light: index }) = read else { return Ok(None) };
        let light = self.lights.get(index).ok_or_else(|| {
            let count = self.lights.len();
            document.error(place, format!("there is no light {index}, the file has {count}"))
        })?;
        let at = format!("/extensions/KHR_lights_punctual/lights/{index}");
        Ok(Some((self.punctual(light, &at)?, light.name.clone())))
    }

    fn punctual(&self, light: &light::GltfLight, at: &str) -> Result<Light, LoadError> {
        let document = self.document;
        let flux = Rgb::from(light.color).map(|c| c.max(0.0)) * (light.intensity.max(0.0) * self.light_scale);
        // A point light of power Φ has the intensity Φ/4π.
        let power_w = flux * (4.0 * PI);
        if !power_w.is_finite() {
            return Err(document.error(at, "the light is too bright for a number"));
        }
        let falloff = Falloff::InverseSquare;
        match &light.kind[..] {
            "point" => Ok(Light::Point { power_w, falloff }),
            "directional" => Ok(Light::Directional { irradiance: flux, angle: 0.0 }),
            "spot" => {
                let spot = light.spot.as_ref();
                let spot = spot.ok_or_else(|| document.error(at, "a spot light needs its \"spot\""))?;
                let (inner_angle, outer_angle) = (spot.inner_cone_angle, spot.outer_cone_angle);
                // Accepts π/2 as rounded up by another program's arithmetic.
                if !(inner_angle >= 0.0 && inner_angle < outer_angle && outer_angle <= FRAC_PI_2 + 1e-5) {
                    let reason = format!(
                        "the cone from {inner_angle} to {outer_angle} is not 0 ≤ inner < outer ≤ π/2"
                    );
                    return Err(document.error(format!("{at}/spot"), reason));
                }
                Ok(Light::Spot { power_w, inner_angle, outer_angle: outer_angle.min(FRAC_PI_2), falloff })
            }
            other => {
                let other: String = other.chars().take(40).flat_map(char::escape_debug).collect();
                let reason = format!("unknown type \"{other}\"; types: directional, point, spot");
                Err(document.error(format!("{at}/type"), reason))
            }
        }
    }
}
