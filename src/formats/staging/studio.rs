//! A photographer's studio as an environment: a large soft light above on the viewer's left, a weaker one on the right,
//! a pale ceiling, a grey floor.

use crate::formats::gltf::environment::towards;
use crate::math::Vec3;
use crate::world::{Image, Texels};

const WIDTH: u32 = 256;
const HEIGHT: u32 = 128;

/// A round light with a soft edge.
struct Softbox {
    towards: Vec3,
    /// The cosines of the angles from its middle between which it fades.
    fades: [f32; 2],
    /// W m⁻² sr⁻¹.
    radiance: f32,
}

/// The viewer stands towards +Z, as the camera of `framing` does.
const LIGHTS: [Softbox; 2] = [
    Softbox { towards: Vec3::new(-0.65, 0.7, 0.6), fades: [0.94, 0.82], radiance: 5.0 },
    Softbox { towards: Vec3::new(0.95, 0.25, 0.4), fades: [0.92, 0.75], radiance: 1.2 },
];
const CEILING: f32 = 0.55;
const HORIZON: f32 = 0.4;
const FLOOR: f32 = 0.18;

/// The studio as the image of an environment.
pub(super) fn image() -> Image {
    let texel = |index: u32| {
        let (column, row) = (index % WIDTH, index / WIDTH);
        let place = |at: u32, of: u32| (f64::from(at) + 0.5) / f64::from(of);
        [radiance(towards(place(column, WIDTH), place(row, HEIGHT))); 3]
    };
    let texels = Texels::Rgb32((0..WIDTH * HEIGHT).map(texel).collect());
    Image { source: None, width: WIDTH, height: HEIGHT, texels }
}

/// The radiance of the studio in a direction.
pub(super) fn radiance(towards: Vec3) -> f32 {
    let height = towards.y;
    let room = if height > 0.0 {
        HORIZON + (CEILING - HORIZON) * height
    } else {
        HORIZON + (FLOOR - HORIZON) * smooth(-3.0 * height)
    };
    let light = |light: &Softbox| {
        let [inner, outer] = light.fades;
        light.radiance * smooth((light.towards.normalize().dot(towards) - outer) / (inner - outer))
    };
    room + LIGHTS.iter().map(light).sum::<f32>()
}

/// Smoothstep: from 0 at 0 to 1 at 1 without a kink.
fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn environment_image_has_its_middle_along_negative_z() {
        let near = |u, v, axis: Vec3| (towards(u, v) - axis).length() < 1e-6;
        assert!(near(0.5, 0.5, Vec3::NEG_Z) && near(0.75, 0.5, Vec3::X) && near(0.0, 0.5, Vec3::Z));
        assert!(near(0.3, 0.0, Vec3::Y) && near(0.3, 1.0, Vec3::NEG_Y));
    }

    #[test]
    fn studio_is_as_bright_as_a_room() {
        let Texels::Rgb32(texels) = image().texels else { panic!() };
        let weight = |row: usize| towards(0.5, (row as f64 + 0.5) / f64::from(HEIGHT)).z.abs();
        let (mut sum, mut whole) = (0.0, 0.0);
        for (row, texels) in texels.chunks(WIDTH as usize).enumerate() {
            sum += texels.iter().map(|texel| texel[0]).sum::<f32>() * weight(row);
            whole += weight(row) * WIDTH as f32;
        }
        assert!((0.5..1.0).contains(&(sum / whole)), "{}", sum / whole);
    }
}
