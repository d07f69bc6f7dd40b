//! Colours and quantities of light.

use super::scan;
use super::source::{Raw, SceneText, VariantText, describe, shorten, suggest};
use crate::error::LoadError;
use crate::film::tonemap::srgb_decode;
use crate::formats::{colors, elsewhere};
use crate::math::Rgb;
use crate::world::fields::Quantity;

/// The forms that are colours.
const FORMS: [&str; 3] = ["Srgb", "Kelvin", "Metal"];

/// True if a form is a colour or a quantity of light in a photometric unit.
pub(super) fn is_color_form(name: &str) -> bool {
    FORMS.contains(&name) || Quantity::UNITS.contains(&name)
}

impl<'a> SceneText<'a> {
    /// A colour that messages call `what`; no component is below 0. One that is a `quantity` of light can be given in
    /// photometric units.
    pub(super) fn color(
        &self,
        raw: Raw<'a>,
        what: &str,
        quantity: Option<Quantity>,
    ) -> Result<Rgb, LoadError> {
        self.keyed(raw, |raw| self.single_color(raw, what, quantity))
    }

    fn single_color(&self, raw: Raw<'a>, what: &str, quantity: Option<Quantity>) -> Result<Rgb, LoadError> {
        if raw.0.starts_with('"') {
            return self.color_in_quotes(raw, what);
        }
        match self.variant(raw) {
            Some(VariantText { name: "Srgb", body: Some(body) }) => return self.encoded(body),
            Some(VariantText { name: "Kelvin", body: Some(body) }) => return self.black_body(body, what),
            Some(VariantText { name: "Metal", body: Some(body) }) => return self.metal(body),
            Some(VariantText { name, body: Some(body) }) if Quantity::UNITS.contains(&name) => {
                return self.photometric((name, body), what, quantity);
            }
            _ => {}
        }
        if raw.0.starts_with('(') {
            let [r, g, b] = self.tuple(raw, "(r, g, b)")?;
            let component = |raw| self.at_least_zero(raw, what);
            return Ok(Rgb::new(component(r)?, component(g)?, component(b)?));
        }
        if self.try_read::<f64>(raw).is_some() {
            return Ok(Rgb::splat(self.at_least_zero(raw, what)?));
        }
        let advice = elsewhere::color_advice(scan::split_identifier(raw.0).0);
        Err(self.no_color(raw, what, advice))
    }

    fn no_color(&self, raw: Raw<'a>, what: &str, advice: Option<String>) -> LoadError {
        let advice = advice.map(|advice| self.advice_at(raw.0, &advice)).unwrap_or_default();
        let forms = "as (r, g, b), one number, \"red\", \"#ff8000\", Srgb(r, g, b) or Kelvin(3000)";
        self.error(raw.0, format!("expected {what}, {forms}, found {}{advice}", describe(raw)))
    }

    /// Advice about what to write at a place: as it is typed in a shell, if it is the value of an option.
    fn advice_at(&self, place: &str, advice: &str) -> String {
        let part = &self.parts[self.part_of(place)];
        match &part.option {
            Some(name) if advice.starts_with('"') && part.text.trim() == place.trim() => {
                format!(" (write --var '{name}={advice}')")
            }
            _ => format!(" (write {advice})"),
        }
    }

    /// The advice for the value of an option that is a colour of digits without quotes.
    pub(super) fn color_of_option(&self, text: &'a str) -> Option<String> {
        let digits = text.trim().strip_prefix('#')?;
        let is_color = super::slips::is_hexadecimal_color(digits);
        self.parts[self.part_of(text)].option.as_ref().filter(|_| is_color)?;
        Some(format!("a colour stands in quotes{}", self.advice_at(text, &format!("\"#{digits}\""))))
    }

    /// The error for the name of a colour without quotes, where a texture can stand, too; none for other names.
    pub(super) fn unquoted_color(&self, variant: &VariantText<'a>) -> Option<LoadError> {
        let advice = variant.body.is_none().then(|| elsewhere::color_advice(variant.name)).flatten()?;
        let advice = self.advice_at(variant.name, &advice);
        let name = shorten(variant.name);
        Some(self.error(variant.name, format!("expected a colour or a texture, found {name}{advice}")))
    }

