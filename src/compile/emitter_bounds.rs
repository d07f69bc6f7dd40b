//! The bounds of emitters for the light tree.

use super::light_tree::LightBounds;
use super::lights::WorldLight;
use super::textured_emission::EmissionAverages;
use crate::math::{Aabb, Vec3};
use crate::scene::emitter_rows::{
    AnyRow, ConeRow, DirectionalRow, PhotometricRow, PlanarRow, PointRow, SphereRow,
};
use crate::scene::emitters::{Emitters, flag, kind};
use crate::scene::environment::Environment;
use crate::world::Outline;

/// The bounds of an emitter: its place, its directions and its power.
pub(super) fn bounds(
    out: &Emitters,
    emitter: usize,
    lamps: &[WorldLight],
    environment: &Environment,
    glows: &mut EmissionAverages,
) -> LightBounds {
    let row = &out.rows[emitter];
    let has = |flag: u32| out.flags[emitter] & flag != 0;
    let mut light = AnyRow::of(row).light.luminance();
    if has(flag::TEXTURED) {
        light *= glows.mean(out.material[emitter], out.primitive[emitter]);
    }
    let everywhere = |place: Vec3| LightBounds {
        bounds: Aabb { min: place, max: place },
        far: false,
        power: light,
        axis: Vec3::Z,
        cos_spread: -1.0,
        cos_emission: 0.0,
        two_sided: false,
        outside: 0.0,
    };
    let coned = |whole: LightBounds| {
        let ConeRow { axis, cos_outer, .. } = ConeRow::of(row);
        LightBounds { axis, cos_spread: 1.0, cos_emission: cos_outer, ..whole }
    };
    match out.kinds[emitter] {
        kind::TRIANGLE | kind::QUAD => {
            let PlanarRow { corner, e1, e2, .. } = PlanarRow::of(row);
            let cross = e1.cross(e2);
            let quad = out.kinds[emitter] == kind::QUAD;
            let round = if has(flag::ROUND) { Outline::Disc.part() } else { 1.0 };
            let part = if quad { round } else { 0.5 };
            let corners = [corner + e1, corner + e2, if quad { corner + e1 + e2 } else { corner }];
            LightBounds {
                bounds: Aabb {
                    min: corners.into_iter().fold(corner, Vec3::min),
                    max: corners.into_iter().fold(corner, Vec3::max),
                },
                power: light * cross.length() * part,
                axis: if has(flag::REVERSED) { -cross } else { cross },
                cos_spread: 1.0,
                two_sided: has(flag::TWO_SIDED),
                ..everywhere(corner)
            }
        }
        kind::SPHERE => {
            let (SphereRow { center, radius, .. }, pi) = (SphereRow::of(row), std::f32::consts::PI);
            let bounds = Aabb { min: center - radius, max: center + radius };
            let within = LightBounds { power: light * pi * radius * radius, ..everywhere(center) };
            let within = if has(flag::CONE) { coned(within) } else { within };
            LightBounds { bounds, ..within }
        }
        kind::PHOTOMETRIC => {
            let PhotometricRow { position, axis, .. } = PhotometricRow::of(row);
            match lamps.get(out.primitive[emitter] as usize) {
                Some(WorldLight::Photometric { beam, .. }) if beam.cosines[0] > -1.0 => LightBounds {
                    power: light * beam.intensity,
                    axis: if beam.backwards { -axis } else { axis },
                    cos_spread: beam.cosines[0],
                    cos_emission: beam.cosines[1],
                    outside: beam.outside,
                    ..everywhere(position)
                },
                _ => everywhere(position),
            }
        }
        kind::POINT | kind::SPOT => {
            let PointRow { position, falls, .. } = PointRow::of(row);
            // Without falloff, irradiance is the same everywhere, as from a distant light.
            match out.kinds[emitter] {
                kind::SPOT if falls > 0.0 => coned(everywhere(position)),
                _ => LightBounds { far: falls == 0.0, ..everywhere(position) },
            }
        }
        kind::DIRECTIONAL => {
            let DirectionalRow { to_light: axis, spread, .. } = DirectionalRow::of(row);
            LightBounds { far: true, axis, cos_spread: 1.0 - spread, ..everywhere(axis) }
        }
        _ => {
            let panorama = environment.panorama.as_ref();
            let power = panorama.map_or(0.0, |p| p.irradiance * p.factor.luminance());
            LightBounds { far: true, power, ..everywhere(Vec3::ZERO) }
        }
    }
}
