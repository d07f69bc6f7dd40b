//! Random parametric shapes.

use proptest::prelude::*;

use super::writing::positive;
use crate::math::{Vec2, Vec3};
use crate::world::{Shape, Spline, TubeEnds};

fn curve() -> impl Strategy<Value = Spline> {
    prop_oneof![Just(Spline::Linear), Just(Spline::CatmullRom)]
}

pub(super) fn parametric_shape() -> impl Strategy<Value = Shape> {
    let segments = || prop::option::of(3..=Shape::MOST_SEGMENTS);
    let part = || 0.0_f32..=0.5;
    let ends = prop_oneof![Just(TubeEnds::Round), Just(TubeEnds::Flat), Just(TubeEnds::Open)];
    // Coordinates of points that differ from their neighbours.
    let steps = || prop::collection::vec(0.5_f32..2.0, 2..6);
    prop_oneof![
        ([positive(), positive(), positive()], part(), segments()).prop_map(|(size, part, segments)| {
            let size_m = Vec3::from(size);
            Shape::Box { size_m, bevel_m: size_m.min_element() * part, segments }
        }),
        (positive(), part(), segments()).prop_map(|(radius_m, part, segments)| Shape::Disc {
            radius_m,
            inner_radius_m: radius_m * part,
            segments
        }),
        (positive(), positive(), segments()).prop_map(|(radius_m, height_m, segments)| Shape::Cylinder {
            radius_m,
            height_m,
            segments
        }),
        (positive(), part(), positive(), segments()).prop_map(
            |(radius_m, top_radius_m, height_m, segments)| {
                Shape::Cone { radius_m, top_radius_m, height_m, segments }
            }
        ),
        (positive(), part(), segments()).prop_map(|(radius_m, part, segments)| {
            let radius_m = radius_m.min(1e38);
            Shape::Capsule { radius_m, height_m: radius_m * (2.0 + part), segments }
        }),
        (positive(), part(), segments()).prop_map(|(radius_m, part, segments)| Shape::Torus {
            radius_m,
            tube_radius_m: (radius_m * part).max(f32::MIN_POSITIVE).min(radius_m),
            segments
        }),
        (steps(), 0.1_f32..0.4, curve(), positive(), segments()).prop_map(
            |(steps, hole, curve, height_m, segments)| {
                let square = |half: f32| vec![[-half, -half], [half, -half], [half, half], [-half, half]];
                let pairs = |points: Vec<[f32; 2]>| points.into_iter().map(Vec2::from).collect();
                let holes = if steps[0] > 1.0 { vec![pairs(square(hole))] } else { Vec::new() };
                Shape::Prism { outline: pairs(square(steps[1])), holes, height_m, curve, segments }
            }
        ),
        (steps(), curve(), any::<bool>(), segments()).prop_map(|(steps, curve, open, segments)| {
            let point = |(number, x): (usize, &f32)| Vec2::new(*x, number as f32);
            let profile = steps.iter().enumerate().map(point).collect();
            Shape::Lathe { profile, curve, open, segments }
        }),
        (steps(), curve(), ends, any::<bool>(), segments()).prop_map(
            |(steps, curve, ends, same, segments)| {
                let point = |(number, x): (usize, &f32)| Vec3::new(*x, number as f32, 0.1);
                let points = steps.iter().enumerate().map(point).collect();
                let radius_m = if same { vec![0.25] } else { steps.iter().map(|step| step * 0.1).collect() };
                Shape::Tube { points, radius_m, curve, ends, segments }
            }
        ),
        ([positive(), positive()], 1..=1_u32 << 14, 1..=1_u32 << 14)
            .prop_map(|(size, columns, rows)| Shape::Grid { size_m: size.into(), columns, rows }),
    ]
}
