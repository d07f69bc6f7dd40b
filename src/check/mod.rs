//! Why an image is not what was meant: rules about the world as it was written, and about what a few hundred rays
//! see.
//!
//! A rule says nothing rather than something doubtful, because its findings appear next to images that are as their
//! authors want them. So most rules first ask whether something is wrong with what is seen, and then what is to
//! blame.

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

use crate::error::words;
use crate::integrator::RenderSetup;
use crate::scene::{CompiledScene, Material};
use crate::world::World;
pub use exposure::{FinishedImage, of_image};
use probes::Probes;
#[cfg(feature = "study")]
pub use samples::{Outlier, outliers};

/// Something that is probably not as intended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The entity or material that it is about, if it is about one.
    pub about: Option<String>,
    /// What is wrong, and why.
    pub what: String,
    /// The option, or the line in the scene, that fixes it.
    pub remedy: Option<String>,
}

impl Finding {
    fn new(about: Option<&str>, what: impl Into<String>, remedy: impl Into<String>) -> Finding {
        Finding { about: about.map(str::to_owned), what: what.into(), remedy: Some(remedy.into()) }
    }
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        if let Some(about) = &self.about {
            write!(f, "{}: ", words(about))?;
        }
        f.write_str(&self.what)?;
        self.remedy.as_ref().map_or(Ok(()), |remedy| write!(f, " ({remedy})"))
    }
}

/// The warnings of a scene's compilation that none of its findings repeats.
pub fn not_found<'a>(warnings: &'a [String], findings: &'a [Finding]) -> impl Iterator<Item = &'a String> {
    warnings.iter().filter(|warning| !findings.iter().any(|finding| finding.to_string() == **warning))
}

/// What all rules look at.
struct Checked<'a> {
    world: &'a World,
    scene: &'a CompiledScene,
    probes: Probes,
}

/// What is probably not as intended in a world and its scene. This takes a few milliseconds, or longer with `all`,
/// which includes the rules that need a tree of their own.
pub fn check(world: &World, setup: &RenderSetup, all: bool) -> Vec<Finding> {
    let scene: &Arc<CompiledScene> = &setup.scene;
    if scene.bvh.root.is_none() {
        // The scene's own warning says so.
        return Vec::new();
    }
    let checked = Checked { world, scene, probes: Probes::new(setup) };
    let mut findings: Vec<Finding> = checked.probes.slowness().into_iter().collect();
    bodies::check(&checked, &mut findings);
    camera::check(&checked, &mut findings);
    lights::check(&checked, &mut findings);
    materials::check(&checked, &mut findings);
    glass::check(&checked, all, &mut findings);
    depth::check(&checked, setup, &mut findings);
    media::check(&checked, &mut findings);
    panes::check(&checked, &mut findings);
    sizes::check(&checked, &mut findings);
    // Where nothing is seen, this may be why.
    if all || checked.probes.coverage() < 0.02 || checked.probes.dark() > 0.5 {
        sides::check(&checked, &mut findings);
    }
    findings
}

/// Whether light that goes through glass keeps to single directions, in which no light sample lies.
fn is_smooth(material: &Material) -> bool {
    material.roughness.factor < 0.03
}

impl Checked<'_> {
    /// The name of an entity by its number.
    fn name(&self, number: u32) -> String {
        let mut entities = self.world.entities.iter();
        let found = entities.find(|entity| entity.entity().id() == number);
        found.map_or_else(|| format!("entity {number}"), |found| self.world.name_of(found.entity()))
    }
}