    /// A colour as one or two hexadecimal digits each for red, green and blue, or by its name in CSS.
    fn color_in_quotes(&self, raw: Raw<'a>, what: &str) -> Result<Rgb, LoadError> {
        let text = self.string(raw, "a colour")?;
        let digits: Option<Vec<u32>> =
            text.strip_prefix('#').unwrap_or(&text).chars().map(|digit| digit.to_digit(16)).collect();
        match digits.as_deref() {
            Some(&[r, g, b]) => return Ok(colors::from_bytes([r * 17, g * 17, b * 17])),
            Some(&[r, s, g, h, b, c]) => return Ok(colors::from_bytes([16 * r + s, 16 * g + h, 16 * b + c])),
            _ => {}
        }
        if let Some(color) = colors::named(&text) {
            return Ok(color);
        }
        if let Some(advice) = elsewhere::color_advice(&text) {
            return Err(self.no_color(raw, what, Some(advice)));
        }
        if text.starts_with('#') {
            return Err(
                self.error(raw.0, "a colour of digits is \"#rrggbb\" or \"#rgb\", such as \"#ff8000\"")
            );
        }
        let near = suggest(&text, colors::names());
        let text = shorten(&text);
        Err(self.error(raw.0, format!("unknown colour \"{text}\"{near}: the names are those of CSS")))
    }

    /// `Srgb(r, g, b)`, on the sRGB curve.
    fn encoded(&self, body: &'a str) -> Result<Rgb, LoadError> {
        let encoded: [Raw; 3] = self.tuple(Raw(body), "Srgb(r, g, b), each from 0 to 1")?;
        let mut linear = [0.0; 3];
        for (linear, raw) in linear.iter_mut().zip(encoded) {
            let encoded: f32 = self.number(raw)?;
            if !(0.0..=1.0).contains(&encoded) {
                let reason = "a part of Srgb is from 0 to 1: with parts from 0 to 255 write \"#rrggbb\"";
                return Err(self.error(raw.0, reason));
            }
            *linear = srgb_decode(encoded);
        }
        Ok(linear.into())
    }

    /// One value in parentheses, and possibly a second one.
    fn one_or_two(&self, body: &'a str, form: &str) -> Result<(Raw<'a>, Option<Raw<'a>>), LoadError> {
        match self.tuple(Raw(body), form) {
            Ok([first, second]) => Ok((first, Some(second))),
            Err(_) => self.tuple(Raw(body), form).map(|[only]| (only, None)),
        }
    }

    /// `Kelvin(temperature)` or `Kelvin(temperature, luminance)`.
    fn black_body(&self, body: &'a str, what: &str) -> Result<Rgb, LoadError> {
        let (raw, factor) = self.one_or_two(body, "Kelvin(temperature) or Kelvin(temperature, luminance)")?;
        let kelvin: f32 = self.number(raw)?;
        let [coldest, hottest] = colors::TEMPERATURES;
        if !(coldest..=hottest).contains(&kelvin) {
            let range = format!("from {coldest} to {hottest} kelvin");
            return Err(self.out_of_range(raw, "the temperature", &range));
        }
        let factor = factor.map_or(Ok(1.0), |raw| self.at_least_zero(raw, what))?;
        Ok(colors::black_body(kelvin) * factor)
    }

    /// `Metal("name")`.
    fn metal(&self, body: &'a str) -> Result<Rgb, LoadError> {
        let [raw] = self.tuple(Raw(body), "Metal(\"name\")")?;
        self.metal_called(raw).map(|[straight, _]| straight)
    }

    /// The colours of a metal: see [`colors::metal`].
    pub(super) fn metal_called(&self, raw: Raw<'a>) -> Result<[Rgb; 2], LoadError> {
        let name = self.string(raw, "the name of a metal")?;
        colors::metal(&name).ok_or_else(|| {
            let suggestion = suggest(&name, colors::METAL_NAMES);
            let (name, known) = (shorten(&name), colors::METAL_NAMES.join(", "));
            self.error(raw.0, format!("unknown metal \"{name}\"{suggestion}; metals: {known}"))
        })
    }

    /// `Lumens(number)`, or `Lumens(number, colour)`: light of that colour, whose luminance is the number. Other units
    /// alike.
    fn photometric(
        &self,
        (unit, body): (&'a str, &'a str),
        what: &str,
        quantity: Option<Quantity>,
    ) -> Result<Rgb, LoadError> {
        let Some(quantity) = quantity else {
            return Err(self.error(unit, format!("{what} is no light that can be given in {unit}")));
        };
        let units = quantity.units();
        let Some((_, factor)) = units.iter().find(|(known, _)| *known == unit) else {
            let known: Vec<&str> = units.iter().map(|(known, _)| *known).collect();
            let known = known.join(" or ");
            return Err(self.error(unit, format!("{what} is not in {unit}: it can be given in {known}")));
        };
        let (raw, tint) = self.one_or_two(body, &format!("{unit}(number) or {unit}(number, colour)"))?;
        let value = self.at_least_zero(raw, what)? * factor;
        let Some(raw) = tint else { return Ok(Rgb::splat(value)) };
        let tint = self.color(raw, "a colour", None)?;
        if tint.luminance() <= 0.0 {
            return Err(self.error(raw.0, "light cannot be black: its brightness is the number before"));
        }
        Ok(tint * (value / tint.luminance()))
    }
}
