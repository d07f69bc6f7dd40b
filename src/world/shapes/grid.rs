//! Surfaces over a rectangle of the XZ plane.

use super::builder::{MeshBuilder, ShapeVertex};
use crate::error::CompileError;
use crate::math::{DVec3, Vec2};
use crate::world::{Image, Mesh};

/// A surface over a rectangle around the origin, between that many lines each way, at heights by column and row. Without
/// smooth normals, it has facets.
fn surface(
    size: Vec2,
    lines: [usize; 2],
    height: impl Fn(usize, usize) -> f64,
    smooth: bool,
) -> Result<Mesh, CompileError> {
    let [columns, rows] = lines;
    let mut builder =
        MeshBuilder::with_room(columns.saturating_mul(rows), columns.saturating_mul(rows).saturating_mul(2))?;
    let [last_column, last_row] = lines.map(|count| count - 1);
    let cell = [f64::from(size.x) / last_column as f64, f64::from(size.y) / last_row as f64];
    // The rise between the neighbours of a line.
    let rise = |at: usize, last: usize, cell: f64, height: &dyn Fn(usize) -> f64| {
        let [low, high] = [at.saturating_sub(1), (at + 1).min(last)];
        (height(high) - height(low)) / ((high - low) as f64 * cell)
    };
    for row in 0..rows {
        for column in 0..columns {
            let part = [column as f64 / last_column as f64, row as f64 / last_row as f64];
            let place = |part: f64, size: f32| (part - 0.5) * f64::from(size);
            let position = DVec3::new(place(part[0], size.x), height(column, row), place(part[1], size.y));
            let along_x = rise(column, last_column, cell[0], &|column| height(column, row));
            let along_z = rise(row, last_row, cell[1], &|row| height(column, row));
            builder.vertex(ShapeVertex { position, normal: DVec3::new(-along_x, 1.0, -along_z), uv: part });
        }
    }
    builder.lattice(0, rows, columns);
    let mut mesh = builder.finish();
    if !smooth {
        mesh.normals = Vec::new();
    }
    Ok(mesh)
}

pub(super) fn flat(size: Vec2, cells: [u32; 2]) -> Result<Mesh, CompileError> {
    surface(size, cells.map(|count| count as usize + 1), |_, _| 0.0, true)
}

/// A surface with a vertex for each pixel of an image of at least 2 × 2, at the height of its red part.
pub(super) fn heights(image: &Image, size: Vec2, height: f32, smooth: bool) -> Result<Mesh, CompileError> {
    let lines = [image.width as usize, image.height as usize];
    let at = |column: usize, row: usize| {
        f64::from(height) * image.texels.stored(row * image.width as usize + column)[0]
    };
    surface(size, lines, at, smooth)
}

#[cfg(test)]
mod tests {
    use super::super::Fineness;
    use super::super::tests::{area_of, assert_sound, made};
    use super::*;
    use crate::world::{Assets, Shape, Texels};

    #[test]
    fn grid_lies_flat_and_faces_up() {
        let shape = Shape::Grid { size_m: Vec2::new(4.0, 2.0), columns: 5, rows: 3 };
        let mesh = made(&shape, Fineness::DEFAULT);
        assert_sound(&mesh);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (24, 30));
        assert!((area_of(&mesh) - 8.0).abs() < 1e-6);
        assert_eq!(mesh.positions[0].to_array(), [-2.0, 0.0, -1.0], "the image's top left");
    }

    /// On a paraboloid, central differences are exact but at the border.
    #[test]
    fn height_field_has_the_heights_and_slopes_of_its_image() {
        let (width, height) = (9u32, 5u32);
        let at = |column: u32, row: u32| 0.05 * (column as f32 - 4.0).powi(2) + 0.1 * row as f32;
        let texels = (0..width * height).map(|i| [at(i % width, i / width), 9.0, 9.0]).collect();
        let mut assets = Assets::default();
        let image = assets.add_image(Image { source: None, width, height, texels: Texels::Rgb32(texels) });
        let size_m = Vec2::new(8.0, 8.0);
        let field = |smooth| {
            let shape = Shape::HeightField { image: Some(image), size_m, height_m: 2.0, smooth };
            shape.to_mesh(&assets, Fineness::DEFAULT).unwrap().unwrap()
        };
        let mesh = field(true);
        assert_sound(&mesh);
        for (index, (position, normal)) in mesh.positions.iter().zip(&mesh.normals).enumerate() {
            let (column, row) = (index as u32 % width, index as u32 / width);
            let (x, z) = (column as f32 - 4.0, 2.0 * row as f32 - 4.0);
            assert!((*position - crate::math::Vec3::new(x, 2.0 * at(column, row), z)).length() < 1e-5);
            if column > 0 && column < width - 1 {
                // ∂y/∂x = 0.2 x, ∂y/∂z = 0.1.
                let exact = DVec3::new(-0.2 * f64::from(x), 1.0, -0.1).normalize();
                assert!((normal.as_dvec3() - exact).length() < 1e-5, "{normal} {exact}");
            }
        }
        assert!(field(false).normals.is_empty());
        let dot = assets.add_image(Image {
            source: None,
            width: 1,
            height: 1,
            texels: Texels::Rgba8(vec![[0; 4]]),
        });
        let shape = Shape::HeightField { image: Some(dot), size_m, height_m: 2.0, smooth: true };
        let error = shape.to_mesh(&assets, Fineness::DEFAULT).unwrap().unwrap_err().to_string();
        assert!(error.contains("at least 2 × 2 pixels"), "{error}");
    }
}
