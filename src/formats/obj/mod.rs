//! Wavefront OBJ with its material libraries (MTL), through the `tobj` crate. The objects of a file become one mesh or,
//! for a scene that consists of the file, one mesh each.
//!
//! tobj 4 panics on short colours and huge indices, turns polylines into triangles, loses texture coordinates that only
//! some corners have, reports no line numbers and fails on a trailing comment. So every file is first checked and
//! normalised to the simplest form (`normalize.rs` for OBJ, `library.rs` for MTL), which is all that tobj reads. Faces
//! are triangulated here, because tobj splits concave ones into fans. Smoothing groups become normals.
//!
//! OBJ's v points up, that of meshes here down, so v becomes 1 − v. Colours are encoded by the sRGB curve, those of
//! libraries linear.

mod faces;
mod library;
mod lines;
mod material;
mod normalize;
mod texture;
mod vertices;

use std::borrow::Cow;
use std::path::Path;

use crate::error::{Diagnostic, LoadError};
use crate::formats::vertex_colors::{self, ColorRange};
use crate::math::{Rgb, Vec2, Vec3};
use crate::memory;
use crate::world::triangulate::Triangulator;
use crate::world::{Assets, DecodedImage, MaterialId, Mesh};

use library::Library;
use material::Materials;
use normalize::Tidied;

/// Memory used per byte of text during reading.
const BYTES_OF_TEXT: u64 = 8;
/// More memory per byte, in files with smoothing groups.
const BYTES_OF_SMOOTH_TEXT: u64 = 24;

/// Reads and decodes an image.
pub type ImageReader<'a> = &'a mut dyn FnMut(&Path) -> Result<DecodedImage, LoadError>;

/// Reads a mesh and the materials that its faces use. `images` is called once for each image file that they name; an
/// image or library that cannot be read is a warning.
pub fn load(
    path: &Path,
    assets: &mut Assets,
    warnings: &mut Vec<Diagnostic>,
    images: ImageReader,
) -> Result<Mesh, LoadError> {
    // There is always one.
    load_parts(path, false, assets, warnings, images).map(|mut parts| parts.swap_remove(0).1)
}

/// Reads the objects of a file with their names, as [`load`] does the whole.
pub fn load_objects(
    path: &Path,
    assets: &mut Assets,
    warnings: &mut Vec<Diagnostic>,
    images: ImageReader,
) -> Result<Vec<(String, Mesh)>, LoadError> {
    load_parts(path, true, assets, warnings, images)
}

fn load_parts(
    path: &Path,
    apart: bool,
    assets: &mut Assets,
    warnings: &mut Vec<Diagnostic>,
    images: ImageReader,
) -> Result<Vec<(String, Mesh)>, LoadError> {
    let bytes = assets.files.read(path).map_err(LoadError::io(path))?;
    let text = text_of(&bytes);
    let smooths = text.lines().any(|line| line.trim_start().starts_with("s "));
    let each = BYTES_OF_TEXT + if smooths { BYTES_OF_SMOOTH_TEXT } else { 0 };
    let _claim =
        memory::reserve("what it says", each * bytes.len() as u64).map_err(LoadError::shortage(path))?;
    let tidied = Tidied::new(&text, apart).map_err(|fault| LoadError::At {
        file: path.to_owned(),
        line: fault.line,
        column: fault.column,
        reason: fault.reason,
    })?;
    let told = tidied.warnings.iter();
    warnings.extend(told.map(|(line, what)| Diagnostic::at_line("import", path, *line, what)));
    let library = library::load_all(path, &tidied.libraries.all, &assets.files, warnings);
    let used = used_materials(&tidied, &library, path, warnings);
    let options = tobj::LoadOptions { single_index: true, ..tobj::LoadOptions::default() };
    let numbers = used.iter().enumerate().filter_map(|(name, used)| Some((name.to_string(), (*used)?)));
    let (models, _) =
        tobj::load_obj_buf(&mut tidied.text(), &options, |_| Ok((Vec::new(), numbers.clone().collect())))
            .map_err(|error| LoadError::invalid(path, error.to_string()))?;
    let mut materials = Materials::new(&library, assets, warnings, images);
    let of_all = library.only().filter(|_| tidied.materials.all.is_empty());
    let mut merger = Merger { tidied: &tidied, path, triangulator: Triangulator::default() };
    let mut parts = merger.merge(&models, &mut |number| materials.id_of(number.or(of_all)))?;
    materials.tell_unused();
    let largest = parts.iter().map(|(_, mesh)| vertex_colors::largest(&mesh.colors)).fold(0.0, f32::max);
    let range = ColorRange::of(largest);
    warnings.extend(range.told().map(|what| Diagnostic::in_file("import", path, &what)));
    let is_whole = parts.len() == 1;
    for (name, mesh) in &mut parts {
        range.decode(&mut mesh.colors);
        mesh.origin = tidied.origin;
        mesh.name = if is_whole && name.is_empty() {
            path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
        } else {
            name.clone()
        };
        mesh.source = Some(path.to_owned());
    }
    Ok(parts)
}

