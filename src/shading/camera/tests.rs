//! Directions of all cameras by formula, and the projection as the inverse of their rays.

use proptest::prelude::*;

use super::*;
use crate::math::{Vec2, Vec3};
use crate::scene::HalfSize;
use crate::world::Pattern;

const SIZE: [u32; 2] = [360, 180];

fn camera(projection: Projection) -> CompiledCamera {
    let (right, up, forward) = (Vec3::X, Vec3::Y, Vec3::NEG_Z);
    CompiledCamera { origin: Vec3::new(0.3, -0.2, 0.5), right, up, forward, projection, stereo: None }
}

fn components(v: Vector<f32>) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

/// The ray of a place in the image, in columns and rows.
fn ray(camera: &CompiledCamera, size: [u32; 2], place: Vec2, lens: (f32, f32)) -> Option<(Vec3, Vec3)> {
    let pixel = (place.x.floor(), place.y.floor());
    let (ray, seen) = CameraImage::new(camera, size).ray((place.x, place.y), pixel, lens);
    seen.then_some((components(ray.origin), components(ray.direction)))
}

fn direction(projection: Projection, size: [u32; 2], place: [f32; 2]) -> Option<Vec3> {
    let camera = camera(projection);
    ray(&camera, size, place.into(), (0.0, 0.0)).map(|(origin, direction)| {
        assert_eq!(origin, camera.origin);
        direction
    })
}

#[track_caller]
fn assert_near(found: Option<Vec3>, expected: Vec3) {
    let found = found.expect("a ray");
    assert!((found - expected).length() < 2e-6, "{found} is not {expected}");
}

const PANORAMA: Projection = Projection::Panorama { half_turns: [0.5, 0.25] };

fn fisheye(mapping: FisheyeMapping, degrees: f64, is_circular: bool) -> Projection {
    let half = 0.5 * degrees.to_radians();
    let rim = match mapping {
        FisheyeMapping::Equidistant => half,
        FisheyeMapping::Equisolid => libm::sin(0.5 * half),
        FisheyeMapping::Stereographic => libm::tan(0.5 * half),
        FisheyeMapping::Orthographic => libm::sin(half),
    };
    Projection::Fisheye { mapping, half_turns: (degrees / 720.0) as f32, rim: rim as f32, is_circular }
}

#[test]
fn panoramas_show_a_degree_for_each_pixel() {
    for place in [[180.0, 90.0], [0.5, 90.5], [270.0, 90.0], [90.0, 45.0], [359.5, 0.5], [12.5, 170.5]] {
        let [longitude, latitude] = [place[0] - 180.0, 90.0 - place[1]].map(f32::to_radians);
        let level = libm::cosf(latitude);
        let expected =
            Vec3::new(libm::sinf(longitude) * level, libm::sinf(latitude), -libm::cosf(longitude) * level);
        assert_near(direction(PANORAMA, SIZE, place), expected);
    }
    // Half of one: −X at the left, +X at the right.
    let half = Projection::Panorama { half_turns: [0.25, 0.25] };
    assert_near(direction(half, [100, 100], [0.0, 50.0]), Vec3::NEG_X);
    assert_near(direction(half, [100, 100], [100.0, 50.0]), Vec3::X);
    assert_near(direction(half, [100, 100], [50.0, 0.0]), Vec3::Y);
}

