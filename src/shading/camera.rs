//! Camera rays from image points, and image points from points of the scene.

use crate::math::elementary::{atan2_turns, sin_cos_turns};
use crate::math::{Ray, Vector};
use crate::sampling::warp;
use crate::scene::{Aperture, CompiledCamera, Lens, Perspective, Projection, StereoPair};
use crate::simd::{Float, Mask};
use crate::world::{FisheyeMapping, StereoLayout};

/// Radians in a turn.
const TURN: f32 = std::f32::consts::TAU;

/// Maps a point of the unit square to a point of a lens of radius 1.
#[inline(always)]
pub fn on_lens<F: Float>(aperture: Option<&Aperture>, u: (F, F)) -> (F, F) {
    let Some(Aperture { table, scale: [across, down] }) = aperture else {
        return warp::concentric_disk(u.0, u.1);
    };
    let ((s, t), _) = table.sample(u, F::Mask::from_bits(u32::MAX));
    let (two, one) = (F::splat(2.0), F::one());
    ((s * two - one) * F::splat(*across), (one - t * two) * F::splat(*down))
}

/// A point of a lens in world space, from its middle; its radius is 1 in the given coordinates.
#[inline(always)]
fn from_middle<F: Float>(lens: &Lens, at: (F, F)) -> Vector<F> {
    let [right, up] = lens.axes.map(Vector::splat);
    let radius = F::splat(lens.radius);
    right * (at.0 * radius) + up * (at.1 * radius)
}

/// A camera with the size of its image in pixels.
#[derive(Clone, Copy)]
pub struct CameraImage<'a> {
    camera: &'a CompiledCamera,
    size: [f32; 2],
}

/// Image points of one eye, from −1 to 1 over the height of its image, x to the right and y up.
struct EyePoint<F: Float> {
    x: F,
    y: F,
    /// The distance of the eye to the right of the camera's origin, in metres.
    offset: F,
}

/// A point as the camera sees it unless something lies between.
pub struct ImagePoint<F: Float> {
    /// Unit vector from the point to the camera.
    pub to_camera: Vector<F>,
    /// The distance to the lens.
    pub distance: F,
    /// Columns from the left of the image, in pixels.
    pub column: F,
    /// Rows from the top of the image.
    pub row: F,
    /// The value of a pixel for a unit of light that leaves the point towards the camera, per unit of |cos| there: m⁻².
    pub importance: F,
    /// Lanes whose point can be seen.
    pub seen: F::Mask,
}

impl<'a> CameraImage<'a> {
    /// A camera's image of a width and height in pixels.
    #[inline(always)]
    pub fn new(camera: &'a CompiledCamera, size: [u32; 2]) -> Self {
        let [width, height] = size;
        Self { camera, size: [width as f32, height as f32] }
    }

    /// Width and height of the image of one eye, in pixels.
    #[inline(always)]
    fn eye_size(&self) -> [f32; 2] {
        let [width, height] = self.size;
        match self.camera.stereo {
            Some(StereoPair { layout: StereoLayout::SideBySide, .. }) => [width * 0.5, height],
            Some(StereoPair { layout: StereoLayout::OverUnder, .. }) => [width, height * 0.5],
            _ => [width, height],
        }
    }

    /// Half of the shorter side of one eye's image, in halves of its height.
    #[inline(always)]
    fn shorter_side(&self) -> f32 {
        let [width, height] = self.eye_size();
        (width / height).min(1.0)
    }

    /// The width in pixels of an image that goes all around, so that its right end continues at its left end.
    pub fn circumference(&self) -> Option<f32> {
        let beside = matches!(self.camera.stereo, Some(StereoPair { layout: StereoLayout::SideBySide, .. }));
        match self.camera.projection {
            Projection::Panorama { half_turns: [across, _] } if across >= 0.5 && !beside => {
                Some(self.size[0])
            }
            _ => None,
        }
    }

    /// The width of a pixel's ray at the camera, in metres, and its growth per metre.
    #[inline(always)]
    pub fn pixel_width(&self) -> (f32, f32) {
        let [width, height] = self.eye_size();
        match self.camera.projection {
            Projection::Pinhole(view) | Projection::ThinLens { view, .. } => {
                let [_, half] = view.scale(width / height);
                (0.0, 2.0 * half / height)
            }
            Projection::Orthographic { half_height } => (2.0 * half_height / height, 0.0),
            Projection::Panorama { half_turns: [_, half] } => (0.0, 2.0 * half * TURN / height),
            Projection::Fisheye { mapping, half_turns, rim, .. } => {
                // The angle per radius at the centre.
                let angle = match mapping {
                    FisheyeMapping::Equidistant => half_turns * TURN,
                    FisheyeMapping::Equisolid | FisheyeMapping::Stereographic => 2.0 * rim,
                    FisheyeMapping::Orthographic => rim,
                };
                (0.0, 2.0 * angle / (height * self.shorter_side()))
            }
        }
    }

