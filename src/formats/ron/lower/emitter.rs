//! Reads `shape`, `light` and `camera`.

use super::Lowering;
use crate::error::LoadError;
use crate::formats::ron::source::{Raw, VariantText};
use crate::math::Rgb;
use crate::world::assets::{ColorSpace, Wrap};
use crate::world::shapes::ShapeFault;
use crate::world::{Camera, Falloff, Light, Shape, Texture, TextureId};

impl<'a> Lowering<'_, 'a> {
    pub(super) fn shape(&mut self, raw: Raw<'a>) -> Result<Shape, LoadError> {
        let mut shape = Shape::Sphere { radius_m: 0.0 };
        let faults = self.source.fault_count();
        self.form(raw, &mut shape)?;
        if self.source.fault_count() > faults {
            return Ok(shape);
        }
        shape.check(&self.world.assets).map_err(|ShapeFault { fields, item, reason }| {
            let given = fields.iter().find_map(|name| self.given(raw, name)).unwrap_or(raw);
            let item = item.and_then(|number| self.source.values(given.0).nth(number));
            self.source.error(item.unwrap_or(given.0), reason)
        })?;
        Ok(shape)
    }

    /// The value that a form's field is given.
    fn given(&self, raw: Raw<'a>, name: &str) -> Option<Raw<'a>> {
        let body = self.source.variant(raw)?.body?;
        let members = self.source.members(body, "").ok()?;
        members.iter().find(|(key, _)| *key == name).map(|(_, raw)| *raw)
    }

    pub(super) fn light(&mut self, raw: Raw<'a>) -> Result<Light, LoadError> {
        let mut light = Light::Point { power_w: Rgb::BLACK, falloff: Falloff::default(), radius_m: 0.0 };
        self.form(raw, &mut light)?;
        if let Light::Spot { inner_angle, outer_angle, .. } = light
            && outer_angle < inner_angle
        {
            let given = self.given(raw, "outer_degrees").or(self.given(raw, "inner_degrees"));
            let place = given.unwrap_or(raw).0;
            // Rounded, so that the message has the digits of the file.
            let degrees = |angle: f32| (f64::from(angle).to_degrees() * 1e4).round() / 1e4;
            let [inner, outer] = [inner_angle, outer_angle].map(degrees);
            let reason = format!("outer_degrees ({outer}) must be at least inner_degrees ({inner})");
            return Err(self.source.error(place, reason));
        }
        Ok(light)
    }

    /// Reads a camera, whose lens needs a distance to focus on unless it `follows` an entity.
    pub(super) fn camera(&mut self, raw: Raw<'a>, follows: bool) -> Result<Camera, LoadError> {
        let mut camera = Camera::Orthographic { height_m: 0.0 };
        self.form(raw, &mut camera)?;
        let Some(VariantText { name, body }) = self.source.variant(raw) else { return Ok(camera) };
        let members = self.source.members(body.unwrap_or("()"), name)?;
        let given = |name: &str| members.iter().find(|(key, _)| *key == name).map(|(_, raw)| raw.0);
        if let Err(reason) = camera.check_angle() {
            return Err(self.source.error(given("fov_degrees").unwrap_or(name), reason));
        }
        if camera.focus_distance_m().is_some() && given("focus_distance_m").is_none() && !follows {
            let reason = format!("{name} needs the field \"focus_distance_m\", or the entity a focus_on");
            return Err(self.source.error(name, reason));
        }
        Ok(camera)
    }

    /// The texture of a photometric profile.
    pub(super) fn profile(&mut self, raw: Raw<'a>) -> Result<TextureId, LoadError> {
        let image = self.assets.image(self.source, raw, &mut self.world)?;
        let wrap = [Wrap::Repeat, Wrap::Clamp];
        let texture = Texture { wrap, color_space: ColorSpace::Linear, ..Texture::new(image) };
        Ok(self.assets.texture(texture, &mut self.world))
    }
}