#[test]
fn fisheyes_show_an_angle_where_their_mapping_says() {
    use FisheyeMapping::{Equidistant, Equisolid, Orthographic, Stereographic};
    // The angle half way to the rim at 90 degrees to the axis.
    let half_way = [
        (Equidistant, 45.0),
        (Equisolid, 2.0 * libm::asin(0.5 * libm::sin(std::f64::consts::FRAC_PI_4)).to_degrees()),
        (Stereographic, 2.0 * libm::atan(0.5).to_degrees()),
        (Orthographic, 30.0),
    ];
    for (mapping, degrees) in half_way {
        let lens = fisheye(mapping, 180.0, true);
        let (sin, cos) = (libm::sin(degrees.to_radians()) as f32, libm::cos(degrees.to_radians()) as f32);
        for size in [[200, 100], [100, 100], [100, 300]] {
            let middle = size.map(|side| side as f32 * 0.5);
            assert_near(direction(lens, size, middle), Vec3::NEG_Z);
            let at = |x: f32, y: f32| direction(lens, size, [middle[0] + x, middle[1] + y]);
            assert_near(at(25.0, 0.0), Vec3::new(sin, 0.0, -cos));
            assert_near(at(0.0, -25.0), Vec3::new(0.0, sin, -cos));
            assert_near(at(-49.999, 0.0), at(-49.999, 0.0).unwrap());
            assert!(at(-49.999, 0.0).unwrap().dot(Vec3::NEG_X) > 0.999, "{mapping:?}");
            assert!(at(36.0, 36.0).is_none(), "{mapping:?}: beyond the rim");
        }
    }
    // The whole sphere, and an image whose corners are filled.
    let everything = fisheye(Equidistant, 360.0, true);
    assert!(direction(everything, [100, 100], [99.99, 50.0]).unwrap().z > 0.999);
    let filled = fisheye(Equidistant, 180.0, false);
    assert!(direction(filled, [100, 100], [0.5, 0.5]).is_some());
    assert!(direction(filled, [400, 100], [0.5, 50.0]).is_none(), "beyond 180 degrees");
}

/// Data sets' pinholes project a point (X, Y, Z) of OpenCV's camera space to (fx X / Z + cx, fy Y / Z + cy).
#[test]
fn intrinsics_project_known_points_to_known_pixels() {
    let [fx, fy, cx, cy] = [525.0, 500.0, 319.5, 250.25];
    let (width, height) = (640.0, 480.0);
    let view = Perspective {
        half: HalfSize::Both([0.5 * width / fx, 0.5 * height / fy]),
        shift: [0.5 - cx / width, cy / height - 0.5],
    };
    let camera = camera(Projection::Pinhole(view));
    for [x, y, z] in [[0.0, 0.0, 1.0], [0.4, -0.2, 1.5], [-1.0, 0.7, 2.0], [0.01, 0.9, 2.3]] {
        // Our axes: +Y up, −Z into the scene.
        let point = camera.origin + Vec3::new(x, -y, -z);
        let expected = [fx * x / z + cx, fy * y / z + cy];
        for by in [1, 2] {
            let size = [640 * by, 480 * by];
            let found =
                CameraImage::new(&camera, size).project(None, Vector::<f32>::splat(point), (0.5, 0.5));
            let found = [found.column, found.row].map(|place| place / by as f32);
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-3, "{found} is not {expected}");
            }
        }
    }
}

/// A lens of 50 mm before a sensor of 36 mm sees 18 mm to either side along the image's longer side.
#[test]
fn photographic_views_fit_the_longer_side_and_shift() {
    let view = Perspective { half: HalfSize::LongerSide(18.0 / 50.0), shift: [0.0; 2] };
    for (size, place, across, above) in [
        ([300, 200], [300.0, 100.0], 18.0, 0.0),
        ([300, 200], [150.0, 0.0], 0.0, 12.0),
        ([200, 300], [100.0, 0.0], 0.0, 18.0),
        ([200, 300], [0.0, 150.0], -12.0, 0.0),
    ] {
        let expected = Vec3::new(across, above, -50.0).normalize();
        assert_near(direction(Projection::Pinhole(view), size, place), expected);
    }
    // A rise by half of the height: the axis is at the lower edge.
    let risen = Perspective { shift: [0.0, 0.5], ..view };
    assert_near(direction(Projection::Pinhole(risen), [300, 200], [150.0, 200.0]), Vec3::NEG_Z);
    let to_right = Perspective { shift: [-0.5, 0.0], ..view };
    assert_near(direction(Projection::Pinhole(to_right), [300, 200], [300.0, 100.0]), Vec3::NEG_Z);
}

