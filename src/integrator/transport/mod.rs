//! Transports: the light at one vertex of a path, under [`whitted`]'s transport and under the path transport
//! ([`path_tracing`]), and the scattering of photons ([`photon_tracing`]).

mod catcher;
pub mod decide;
pub mod direct;
pub mod medium;
mod medium_light;
pub mod onward;
pub mod path_tracing;
pub mod photon_tracing;
pub mod reusable;
pub mod scatter_vertex;
pub mod transparent_shadow;
pub mod unseen_lamps;
pub mod whitted;
