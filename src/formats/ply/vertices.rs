//! The `vertex` element.

use crate::film::tonemap::srgb_decode;
use crate::math::{DVec3, Rgb, Vec2, Vec3};
use crate::world::origin;

use super::PlyMesh;
use super::header::{Element, PropertyKind, Scalar};
use super::source::{NumberFault, NumberSource};

/// Slots of a row's values: position (from 0), normal, texture coordinates, colour, alpha.
const NORMAL: usize = 3;
const UV: usize = 6;
pub const COLOR: usize = 8;
pub const ALPHA: usize = 11;
const SLOTS: usize = 12;

/// The property names of each slot, the usual one first.
pub const NAMES: [&[&str]; SLOTS] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["u", "s", "texture_u", "texture_s"],
    &["v", "t", "texture_v", "texture_t"],
    &["red", "diffuse_red", "r"],
    &["green", "diffuse_green", "g"],
    &["blue", "diffuse_blue", "b"],
    &["alpha", "diffuse_alpha", "a"],
];

/// The properties of a row.
struct PlyLayout {
    /// Reads into a slot or skips, for each property in order.
    steps: Vec<VertexField>,
    /// The type of each slot that is present.
    types: [Option<Scalar>; SLOTS],
}

enum VertexField {
    Keep(usize, Scalar),
    Skip(PropertyKind),
}

impl PlyLayout {
    fn new(element: &Element) -> Result<PlyLayout, String> {
        let mut types = [None; SLOTS];
        let mut steps = Vec::with_capacity(element.properties.len());
        for property in &element.properties {
            let slot = NAMES.iter().position(|names| names.contains(&property.name.as_str()));
            steps.push(match (slot, property.kind) {
                (Some(slot), PropertyKind::Scalar(scalar)) if types[slot].is_none() => {
                    types[slot] = Some(scalar);
                    VertexField::Keep(slot, scalar)
                }
                (_, kind) => VertexField::Skip(kind),
            });
        }
        for (slot, name) in ["x", "y", "z"].iter().enumerate() {
            if types[slot].is_none() {
                return Err(format!("element vertex has no property {name}"));
            }
        }
        Ok(PlyLayout { steps, types })
    }

    fn has(&self, slots: std::ops::Range<usize>) -> bool {
        self.types[slots].iter().all(Option::is_some)
    }

    /// Reads a row's position, and its other values.
    fn read_row<S: NumberSource>(
        &self,
        source: &mut S,
        point: &mut DVec3,
        row: &mut [f32; SLOTS],
    ) -> Result<(), NumberFault> {
        for step in &self.steps {
            match *step {
                VertexField::Keep(slot, scalar) => {
                    let number = source.float(scalar)?;
                    row[slot] = number as f32;
                    if slot < NORMAL {
                        point[slot] = number;
                    }
                }
                VertexField::Skip(kind) => source.skip_property(kind)?,
            }
        }
        Ok(())
    }
}