fn pair(layout: StereoLayout, convergence: f32) -> Option<StereoPair> {
    Some(StereoPair { layout, half_distance: 0.03, convergence })
}

#[test]
fn eyes_are_beside_each_other_and_converge() {
    let pinhole = Projection::Pinhole(Perspective::upright(0.5));
    let middles = [
        (StereoLayout::SideBySide, [200, 100], [50.0, 50.0], [150.0, 50.0]),
        (StereoLayout::OverUnder, [100, 200], [50.0, 50.0], [50.0, 150.0]),
    ];
    for (layout, size, left, right) in middles {
        let pair = CompiledCamera { stereo: pair(layout, 0.5), ..camera(pinhole) };
        let [left, right] = [left, right].map(|place| ray(&pair, size, place.into(), (0.0, 0.0)).unwrap());
        assert!((right.0 - left.0 - Vec3::new(0.06, 0.0, 0.0)).length() < 1e-6, "{layout:?}");
        // Both meet 2 m ahead.
        for (origin, direction) in [left, right] {
            let met = origin + direction * (2.0 / -direction.z);
            assert!((met - pair.origin - Vec3::NEG_Z * 2.0).length() < 1e-5, "{layout:?}: {met}");
        }
        // Each image is that of a single camera at its place.
        let single = CompiledCamera { origin: left.0, ..camera(pinhole) };
        let parallel = CompiledCamera { stereo: pair_of(layout), ..camera(pinhole) };
        let here = ray(&parallel, size, Vec2::new(20.5, 30.5), (0.0, 0.0)).unwrap();
        let there = ray(&single, [100, 100], Vec2::new(20.5, 30.5), (0.0, 0.0)).unwrap();
        assert!((here.1 - there.1).length() < 1e-6, "{layout:?}");
    }
}

fn pair_of(layout: StereoLayout) -> Option<StereoPair> {
    pair(layout, 0.0)
}

/// In a stereo panorama, each ray is a tangent of the circle on which the eyes are, the right eye's to its right.
#[test]
fn eyes_of_panoramas_turn_with_the_view() {
    let around = CompiledCamera { stereo: pair_of(StereoLayout::OverUnder), ..camera(PANORAMA) };
    for column in 0..36 {
        for (row, side) in [(20.0, -1.0), (130.0, 1.0)] {
            let place = Vec2::new(column as f32 * 10.0 + 0.5, row);
            let (origin, direction) = ray(&around, SIZE, place, (0.0, 0.0)).unwrap();
            let arm = origin - around.origin;
            assert!((arm.length() - 0.03).abs() < 1e-6 && arm.y.abs() < 1e-6);
            assert!(arm.dot(direction).abs() < 1e-7, "{arm} {direction}");
            assert!(direction.cross(Vec3::Y).dot(arm) * side > 0.0, "{column} {row}");
        }
    }
}