/// The number in the library of each material that a file uses; none for those that no library has.
fn used_materials(
    tidied: &Tidied,
    library: &Library,
    path: &Path,
    warnings: &mut Vec<Diagnostic>,
) -> Vec<Option<usize>> {
    let names = &tidied.materials.all;
    let used: Vec<Option<usize>> = names.iter().map(|(name, _)| library.find(name)).collect();
    let unknown: Vec<&(String, usize)> =
        names.iter().zip(&used).filter(|(_, used)| used.is_none()).map(|(name, _)| name).collect();
    if let Some((_, line)) = unknown.first() {
        let quoted: Vec<String> = unknown.iter().map(|(name, _)| format!("{name:?}")).collect();
        let what = format!("no library has the material {}: the default is used", first_of(&quoted));
        warnings.push(Diagnostic::at_line("import", path, *line, what));
    }
    let count = library.materials.len();
    if let Some((_, line)) = tidied.libraries.all.first().filter(|_| names.is_empty() && count > 1) {
        let what = format!("none of the {count} materials of its library is used: there is no usemtl line");
        warnings.push(Diagnostic::at_line("import", path, *line, what));
    }
    used
}

/// Decodes the text of a file. It may be UTF-16 if it begins with a mark of that; else it may not even be UTF-8
/// (comments and names of old files often are not).
fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    let wide = |unit: fn([u8; 2]) -> u16| {
        let units = bytes.as_chunks::<2>().0.iter().skip(1).map(|pair| unit(*pair));
        Cow::Owned(char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect())
    };
    let text = match bytes {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes),
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes),
        _ => String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)),
    };
    // Line ends of the classic Mac OS.
    if text.contains('\r') && !text.contains('\n') { text.replace('\r', "\n").into() } else { text }
}

/// Lists the first few of possibly millions of items.
fn first_of(items: &[String]) -> String {
    const MOST: usize = 8;
    match items.len().saturating_sub(MOST) {
        0 => items.join(", "),
        more => format!("{} and {more} more", items[..MOST].join(", ")),
    }
}

/// Merges tobj's meshes, which are split by material, into one mesh or one for each object.
struct Merger<'a> {
    tidied: &'a Tidied,
    path: &'a Path,
    triangulator: Triangulator,
}

impl Merger<'_> {
    fn merge(
        &mut self,
        models: &[tobj::Model],
        material_of: &mut dyn FnMut(Option<usize>) -> MaterialId,
    ) -> Result<Vec<(String, Mesh)>, LoadError> {
        let mut parts = match self.tidied.objects.len() {
            0 => vec![(String::new(), Mesh::default())],
            _ => self.tidied.objects.iter().map(|name| (name.clone(), Mesh::default())).collect(),
        };
        let has_materials =
            models.iter().any(|model| material_of(model.mesh.material_id) != MaterialId::DEFAULT);
        for model in models {
            let object = if parts.len() > 1 { model.name.parse().unwrap_or(0) } else { 0usize };
            let Some((_, mesh)) = parts.get_mut(object) else { continue };
            self.add(&model.mesh, mesh)?;
            if has_materials && mesh.triangles.len() > mesh.triangle_materials.len() {
                mesh.triangle_materials.resize(mesh.triangles.len(), material_of(model.mesh.material_id));
            }
        }
        parts.retain(|(_, mesh)| !mesh.triangles.is_empty());
        if parts.is_empty() {
            let reason = "has no faces (only points or lines?): make a surface of it first";
            return Err(LoadError::invalid(self.path, reason));
        }
        Ok(parts)
    }

    fn add(&mut self, part: &tobj::Mesh, mesh: &mut Mesh) -> Result<(), LoadError> {
        let invalid = |reason: String| LoadError::invalid(self.path, reason);
        let base = u32::try_from(mesh.positions.len() + part.positions.len() / 3)
            .map(|_| mesh.positions.len() as u32)
            .map_err(|_| invalid("has more vertices than 32-bit indices can name".into()))?;
        mesh.positions.extend(part.positions.chunks_exact(3).map(Vec3::from_slice));
        if self.tidied.has_normals {
            mesh.normals.extend(part.normals.chunks_exact(3).map(Vec3::from_slice));
        }
        if self.tidied.has_uvs {
            mesh.uvs.extend(part.texcoords.chunks_exact(2).map(|uv| Vec2::new(uv[0], 1.0 - uv[1])));
        }
        if self.tidied.has_colors {
            mesh.colors.extend(part.vertex_color.chunks_exact(3).map(|c| Rgb::new(c[0], c[1], c[2])));
        }
        let mut rest = &part.indices[..];
        // tobj gives no corner counts if all faces have three.
        let triangles = if part.face_arities.is_empty() { rest.len() / 3 } else { 0 };
        let mut corners = Vec::new();
        for &arity in part.face_arities.iter().chain(std::iter::repeat_n(&3, triangles)) {
            let (face, after) = rest.split_at(arity as usize);
            rest = after;
            corners.clear();
            corners.extend(face.iter().map(|index| index + base));
            let Mesh { positions, triangles, .. } = &mut *mesh;
            let split =
                self.triangulator.split(positions, &corners, |t| triangles.push(t.map(|k| corners[k])));
            split.map_err(|fault| LoadError::invalid(self.path, format!("one of its faces: {fault}")))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