/// Reads all vertices into an empty mesh.
pub fn read<S: NumberSource>(
    source: &mut S,
    element: &Element,
    PlyMesh { mesh, colors_are_encoded, faults, .. }: &mut PlyMesh,
) -> Result<(), String> {
    let layout = PlyLayout::new(element)?;
    if element.count > u64::from(u32::MAX) {
        return Err(format!("{} vertices are too many: at most {} fit", element.count, u32::MAX));
    }
    let count = element.count as usize;
    let [has_normals, has_uvs, has_colors, has_alphas] =
        [NORMAL..UV, UV..COLOR, COLOR..ALPHA, ALPHA..SLOTS].map(|slots| layout.has(slots));
    for slots in [NORMAL..UV, UV..COLOR, COLOR..ALPHA] {
        if !layout.has(slots.clone()) && layout.types[slots.clone()].iter().any(Option::is_some) {
            let names: Vec<&str> = NAMES[slots].iter().map(|names| names[0]).collect();
            faults.incomplete.push(names.join(", "));
        }
    }
    let capacity = |present| if present { count } else { 0 };
    mesh.normals.reserve_exact(capacity(has_normals));
    mesh.uvs.reserve_exact(capacity(has_uvs));
    mesh.colors.reserve_exact(capacity(has_colors));
    let colors = ColorCurve::of(layout.types[COLOR..ALPHA].iter().flatten());
    *colors_are_encoded = has_colors && colors.is_encoded;
    let is_double = S::IS_TEXT || layout.types[..NORMAL].contains(&Some(Scalar::F64));
    let mut points = Vec::with_capacity(capacity(is_double));
    mesh.positions.reserve_exact(capacity(!is_double));
    let (mut point, mut row) = (DVec3::ZERO, [0.0; SLOTS]);
    for i in 0..count {
        let read = layout.read_row(source, &mut point, &mut row);
        read.map_err(|fault| format!("vertex {i}: {}", source.describe(fault)))?;
        let position = point.as_vec3();
        if is_double {
            points.push(point);
        } else {
            mesh.positions.push(position);
        }
        if !position.is_finite() {
            faults.positions.push((i as u32, position));
        }
        if has_normals {
            let normal = Vec3::new(row[NORMAL], row[NORMAL + 1], row[NORMAL + 2]);
            mesh.normals.push(if normal.is_finite() { normal } else { Vec3::ZERO });
            if !normal.is_finite() {
                faults.normals.push(i as u32);
            }
        }
        if has_uvs {
            let [u, v] = [UV, UV + 1].map(|slot| normalized(row[slot], layout.types[slot]));
            mesh.uvs.push(uv_from_file(u, v).unwrap_or_else(|| {
                faults.uvs.note(i);
                Vec2::ZERO
            }));
        }
        if has_colors {
            let components = [COLOR, COLOR + 1, COLOR + 2];
            if components.iter().any(|slot| !row[*slot].is_finite()) {
                faults.colors.note(i);
            }
            let [r, g, b] = components.map(|slot| colors.convert(row[slot], layout.types[slot]));
            mesh.colors.push(Rgb::new(r, g, b));
        }
        if has_alphas && row[ALPHA] < most(layout.types[ALPHA]) {
            faults.alphas.note(i);
        }
    }
    if is_double {
        (mesh.origin, mesh.positions) = origin::split(&points);
    }
    for (vertex, _) in &faults.positions {
        mesh.positions[*vertex as usize] = Vec3::ZERO;
    }
    Ok(())
}

/// The value of a type that stands for 1.
fn most(scalar: Option<Scalar>) -> f32 {
    match scalar {
        Some(Scalar::F32 | Scalar::F64) => 1.0,
        Some(Scalar::U16) => 65535.0,
        _ => 255.0,
    }
}

/// Converts texture coordinates with a bottom-left origin to a top-left origin; none if they are not finite.
pub fn uv_from_file(u: f32, v: f32) -> Option<Vec2> {
    Some(Vec2::new(u, 1.0 - v)).filter(|uv| uv.is_finite())
}

/// Scales unsigned integers to the range from 0 to 1.
fn normalized(value: f32, scalar: Option<Scalar>) -> f32 {
    match scalar {
        Some(Scalar::U8) => value / 255.0,
        Some(Scalar::U16) => value / 65535.0,
        _ => value,
    }
}

/// Converts the components of colours in files.
pub struct ColorCurve {
    of_byte: [f32; 256],
    /// True if a component is a float: then all stay as the file has them, 0 to 1, and are decoded together later.
    pub is_encoded: bool,
}

impl ColorCurve {
    /// The conversion of colours whose components have these types.
    pub fn of<'a>(mut types: impl Iterator<Item = &'a Scalar>) -> Self {
        let is_encoded = types.any(|scalar| scalar.is_float());
        Self { of_byte: std::array::from_fn(|i| srgb_decode(i as f32 / 255.0)), is_encoded }
    }

    /// Converts a component. Integers go from 0 to 65,535 for `ushort`, otherwise from 0 to 255.
    pub fn convert(&self, value: f32, scalar: Option<Scalar>) -> f32 {
        match scalar {
            Some(Scalar::F32 | Scalar::F64) => value,
            Some(Scalar::U16) if self.is_encoded => value / 65535.0,
            Some(Scalar::U16) => srgb_decode(value / 65535.0),
            _ if self.is_encoded => value.clamp(0.0, 255.0) / 255.0,
            // The cast saturates, so the index lies within the table.
            _ => self.of_byte[usize::from(value as u8)],
        }
    }
}
