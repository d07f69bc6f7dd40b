//! What systems made before: a system whose inputs are the same makes nothing again.

use std::sync::Arc;

/// What a system made, and of what.
pub(super) struct Made<I, O> {
    pub of: I,
    pub made: O,
}

impl<I: PartialEq, O: Clone> Made<I, O> {
    /// What was made from the same inputs before, or else is made now.
    pub fn again<E>(before: Option<&Self>, of: I, make: impl FnOnce(&I) -> Result<O, E>) -> Result<Self, E> {
        let made = match before.filter(|before| before.of == of) {
            Some(before) => before.made.clone(),
            None => make(&of)?,
        };
        Ok(Self { of, made })
    }
}

/// A value that is equal to itself alone: pointers are compared. It is kept, so that no other value can take its
/// address.
pub(super) struct Same<T>(pub Arc<T>);

impl<T> PartialEq for Same<T> {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// The pointers of a list.
pub(super) fn all<T>(list: &[Arc<T>]) -> Vec<Same<T>> {
    list.iter().map(|one| Same(one.clone())).collect()
}

/// What a value is to the last bit: the sign of a zero counts.
#[derive(PartialEq)]
pub(super) struct Bits(String);

/// By its debug text, which tells any two floats apart.
pub(super) fn bits(value: &impl std::fmt::Debug) -> Bits {
    Bits(format!("{value:?}"))
}
