//! Memoized results: a system whose inputs are unchanged does not run again.

use std::hash::{Hash, Hasher};
use std::sync::Arc;

/// A system's output, with the inputs that it was made from.
pub(super) struct Memo<I, O> {
    pub inputs: I,
    pub output: O,
}

impl<I: PartialEq, O: Clone> Memo<I, O> {
    /// Reuses the output of `before` if its inputs are equal, or else makes it.
    pub fn reuse_or_make<E>(
        before: Option<&Self>,
        of: I,
        make: impl FnOnce(&I) -> Result<O, E>,
    ) -> Result<Self, E> {
        let made = match before.filter(|before| before.inputs == of) {
            Some(before) => before.output.clone(),
            None => make(&of)?,
        };
        Ok(Self { inputs: of, output: made })
    }
}

/// A value that is compared by its address. Holds the value, so that no other can get that address.
pub(super) struct ByPtr<T>(pub Arc<T>);

impl<T> PartialEq for ByPtr<T> {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl<T> Eq for ByPtr<T> {}

impl<T> Hash for ByPtr<T> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        Arc::as_ptr(&self.0).hash(state);
    }
}

/// The values of a list, to be compared by their addresses.
pub(super) fn all<T>(list: &[Arc<T>]) -> Vec<ByPtr<T>> {
    list.iter().map(|one| ByPtr(one.clone())).collect()
}

/// A value's debug text, exact to the last bit: the sign of a zero counts.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct DebugText(String);

/// The debug text of a value; any two floats have different ones.
pub(super) fn debug_text(value: &impl std::fmt::Debug) -> DebugText {
    DebugText(format!("{value:?}"))
}
