//! The steps from recursion to the wavefront. Each changes one thing, so that the times show what it brings.

use super::ProfilePlan;
use crate::integrator::{RenderSetup, Schedule, Sorting};
use crate::render::Options;
use crate::simd::Isa;
use crate::world::Transport;

/// A way to render, named by what it changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileStep {
    /// Recursion with one lane.
    Recursion,
    /// The wavefront with one lane: another order of work.
    Order,
    /// Rays are traced in lanes.
    Traversal,
    /// The other stages work in lanes, too.
    Shading,
    /// Hits are sorted by material before they are shaded: the wavefront as it is used.
    Sorting,
    /// Recursion as it is used: the boxes of a node are tested in lanes, for one ray at a time.
    Boxes,
}

impl ProfileStep {
    /// The name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            ProfileStep::Recursion => "recursion",
            ProfileStep::Order => "order",
            ProfileStep::Traversal => "traversal",
            ProfileStep::Shading => "shading",
            ProfileStep::Sorting => "sorting",
            ProfileStep::Boxes => "boxes",
        }
    }

    /// A title for tables; steps between the first and the last of a schedule are indented.
    pub fn title(self, isa: Isa) -> String {
        let isa = isa.name();
        match self {
            ProfileStep::Recursion => "recursion, one lane".into(),
            ProfileStep::Order => "wavefront, one lane: order of work".into(),
            ProfileStep::Traversal => format!("  rays in lanes ({isa})"),
            ProfileStep::Shading => "  other stages in lanes".into(),
            ProfileStep::Sorting => "  hits sorted by material".into(),
            ProfileStep::Boxes => format!("recursion, boxes in lanes ({isa})"),
        }
    }
}

/// Returns the steps that change anything, with their options: the wavefront as it is used is the last but one,
/// recursion as it is used is the last.
pub fn steps(setup: &RenderSetup, plan: &ProfilePlan) -> Vec<(ProfileStep, Options)> {
    let [sorted, recursion] =
        [Schedule::Wavefront, Schedule::Recursive].map(|schedule| plan.options(schedule));
    let unsorted = Options { sorting: Sorting::Unsorted, ..sorted };
    let one_lane = |options: Options| Options { isa: Isa::PORTABLE, ..options };
    let mut steps = vec![(ProfileStep::Order, one_lane(unsorted))];
    let has_lanes = plan.isa != Isa::PORTABLE;
    if has_lanes {
        steps.insert(0, (ProfileStep::Recursion, one_lane(recursion)));
        steps.push((ProfileStep::Traversal, Options { traversal: Some(plan.isa), ..one_lane(unsorted) }));
        steps.push((ProfileStep::Shading, unsorted));
    }
    // The other transport does not sort.
    if setup.transport == Transport::Path {
        steps.push((ProfileStep::Sorting, sorted));
    }
    steps.push((if has_lanes { ProfileStep::Boxes } else { ProfileStep::Recursion }, recursion));
    steps
}
