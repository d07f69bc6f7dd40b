//! Copies of entities: in rows and grids, and scattered on a surface.

use crate::math::Vec2;

use super::components::Transform;
use super::fields::{Range, fields};

/// Copies of an entity and of all below it: steps of a row, of a row of such rows, and so on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Array(pub Vec<ArrayRow>);

/// A row of copies, each moved by one step more than the one before.
#[derive(Clone, Debug, PartialEq)]
pub struct ArrayRow {
    /// The number of copies, with the entity itself.
    pub count: u32,
    /// The step, in the space of the entity's parent.
    pub step: Transform,
}

fields! {
    /// Copies of an entity and of all below it at random places of a surface. Each stands upright (+Y) or along the
    /// surface's normal, after the entity's own transform.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ScatteredCopies, "a scatter" {
        /// name of the entity on whose surface they stand; or `entity/node`, a node of the glTF file that an entity places
        on: String = String::new(), Text;
        /// number of copies
        count: u32 = 0, Whole(0, ScatteredCopies::MOST);
        /// copies per square metre, instead of `count`
        density: f32 = 0.0, Number(Range::From(0.0));
        /// another number gives other places
        seed: u64 = 0, Seed;
        /// least and greatest factor on the size
        scale: Vec2 = Vec2::ONE, Pair(Range::Above0);
        /// from 0, upright, to 1, along the surface's normal
        align: f32 = 1.0, Number(Range::UNIT);
        /// whether each is turned about its own axis by a random angle
        turn: bool = true, Flag;
    }
}

impl ScatteredCopies {
    /// The largest number of copies.
    pub const MOST: u32 = 1 << 24;
}

impl Array {
    /// The number of copies, with the entity itself.
    pub(crate) fn count(&self) -> u64 {
        self.0.iter().fold(1, |count, row| count.saturating_mul(row.count.into()))
    }
}

/// Errors: a number that is out of its range, neither a number nor a density, or both.
pub(crate) fn check_scatter(scatter: &ScatteredCopies) -> Result<(), String> {
    super::bounds::check(&mut scatter.clone())?;
    match (scatter.count > 0, scatter.density > 0.0) {
        (true, true) => Err("give either a count or a density".into()),
        (false, false) => Err("give a count, or a density in copies per square metre".into()),
        _ if scatter.scale.x > scatter.scale.y => Err("its scale must be (least, greatest)".into()),
        _ => Ok(()),
    }
}

/// Errors: more copies than fit into a scene, or none.
pub(crate) fn check_array(array: &Array) -> Result<(), String> {
    match array.count() {
        0 => Err("a row of an array needs a count of at least 1".into()),
        count if count > u64::from(ScatteredCopies::MOST) => {
            Err(format!("an array of {count} copies: at most {} fit into a scene", ScatteredCopies::MOST))
        }
        _ => Ok(()),
    }
}
