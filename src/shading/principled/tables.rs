//! The tables of lobes: albedos by cosine and roughness. They do not depend on the scene and are compiled in; only
//! tests integrate. `UPDATE=1 cargo test --lib as_the_code` writes them.

use super::albedo::{self, AlbedoTable};
use super::anisotropic::{self, AnisotropicTable};
use super::anisotropic_glass::{self, AnisotropicGlassTable};
use super::glass::{self, GlassTable};
use super::sheen;

static MIRROR_NUMBERS: [f32; albedo::LENGTH] = numbers(include_bytes!("tables/mirror.bin"));
static ANISOTROPIC_NUMBERS: [f32; anisotropic::LENGTH] = numbers(include_bytes!("tables/anisotropic.bin"));
static GLASS_NUMBERS: [f32; glass::LENGTH] = numbers(include_bytes!("tables/glass.bin"));
static ANISOTROPIC_GLASS_NUMBERS: [f32; anisotropic_glass::LENGTH] =
    numbers(include_bytes!("tables/anisotropic_glass.bin"));

/// The table of rough mirrors.
pub static MIRROR: AlbedoTable = AlbedoTable::new(&MIRROR_NUMBERS);
/// The table of rough mirrors with anisotropic microfacets.
pub static ANISOTROPIC: AnisotropicTable = AnisotropicTable::new(&ANISOTROPIC_NUMBERS);
/// The table of rough glass.
pub static GLASS: GlassTable = GlassTable::new(&GLASS_NUMBERS);
/// The table of rough glass with anisotropic microfacets.
pub static ANISOTROPIC_GLASS: AnisotropicGlassTable = AnisotropicGlassTable::new(&ANISOTROPIC_GLASS_NUMBERS);
/// The table of sheen.
pub static SHEEN: [f32; sheen::LENGTH] = numbers(include_bytes!("tables/sheen.bin"));

/// The numbers of a file. One of another length is accepted, so that after a change of a table's size the test that
/// writes the file can be compiled.
const fn numbers<const COUNT: usize>(file: &[u8]) -> [f32; COUNT] {
    let (words, _) = file.as_chunks();
    let mut numbers = [0.0; COUNT];
    let mut i = 0;
    while i < COUNT && i < words.len() {
        numbers[i] = f32::from_le_bytes(words[i]);
        i += 1;
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::super::{albedo, anisotropic, anisotropic_glass, glass, sheen};
    use crate::tests::is_up_to_date;

    #[track_caller]
    fn check(name: &str, numbers: Vec<f32>) {
        let bytes: Vec<u8> = numbers.into_iter().flat_map(f32::to_le_bytes).collect();
        is_up_to_date(&format!("src/shading/principled/tables/{name}.bin"), &bytes);
    }

    #[test]
    fn lobe_tables_are_as_the_code() {
        check("mirror", albedo::integral::numbers());
        check("anisotropic", anisotropic::integral::numbers());
        check("glass", glass::integral::numbers());
        check("anisotropic_glass", anisotropic_glass::integral::numbers());
        check("sheen", sheen::integral::numbers());
    }
}
