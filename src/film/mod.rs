//! From samples to pixels, and from pixels to what a screen shows.

pub mod tonemap;