    /// The point in the image of its eye. The pixel decides which eye sees a sample, wherever its filter puts it.
    #[inline(always)]
    fn eye_point<F: Float>(&self, (column, row): (F, F), pixel: (F, F)) -> EyePoint<F> {
        let [width, height] = self.size;
        let (half, one) = (F::splat(0.5), F::one());
        let scale = F::splat(2.0 / height);
        let x = column * scale - F::splat(width / height);
        let y = one - row * scale;
        let Some(StereoPair { layout, half_distance, .. }) = self.camera.stereo else {
            return EyePoint { x, y, offset: F::zero() };
        };
        let distance = F::splat(half_distance);
        match layout {
            StereoLayout::SideBySide => {
                let right = (pixel.0 + half).ge(F::splat(0.5 * width));
                let middle = F::splat(0.5 * width / height);
                let x = F::select(right, x - middle, x + middle);
                EyePoint { x, y, offset: F::select(right, distance, -distance) }
            }
            StereoLayout::OverUnder => {
                let right = (pixel.1 + half).ge(F::splat(0.5 * height));
                let y = y + y;
                let y = F::select(right, y + one, y - one);
                EyePoint { x: x + x, y, offset: F::select(right, distance, -distance) }
            }
            StereoLayout::Left => EyePoint { x, y, offset: -distance },
            StereoLayout::Right => EyePoint { x, y, offset: distance },
        }
    }

    /// The ray of a sample at `place` (columns and rows from the image's top left) of a pixel, given by its column and
    /// row, through a point of the lens, whose radius is 1 in these coordinates (PBRT 4th ed., 5.2); and the lanes that
    /// have one, since a fisheye's image may have points that see nothing.
    #[inline(always)]
    pub fn ray<F: Float>(&self, place: (F, F), pixel: (F, F), lens: (F, F)) -> (Ray<F>, F::Mask) {
        let camera = self.camera;
        let [width, height] = self.eye_size();
        let EyePoint { x, y, offset } = self.eye_point(place, pixel);
        let mut origin = Vector::splat(camera.origin);
        let right = Vector::splat(camera.right);
        let up = Vector::splat(camera.up);
        let forward = Vector::splat(camera.forward);
        let mut seen = F::Mask::from_bits(u32::MAX);
        if camera.stereo.is_some() && !matches!(camera.projection, Projection::Panorama { .. }) {
            origin = origin + right * offset;
        }
        let (origin, direction) = match camera.projection {
            Projection::Pinhole(view) => (origin, self.through(&view, x, y, offset)),
            Projection::ThinLens { view, lens: shape, .. } => {
                let middle = self.through(&view, x, y, offset);
                let on_lens = from_middle(&shape, lens);
                // What is in focus lies there, or, behind a tilted lens, where rays seem to come from.
                let nearness = middle.dot(Vector::splat(shape.focus));
                (origin + on_lens, middle - on_lens * nearness)
            }
            Projection::Orthographic { half_height } => {
                let h = F::splat(half_height);
                (origin + right * (x * h) + up * (y * h), forward)
            }
            Projection::Panorama { half_turns: [across, above] } => {
                let (sin, cos) = sin_cos_turns(x * F::splat(across * height / width));
                let (rise, level) = sin_cos_turns(y * F::splat(above));
                let ahead = forward * cos + right * sin;
                // Omnidirectional stereo: the eyes look along tangents of a circle.
                if camera.stereo.is_some() {
                    origin = origin + (right * cos - forward * sin) * offset;
                }
                (origin, ahead * level + up * rise)
            }
            Projection::Fisheye { mapping, half_turns, rim, is_circular } => {
                let scale = F::splat(1.0 / self.shorter_side());
                let (x, y) = (x * scale, y * scale);
                let radius = (x * x + y * y).sqrt();
                let (sin, cos, exists) = from_radius(mapping, radius, half_turns, rim);
                seen = exists;
                if is_circular {
                    seen = seen & radius.le(F::one());
                }
                let across = sin / radius.max(F::splat(1e-20));
                (origin, forward * cos + right * (x * across) + up * (y * across))
            }
        };
        let ray = Ray {
            origin,
            direction: direction.normalize(),
            t_min: F::zero(),
            t_max: F::splat(f32::INFINITY),
        };
        (ray, seen)
    }

