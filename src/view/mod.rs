//! `rayfront view`: a scene that is rendered, looked at, asked and edited at the same time.
//!
//! One thread renders: the first picture is small and of one sample, so that it is there at once; then come passes of
//! the whole image. Whoever wants something of it puts a wish into a queue, which stops the pass that is under way.
//! Files are looked at between passes. Other threads answer the page: all that they need of a picture they share
//! ([`viewer::Shown`]), so that no answer makes the rendering wait.

pub mod command;
mod explanation;
pub mod picture;
pub mod rig;
pub mod scene;
pub mod server;
mod status;
pub mod viewer;
pub mod watched;
