//! Building a tree: [`builder`] makes a binary tree with the surface area heuristic ([`binning`]), large ones by way of
//! [`buckets`], after long thin triangles have been split where it is worthwhile ([`slivers`]); [`collapse`] folds it into
//! wide nodes at least expected cost; [`assemble`] combines the steps.

pub mod assemble;
pub mod binary;
pub mod binning;
pub mod buckets;
pub mod builder;
pub mod clip;
pub mod collapse;
pub mod costs;
pub mod halve;
pub mod primitives;
pub mod reference;
pub mod slivers;
