//! What is said of a scene beside its files: values that are others, things that are left out.

use std::collections::HashSet;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Files;
use super::ron::query::{Query, QueryError, nothing_meant, set};
use crate::error::LoadError;
use crate::world::{Light, Shape, World};

/// Edits in the language of [`super::ron::query`], in the order in which they are carried out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Edits {
    /// Statements that change values.
    pub set: Vec<String>,
    /// Of what rays can hit, what alone is left.
    pub only: Vec<String>,
    /// What is taken away, light or shape.
    pub hide: Vec<String>,
    /// From where to where cameras look, as scene files have it.
    pub look_at: Option<[String; 2]>,
    /// By how many degrees cameras turn about what they look at: to the right, and up.
    pub orbit: Option<[f64; 2]>,
    /// How many times nearer they come to it.
    pub zoom: Option<f64>,
    /// Whether there is a floor under everything.
    pub ground: bool,
}

impl Edits {
    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        *self == Edits::default()
    }

    /// Leaves cameras where files say.
    pub(crate) fn forget_camera(&mut self) {
        (self.look_at, self.orbit, self.zoom) = (None, None, None);
    }

    /// Carries out what is no matter of where things are. Errors: what is no query, or means nothing.
    pub(crate) fn apply(&self, world: &mut World, files: &mut Files) -> Result<(), LoadError> {
        let wrong =
            |option: &str, error: QueryError| LoadError::invalid(Path::new(option), error.to_string());
        if let Some([from, to]) = &self.look_at {
            let statement = format!("Camera.transform = LookAt(from: ({from}), to: ({to}))");
            set(world, &statement, files).map_err(|error| wrong("--look-at", error))?;
        }
        for statement in &self.set {
            set(world, statement, files).map_err(|error| wrong("--set", error))?;
        }
        if !self.only.is_empty() {
            let queries = self.queries(&self.only).map_err(|error| wrong("--only", error))?;
            let kept = meant(world, &queries, "--only", &self.only)?;
            for entity in world.in_order() {
                if !kept.contains(&entity) {
                    // Not all have one.
                    let _ = world.entities.remove_one::<Shape>(entity);
                }
            }
        }
        if !self.hide.is_empty() {
            let queries = self.queries(&self.hide).map_err(|error| wrong("--hide", error))?;
            let mut hides = false;
            for entity in meant(world, &queries, "--hide", &self.hide)? {
                hides |= world.entities.remove_one::<Shape>(entity).is_ok();
                hides |= world.entities.remove_one::<Light>(entity).is_ok();
            }
            if !hides {
                world
                    .warnings
                    .push("--hide: nothing of that is a shape or a light, so nothing is hidden".into());
            }
        }
        Ok(())
    }

    fn queries(&self, texts: &[String]) -> Result<Vec<Query>, QueryError> {
        texts.iter().map(|text| Query::parse(text)).collect()
    }
}

/// What any of some queries means, with what hangs on it.
fn meant(
    world: &World,
    queries: &[Query],
    option: &str,
    texts: &[String],
) -> Result<HashSet<hecs::Entity>, LoadError> {
    let order = world.in_order();
    for (query, text) in queries.iter().zip(texts) {
        if !order.iter().any(|entity| query.takes(world, *entity)) {
            let reason = format!("{text}: {}", nothing_meant(world, query));
            return Err(LoadError::invalid(Path::new(option), reason));
        }
    }
    let is_meant =
        |entity: &hecs::Entity| queries.iter().any(|query| query.takes_with_parents(world, *entity));
    Ok(order.into_iter().filter(is_meant).collect())
}
