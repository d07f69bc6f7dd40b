//! `EXT_lights_image_based`: converts a cube map to one equirectangular image.

use gltf::json::{self, Index};

use super::extensions::light::{ImageLight, ImageLightOfScene, ImageLights};
use super::{GltfNode, Import, pose};
use crate::error::LoadError;
use crate::film::texels::linear_colors;
use crate::math::{DVec3, Rgb, Vec3};
use crate::world::{Image, Light, Texels, Transform};

/// The largest number of rows of the image; it has twice as many columns.
const MOST_ROWS: u32 = 1024;

impl Import<'_> {
    /// The environment light of a scene; none, with a warning, if an image cannot be read.
    pub(super) fn environment(
        &mut self,
        scene: Option<Index<json::Scene>>,
    ) -> Result<Option<GltfNode>, LoadError> {
        let document = self.document;
        let Some(number) = scene.map(|index| index.value()) else { return Ok(None) };
        let Some(scene) = document.root.scenes.get(number) else { return Ok(None) };
        let name = "EXT_lights_image_based";
        let at = format!("/scenes/{number}");
        let extensions = scene.extensions.as_ref().map(|extensions| &extensions.others);
        let read: Option<ImageLightOfScene> = document.extension(extensions, name, &at);
        let Some(ImageLightOfScene { light: index }) = read else { return Ok(None) };
        let extensions = document.root.extensions.as_ref().map(|extensions| &extensions.others);
        let lights: Option<ImageLights> = document.extension(extensions, name, "");
        let lights = lights.map_or_else(Vec::new, |read| read.lights);
        let light = document.find(&lights, Index::new(index), &at, "light", "it is left out");
        let at = format!("/extensions/{name}/lights/{index}");
        let light: Option<ImageLight> = light.and_then(|light| document.lenient(light, &at));
        let Some(light) = light else { return Ok(None) };
        let rotation = pose::rotation(document, light.rotation, &format!("{at}/rotation"));
        let Some(image) = self.equirectangular(&light, &at)? else { return Ok(None) };
        let image = Some(self.assets.add_made_image(image));
        let radiance = Rgb::splat(light.intensity.max(0.0));
        Ok(Some(GltfNode {
            parent: None,
            name: light.name.clone().filter(|name| !name.is_empty()),
            transform: Transform::Trs {
                translation: DVec3::ZERO,
                rotation: rotation.normalize().as_quat(),
                scale: Vec3::ONE,
            },
            mesh: None,
            light: Some(Light::Environment { radiance, image }),
            camera: None,
        }))
    }

    fn equirectangular(&mut self, light: &ImageLight, at: &str) -> Result<Option<Image>, LoadError> {
        let document = self.document;
        let at = format!("{at}/specularImages");
        let Some(&[a, b, c, d, e, f]) = light.specular_images.first().map(Vec::as_slice) else {
            document.mend(at, "the first level must have six images: the light is left out");
            return Ok(None);
        };
        let mut faces = Vec::with_capacity(6);
        for image in [a, b, c, d, e, f] {
            let image =
                self.images.picture(document, Index::new(image), &at, &self.assets.files, self.warnings)?;
            let Some(image) = image else { return Ok(None) };
            faces.push(Face::new(&image));
        }
        let rows = faces.iter().map(|face| face.height as u32 * 2).max().unwrap_or(2).clamp(2, MOST_ROWS);
        let columns = rows * 2;
        document.charge(u64::from(rows) * u64::from(columns) * 12, &at)?;
        let mut texels = Vec::with_capacity(rows as usize * columns as usize);
        for row in 0..rows {
            for column in 0..columns {
                let place = |at: u32, of: u32| (f64::from(at) + 0.5) / f64::from(of);
                let (face, s, t) = on_cube(towards(place(column, columns), place(row, rows)));
                texels.push(faces[face].at(s, t));
            }
        }
        Ok(Some(Image { source: None, width: columns, height: rows, texels: Texels::Rgb32(texels) }))
    }
}

