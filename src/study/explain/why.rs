//! The reasons why paths end.

use crate::integrator::path::bounces::LobeKind;

/// The reason why a path ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// The ray missed the scene.
    Escaped,
    /// The surface neither reflects specularly nor transmits.
    Surface,
    /// The path has had all allowed bounces.
    Bounces,
    /// Its throughput would have fallen below `min_throughput`.
    Weak,
    /// The path has had all allowed bounces of a kind.
    Limit(LobeKind),
    /// The surface is unlit: it shows its colour and ignores all light.
    Unlit,
    /// No direction could be sampled.
    Absorbed,
    /// The throughput would have been 0.
    Black,
    /// Russian roulette ended it.
    Roulette,
}

impl Why {
    /// The machine-readable name.
    pub fn name(self) -> String {
        match self {
            Why::Limit(kind) => format!("{} limit", kind.name()),
            other => format!("{other:?}").to_lowercase(),
        }
    }

    /// The human-readable text.
    pub fn text(self) -> &'static str {
        match self {
            Why::Escaped => "it met nothing and sees the background",
            Why::Surface => "the surface neither mirrors nor lets light through",
            Why::Bounces => "it has had max_depth bounces",
            Why::Weak => "less than min_throughput would be left of it",
            Why::Limit(LobeKind::Diffuse) => "it has had diffuse_depth diffuse bounces",
            Why::Limit(LobeKind::Glossy) => "it has had glossy_depth glossy bounces",
            Why::Limit(LobeKind::Transmission) => "it has been through transmission_depth surfaces",
            Why::Unlit => "the surface is unlit: it shows its colour and answers no light",
            Why::Absorbed => "no direction could be drawn: the surface absorbs, or it led to the wrong side",
            Why::Black => "nothing would be left of what comes from the drawn direction",
            Why::Roulette => "it has lost at Russian roulette",
        }
    }
}
