//! Rules that find why an image is not what was intended, from the world as it was written and from a few hundred rays.
//!
//! A rule reports nothing rather than something doubtful, because findings also appear next to images that are as
//! intended. So most rules first check that something is wrong with the image, and then look for the cause.

mod bodies;
mod camera;
mod depth;
mod exposure;
mod glass;
mod lights;
mod materials;
mod media;
mod panes;
mod probes;
#[cfg(feature = "study")]
mod samples;
mod sides;
mod sizes;

use std::sync::Arc;

use crate::error::{Diagnostic, Subject};
use crate::integrator::RenderSetup;
use crate::scene::{CompiledScene, MaterialRecord};
use crate::world::World;
pub use exposure::{FinishedImage, of_image};
use probes::Probes;
#[cfg(feature = "study")]
pub use samples::{Outlier, outliers};

/// Creates a finding: something that is probably not as intended, with the option or the line of the scene that fixes
/// it, in which options are marked by backticks.
fn finding(
    code: &'static str,
    about: Option<Subject>,
    what: impl Into<String>,
    remedy: impl Into<String>,
) -> Diagnostic {
    Diagnostic { subject: about, ..Diagnostic::warning(code, what).fixed_by(remedy) }
}

/// Returns the warnings of a scene's compilation that no finding repeats.
pub fn not_found<'a>(
    warnings: &'a [Diagnostic],
    findings: &'a [Diagnostic],
) -> impl Iterator<Item = &'a Diagnostic> {
    warnings.iter().filter(|warning| !findings.iter().any(|finding| finding.code == warning.code))
}

/// The input of all rules.
struct Checked<'a> {
    world: &'a World,
    scene: &'a CompiledScene,
    probes: Probes,
}

/// Returns what is probably not as intended in a world and its scene. Takes a few milliseconds, or longer with `all`,
/// which includes the rules that need a BVH of their own.
pub fn check(world: &World, setup: &RenderSetup, all: bool) -> Vec<Diagnostic> {
    let scene: &Arc<CompiledScene> = &setup.scene;
    if scene.bvh.root.is_none() {
        // The compilation's own warning reports an empty scene.
        return Vec::new();
    }
    let checked = Checked { world, scene, probes: Probes::new(setup) };
    let mut findings: Vec<Diagnostic> = checked.probes.slowness().into_iter().collect();
    bodies::check(&checked, &mut findings);
    camera::check(&checked, &mut findings);
    lights::check(&checked, &mut findings);
    materials::check(&checked, &mut findings);
    glass::check(&checked, all, &mut findings);
    depth::check(&checked, setup, &mut findings);
    media::check(&checked, &mut findings);
    panes::check(&checked, &mut findings);
    sizes::check(&checked, &mut findings);
    // This may be the reason why nothing is visible.
    if all || checked.probes.coverage() < 0.02 || checked.probes.dark() > 0.5 {
        sides::check(&checked, &mut findings);
    }
    findings
}

/// True if light through the glass leaves in discrete directions, which light samples cannot hit.
fn is_smooth(material: &MaterialRecord) -> bool {
    material.roughness.factor < 0.03
}

impl Checked<'_> {
    /// Returns an entity by its number, as the subject of a finding.
    fn subject(&self, number: u32) -> Subject {
        let mut entities = self.world.entities.iter();
        let found = entities.find(|entity| entity.entity().id() == number);
        found.map_or_else(
            || Subject::named(format!("entity {number}")),
            |found| self.world.subject(found.entity()),
        )
    }

    /// Returns the name of an entity by its number.
    fn name(&self, number: u32) -> String {
        self.subject(number).name
    }
}