/// A face of the cube, linear.
struct Face {
    width: usize,
    height: usize,
    texels: Vec<[f32; 3]>,
}

impl Face {
    /// Decodes a face. Eight-bit images are RGBD: sRGB-encoded colours, divided by alpha.
    fn new(image: &Image) -> Self {
        let mut texels = linear_colors(&image.texels).into_owned();
        if let Texels::Rgba8(stored) = &image.texels {
            for (texel, [.., divisor]) in texels.iter_mut().zip(stored) {
                *texel = texel.map(|color| color / (f32::from(*divisor).max(1.0) / 255.0));
            }
        }
        Self { width: image.width as usize, height: image.height as usize, texels }
    }

    /// Bilinear lookup; both coordinates are from 0 to 1.
    fn at(&self, s: f32, t: f32) -> [f32; 3] {
        let split = |at: f32, size: usize| {
            let at = (at * size as f32 - 0.5).clamp(0.0, (size - 1) as f32);
            let first = at as usize;
            (first, (first + 1).min(size - 1), at - first as f32)
        };
        let (left, right, x) = split(s, self.width);
        let (top, bottom, y) = split(t, self.height);
        let texel = |column: usize, row: usize| self.texels[row * self.width + column];
        let [a, b, c, d] = [texel(left, top), texel(right, top), texel(left, bottom), texel(right, bottom)];
        std::array::from_fn(|i| {
            let (above, below) = (a[i] + (b[i] - a[i]) * x, c[i] + (d[i] - c[i]) * x);
            above + (below - above) * y
        })
    }
}

/// The face of the cube map (+X, −X, +Y, −Y, +Z, −Z) that a direction intersects, and the coordinates on it, by the
/// conventions of graphics APIs.
fn on_cube(towards: Vec3) -> (usize, f32, f32) {
    let [x, y, z] = towards.to_array();
    let size = towards.abs();
    let (face, s, t, axis) = if size.x >= size.y && size.x >= size.z {
        if x > 0.0 { (0, -z, -y, size.x) } else { (1, z, -y, size.x) }
    } else if size.y >= size.z {
        if y > 0.0 { (2, x, z, size.y) } else { (3, x, -z, size.y) }
    } else if z > 0.0 {
        (4, x, -y, size.z)
    } else {
        (5, -x, -y, size.z)
    };
    (face, (s / axis + 1.0) * 0.5, (t / axis + 1.0) * 0.5)
}

/// The direction of a point in an environment's image, with coordinates from 0 to 1.
pub(in crate::formats) fn towards(u: f64, v: f64) -> Vec3 {
    let (azimuth, polar) = ((u - 0.5) * std::f64::consts::TAU, v * std::f64::consts::PI);
    let level = libm::sin(polar);
    let [x, z] = [libm::sin(azimuth) * level, -libm::cos(azimuth) * level];
    Vec3::new(x as f32, libm::cos(polar) as f32, z as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_map_to_cube_faces() {
        let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        for (face, axis) in axes.into_iter().enumerate() {
            assert_eq!(on_cube(axis), (face, 0.5, 0.5));
        }
        assert_eq!(on_cube(Vec3::new(0.5, 0.5, 1.0)), (4, 0.75, 0.25));
        assert_eq!(on_cube(Vec3::new(1.0, 0.0, 0.5)), (0, 0.25, 0.5));
    }

    #[test]
    fn alpha_divides_rgbd_colors() {
        let image = |texels: Vec<[u8; 4]>| Image {
            source: None,
            width: texels.len() as u32,
            height: 1,
            texels: Texels::Rgba8(texels),
        };
        let face = Face::new(&image(vec![[255, 0, 0, 51], [255, 0, 0, 255]]));
        let near = |a: f32, b: f32| (a - b).abs() < 1e-5;
        assert!(near(face.at(0.0, 0.0)[0], 5.0) && near(face.at(0.5, 0.5)[0], 3.0));
    }
}
