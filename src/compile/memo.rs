//! What systems made before: a system whose inputs are the same makes nothing again.

use std::sync::Arc;

/// What a system made, and of what.
pub(super) struct Memo<I, O> {
    pub inputs: I,
    pub output: O,
}

impl<I: PartialEq, O: Clone> Memo<I, O> {
    /// What was made from the same inputs before, or else is made now.
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

/// A value that is equal to itself alone: pointers are compared. It is kept, so that no other value can take its
/// address.
pub(super) struct ByPtr<T>(pub Arc<T>);

impl<T> PartialEq for ByPtr<T> {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// The pointers of a list.
pub(super) fn all<T>(list: &[Arc<T>]) -> Vec<ByPtr<T>> {
    list.iter().map(|one| ByPtr(one.clone())).collect()
}

/// What a value is to the last bit: the sign of a zero counts.
#[derive(PartialEq)]
pub(super) struct DebugText(String);

/// By its debug text, which tells any two floats apart.
pub(super) fn debug_text(value: &impl std::fmt::Debug) -> DebugText {
    DebugText(format!("{value:?}"))
}
