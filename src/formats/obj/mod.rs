//! Wavefront OBJ with its material libraries (MTL), through the `tobj` crate: all objects of a file become one mesh.
//!
//! tobj 4 panics on short colours and huge indices, turns polylines into triangles, loses texture coordinates that only
//! some corners have, reports no line numbers and fails on a trailing comment. So every file is first checked and
//! normalised to the simplest form (`normalize.rs` for OBJ, `library.rs` for MTL), which is all that tobj reads. Faces
//! are triangulated here, because tobj splits concave ones into fans.
//!
//! OBJ's v points up, that of meshes here down, so v becomes 1 − v. Colours are assumed to be linear.

mod library;
mod material;
mod normalize;
mod texture;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use crate::error::{Diagnostic, LoadError};
use crate::formats::triangulate::Triangulator;
use crate::math::{Rgb, Vec2, Vec3};
use crate::memory;
use crate::world::{Assets, ImageId, MaterialId, Mesh};

use material::Materials;
use normalize::Tidied;

/// Memory used per byte of text during reading.
const BYTES_OF_TEXT: u64 = 8;

/// Reads a mesh and the materials that its faces use. `images` is called once for each image file that they name; an
/// image or library that cannot be read is a warning.
pub fn load(
    path: &Path,
    assets: &mut Assets,
    warnings: &mut Vec<Diagnostic>,
    images: &mut dyn FnMut(&Path) -> Result<ImageId, LoadError>,
) -> Result<Mesh, LoadError> {
    let bytes = assets.files.read(path).map_err(LoadError::io(path))?;
    let _claim = memory::reserve("what it says", BYTES_OF_TEXT * bytes.len() as u64)
        .map_err(LoadError::shortage(path))?;
    let tidied = Tidied::new(&text_of(&bytes)).map_err(|fault| LoadError::At {
        file: path.to_owned(),
        line: fault.line,
        column: fault.column,
        reason: fault.reason,
    })?;
    warnings.extend(tidied.warnings.iter().map(|what| Diagnostic::in_file("import", path, what)));
    let library = library::load_all(path, &tidied.libraries, &assets.files, warnings);
    let unknown = tidied.material_names.iter().filter(|name| library.find(name).is_none());
    let unknown: Vec<String> = unknown.map(|name| format!("{name:?}")).collect();
    if !unknown.is_empty() {
        let names = first_of(&unknown);
        let what = format!("no library has the material {names}: the default is used");
        warnings.push(Diagnostic::in_file("import", path, &what));
    }
    let options = tobj::LoadOptions { single_index: true, ..tobj::LoadOptions::default() };
    let (models, _) = tobj::load_obj_buf(&mut tidied.text.as_bytes(), &options, |_| library.for_tobj())
        .map_err(|error| LoadError::invalid(path, error.to_string()))?;
    let mut materials = Materials::new(&library, assets, warnings, images);
    let mut mesh = merge(&models, &tidied, |id| materials.id_of(id), path)?;
    mesh.name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    mesh.source = Some(path.to_owned());
    Ok(mesh)
}

/// Decodes the text of a file that may not be UTF-8 (comments and names of old files often are not).
fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    let text = String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    // Line ends of the classic Mac OS.
    if text.contains('\r') && !text.contains('\n') { text.replace('\r', "\n").into() } else { text }
}

/// Resolves a file name in `from`: relative to its folder or, failing that, in this folder itself, which helps with
/// absolute paths on the author's machine.
fn refer(from: &Path, name: &str) -> PathBuf {
    let name = name.trim().trim_matches('"').replace('\\', "/");
    let folder = from.parent().unwrap_or(Path::new(""));
    let is_absolute = name.starts_with('/') || name.as_bytes().get(1) == Some(&b':');
    let beside = folder.join(name.rsplit('/').next().unwrap_or_default());
    let written = folder.join(&name);
    if is_absolute || (beside.is_file() && !written.is_file()) { beside } else { written }
}

/// Lists the first few of possibly millions of items.
fn first_of(items: &[String]) -> String {
    const MOST: usize = 8;
    match items.len().saturating_sub(MOST) {
        0 => items.join(", "),
        more => format!("{} and {more} more", items[..MOST].join(", ")),
    }
}

/// Merges tobj's meshes, which are split by material, into one mesh.
fn merge(
    models: &[tobj::Model],
    tidied: &Tidied,
    mut material_of: impl FnMut(Option<usize>) -> MaterialId,
    path: &Path,
) -> Result<Mesh, LoadError> {
    let mut mesh = Mesh::default();
    let mut triangulator = Triangulator::default();
    let has_materials = models.iter().any(|model| model.mesh.material_id.is_some());
    for part in models.iter().map(|model| &model.mesh) {
        let base = u32::try_from(mesh.positions.len() + part.positions.len() / 3)
            .map(|_| mesh.positions.len() as u32)
            .map_err(|_| LoadError::invalid(path, "has more vertices than 32-bit indices can name"))?;
        mesh.positions.extend(part.positions.chunks_exact(3).map(Vec3::from_slice));
        if tidied.has_normals {
            mesh.normals.extend(part.normals.chunks_exact(3).map(Vec3::from_slice));
        }
        if tidied.has_uvs {
            mesh.uvs.extend(part.texcoords.chunks_exact(2).map(|uv| Vec2::new(uv[0], 1.0 - uv[1])));
        }
        if tidied.has_colors {
            mesh.colors.extend(
                part.vertex_color.chunks_exact(3).map(|c| Rgb::new(c[0], c[1], c[2]).map(|c| c.max(0.0))),
            );
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
            let Mesh { positions, triangles, .. } = &mut mesh;
            let split = triangulator.split(positions, &corners, |t| triangles.push(t.map(|k| corners[k])));
            split.map_err(|fault| LoadError::invalid(path, format!("one of its faces: {fault}")))?;
        }
        if has_materials && mesh.triangles.len() > mesh.triangle_materials.len() {
            mesh.triangle_materials.resize(mesh.triangles.len(), material_of(part.material_id));
        }
    }
    if mesh.triangles.is_empty() {
        return Err(LoadError::invalid(
            path,
            "has no faces (only points or lines?): make a surface of it first",
        ));
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests;
