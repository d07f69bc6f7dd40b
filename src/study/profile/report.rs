//! All that a profile has measured: the text, the JSON and the page are made from it.

use std::collections::HashMap;
use std::path::Path;

use super::counters::Counted;
use super::flow::Flows;
use super::parts::PartCost;
use super::{ProfilePlan, StageTimes, Timed};
use crate::integrator::setup::NoPhotons;
use crate::integrator::{RenderSetup, Schedule, Stage};
use crate::simd::Isa;

/// The measurements.
pub struct ProfileReport<'a> {
    /// The scene's file.
    pub scene: &'a Path,
    /// Width and height of the image in pixels.
    pub size: [u32; 2],
    /// The parameters.
    pub plan: &'a ProfilePlan,
    /// The setup.
    pub setup: &'a RenderSetup,
    /// The times of all steps.
    pub times: &'a [Timed],
    /// The times of stages.
    pub stages: &'a StageTimes,
    /// The number of photons of a sample, or the reason for none.
    pub photons: Result<u32, NoPhotons>,
    /// The rays and items.
    pub flows: &'a Flows,
    /// The names of entities by their numbers.
    pub names: &'a HashMap<u32, String>,
    /// The processor's counters, or why there are none.
    pub counted: &'a Result<Counted, String>,
}

impl ProfileReport<'_> {
    /// Returns the times of the wavefront and of recursion as they are used: the last of each.
    pub fn as_used(&self) -> [&Timed; 2] {
        [Schedule::Wavefront, Schedule::Recursive].map(|schedule| {
            let last = self.times.iter().rfind(|timed| timed.options.schedule == schedule);
            last.unwrap_or(&self.times[0])
        })
    }

    /// Says how the wavefront's time compares with that of recursion.
    pub fn comparison(&self) -> String {
        let [wavefront, recursive] = self.as_used().map(|timed| timed.wall.median);
        let one_lane = |schedule| {
            let mut own = self.times.iter().filter(|timed| timed.options.isa == Isa::PORTABLE);
            own.find(|timed| timed.options.schedule == schedule).map(|timed| timed.wall.median)
        };
        let [breadth, depth] = [Schedule::Wavefront, Schedule::Recursive].map(one_lane);
        let one_lane = breadth.zip(depth).map(|(breadth, depth)| breadth / depth.max(1e-12));
        format!(
            "the wavefront takes {:.2} of the time of recursion{}",
            wavefront / recursive.max(1e-12),
            one_lane.map_or(String::new(), |ratio| format!("; with one lane for both {ratio:.2}"))
        )
    }

    /// Returns the stages that items have entered.
    pub fn stages_in_use(&self) -> impl Iterator<Item = Stage> {
        Stage::ALL.into_iter().filter(|stage| self.flows.stages[*stage as usize].entering > 0)
    }

    /// Returns the costs of entities, the highest first.
    pub fn entities(&self) -> Vec<(String, PartCost)> {
        let name =
            |number: u32| self.names.get(&number).cloned().unwrap_or_else(|| format!("entity {number}"));
        let costs = self.flows.parts.by_entity().into_iter();
        costs.map(|(number, cost)| (number.map_or_else(nothing, name), cost)).collect()
    }

    /// Returns the costs of materials, the highest first.
    pub fn materials(&self) -> Vec<(String, PartCost)> {
        let names = &self.setup.scene.material_names;
        let costs = self.flows.parts.by_material().into_iter();
        let name = |index: u32| names[index as usize].clone();
        costs.map(|(index, cost)| (index.map_or_else(nothing, name), cost)).collect()
    }
}

/// Formats a part of 1 in percent.
pub fn percent(part: f64) -> String {
    format!("{:.1} %", 100.0 * part)
}

/// The name for rays that hit nothing.
fn nothing() -> String {
    "(nothing)".into()
}