    /// The vector from the pinhole to the image a metre ahead.
    #[inline(always)]
    fn through<F: Float>(&self, view: &Perspective, x: F, y: F, offset: F) -> Vector<F> {
        let camera = self.camera;
        let [width, height] = self.eye_size();
        let [across, along] = view.scale(width / height).map(F::splat);
        let [to_right, to_top] = view.offset(width / height).map(F::splat);
        let (mut x, y) = ((x + to_right) * across, (y + to_top) * along);
        if let Some(pair) = camera.stereo {
            x = x - offset * F::splat(pair.convergence);
        }
        Vector::splat(camera.forward) + Vector::splat(camera.right) * x + Vector::splat(camera.up) * y
    }

    /// Projects a point into the image through a point of the lens, given by two numbers from 0 to 1, of which the first
    /// also chooses the eye: the inverse of [`CameraImage::ray`] (camera importance: PBRT 3rd ed., 16.1.1).
    #[inline(always)]
    pub fn project<F: Float>(
        &self,
        aperture: Option<&Aperture>,
        point: Vector<F>,
        mut lens: (F, F),
    ) -> ImagePoint<F> {
        let camera = self.camera;
        let (one, half) = (F::one(), F::splat(0.5));
        let (forward, right, up) =
            (Vector::splat(camera.forward), Vector::splat(camera.right), Vector::splat(camera.up));
        let [width, height] = self.eye_size();
        let mut origin = Vector::splat(camera.origin);
        let (mut offset, mut is_right, mut eyes) = (F::zero(), F::Mask::from_bits(0), one);
        if let Some(pair) = camera.stereo {
            match pair.layout {
                StereoLayout::Left => {}
                StereoLayout::Right => is_right = F::Mask::from_bits(u32::MAX),
                StereoLayout::SideBySide | StereoLayout::OverUnder => {
                    is_right = lens.0.ge(half);
                    lens.0 = (lens.0 - F::select(is_right, half, F::zero())) * F::splat(2.0);
                    eyes = F::splat(2.0);
                }
            }
            let distance = F::splat(pair.half_distance);
            offset = F::select(is_right, distance, -distance);
            if !matches!(camera.projection, Projection::Panorama { .. }) {
                origin = origin + right * offset;
            }
        }
        let way = point - origin;
        let found = match camera.projection {
            Projection::Orthographic { half_height } => {
                let pixel = 2.0 * half_height / height;
                let scale = F::splat(1.0 / half_height);
                let distance = way.dot(forward);
                ImagePoint {
                    to_camera: -forward,
                    distance,
                    column: way.dot(right) * scale,
                    row: way.dot(up) * scale,
                    importance: F::splat(1.0 / (pixel * pixel)),
                    seen: distance.gt(F::splat(1e-6)),
                }
            }
            Projection::Pinhole(view) => {
                let ahead = way.dot(forward);
                let place = self.onto(&view, [way.dot(right), way.dot(up)], ahead, offset);
                self.flat(&view, place, way, ahead)
            }
            Projection::ThinLens { view, lens: shape, .. } => {
                let on_lens = from_middle(&shape, on_lens(aperture, lens));
                self.through_lens(&view, Vector::splat(shape.focus), way, on_lens, offset)
            }
            Projection::Panorama { half_turns } => self.on_panorama(half_turns, way, offset),
            Projection::Fisheye { mapping, half_turns, rim, is_circular } => {
                self.on_disc(mapping, (half_turns, rim, is_circular), way)
            }
        };
        // The place in halves of the height, in pixels.
        let (x, y, mut seen) = (found.column, found.row, found.seen);
        let middle = F::splat(0.5 * height);
        let mut column = (x + F::splat(width / height)) * middle;
        let mut row = (one - y) * middle;
        if let Some(pair) = camera.stereo {
            // Nothing may lie in the other eye's image.
            let within = x.abs().le(F::splat(width / height)) & y.abs().le(one);
            match pair.layout {
                StereoLayout::SideBySide => {
                    seen = seen & within;
                    column = column + F::select(is_right, F::splat(width), F::zero());
                }
                StereoLayout::OverUnder => {
                    seen = seen & within;
                    row = row + F::select(is_right, F::splat(height), F::zero());
                }
                StereoLayout::Left | StereoLayout::Right => {}
            }
        }
        ImagePoint { column, row, importance: found.importance * eyes, seen, ..found }
    }

