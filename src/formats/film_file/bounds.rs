//! Validation of film headers: their numbers must lie within the bounds of the options they come from.

use std::ops::RangeInclusive;

use super::header::{Begun, FilmHeader, PROGRAM, RenderedView};
use crate::error::words;
use crate::film::{Allocation, MOST_LIGHT_GROUPS, Region};
use crate::formats::{Edits, EnvironmentPreset, SkyOptions};
use crate::world::{Adaptive, Settings};

/// An upper bound: a film cannot have more shards than samples.
const MOST_PARTS: u32 = 1 << 22;
/// Under adaptive sampling, a block gets at most this multiple of the requested samples.
const MOST_TIMES: u32 = 16;
/// An upper bound: more rays than a block takes in a century.
const MOST_RAYS: u64 = 1 << 53;
/// An upper bound: more seconds than any rendering takes.
const MOST_SECONDS: f64 = 1e12;

impl FilmHeader {
    /// Parses a header. The error is a predicate that follows "its header" or "its record".
    pub fn parse(json: &[u8]) -> Result<FilmHeader, String> {
        let damaged = || "is damaged: render it again, or use another copy".to_owned();
        // A header of another version may have other fields.
        let any: serde_json::Value = serde_json::from_slice(json).map_err(|_| damaged())?;
        let program = any.get("program").and_then(serde_json::Value::as_str).ok_or_else(damaged)?;
        if program != PROGRAM {
            let program = words(program);
            return Err(format!(
                "was written by {program}, and this is {PROGRAM}, whose samples may be other ones: use {program}"
            ));
        }
        let header: FilmHeader = serde_json::from_slice(json).map_err(|_| damaged())?;
        header.check().map_err(|what| format!("is damaged: {what}: render it again, or use another copy"))?;
        Ok(header)
    }

    /// Checks all numbers. The error names the first one that is out of bounds or inconsistent with others.
    fn check(&self) -> Result<(), String> {
        self.settings.check()?;
        self.view.check()?;
        let Region { x0, y0, x1, y1 } = self.region;
        let [width, height] = self.settings.size;
        is_true("region", x0 < x1 && y0 < y1 && x1 <= width && y1 <= height)?;
        is_true("unit", self.unit.is_sound())?;
        is_true("light_groups", self.light_groups.len() <= MOST_LIGHT_GROUPS)?;
        if let Some(allocation) = &self.allocation {
            let most = self.settings.samples.saturating_mul(MOST_TIMES).max(Allocation::LEAST);
            is_true("allocation", allocation.is_sound() && allocation.most() <= most)?;
        }
        let total = self.total();
        let [start, end] = self.wanted;
        is_true("wanted", start <= end && end <= total.max(self.settings.samples))?;
        is_true("samples", self.ranges().is_some())?;
        is_true("most", self.most <= total.max(self.settings.samples.saturating_mul(MOST_TIMES)))?;
        is_true("shard", self.shard.is_none_or(|[index, count]| index < count && count <= MOST_PARTS))?;
        is_true("rays", self.rays.iter().flatten().all(|rays| *rays <= MOST_RAYS))?;
        is_true("seconds", (0.0..=MOST_SECONDS).contains(&self.note.seconds))?;
        let in_rounds = self.settings.adaptive == Adaptive::On;
        let most = if in_rounds { self.settings.samples.saturating_mul(MOST_TIMES) } else { total };
        self.begun.as_ref().map_or(Ok(()), |begun| is_true("begun", begun.is_sound(self.region, most)))
    }
}

impl Begun {
    /// True if a film of a region, all of whose sample numbers are below `most`, can have such a pass.
    fn is_sound(&self, region: Region, most: u32) -> bool {
        let Begun { samples: [start, end], until, tile, tiles, blocks: _ } = self;
        let side = |from: u32, to: u32| u64::from(to.div_ceil(*tile) - from / tile);
        start < end
            && *end <= until.unwrap_or(*end)
            && until.unwrap_or(*end) <= most
            && (1..=Settings::MOST_PIXELS_A_SIDE).contains(tile)
            && tiles.len() as u64 <= side(region.x0, region.x1) * side(region.y0, region.y1)
    }
}

impl RenderedView {
    /// Checks all numbers. The error names the first one that no option can have set.
    fn check(&self) -> Result<(), String> {
        let all = |numbers: &[f64], most: f64| numbers.iter().all(|number| number.abs() <= most);
        is_true("time_s", self.options.time_s.is_none_or(f32::is_finite))?;
        is_true(
            "shutter_s",
            self.shutter_s.is_none_or(|time| time > 0.0 && time <= RenderedView::LONGEST_SHUTTER_S),
        )?;
        is_true(
            "moments",
            self.moments.is_none_or(|moments| (1..=RenderedView::MOST_MOMENTS).contains(&moments)),
        )?;
        let side = |side: &u32| (1..=Settings::MOST_PIXELS_A_SIDE).contains(side);
        is_true("size", self.options.size.iter().flatten().all(side))?;
        is_true("zoom", self.options.edits.zoom.is_none_or(|zoom| (1e-3..=1e3).contains(&zoom)))?;
        is_true(
            "orbit",
            self.options.edits.orbit.is_none_or(|angles| all(&angles, RenderedView::MOST_DEGREES)),
        )?;
        let edits = &self.options.edits;
        is_true("fov_degrees", edits.fov_degrees.is_none_or(|fov| fov > 0.0 && fov < 180.0))?;
        let is_within =
            |value: Option<f64>, range: &RangeInclusive<f64>| value.is_none_or(|it| range.contains(&it));
        is_true("focal_length_mm", is_within(edits.focal_length_mm, &Edits::FOCAL_LENGTHS_MM))?;
        is_true("f_stop", is_within(edits.f_stop, &Edits::F_STOPS))?;
        is_true(
            "env_turn_degrees",
            edits.env_turn_degrees.is_none_or(|angle| all(&[angle], RenderedView::MOST_DEGREES)),
        )?;
        is_true(
            "env_strength",
            edits.env_strength.is_none_or(|factor| (0.0..=Edits::MOST_STRENGTH).contains(&factor)),
        )?;
        if let Some(EnvironmentPreset::Sky(sky)) = &self.options.surroundings {
            let SkyOptions { elevation_degrees, azimuth_degrees, haze } = sky;
            is_true("elevation_degrees", all(&[*elevation_degrees], 90.0))?;
            is_true("azimuth_degrees", azimuth_degrees.is_finite())?;
            is_true("haze", (0.0..=SkyOptions::MOST_HAZE).contains(haze))?;
        }
        Ok(())
    }
}

fn is_true(name: &str, is_sound: bool) -> Result<(), String> {
    if is_sound { Ok(()) } else { Err(format!("{name} says what cannot be")) }
}
