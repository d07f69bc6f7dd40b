//! Studies of the renderer itself: whether all ways to render agree, what happens to a sample,
//! where the time goes, how errors and times grow.

pub mod experiment;
pub mod explain;
pub mod facts;
pub mod profile;
pub mod verify;
