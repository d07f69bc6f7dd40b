//! Tests that go through the crate's public face, in one binary to link once.

mod agreement;
mod aov;
mod browser;
mod camera;
mod cameras;
mod catcher;
mod caustics;
mod cli;
mod compare;
mod copies;
mod corpus;
mod edits;
mod energy;
mod far;
mod films;
mod filter_glossy;
mod findings;
#[path = "../fuzz/src/targets.rs"]
mod fuzz_targets;
mod gltf;
mod guides;
#[cfg(unix)]
mod hostile;
mod images;
mod lamps;
mod lens;
mod light_groups;
mod media;
mod meshes;
mod metamorphic;
mod nested;
mod one_thing;
mod page;
mod parts;
mod path;
mod pictures;
mod plans;
#[cfg(unix)]
mod printed;
mod program;
mod references;
mod scenes;
mod shapes;
mod sharing;
mod stopping;
mod straight;
mod studies;
mod support;
mod surroundings;
mod tev;
mod tidy;
mod trace;
mod transparency;
mod view;
