//! Reads `settings`, and the types of values that occur only in them.

use super::Lowering;
use crate::error::LoadError;
use crate::formats::ron::color::is_color_form;
use crate::formats::ron::source::{Raw, SceneText, VariantText};
use crate::math::Rgb;
use crate::world::fields::{Field, Forms, Quantity, Range, Slot};
use crate::world::{Aov, Background, Backplate, Caustics, Settings, Sharing, Transport};

const TRANSPORTS: &[(&str, Option<Transport>)] =
    &[("Whitted", Some(Transport::Whitted)), ("Path", Some(Transport::Path)), ("Auto", None)];

/// The kinds of exposure; true if it is chosen from the image.
const EXPOSURES: &[(&str, bool)] = &[("Fixed", false), ("Auto", true)];

impl<'a> Lowering<'_, 'a> {
    /// Reads the settings. Also returns the transport (none if it is to be chosen once the scene is known), and true if
    /// `max_depth` is given.
    pub(super) fn settings(
        &mut self,
        raw: Raw<'a>,
    ) -> Result<(Settings, Option<Transport>, bool), LoadError> {
        let mut settings = Settings::default();
        self.structure(raw, &mut settings)?;
        let members = self.source.structure(raw, "settings")?;
        let given = |name: &str| {
            let found = members.iter().find(|(key, _)| *key == name);
            found.and_then(|(_, raw)| self.source.optional(*raw))
        };
        let transport = given("transport").map(|raw| self.source.transport(raw)).transpose()?.flatten();
        Ok((settings, transport, given("max_depth").is_some()))
    }

    /// The caustics: `Auto`, `Off` or `(photons: number, radius: pixels)`.
    pub(super) fn caustics(&mut self, raw: Raw<'a>) -> Result<Caustics, LoadError> {
        const FORMS: &str = "Auto, Off, or (photons: number, radius: pixels)";
        if let Some(caustics) = self.source.auto_or_off(raw, (Caustics::Auto, Caustics::Off), FORMS)? {
            return Ok(caustics);
        }
        if !raw.0.starts_with('(') {
            return Err(self.source.expected(raw, FORMS));
        }
        let members = self.source.members(raw.0, "photons")?;
        let (mut photons, mut radius) = (Caustics::PHOTONS, Caustics::RADIUS);
        self.fill(&members, ("photons", raw.0), None, &mut |each| {
            each(Field::plain("photons", false, Slot::Number(&mut photons, Caustics::PHOTON_RANGE)));
            each(Field::plain("radius", false, Slot::Number(&mut radius, Caustics::RADIUS_RANGE)));
        })?;
        Ok(Caustics::Photons { photons, radius })
    }

    /// The background: a colour or a gradient.
    pub(super) fn background(&mut self, raw: Raw<'a>) -> Result<Background, LoadError> {
        let source = self.source;
        let variant = match source.variant(raw) {
            Some(variant) if variant.name == "Gradient" => variant,
            Some(variant) if !is_color_form(variant.name) => {
                return Err(source.unknown(
                    variant.name,
                    "background",
                    &["Gradient", "Srgb", "Kelvin", "Nits"],
                ));
            }
            _ => {
                return Ok(Background::Constant(source.color(
                    raw,
                    "a radiance",
                    Some(Quantity::Radiance),
                )?));
            }
        };
        let [bottom, top] = self.gradient(variant, Range::Light(Quantity::Radiance))?;
        Ok(Background::Gradient { bottom, top })
    }

    /// The colours at the bottom and at the top of a gradient.
    fn gradient(&mut self, variant: VariantText<'a>, range: Range) -> Result<[Rgb; 2], LoadError> {
        let VariantText { name, body } = variant;
        let members = self.source.members(body.unwrap_or("()"), name)?;
        let [mut bottom, mut top] = [Rgb::BLACK; 2];
        self.fill(&members, (name, name), None, &mut |each| {
            each(Field::plain("bottom", true, Slot::Color(&mut bottom, range)));
            each(Field::plain("top", true, Slot::Color(&mut top, range)));
        })?;
        Ok([bottom, top])
    }

    /// The backplate: a colour, a gradient or an image.
    pub(super) fn backplate(&mut self, raw: Raw<'a>) -> Result<Backplate, LoadError> {
        let source = self.source;
        match source.variant(raw) {
            Some(VariantText { name: "Image", body: Some(body) }) => {
                let [file] = source.tuple(Raw(body), "Image(\"street.jpg\")")?;
                Ok(Backplate::Image(self.assets.picture(source, file)?))
            }
            Some(variant) if variant.name == "Gradient" => {
                let [bottom, top] = self.gradient(variant, Range::UNIT)?;
                Ok(Backplate::Gradient { bottom, top })
            }
            Some(variant) if !is_color_form(variant.name) => {
                Err(source.unknown(variant.name, "backplate", &["Gradient", "Image", "Srgb", "Kelvin"]))
            }
            _ if raw.0.starts_with('"') && raw.0.contains('.') => {
                Err(source.error(raw.0, format!("a picture is written Image({})", raw.0)))
            }
            _ => {
                let color = source.color(raw, "a colour", None)?;
                let is_shown = color.to_array().iter().all(|part| Range::UNIT.contains(*part));
                let error = || source.out_of_range(raw, "backplate", &Range::UNIT.to_string());
                is_shown.then_some(Backplate::Constant(color)).ok_or_else(error)
            }
        }
    }
}

