//! The parts of this crate that its program, tests and benchmarks use beyond the public interface. Nothing here is
//! stable: names and meanings may change in any release.
//!
//! To document all of it: `cargo doc --no-deps --document-private-items`.

#[doc(hidden)]
pub mod bvh {
    pub use crate::bvh::*;
}
#[doc(hidden)]
#[cfg(feature = "study")]
pub mod check {
    pub use crate::check::*;
}
#[doc(hidden)]
#[cfg(feature = "cli")]
pub mod cli {
    pub use crate::cli::{main, run, understands};
}
#[doc(hidden)]
#[cfg(feature = "render")]
pub mod compile {
    pub use crate::compile::compiled::*;
    pub use crate::compile::*;
}
#[doc(hidden)]
#[cfg(feature = "render")]
pub mod film {
    pub use crate::film::allocation::*;
    pub use crate::film::features::*;
    pub use crate::film::moments::*;
    pub use crate::film::sums::*;
    pub use crate::film::*;
    pub mod exposure {
        pub use crate::film::exposure::*;
    }
    pub mod tonemap {
        pub use crate::film::tonemap::*;
    }
}
#[doc(hidden)]
#[cfg(feature = "formats")]
pub mod formats {
    pub use crate::formats::asset_files::*;
    pub use crate::formats::load_options::*;
    pub use crate::formats::staging::load::*;
    pub use crate::formats::*;
    pub mod film_file {
        pub use crate::formats::film_file::*;
    }
    pub mod gltf {
        pub use crate::formats::gltf::*;
    }
    pub mod obj {
        pub use crate::formats::obj::*;
    }
    pub mod picture {
        pub use crate::formats::picture::*;
    }
    pub mod ply {
        pub use crate::formats::ply::*;
    }
    pub mod rays {
        pub use crate::formats::rays::*;
    }
    pub mod ron {
        pub use crate::formats::ron::*;
    }
    pub mod stl {
        pub use crate::formats::stl::*;
    }
    pub mod study {
        pub use crate::formats::study::*;
    }
}
#[doc(hidden)]
#[cfg(feature = "render")]
pub mod integrator {
    pub use crate::integrator::*;
}
#[doc(hidden)]
pub mod math {
    pub use crate::math::ray::*;
    pub use crate::math::vector::*;
    pub mod elementary {
        pub use crate::math::elementary::*;
    }
}
#[doc(hidden)]
#[cfg(feature = "render")]
pub mod render {
    pub use crate::render::prepare::*;
    pub use crate::render::render_state::*;
    pub use crate::render::session::*;
    pub use crate::render::*;
}
#[doc(hidden)]
#[cfg(feature = "render")]
pub mod sampling {
    pub use crate::sampling::*;
}
#[doc(hidden)]
#[cfg(feature = "render")]
pub mod scene {
    pub use crate::scene::*;
}
#[doc(hidden)]
pub mod simd {
    pub use crate::simd::*;
}
#[doc(hidden)]
#[cfg(feature = "cli")]
pub mod view {
    pub use crate::view::*;
}
#[doc(hidden)]
#[cfg(feature = "render")]
pub mod world {
    pub use crate::world::asset_cache::*;
    pub use crate::world::source_files::*;
}
