//! The parameters of a request for an image.

use std::str::FromStr;

use serde::Deserialize;
use serde_json::json;

use super::picture::{Display, Layer};
use crate::math::Rgb;
use crate::world::Tonemap;

/// The largest factor of a light group.
const MOST_LIGHT: f32 = 1e6;

/// An image that a page asks for.
#[derive(Deserialize)]
pub struct WantedImage {
    layer: Option<String>,
    exposure: Option<String>,
    tonemap: Option<String>,
    /// A factor for each light group: a list of colours, as JSON.
    mix: Option<String>,
}

impl WantedImage {
    /// The factors of light groups; an error if they are not such.
    pub fn factors(&self) -> Result<Vec<Rgb>, String> {
        let Some(text) = &self.mix else { return Ok(Vec::new()) };
        let factors: Vec<[f32; 3]> = serde_json::from_str(text).map_err(|_| "a mix is a list of colours")?;
        let is_factor = |value: &f32| (0.0..=MOST_LIGHT).contains(value);
        if !factors.as_flattened().iter().all(is_factor) {
            return Err(format!("a light's factor is from 0 to {MOST_LIGHT}"));
        }
        Ok(factors.into_iter().map(Rgb::from).collect())
    }

    /// The layer and how it is displayed; an error if there is no such thing.
    pub fn read(&self) -> Result<(Layer, Display), String> {
        let layer = self.layer.as_deref().map_or(Ok(Layer::Light), Layer::from_str)?;
        let exposure_ev = match self.exposure.as_deref() {
            None => Some(0.0),
            Some("auto") => None,
            Some(stops) => {
                let stops = stops.parse().ok().filter(|stops: &f32| stops.is_finite());
                Some(stops.ok_or("an exposure is a number of stops, or auto")?)
            }
        };
        let tonemap = match self.tonemap.as_deref() {
            None => Tonemap::default(),
            Some(name) => serde_json::from_value(json!(name)).map_err(|_| "there is no such tone curve")?,
        };
        Ok((layer, Display { exposure_ev, tonemap }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn image_queries_are_parsed_and_checked() {
        let read = |layer: &str, exposure: &str, tonemap: &str| {
            let [layer, exposure, tonemap] = [layer, exposure, tonemap].map(|text| Some(text.to_owned()));
            WantedImage { layer, exposure, tonemap, mix: None }.read()
        };
        let display = Display { exposure_ev: Some(-1.5), tonemap: Tonemap::Aces };
        assert_eq!(read("depth", "-1.5", "Aces"), Ok((Layer::Depth, display)));
        assert!(read("light", "auto", "Agx").is_ok_and(|(_, display)| display.exposure_ev.is_none()));
        for [layer, exposure, tonemap] in
            [["light", "nan", "Aces"], ["dark", "0", "Aces"], ["light", "0", "x"]]
        {
            assert!(read(layer, exposure, tonemap).is_err());
        }
        let factors = |mix: &str| {
            WantedImage { layer: None, exposure: None, tonemap: None, mix: Some(mix.to_owned()) }.factors()
        };
        assert_eq!(factors("[[1,1,1],[0,2.5,0]]"), Ok(vec![Rgb::WHITE, Rgb::new(0.0, 2.5, 0.0)]));
        for wrong in ["", "[1]", "[[1,1,-1]]", "[[1,1,1e9]]"] {
            assert!(factors(wrong).is_err(), "{wrong}");
        }
    }
}
