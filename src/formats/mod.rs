//! Files: the only place that knows file formats.

pub mod picture;