/// A tilted lens shows sharply the plane through the point in focus on the axis and a line in the plane through the
/// lens parallel to the image, at the focal length over the sine of the tilt (Merklinger, "Focusing the view camera").
#[test]
fn tilted_lenses_focus_on_a_plane_through_their_hinge() {
    let (focal_length, distance, tilt) = (0.09f32, 4.0f32, 0.1f64);
    let hinge = focal_length / libm::sin(tilt) as f32;
    let view = Perspective::upright(0.3);
    for (angles, hinged) in [([0.0, tilt], Vec3::Y), ([tilt, 0.0], Vec3::NEG_X), ([0.0, -tilt], Vec3::NEG_Y)]
    {
        let lens =
            Lens::new([Vec3::X, Vec3::Y, Vec3::NEG_Z], 0.02, distance, (focal_length, angles.map(libm::tan)));
        let camera = camera(Projection::ThinLens { view, lens, pattern: Pattern::Jittered });
        for place in [[180.0, 90.0], [20.0, 10.0], [350.0, 170.0], [100.0, 150.0]] {
            let through = |lens: (f32, f32)| {
                let (origin, direction) = ray(&camera, SIZE, place.into(), lens).unwrap();
                let origin = origin - camera.origin;
                // Depth and height above the hinge grow together: z / D = 1 + y / J.
                let [rise, run] = [origin, direction].map(|v| -v.z / distance - v.dot(hinged) / hinge);
                origin + direction * ((1.0 - rise) / run)
            };
            let middle = through((0.0, 0.0));
            for lens in [(1.0, 0.0), (-0.6, 0.7), (0.0, -1.0)] {
                assert!(
                    (through(lens) - middle).length() < 1e-4 * middle.length(),
                    "{angles:?} {place:?} {lens:?}"
                );
            }
        }
        // The lens is where it turns to: its points are across its axis.
        let axis = lens.axes[0].cross(lens.axes[1]);
        assert!((axis.dot(Vec3::Z) - libm::cos(tilt) as f32).abs() < 1e-6, "{axis}");
        assert!((axis.dot(hinged) - libm::sin(tilt) as f32).abs() < 1e-6, "{axis}");
    }
}

fn projections() -> impl Strategy<Value = Projection> {
    let perspective = ((0.1f32..2.0, 0.1f32..2.0), (-0.6f32..0.6, -0.6f32..0.6), 0..3).prop_map(
        |((width, height), (right, up), kind)| Perspective {
            half: match kind {
                0 => HalfSize::Height(height),
                1 => HalfSize::LongerSide(height),
                _ => HalfSize::Both([width, height]),
            },
            shift: [right, up],
        },
    );
    let mapping = prop_oneof![
        Just(FisheyeMapping::Equidistant),
        Just(FisheyeMapping::Equisolid),
        Just(FisheyeMapping::Stereographic),
        Just(FisheyeMapping::Orthographic),
    ];
    prop_oneof![
        perspective.clone().prop_map(Projection::Pinhole),
        (perspective, 0.0f32..0.2, 0.5f32..5.0, [-0.3f64..0.3, -0.3f64..0.3], 0.2f32..2.0).prop_map(
            |(view, radius, distance, tilt, focal_length)| {
                let lens = Lens::new([Vec3::X, Vec3::Y, Vec3::NEG_Z], radius, distance, (focal_length, tilt));
                Projection::ThinLens { view, lens, pattern: Pattern::Jittered }
            }
        ),
        (0.2f32..5.0).prop_map(|half_height| Projection::Orthographic { half_height }),
        (0.05f32..=0.5, 0.05f32..=0.25)
            .prop_map(|(across, above)| Projection::Panorama { half_turns: [across, above] }),
        (mapping, 20.0f64..178.0, any::<bool>())
            .prop_map(|(mapping, degrees, is_circular)| fisheye(mapping, degrees, is_circular)),
    ]
}

