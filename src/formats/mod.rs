//! Files: the only place that knows file formats. Layer 4.

pub mod obj;
pub mod picture;
pub mod ply;
pub mod triangulate;
