//! Studies of the renderer itself: agreement of all ways to render, records of single samples, profiles, and the growth
//! of errors and times.

pub mod descriptions;
pub mod experiment;
pub mod explain;
pub mod furnace;
mod html;
mod machine;
pub mod profile;
pub mod verify;
