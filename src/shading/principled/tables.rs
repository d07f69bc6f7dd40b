//! What is known of lobes beforehand: albedos by cosine and roughness, computed before rendering begins,
//! once for all scenes of a program.

use std::sync::OnceLock;

use super::{albedo, glass, sheen, stretched, stretched_glass};
use crate::scene::Material;

/// Tables of lobes. Those that no material needs are empty.
#[derive(Clone, Copy)]
pub struct LobeTables {
    /// Of rough mirrors.
    pub mirror: &'static albedo::Table,
    /// Of those whose microfacets are stretched.
    pub(super) stretched: &'static stretched::Table,
    /// Of rough glass.
    pub(super) glass: &'static glass::Table,
    /// The table of rough glass whose microfacets are stretched.
    pub(super) stretched_glass: &'static stretched_glass::Table,
    /// Of fibres.
    pub(super) sheen: &'static [f32],
}

static MIRROR: OnceLock<albedo::Table> = OnceLock::new();
static STRETCHED: OnceLock<stretched::Table> = OnceLock::new();
static GLASS: OnceLock<glass::Table> = OnceLock::new();
static STRETCHED_GLASS: OnceLock<stretched_glass::Table> = OnceLock::new();
static SHEEN: OnceLock<Vec<f32>> = OnceLock::new();
static NO_MIRROR: albedo::Table = albedo::Table::EMPTY;
static NO_GLASS: glass::Table = glass::Table::EMPTY;
static NOT_STRETCHED: stretched::Table = stretched::Table::EMPTY;
static NO_STRETCHED_GLASS: stretched_glass::Table = stretched_glass::Table::EMPTY;

impl LobeTables {
    /// None.
    pub const NONE: LobeTables = LobeTables {
        mirror: &NO_MIRROR,
        stretched: &NOT_STRETCHED,
        glass: &NO_GLASS,
        stretched_glass: &NO_STRETCHED_GLASS,
        sheen: &[],
    };

    /// All.
    pub fn all() -> Self {
        Self {
            mirror: MIRROR.get_or_init(albedo::Table::new),
            stretched: STRETCHED.get_or_init(stretched::Table::new),
            glass: GLASS.get_or_init(glass::Table::new),
            stretched_glass: STRETCHED_GLASS.get_or_init(stretched_glass::Table::new),
            sheen: SHEEN.get_or_init(sheen::table),
        }
    }

    /// Those that materials need, each made by a thread of its own.
    pub fn of(materials: &[Material]) -> Self {
        let any = |needs: fn(&Material) -> bool| materials.iter().any(needs);
        let mirror = any(|m| m.has_mirror() || !m.coat.is_zero());
        let stretched = any(Material::is_stretched);
        let glass = any(|m| {
            let plain = m.roughness.is_zero() && m.transmission.is_one() && m.diffuse_transmission.is_zero();
            m.refracts() && (!plain || m.is_stretched())
        });
        let stretched_glass = any(|m| m.refracts() && m.is_stretched());
        let sheen = any(|m| !m.sheen_color.is_black());
        std::thread::scope(|scope| {
            // If no thread can be started, the table is made below.
            let aside = || std::thread::Builder::new();
            if stretched {
                let _ = aside().spawn_scoped(scope, || STRETCHED.get_or_init(stretched::Table::new));
            }
            if glass {
                let _ = aside().spawn_scoped(scope, || GLASS.get_or_init(glass::Table::new));
            }
            if stretched_glass {
                let _ =
                    aside().spawn_scoped(scope, || STRETCHED_GLASS.get_or_init(stretched_glass::Table::new));
            }
            if sheen {
                let _ = aside().spawn_scoped(scope, || SHEEN.get_or_init(sheen::table));
            }
            if mirror {
                MIRROR.get_or_init(albedo::Table::new);
            }
        });
        let mut tables = Self::NONE;
        if mirror {
            tables.mirror = MIRROR.get_or_init(albedo::Table::new);
        }
        if stretched {
            tables.stretched = STRETCHED.get_or_init(stretched::Table::new);
        }
        if glass {
            tables.glass = GLASS.get_or_init(glass::Table::new);
        }
        if stretched_glass {
            tables.stretched_glass = STRETCHED_GLASS.get_or_init(stretched_glass::Table::new);
        }
        if sheen {
            tables.sheen = SHEEN.get_or_init(sheen::table);
        }
        tables
    }
}
