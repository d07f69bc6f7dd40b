//! The component of entities that rays can hit. [`super::shapes`] makes the meshes of those that become triangles.

use crate::math::{DVec3, Vec2, Vec3};

use super::assets::{FontId, ImageId, MeshId, StrandsId};
use super::fields::{Range, forms};
use super::origin;

forms! {
    /// A surface that rays can hit, in local space.
    #[derive(Clone, Debug, PartialEq)]
    pub enum Shape, "shape" {
        /// A sphere centred at the local origin. u runs around +Y once, from −X by +Z; v runs from 0 at the +Y pole to 1
        /// at the −Y pole.
        Sphere {
            /// in metres, around the origin
            radius_m: f32 = 1.0, Number(Range::Above0);
        },
        /// A triangle, counter-clockwise seen from the front.
        Triangle {
            /// the corners, counter-clockwise seen from the front
            vertices: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y], Triangle, required;
            /// shading normals at the corners; without them it is flat
            normals: Option<[Vec3; 3]> = None, CornerVectors;
            /// texture coordinates at the corners; without them (0, 0), (1, 0), (0, 1)
            uvs: Option<[Vec2; 3]> = None, CornerUvs;
        },
        /// A planar convex quadrilateral. Its corners, in order around it, are the texture's top left, top right, bottom
        /// right and bottom left. Its front, which is the outside of glass, is the side from which they appear
        /// counter-clockwise, as for triangles; the texture appears unmirrored from the back.
        Plane {
            /// the corners of a planar, convex quadrilateral, in order around it
            corners: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y], Quadrilateral, required;
        },
        /// A triangle mesh in [`Assets::meshes`](super::Assets::meshes).
        Mesh(id: MeshId = MeshId(0), Mesh),
        /// A box centred at the local origin. Each face has the whole image, upright seen from outside; those at the top
        /// and at the bottom have −Z and +Z at the image's top.
        Box {
            /// width along X, height along Y and depth along Z
            size_m: Vec3 = Vec3::splat(2.0), Extents;
            /// the radius of rounded edges and corners, within that size; at most half of the shortest side
            bevel_m: f32 = 0.0, Number(Range::From(0.0));
            /// chords in place of a full circle; without them as many as the image shows
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// A flat disc around the local origin, or a ring, which faces +Y. The image lies in its square, its top at −Z.
        Disc {
            /// the outer radius
            radius_m: f32 = 1.0, Number(Range::Above0);
            /// the radius of the hole
            inner_radius_m: f32 = 0.0, Number(Range::From(0.0));
            /// as of `Box`
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// A closed cylinder around the Y axis, centred at the local origin. On its side, u and v run as on a sphere; the
        /// discs at its ends have the whole image, as those of a box.
        Cylinder {
            /// its radius
            radius_m: f32 = 1.0, Number(Range::Above0);
            /// its height along Y
            height_m: f32 = 2.0, Number(Range::Above0);
            /// as of `Box`
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// A closed cone or frustum around the Y axis, centred at the local origin. u and v as of a cylinder.
        Cone {
            /// the radius at the bottom
            radius_m: f32 = 1.0, Number(Range::From(0.0));
            /// the radius at the top
            top_radius_m: f32 = 0.0, Number(Range::From(0.0));
            /// its height along Y
            height_m: f32 = 2.0, Number(Range::Above0);
            /// as of `Box`
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// A cylinder around the Y axis with half a ball at each end, centred at the local origin. u runs as on a sphere,
        /// v from 0 at the top to 1 at the bottom, along the surface.
        Capsule {
            /// the radius of the cylinder and of the balls
            radius_m: f32 = 0.5, Number(Range::Above0);
            /// the height along Y, with the balls; at least twice the radius
            height_m: f32 = 2.0, Number(Range::Above0);
            /// as of `Box`
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// A torus around the Y axis, centred at the local origin. u runs as on a sphere, v once around the tube, from its
        /// innermost circle by way of the top.
        Torus {
            /// from the axis to the middle of the tube
            radius_m: f32 = 1.0, Number(Range::Above0);
            /// the radius of the tube; at most the other one
            tube_radius_m: f32 = 0.25, Number(Range::Above0);
            /// as of `Box`, for both circles
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// A polygon or a closed curve in the XZ plane, extruded along Y, half of the height to either side. The image lies
        /// in the rectangle around it, at the top and at the bottom as on a box; on the side, u runs once around.
        Prism {
            /// its points (x, z), in order around it, either way; it must not cross itself
            outline: Vec<Vec2> = Vec::new(), Pairs, required;
            /// lists of such points, within the outline and apart from each other
            holes: Vec<Vec<Vec2>> = Vec::new(), PairLists;
            /// its height along Y
            height_m: f32 = 1.0, Number(Range::Above0);
            /// the way from point to point
            curve: Spline = Spline::Linear, Form;
            /// as of `Box`; a curve has a quarter of them between two points
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// A profile turned around the Y axis. u runs as on a sphere, v along the profile by its length, downwards on its
        /// outside.
        Lathe {
            /// its points (distance from the axis, y); one that ends in its first point is a ring
            profile: Vec<Vec2> = Vec::new(), Pairs, required;
            /// the way from point to point
            curve: Spline = Spline::Linear, Form;
            /// without the discs that close it where the profile ends away from the axis
            open: bool = false, Flag;
            /// as of `Prism`
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// A round tube along a curve. u runs around it, v along it from 0 to 1; a disc at its end has the whole image.
        Tube {
            /// the points of the curve (x, y, z); one that ends in its first point is closed
            points: Vec<Vec3> = Vec::new(), Path, required;
            /// the radius everywhere, or a list of one for each point
            radius_m: Vec<f32> = vec![0.1], Numbers(Range::From(0.0));
            /// the way from point to point; sharp corners are mitred
            curve: Spline = Spline::CatmullRom, Form;
            /// how it ends: by half a ball, by a disc, or hollow
            ends: TubeEnds = TubeEnds::Round, Form;
            /// as of `Prism`
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// Many tubes along curves from a file. Text files (`.txt`) have a point `x y z` or `x y z radius` in each line, in
        /// metres, an empty line between strands, and comments after `#`; `.hair` files are Yuksel's. u and v are as of a
        /// tube.
        Strands {
            /// the file
            file: StrandsId = StrandsId(0), Strands, required;
            /// the radius where the file has none
            radius_m: f32 = 5e-5, Number(Range::Above0);
            /// the way from point to point
            curve: Spline = Spline::CatmullRom, Form;
            /// how each ends, as of `Tube`
            ends: TubeEnds = TubeEnds::Open, Form;
            /// as of `Prism`
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// Balls that flow into each other where they are near: a smooth closed surface. The image lies in the rectangle around
        /// all of them, upright seen from +Z.
        Metaballs {
            /// the middles of the balls (x, y, z)
            points: Vec<Vec3> = Vec::new(), Path, required;
            /// the radius of each ball by itself, or a list of one for each
            radius_m: Vec<f32> = vec![0.5], Numbers(Range::Above0);
            /// the distance up to which a ball flows into others, in radii; above 1
            reach: f32 = 2.0, Number(Range::FromTo(1.05, 16.0));
            /// chords around each ball; as of `Prism`
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// Words of solid letters in the XY plane that face +Z, half of their depth to either side of it. The baseline of
        /// the first line is the X axis. The image lies in the rectangle around all letters, upright on their fronts.
        Text {
            /// the words; `\n` begins another line
            text: String = String::new(), Text, required;
            /// a TrueType or OpenType file, `.ttf` or `.otf`
            font: FontId = FontId(0), Font, required;
            /// the font's em: about 1.4 times as high as capital letters
            size_m: f32 = 1.0, Number(Range::Above0);
            /// the thickness along Z, with bevels
            depth_m: f32 = 0.2, Number(Range::Above0);
            /// the radius of round edges, by which letters become wider; at most half of the depth
            bevel_m: f32 = 0.0, Number(Range::From(0.0));
            /// the part of each line that is at x = 0
            align: Align = Align::Left, Form;
            /// as of `Prism`
            segments: Option<u32> = None, OptionalWhole(3, Shape::MOST_SEGMENTS);
        },
        /// A flat rectangle of cells in the XZ plane, centred at the local origin, which faces +Y. The image lies on it, its
        /// top at −Z.
        Grid {
            /// width along X and depth along Z
            size_m: Vec2 = Vec2::splat(2.0), Sides;
            /// cells along X
            columns: u32 = 10, Whole(1, 1 << 14);
            /// cells along Z
            rows: u32 = 10, Whole(1, 1 << 14);
        },
        /// A grid with a point for each pixel of an image, the brighter the higher. Other images lie on it as on a grid.
        HeightField {
            /// its red channel, as stored, is from 0 at y = 0 to 1 at `height_m`
            image: Option<ImageId> = None, Image, required;
            /// width along X and depth along Z
            size_m: Vec2 = Vec2::splat(2.0), Sides;
            /// the height of 1; negative for hollows
            height_m: f32 = 1.0, Number(Range::Finite);
            /// smooth shading, or facets
            smooth: bool = true, Flag;
        },
    }
}

impl Shape {
    /// The corners of a flat convex shape, in order around it, relative to a point that comes first.
    pub(crate) fn flat_corners(&self) -> Option<(DVec3, Vec<Vec3>)> {
        match self {
            Shape::Triangle { vertices, .. } => Some(origin::split(vertices)),
            Shape::Plane { corners } => Some(origin::split(corners)),
            _ => None,
        }
    }

    /// The most chords in place of a circle.
    pub(crate) const MOST_SEGMENTS: u32 = 4096;

    /// The triangles of a flat convex shape with that many corners: a fan around the first one.
    pub(crate) fn fan(corners: usize) -> impl Iterator<Item = [u32; 3]> {
        (2..corners as u32).map(|at| [0, at - 1, at])
    }
}

forms! {
    /// The way of a curve between its points.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Spline, "curve" {
        /// Straight lines, with corners at the points.
        #[default]
        Linear,
        /// A smooth curve through all points: Catmull and Rom's, centripetal.
        CatmullRom,
        /// Cubic Bézier curves: a point on the curve, two that draw it towards them, the next point on it, and so on.
        Bezier,
    }
}

forms! {
    /// The part of a line of text that is at its origin.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Align, "alignment" {
        /// Its beginning.
        #[default]
        Left,
        /// Its middle.
        Center,
        /// Its end.
        Right,
    }
}

forms! {
    /// The ends of a tube.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum TubeEnds, "end" {
        /// Half a ball.
        #[default]
        Round,
        /// A disc.
        Flat,
        /// Nothing: the tube is hollow.
        Open,
    }
}

/// The largest distance of a plane's corners from their mean plane, relative to the diameter.
const PLANAR: f64 = 1e-4;
/// The sine of the angle at a corner below which its edges count as collinear.
const STRAIGHT: f64 = 1e-9;

/// Checks that the corners form a flat convex quadrilateral; the error is the index of the wrong corner, if it is a
/// single one, and the reason.
pub(crate) fn check_plane([a, b, c, d]: [DVec3; 4]) -> Result<(), (Option<usize>, String)> {
    // The normal, with twice the area as length: the cross product of the diagonals.
    let normal = (c - a).cross(d - b);
    let diameter =
        [b - a, c - a, d - a, c - b, d - b, d - c].map(|v| v.length()).into_iter().fold(0.0, f64::max);
    if normal.length() <= STRAIGHT * diameter * diameter {
        return Err((None, "the plane has no area: give its corners in order around it".to_owned()));
    }
    let normal = normal / normal.length();
    let centre = (a + b + c + d) / 4.0;
    for (index, corner) in [a, b, c, d].into_iter().enumerate() {
        let distance = (corner - centre).dot(normal).abs();
        if distance > PLANAR * diameter {
            let reason = format!(
                "the corners are not in one plane (this one is {distance:.3e} m off): move it or use two triangles"
            );
            return Err((Some(index), reason));
        }
    }
    for (index, [before, at, after]) in [[d, a, b], [a, b, c], [b, c, d], [c, d, a]].into_iter().enumerate() {
        let (incoming, outgoing) = (at - before, after - at);
        if incoming.cross(outgoing).dot(normal) <= STRAIGHT * incoming.length() * outgoing.length() {
            let reason = "the plane is not convex at this corner: give the corners in order around it, \
                          or use two triangles";
            return Err((Some(index), reason.to_owned()));
        }
    }
    Ok(())
}