    /// The point of a perspective view of what lies `way` from the middle of a lens, through a point `on_lens` of it; the
    /// plane in focus is that of [`Lens::focus`].
    #[inline(always)]
    fn through_lens<F: Float>(
        &self,
        view: &Perspective,
        focus: Vector<F>,
        way: Vector<F>,
        on_lens: Vector<F>,
        offset: F,
    ) -> ImagePoint<F> {
        let [right, up, forward] =
            [self.camera.right, self.camera.up, self.camera.forward].map(Vector::splat);
        let way = way - on_lens;
        // The vector through the middle of the lens whose ray through this point of it goes this way.
        let part = F::one() - on_lens.dot(focus);
        let middle = way * part + on_lens * way.dot(focus);
        let (ahead, depth) = (way.dot(forward), middle.dot(forward));
        let place = self.onto(view, [middle.dot(right), middle.dot(up)], depth, offset);
        let found = self.flat(view, place, way, ahead);
        // The area of a pixel on a plane ahead, from there and from the middle of the lens.
        let ratio = ahead / depth.max(F::splat(1e-20));
        ImagePoint {
            importance: found.importance * (part * part * ratio * ratio * ratio),
            seen: found.seen & depth.gt(F::splat(1e-6)) & part.gt(F::zero()),
            ..found
        }
    }

    /// The point of a perspective view at `place`, in halves of the height; `way` leads there from the lens.
    #[inline(always)]
    fn flat<F: Float>(&self, view: &Perspective, place: (F, F), way: Vector<F>, ahead: F) -> ImagePoint<F> {
        let distance = way.dot(way).sqrt().max(F::splat(1e-20));
        ImagePoint {
            to_camera: way * (-F::one() / distance),
            distance,
            column: place.0,
            row: place.1,
            importance: self.per_square_metre(view, ahead, distance),
            seen: ahead.gt(F::splat(1e-6)),
        }
    }

    /// The point of a panorama, in halves of the height, for the way from its middle.
    #[inline(always)]
    fn on_panorama<F: Float>(&self, [across, above]: [f32; 2], way: Vector<F>, offset: F) -> ImagePoint<F> {
        let (one, half) = (F::one(), F::splat(0.5));
        let [width, height] = self.eye_size();
        let (forward, right, up) = (
            Vector::splat(self.camera.forward),
            Vector::splat(self.camera.right),
            Vector::splat(self.camera.up),
        );
        let (to_right, ahead, rise) = (way.dot(right), way.dot(forward), way.dot(up));
        let level_square = to_right * to_right + ahead * ahead;
        let level = (level_square - offset * offset).max(F::zero()).sqrt();
        let turned = atan2_turns(to_right, ahead) - atan2_turns(offset, level);
        // Around once more, to −½ to ½ turns.
        let turned = turned - (turned + half).floor();
        let (sin, cos) = sin_cos_turns(turned);
        let distance = (level * level + rise * rise).sqrt().max(F::splat(1e-20));
        let pixel = (2.0 * TURN * across / width) * (2.0 * TURN * above / height);
        let cosine = (level / distance).max(F::splat(1e-6));
        ImagePoint {
            to_camera: ((forward * cos + right * sin) * level + up * rise) * (-one / distance),
            distance,
            column: turned * F::splat(width / (height * across)),
            row: atan2_turns(rise, level) * F::splat(1.0 / above),
            importance: one / (distance * distance * cosine * F::splat(pixel)),
            seen: distance.gt(F::splat(1e-6)) & level_square.gt(offset * offset),
        }
    }

    /// The point of a fisheye's disc, in halves of the height, for the way from its eye.
    #[inline(always)]
    fn on_disc<F: Float>(
        &self,
        mapping: FisheyeMapping,
        (half_turns, rim, is_circular): (f32, f32, bool),
        way: Vector<F>,
    ) -> ImagePoint<F> {
        let (one, least) = (F::one(), F::splat(1e-20));
        let [_, height] = self.eye_size();
        let to_right = way.dot(Vector::splat(self.camera.right));
        let to_top = way.dot(Vector::splat(self.camera.up));
        let ahead = way.dot(Vector::splat(self.camera.forward));
        let across = (to_right * to_right + to_top * to_top).sqrt();
        let distance = way.dot(way).sqrt().max(least);
        let (radius, density) = to_radius(mapping, across / distance, ahead / distance, half_turns, rim);
        let scale = radius * F::splat(self.shorter_side()) / across.max(least);
        let pixel = 2.0 / (height * self.shorter_side());
        let mut seen = distance.gt(F::splat(1e-6));
        if mapping == FisheyeMapping::Orthographic {
            seen = seen & ahead.gt(F::zero());
        }
        if is_circular {
            seen = seen & radius.le(one);
        }
        ImagePoint {
            to_camera: way * (-one / distance),
            distance,
            column: to_right * scale,
            row: to_top * scale,
            importance: one / (distance * distance * density.max(least) * F::splat(pixel * pixel)),
            seen,
        }
    }

