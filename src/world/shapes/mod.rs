//! Meshes of parametric shapes: functions of their parameters and of the fineness with which circles and curves become
//! chords. Vertices lie on the true surface, with its normals.

mod builder;
mod check;
mod curves;
mod extrude;
mod grid;
mod lathe;
mod metaballs;
mod prism;
mod revolve;
mod rounded_box;
pub(crate) mod text;
mod tube;

use crate::error::CompileError;
use crate::math::{DVec3, Vec3};
use crate::world::{Align, Assets, Mesh, Shape, Spline, Strands, TubeEnds};

pub(crate) use check::ShapeFault;
use metaballs::{Metaball, MetaballStyle};
use text::TextStyle;
pub(crate) use text::check_font;
use tube::TubeStyle;

/// The greatest distance between a curve and its chords.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fineness {
    /// Relative to the radius of curvature.
    Relative(f64),
    /// In metres, before the shape's transform.
    Metres(f64),
}

impl Fineness {
    /// The fineness without a camera: 71 chords in a circle.
    pub(crate) const DEFAULT: Fineness = Fineness::Relative(1e-3);
    /// The most chords of a circle that are chosen: 5·10⁻⁶ of the radius are left.
    const MOST_CHOSEN: f64 = 1024.0;

    /// The finer one of two. One without a camera is finer than none.
    pub(crate) fn finer(self, other: Fineness) -> Fineness {
        match (self, other) {
            (Fineness::Relative(a), Fineness::Relative(b)) => Fineness::Relative(a.min(b)),
            (Fineness::Metres(a), Fineness::Metres(b)) => Fineness::Metres(a.min(b)),
            (Fineness::Metres(_), _) => self,
            _ => other,
        }
    }

    /// The greatest distance from an arc of a radius, in metres.
    fn error_m(self, radius_m: f64) -> f64 {
        match self {
            Fineness::Relative(part) => part * radius_m,
            Fineness::Metres(error) => error,
        }
    }

    /// The number of chords of a circle: the one that the author gives or, from `least` on, a multiple of four, so that
    /// the circle is as wide as its chords.
    fn segments(self, radius_m: f64, given: Option<u32>, least: f64) -> usize {
        if let Some(given) = given {
            return given as usize;
        }
        // A chord's sagitta: r (1 − cos(π / n)).
        let cos = (1.0 - self.error_m(radius_m) / radius_m).clamp(-1.0, 1.0);
        let exact = std::f64::consts::PI / libm::acos(cos).max(1e-9);
        4 * (exact.clamp(least, Fineness::MOST_CHOSEN) / 4.0).ceil() as usize
    }
}

