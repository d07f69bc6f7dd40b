//! Tests that go through the crate's public face, in one binary to link once.

mod agreement;
mod aov;
mod browser;
mod cli;
mod compare;
mod corpus;
mod edits;
mod films;
mod findings;
mod gltf;
mod images;
mod lamps;
mod media;
mod meshes;
mod metamorphic;
mod path;
mod pictures;
mod references;
mod scenes;
mod sharing;
mod studies;
mod support;
mod tev;
mod tidy;
mod trace;
mod view;
