//! Files: what the world is read from and what is written.

pub mod obj;
pub mod ply;
pub mod triangulate;