impl<'a> SceneText<'a> {
    /// A transport; none for `Auto`.
    pub(super) fn transport(&self, raw: Raw<'a>) -> Result<Option<Transport>, LoadError> {
        self.choice(raw, "transport", TRANSPORTS)
    }

    /// An image size, `(width, height)`, each from 1 to `most`.
    pub(super) fn size(&self, raw: Raw<'a>, most: u32) -> Result<[u32; 2], LoadError> {
        let [width, height] = self.tuple(raw, "(width, height)")?;
        Ok([
            self.whole(width, "the width in pixels", 1, most.into())? as u32,
            self.whole(height, "the height in pixels", 1, most.into())? as u32,
        ])
    }

    /// `Auto` or `Fixed`; true for `Auto`, an exposure chosen from the image.
    pub(super) fn exposure(&self, raw: Raw<'a>) -> Result<bool, LoadError> {
        // A number is probably meant in stops.
        let kind = match raw.0.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
            true => "kind of exposure (in stops it is exposure_ev)",
            false => "kind of exposure",
        };
        self.choice(raw, kind, EXPOSURES)
    }

    /// `All`, or a list of output variables.
    pub(super) fn aovs(&self, raw: Raw<'a>) -> Result<Vec<Aov>, LoadError> {
        if self.variant(raw).is_some_and(|variant| variant.name == "All") {
            return Ok(Aov::IMAGE.to_vec());
        }
        let known: Vec<(&str, Aov)> = Aov::Depth.names().iter().copied().zip(Aov::ALL).collect();
        let mut aovs = Vec::new();
        for item in self.list(raw, "All, or output variables")? {
            let aov = self.choice(item, Aov::Depth.kind(), &known)?;
            if !aovs.contains(&aov) {
                aovs.push(aov);
            }
        }
        Ok(aovs)
    }

    /// `Auto` or `Off`; none if the value is not a name, an error for any other name. Messages list all `forms`.
    fn auto_or_off<T>(&self, raw: Raw<'a>, (auto, off): (T, T), forms: &str) -> Result<Option<T>, LoadError> {
        let Some(variant) = self.variant(raw) else { return Ok(None) };
        let value = match variant.name {
            "Auto" => auto,
            "Off" => off,
            _ => return Err(self.expected(raw, forms)),
        };
        self.no_fields(variant)?;
        Ok(Some(value))
    }

    /// The path reuse: `Auto`, `Off` or a number of pixels.
    pub(super) fn sharing(&self, raw: Raw<'a>) -> Result<Sharing, LoadError> {
        const FORMS: &str = "Auto, Off, or 2, 4, 8, 16, 32 or 64 pixels that share";
        if let Some(sharing) = self.auto_or_off(raw, (Sharing::Auto, Sharing::Off), FORMS)? {
            return Ok(sharing);
        }
        let most = u64::from(Sharing::SIZES[Sharing::SIZES.len() - 1]);
        let pixels = self.whole(raw, "sharing", u64::from(Sharing::SIZES[0]), most)? as u32;
        if !Sharing::SIZES.contains(&pixels) {
            return Err(self.expected(raw, FORMS));
        }
        Ok(Sharing::Groups(pixels))
    }
}