    /// The place on a flat image of what lies `ahead` metres along the axis and `way` across.
    #[inline(always)]
    fn onto<F: Float>(&self, view: &Perspective, way: [F; 2], ahead: F, offset: F) -> (F, F) {
        let (one, least) = (F::one(), F::splat(1e-20));
        let [width, height] = self.eye_size();
        let [across, along] = view.scale(width / height).map(F::splat);
        let [to_right, to_top] = view.offset(width / height).map(F::splat);
        let [mut x, y] = way;
        if let Some(pair) = self.camera.stereo {
            x = x + offset * ahead * F::splat(pair.convergence);
        }
        let scale = [one / (ahead * across).max(least), one / (ahead * along).max(least)];
        (x * scale[0] - to_right, y * scale[1] - to_top)
    }

    /// 1 / (d² A cos³ θ), with the area A of a pixel a metre in front of the camera.
    #[inline(always)]
    fn per_square_metre<F: Float>(&self, view: &Perspective, ahead: F, distance: F) -> F {
        let [width, height] = self.eye_size();
        let [across, along] = view.scale(width / height);
        let pixel = (2.0 * across / height) * (2.0 * along / height);
        let cosine = (ahead / distance).max(F::splat(1e-6));
        F::one() / (distance * distance * cosine * cosine * cosine * F::splat(pixel))
    }
}

/// Sine and cosine of the angle to the axis at a radius of the disc, whose rim is at 1, and the lanes in which there is
/// such an angle.
#[inline(always)]
fn from_radius<F: Float>(mapping: FisheyeMapping, radius: F, half_turns: f32, rim: f32) -> (F, F, F::Mask) {
    let (zero, one, two) = (F::zero(), F::one(), F::splat(2.0));
    let own = radius * F::splat(rim);
    match mapping {
        FisheyeMapping::Equidistant => {
            let turns = radius * F::splat(half_turns);
            let (sin, cos) = sin_cos_turns(turns);
            (sin, cos, turns.le(F::splat(0.5)))
        }
        FisheyeMapping::Equisolid => {
            let square = own * own;
            (two * own * (one - square).max(zero).sqrt(), one - two * square, own.le(one))
        }
        FisheyeMapping::Stereographic => {
            let square = own * own;
            let scale = one / (one + square);
            (two * own * scale, (one - square) * scale, F::Mask::from_bits(u32::MAX))
        }
        FisheyeMapping::Orthographic => (own, (one - own * own).max(zero).sqrt(), own.le(one)),
    }
}

/// The radius on the disc of an angle to the axis, and the solid angle per area of the disc there.
#[inline(always)]
fn to_radius<F: Float>(mapping: FisheyeMapping, sin: F, cos: F, half_turns: f32, rim: f32) -> (F, F) {
    let (one, least) = (F::one(), F::splat(1e-6));
    let inverse = F::splat(1.0 / rim);
    let square = F::splat(rim * rim);
    match mapping {
        FisheyeMapping::Equidistant => {
            let radius = atan2_turns(sin, cos) * F::splat(1.0 / half_turns);
            let angle = F::splat(half_turns * TURN);
            let slope = F::select(radius.lt(F::splat(1e-4)), angle, sin / radius.max(least));
            (radius, angle * slope)
        }
        FisheyeMapping::Equisolid => {
            // sin(θ/2), without cancellation.
            let half = sin / (F::splat(2.0) * (one + cos).max(least)).sqrt();
            (half * inverse, F::splat(4.0) * square)
        }
        FisheyeMapping::Stereographic => {
            let tangent = sin / (one + cos).max(least);
            let scale = one / (one + tangent * tangent);
            (tangent * inverse, F::splat(4.0) * square * scale * scale)
        }
        FisheyeMapping::Orthographic => (sin * inverse, square / cos.max(least)),
    }
}

#[cfg(test)]
mod tests;