impl Shape {
    /// The mesh of a parametric shape; none of spheres, flat shapes and meshes, which need none. Errors: the mesh would be
    /// too large.
    pub(crate) fn to_mesh(&self, assets: &Assets, fineness: Fineness) -> Option<Result<Mesh, CompileError>> {
        Some(match self {
            Shape::Sphere { .. } | Shape::Triangle { .. } | Shape::Plane { .. } | Shape::Mesh(_) => {
                return None;
            }
            Shape::Box { size_m, bevel_m, segments } => {
                rounded_box::mesh(*size_m, *bevel_m, *segments, fineness)
            }
            Shape::Disc { radius_m, inner_radius_m, segments } => {
                revolve::disc([*inner_radius_m, *radius_m], *segments, fineness)
            }
            Shape::Cylinder { radius_m, height_m, segments } => {
                revolve::cone([*radius_m; 2], *height_m, *segments, fineness)
            }
            Shape::Cone { radius_m, top_radius_m, height_m, segments } => {
                revolve::cone([*top_radius_m, *radius_m], *height_m, *segments, fineness)
            }
            Shape::Capsule { radius_m, height_m, segments } => {
                revolve::capsule(*radius_m, *height_m, *segments, fineness)
            }
            Shape::Torus { radius_m, tube_radius_m, segments } => {
                revolve::torus(*radius_m, *tube_radius_m, *segments, fineness)
            }
            Shape::Prism { outline, holes, height_m, curve, segments } => {
                prism::mesh(outline, holes, *height_m, (*curve, *segments, fineness))
            }
            Shape::Lathe { profile, curve, open, segments } => {
                lathe::mesh(profile, *curve, *open, *segments, fineness)
            }
            Shape::Tube { points, radius_m, curve, ends, segments } => {
                let style = TubeStyle { curve: *curve, ends: *ends, segments: *segments, fineness };
                tube::mesh(std::iter::once_with(|| with_radii(points, radius_m)), style)
            }
            Shape::Strands { file, radius_m, curve, ends, segments } => {
                let strands = assets.strands.get(file.0 as usize)?;
                // They are thin, and many.
                let fineness = match fineness {
                    Fineness::Relative(part) => Fineness::Relative(part.max(0.1)),
                    seen => seen,
                };
                let style = TubeStyle { curve: *curve, ends: *ends, segments: *segments, fineness };
                tube::mesh(strands_of(strands, *radius_m), style)
            }
            Shape::Metaballs { points, radius_m, reach, segments } => {
                let balls: Vec<Metaball> = with_radii(points, radius_m)
                    .into_iter()
                    .map(|(middle, radius)| Metaball { middle, radius })
                    .collect();
                let (reach, segments) = (f64::from(*reach), *segments);
                metaballs::mesh(&balls, MetaballStyle { reach, segments, fineness })
            }
            Shape::Text { text, font, size_m, depth_m, bevel_m, align, segments } => {
                let font = assets.fonts.get(font.0 as usize)?;
                let [size_m, depth_m, bevel_m] = [*size_m, *depth_m, *bevel_m];
                let (align, segments) = (*align, *segments);
                text::mesh(text, font, TextStyle { size_m, depth_m, bevel_m, align, segments, fineness })
            }
            Shape::Grid { size_m, columns, rows } => grid::flat(*size_m, [*columns, *rows]),
            Shape::HeightField { image, size_m, height_m, smooth } => {
                let image = image.and_then(|id| assets.images.get(id.0 as usize));
                match image.filter(|image| image.width.min(image.height) > 1) {
                    Some(image) => grid::heights(image, *size_m, *height_m, *smooth),
                    None => {
                        let place = "the image of a HeightField".to_owned();
                        let reason = "it needs at least 2 × 2 pixels".to_owned();
                        Err(CompileError::Invalid { place, reason })
                    }
                }
            }
        })
    }

    /// True if the shape becomes a mesh when it is compiled.
    pub(crate) fn is_parametric(&self) -> bool {
        !matches!(self, Shape::Sphere { .. } | Shape::Triangle { .. } | Shape::Plane { .. } | Shape::Mesh(_))
    }

    /// True if the shape's mesh depends on the fineness.
    pub(crate) fn is_curved(&self) -> bool {
        match self {
            Shape::Box { bevel_m, segments, .. } => *bevel_m > 0.0 && segments.is_none(),
            Shape::Disc { segments, .. }
            | Shape::Cylinder { segments, .. }
            | Shape::Cone { segments, .. }
            | Shape::Capsule { segments, .. }
            | Shape::Torus { segments, .. }
            | Shape::Lathe { segments, .. }
            | Shape::Tube { segments, .. }
            | Shape::Strands { segments, .. }
            | Shape::Metaballs { segments, .. }
            | Shape::Text { segments, .. } => segments.is_none(),
            Shape::Prism { curve, segments, .. } => *curve != Spline::Linear && segments.is_none(),
            _ => false,
        }
    }

    /// True if the shape encloses nothing, whatever its material: a surface that is seen from both sides.
    pub(crate) fn is_sheet(&self) -> bool {
        match self {
            Shape::Plane { .. } | Shape::Disc { .. } | Shape::Grid { .. } | Shape::HeightField { .. } => true,
            Shape::Lathe { open, .. } => *open,
            Shape::Tube { ends, .. } | Shape::Strands { ends, .. } => *ends == TubeEnds::Open,
            _ => false,
        }
    }

