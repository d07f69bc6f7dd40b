//! Reads `settings`, and the types of values that occur only in them.

use super::Lowering;
use crate::error::LoadError;
use crate::formats::ron::source::{Raw, SceneText};
use crate::world::fields::{Forms, Range};
use crate::world::{Aov, Background, Caustics, Settings, Sharing, Transport};

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
            return Ok(Aov::ALL.to_vec());
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

    /// The caustics: `Auto`, `Off` or `(photons: number, radius: pixels)`.
    pub(super) fn caustics(&self, raw: Raw<'a>) -> Result<Caustics, LoadError> {
        const FORMS: &str = "Auto, Off, or (photons: number, radius: pixels)";
        if let Some(caustics) = self.auto_or_off(raw, (Caustics::Auto, Caustics::Off), FORMS)? {
            return Ok(caustics);
        }
        if !raw.0.starts_with('(') {
            return Err(self.expected(raw, FORMS));
        }
        let (mut photons, mut radius) = (Caustics::PHOTONS, Caustics::RADIUS);
        for (key, raw) in self.structure(raw, "photons")? {
            let (to, least, most) = match key {
                "photons" => (&mut photons, 0.0, Caustics::MOST_PHOTONS),
                "radius" => (&mut radius, Caustics::LEAST_RADIUS, Caustics::LARGEST_RADIUS),
                _ => return Err(self.unknown_field(key, "photons", &["photons", "radius"])),
            };
            *to = self.number_in(raw, key, Range::Above0)?;
            if !(least..=most).contains(to) {
                let least = if least > 0.0 { format!("at least {least} and ") } else { String::new() };
                return Err(self.expected(raw, &format!("{key} of {least}at most {most}")));
            }
        }
        Ok(Caustics::Photons { photons, radius })
    }

    /// The background: a colour or a gradient.
    pub(super) fn background(&self, raw: Raw<'a>) -> Result<Background, LoadError> {
        let variant = match self.variant(raw) {
            Some(variant) if variant.name == "Gradient" => variant,
            Some(variant) if variant.name != "Srgb" => {
                return Err(self.unknown(variant.name, "background", &["Gradient", "Srgb"]));
            }
            _ => return Ok(Background::Constant(self.color(raw, "a radiance")?)),
        };
        let members = self.members(variant.body.unwrap_or("()"), variant.name)?;
        let known = ["bottom", "top"];
        if let Some((key, _)) = members.iter().find(|(key, _)| !known.contains(key)) {
            return Err(self.unknown_field(key, variant.name, &known));
        }
        let end = |name: &str| {
            let mut found = members.iter().filter(|(key, _)| *key == name);
            let missing = || self.error(variant.name, format!("{} needs the field \"{name}\"", variant.name));
            let (_, raw) = found.next().ok_or_else(missing)?;
            match found.next() {
                Some((key, _)) => {
                    Err(self.error(key, format!("{} has the field \"{name}\" twice", variant.name)))
                }
                None => self.color(*raw, "a radiance"),
            }
        };
        Ok(Background::Gradient { bottom: end("bottom")?, top: end("top")? })
    }
}
