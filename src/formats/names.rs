//! Unique names for entities.

use std::collections::{HashMap, HashSet};

use crate::world::{Name, World};

/// The names that a world's entities have.
pub(super) struct TakenNames {
    taken: HashSet<String>,
    /// The last number that was appended to a name.
    last: HashMap<String, u64>,
}

impl TakenNames {
    pub(super) fn of(world: &World) -> Self {
        let taken = world.entities.query::<&Name>().iter().map(|name| name.0.clone()).collect();
        Self { taken, last: HashMap::new() }
    }

    /// `wish` or, if it is taken, `wish (2)` and so on.
    pub(super) fn unique(&mut self, wish: &str) -> Name {
        let mut name = wish.to_owned();
        while !self.taken.insert(name.clone()) {
            let last = self.last.entry(wish.to_owned()).or_insert(1);
            *last += 1;
            name = format!("{wish} ({last})");
        }
        Name(name)
    }
}