    /// The least and the greatest corner of a box around a sphere or a parametric shape, perhaps a little larger than
    /// necessary; none of flat shapes and meshes.
    pub(crate) fn corners_around(&self, assets: &Assets) -> Option<[Vec3; 2]> {
        let half = match self {
            Shape::Triangle { .. } | Shape::Plane { .. } | Shape::Mesh(_) => return None,
            Shape::Sphere { radius_m } => Vec3::splat(*radius_m),
            Shape::Box { size_m, .. } => 0.5 * *size_m,
            Shape::Disc { radius_m, .. } => Vec3::new(*radius_m, 0.0, *radius_m),
            Shape::Cylinder { radius_m, height_m, .. } | Shape::Capsule { radius_m, height_m, .. } => {
                Vec3::new(*radius_m, 0.5 * height_m, *radius_m)
            }
            Shape::Cone { radius_m, top_radius_m, height_m, .. } => {
                let radius = radius_m.max(*top_radius_m);
                Vec3::new(radius, 0.5 * height_m, radius)
            }
            Shape::Torus { radius_m, tube_radius_m, .. } => {
                let radius = radius_m + tube_radius_m;
                Vec3::new(radius, *tube_radius_m, radius)
            }
            Shape::Grid { size_m, .. } => Vec3::new(0.5 * size_m.x, 0.0, 0.5 * size_m.y),
            Shape::HeightField { size_m, height_m, .. } => {
                let [x, z] = (0.5 * *size_m).to_array();
                return Some([Vec3::new(-x, height_m.min(0.0), -z), Vec3::new(x, height_m.max(0.0), z)]);
            }
            Shape::Prism { outline, height_m, .. } => {
                let [low, high] = around(outline.iter().map(|point| point.extend(0.0)))?;
                let y = 0.5 * height_m;
                return Some([Vec3::new(low.x, -y, low.y), Vec3::new(high.x, y, high.y)]);
            }
            Shape::Lathe { profile, .. } => {
                let [low, high] = around(profile.iter().map(|point| point.extend(0.0)))?;
                return Some([Vec3::new(-high.x, low.y, -high.x), Vec3::new(high.x, high.y, high.x)]);
            }
            Shape::Strands { file, radius_m, .. } => {
                let strands = assets.strands.get(file.0 as usize)?;
                let radius = strands.radii_m.iter().copied().reduce(f32::max).unwrap_or(*radius_m);
                let [low, high] = around(strands.points.iter().copied())?;
                return Some([low - radius, high + radius]);
            }
            Shape::Text { text, size_m, depth_m, align, .. } => {
                let width = text.lines().map(|line| line.chars().count()).max()? as f32 * size_m;
                let below = -1.3 * size_m * text.lines().count() as f32;
                let [left, right] = match align {
                    Align::Left => [0.0, width],
                    Align::Center => [-0.5 * width, 0.5 * width],
                    Align::Right => [-width, 0.0],
                };
                return Some([
                    Vec3::new(left, below, -0.5 * depth_m),
                    Vec3::new(right, *size_m, 0.5 * depth_m),
                ]);
            }
            Shape::Metaballs { points, radius_m, reach, .. } => {
                let [low, high] = around(points.iter().copied())?;
                let radius = reach * radius_m.iter().copied().fold(0.0, f32::max);
                return Some([low - radius, high + radius]);
            }
            Shape::Tube { points, radius_m, .. } => {
                let [low, high] = around(points.iter().copied())?;
                let radius = radius_m.iter().copied().fold(0.0, f32::max);
                return Some([low - radius, high + radius]);
            }
        };
        Some([-half, half])
    }
}

/// The corners of the box around points; none without any.
fn around(points: impl Iterator<Item = Vec3>) -> Option<[Vec3; 2]> {
    points.map(|point| [point; 2]).reduce(|[low, high], [point, _]| [low.min(point), high.max(point)])
}

/// The points of a curve with their radii, of which there is one for each or one for all.
fn with_radii(points: &[Vec3], radii: &[f32]) -> Vec<(DVec3, f64)> {
    let last = radii.last().copied().unwrap_or_default();
    let radius =
        |index: usize| if radii.len() == 1 { last } else { radii.get(index).copied().unwrap_or(last) };
    points.iter().enumerate().map(|(index, point)| (point.as_dvec3(), radius(index).into())).collect()
}

/// The curves of strands, without points that are where the last one is.
fn strands_of(strands: &Strands, radius_m: f32) -> impl Iterator<Item = Vec<(DVec3, f64)>> + Clone {
    let starts = std::iter::once(0).chain(strands.ends.iter().copied());
    starts.zip(strands.ends.iter().copied()).map(move |(from, to)| {
        let range = from as usize..to as usize;
        let points = strands.points.get(range.clone()).unwrap_or_default();
        let mut curve = match strands.radii_m.get(range) {
            Some(radii) if !radii.is_empty() => with_radii(points, radii),
            _ => with_radii(points, &[radius_m]),
        };
        curve.dedup_by_key(|point| point.0);
        curve
    })
}

/// The points of a curve without the last one, and true, if that is the first one again.
fn distinct(mut points: Vec<(DVec3, f64)>) -> (Vec<(DVec3, f64)>, bool) {
    let is_ring = points.len() > 2 && points.first().map(|p| p.0) == points.last().map(|p| p.0);
    if is_ring {
        points.pop();
    }
    (points, is_ring)
}

#[cfg(test)]
mod tests;
