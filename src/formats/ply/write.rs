//! Writing a mesh as binary PLY.

use std::io::{self, Write};
use std::path::Path;

use crate::error::SaveError;
use crate::files::atomic_write::write_whole;
use crate::film::tonemap::srgb_encode;
use crate::world::Mesh;

/// Writes a mesh to a file with [`write()`].
pub fn save(path: &Path, mesh: &Mesh) -> Result<(), SaveError> {
    write_whole(path, |mut file| write(mesh, &mut file).and_then(|()| file.flush()))
}

/// Writes positions, triangles and, if present, normals, texture coordinates and colours, little-endian. Reading the
/// file returns the same floats, except that v is stored as 1 − v (exact for multiples of 2⁻²⁴ from 0 to 1, and within
/// 2⁻²⁴ of other values between them) and colours are stored by the sRGB curve (six digits are kept, up to 4). The name
/// and the materials are not written.
pub fn write(mesh: &Mesh, mut out: impl Write) -> io::Result<()> {
    let vertices = mesh.positions.len();
    let [has_normals, has_uvs, has_colors] = [mesh.normals.len(), mesh.uvs.len(), mesh.colors.len()]
        .map(|length| if length == 0 { Ok(false) } else { check(length == vertices).map(|()| true) });
    let (has_normals, has_uvs, has_colors) = (has_normals?, has_uvs?, has_colors?);
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}")?;
    let columns =
        [("x y z", true), ("nx ny nz", has_normals), ("s t", has_uvs), ("red green blue", has_colors)];
    for name in columns.iter().filter(|c| c.1).flat_map(|c| c.0.split(' ')) {
        writeln!(out, "property float {name}")?;
    }
    // `int` is supported by every other program; `uint` is used only if necessary.
    let index = if i32::try_from(vertices).is_ok() { "int" } else { "uint" };
    writeln!(
        out,
        "element face {}\nproperty list uchar {index} vertex_indices\nend_header",
        mesh.triangles.len()
    )?;
    for i in 0..vertices {
        write_floats(&mut out, mesh.positions[i].to_array())?;
        if has_normals {
            write_floats(&mut out, mesh.normals[i].to_array())?;
        }
        if has_uvs {
            write_floats(&mut out, [mesh.uvs[i].x, 1.0 - mesh.uvs[i].y])?;
        }
        if has_colors {
            write_floats(&mut out, mesh.colors[i].to_array().map(srgb_encode))?;
        }
    }
    for triangle in &mesh.triangles {
        let mut bytes = [3; 13];
        for (place, index) in bytes[1..].chunks_exact_mut(4).zip(triangle) {
            place.copy_from_slice(&index.to_le_bytes());
        }
        out.write_all(&bytes)?;
    }
    Ok(())
}

fn check(lengths_agree: bool) -> io::Result<()> {
    let error = || io::Error::other("a mesh's normals, texture coordinates and colours must be one a vertex");
    lengths_agree.then_some(()).ok_or_else(error)
}

fn write_floats<const N: usize>(out: &mut impl Write, floats: [f32; N]) -> io::Result<()> {
    floats.iter().try_for_each(|float| out.write_all(&float.to_le_bytes()))
}
