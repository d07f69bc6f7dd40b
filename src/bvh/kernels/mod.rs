//! The kernels that trace queues of rays, and the choice among them ([`query`]).

pub mod counters;
pub(super) mod direction_classes;
pub(super) mod interleaved;
pub(super) mod leaf_list;
pub(super) mod packet;
pub(super) mod prepare;
pub mod query;
pub(super) mod shaft;
pub(super) mod stream;
pub(super) mod subtree;
pub mod traverse;