fn cameras() -> impl Strategy<Value = CompiledCamera> {
    let layouts = prop_oneof![
        Just(StereoLayout::SideBySide),
        Just(StereoLayout::OverUnder),
        Just(StereoLayout::Left),
        Just(StereoLayout::Right),
    ];
    let stereo = (layouts, 0.0f32..0.2, 0.0f32..1.0)
        .prop_map(|(layout, half_distance, convergence)| StereoPair { layout, half_distance, convergence });
    (projections(), proptest::option::of(stereo), -2.0f32..2.0, -1.0f32..1.0).prop_map(
        |(mut projection, stereo, turn, tilt)| {
            let turned = crate::math::Quat::from_euler(glam::EulerRot::YXZ, turn, tilt, 0.3);
            let [right, up, forward] = [Vec3::X, Vec3::Y, Vec3::NEG_Z].map(|axis| turned * axis);
            if let Projection::ThinLens { lens, .. } = &mut projection {
                lens.axes = lens.axes.map(|axis| turned * axis);
                lens.focus = turned * lens.focus;
            }
            CompiledCamera { right, up, forward, stereo, ..camera(projection) }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// The projection of a point on a ray is the place that the ray belongs to, and the importance the inverse of the
    /// pixel's solid angle times the distance squared (divided by 2 for the choice between two eyes).
    #[test]
    fn projection_is_the_inverse_of_rays(
        camera in cameras(),
        size in prop_oneof![Just([400u32, 200]), Just([200u32, 300]), Just([640, 480])],
        (x, y) in (0.02f32..0.98, 0.02f32..0.98),
        (u, v) in (0.0f32..1.0, 0.0f32..1.0),
        distance in 0.5f32..20.0,
    ) {
        let place = Vec2::new(x * size[0] as f32, y * size[1] as f32);
        let pixel = Vec2::new(place.x.floor(), place.y.floor());
        let is_right = match camera.stereo.map(|pair| pair.layout) {
            None => false,
            Some(StereoLayout::SideBySide) => pixel.x + 0.5 >= 0.5 * size[0] as f32,
            Some(StereoLayout::OverUnder) => pixel.y + 0.5 >= 0.5 * size[1] as f32,
            Some(eye) => eye == StereoLayout::Right,
        };
        let shares = matches!(
            camera.stereo,
            Some(StereoPair { layout: StereoLayout::SideBySide | StereoLayout::OverUnder, .. })
        );
        let chosen = match (shares, is_right) {
            (false, _) => u,
            (true, right) => 0.5 * u + if right { 0.5 } else { 0.0 },
        };
        let lens = on_lens(None, (u, v));
        let image = CameraImage::new(&camera, size);
        let ray_at = |place: Vec2| image.ray((place.x, place.y), (pixel.x, pixel.y), lens);
        let (ray, seen) = ray_at(place);
        prop_assume!(seen);
        let (origin, direction) = (components(ray.origin), components(ray.direction));
        let point = origin + direction * distance;
        let found = image.project(None, Vector::<f32>::splat(point), (chosen, v));
        // Directly beside the border between two eyes' images, rounding may put a point on the other side.
        prop_assume!(found.seen || camera.stereo.is_none());
        prop_assert!(found.seen);
        // Where images are strongly stretched, rounding moves a point along with them.
        let slack = 0.02 + 2e-6 / image.pixel_width().1.max(1e-6);
        prop_assert!((found.column - place.x).abs() < slack && (found.row - place.y).abs() < slack,
            "{:?} is not {place}", (found.column, found.row));
        prop_assert!((components(found.to_camera) + direction).length() < 1e-4);
        prop_assert!((found.distance - distance).abs() < 1e-4 * distance.max(1.0));
        // The area across the ray of what a pixel sees at this distance.
        let at = |(ray, seen): (Ray<f32>, bool)| {
            seen.then(|| components(ray.origin) + components(ray.direction) * distance - point)
        };
        let area = |step: f32| {
            let right = at(ray_at(place + Vec2::new(step, 0.0)))?;
            let down = at(ray_at(place + Vec2::new(0.0, step)))?;
            Some(right.cross(down).dot(direction).abs() / (step * step))
        };
        let (Some(ahead), Some(behind)) = (area(0.25), area(-0.25)) else { return Ok(()) };
        // At the rim of an orthographic fisheye, the area grows without bounds: no difference measures it there.
        prop_assume!((ahead - behind).abs() < 0.05 * ahead.min(behind));
        let area = 0.5 * (ahead + behind);
        let eyes = if shares { 2.0 } else { 1.0 };
        prop_assume!(area > 1e-9);
        let product = found.importance * area / eyes;
        prop_assert!((product - 1.0).abs() < 0.06, "{product}");
    }
}
