//! Precomputed tables of lobes: albedos by cosine and roughness, computed before rendering, once for all scenes of a
//! process.

use std::sync::OnceLock;

use super::{albedo, anisotropic, anisotropic_glass, glass, sheen};
use crate::scene::MaterialRecord;

/// The tables of lobes. Tables that no material needs are empty.
#[derive(Clone, Copy)]
pub struct LobeTables {
    /// The table of rough mirrors.
    pub mirror: &'static albedo::AlbedoTable,
    /// The table of rough mirrors with anisotropic microfacets.
    pub(super) anisotropic: &'static anisotropic::AnisotropicTable,
    /// The table of rough glass.
    pub(super) glass: &'static glass::GlassTable,
    /// The table of rough glass with anisotropic microfacets.
    pub(super) anisotropic_glass: &'static anisotropic_glass::AnisotropicGlassTable,
    /// The table of sheen.
    pub(super) sheen: &'static [f32],
}

static MIRROR: OnceLock<albedo::AlbedoTable> = OnceLock::new();
static ANISOTROPIC: OnceLock<anisotropic::AnisotropicTable> = OnceLock::new();
static GLASS: OnceLock<glass::GlassTable> = OnceLock::new();
static ANISOTROPIC_GLASS: OnceLock<anisotropic_glass::AnisotropicGlassTable> = OnceLock::new();
static SHEEN: OnceLock<Vec<f32>> = OnceLock::new();
static NO_MIRROR: albedo::AlbedoTable = albedo::AlbedoTable::EMPTY;
static NO_GLASS: glass::GlassTable = glass::GlassTable::EMPTY;
static NOT_STRETCHED: anisotropic::AnisotropicTable = anisotropic::AnisotropicTable::EMPTY;
static NO_STRETCHED_GLASS: anisotropic_glass::AnisotropicGlassTable =
    anisotropic_glass::AnisotropicGlassTable::EMPTY;

impl LobeTables {
    /// Empty tables.
    pub const NONE: LobeTables = LobeTables {
        mirror: &NO_MIRROR,
        anisotropic: &NOT_STRETCHED,
        glass: &NO_GLASS,
        anisotropic_glass: &NO_STRETCHED_GLASS,
        sheen: &[],
    };

    /// All tables.
    pub fn all() -> Self {
        Self {
            mirror: MIRROR.get_or_init(albedo::AlbedoTable::new),
            anisotropic: ANISOTROPIC.get_or_init(anisotropic::AnisotropicTable::new),
            glass: GLASS.get_or_init(glass::GlassTable::new),
            anisotropic_glass: ANISOTROPIC_GLASS.get_or_init(anisotropic_glass::AnisotropicGlassTable::new),
            sheen: SHEEN.get_or_init(sheen::table),
        }
    }

    /// The tables that materials need, computed in parallel, one thread each.
    pub fn of(materials: &[MaterialRecord]) -> Self {
        let any = |needs: fn(&MaterialRecord) -> bool| materials.iter().any(needs);
        let mirror = any(|m| m.has_mirror() || !m.coat.is_zero());
        let anisotropic = any(MaterialRecord::is_anisotropic);
        let glass = any(|m| {
            let plain = m.roughness.is_zero() && m.transmission.is_one() && m.diffuse_transmission.is_zero();
            m.refracts() && (!plain || m.is_anisotropic())
        });
        let anisotropic_glass = any(|m| m.refracts() && m.is_anisotropic());
        let sheen = any(|m| !m.sheen_color.is_black());
        std::thread::scope(|scope| {
            // If a thread cannot be started, the table is computed below.
            let aside = || std::thread::Builder::new();
            if anisotropic {
                let _ = aside()
                    .spawn_scoped(scope, || ANISOTROPIC.get_or_init(anisotropic::AnisotropicTable::new));
            }
            if glass {
                let _ = aside().spawn_scoped(scope, || GLASS.get_or_init(glass::GlassTable::new));
            }
            if anisotropic_glass {
                let _ = aside().spawn_scoped(scope, || {
                    ANISOTROPIC_GLASS.get_or_init(anisotropic_glass::AnisotropicGlassTable::new)
                });
            }
            if sheen {
                let _ = aside().spawn_scoped(scope, || SHEEN.get_or_init(sheen::table));
            }
            if mirror {
                MIRROR.get_or_init(albedo::AlbedoTable::new);
            }
        });
        let mut tables = Self::NONE;
        if mirror {
            tables.mirror = MIRROR.get_or_init(albedo::AlbedoTable::new);
        }
        if anisotropic {
            tables.anisotropic = ANISOTROPIC.get_or_init(anisotropic::AnisotropicTable::new);
        }
        if glass {
            tables.glass = GLASS.get_or_init(glass::GlassTable::new);
        }
        if anisotropic_glass {
            tables.anisotropic_glass =
                ANISOTROPIC_GLASS.get_or_init(anisotropic_glass::AnisotropicGlassTable::new);
        }
        if sheen {
            tables.sheen = SHEEN.get_or_init(sheen::table);
        }
        tables
    }
}
