//! A flat patch of a material, without normal and bump maps.

use super::FurnacePlan;
use crate::math::{Hit, Vector};
use crate::scene::CompiledScene;
use crate::scene::material::MaterialRecord;
use crate::shading::footprint::Footprint;
use crate::shading::point::{ShadingPoint, Tables};
use crate::shading::principled::bsdf::Bsdf;
use crate::shading::principled::parameters::{LobeFlags, Outside, Parameters};
use crate::shading::principled::shading_frame::ShadingFrame;
use crate::shading::surface::{HitLanes, Surface};
use crate::shading::texture_lookup::Coordinates;

/// The width of the footprint by which textures are averaged, in widths of the image and in metres.
const WHOLE_TEXTURE: f32 = 1.0;

/// A material on a plane with the normal (0, 0, 1), in air.
pub struct Patch<'a> {
    scene: &'a CompiledScene,
    record: &'a MaterialRecord,
    has: LobeFlags,
    inside: bool,
    at: Coordinates<f32>,
}

impl<'a> Patch<'a> {
    /// A patch at the plan's texture coordinates.
    pub fn new(scene: &'a CompiledScene, record: &'a MaterialRecord, plan: &FurnacePlan) -> Patch<'a> {
        let uv = plan.uv.unwrap_or([0.5; 2]);
        let mut at = Coordinates::point([(uv[0], uv[1]); 2]);
        if plan.uv.is_none() {
            at.footprint = [Footprint { axes: [(WHOLE_TEXTURE, 0.0), (0.0, WHOLE_TEXTURE)] }; 2];
            let axis = |x, y| Vector { x, y, z: 0.0 };
            at.object_footprint = [axis(WHOLE_TEXTURE, 0.0), axis(0.0, WHOLE_TEXTURE)];
        }
        Patch { scene, record, has: lobes(scene, record), inside: plan.inside, at }
    }

    /// The BSDF for a viewer.
    pub fn bsdf(&self, to_viewer: Vector<f32>) -> Bsdf<f32> {
        Bsdf::new(self.has, self.parameters(to_viewer), to_viewer, true)
    }

    /// The perceptual roughness of the microfacets, 1 if there are none.
    pub fn roughness(&self) -> f32 {
        self.parameters(up()).roughness
    }

    fn parameters(&self, to_viewer: Vector<f32>) -> Parameters<f32> {
        let surface = surface(self.inside, self.at.uv[0]);
        let hit = HitLanes::one(&Hit::MISS);
        let point = ShadingPoint {
            tables: Tables { geometry: &self.scene.geometry, textures: &self.scene.textures },
            material: self.record,
            hit: &hit,
            surface: &surface,
            at: self.at,
            to_viewer,
            mask: true,
        };
        let frame = ShadingFrame::about(up());
        point.parameters_in(self.has, &Outside::air(), (frame, frame))
    }
}

fn up() -> Vector<f32> {
    Vector { x: 0.0, y: 0.0, z: 1.0 }
}

fn surface(inside: bool, uv: (f32, f32)) -> Surface<f32> {
    Surface {
        position: Vector { x: 0.0, y: 0.0, z: 0.0 },
        offset: 0.0,
        geometric_normal: up(),
        normal: up(),
        inside,
        uv,
        color: Vector { x: 1.0, y: 1.0, z: 1.0 },
        material: std::num::Wrapping(0),
    }
}

/// The lobes of a material; all colours are bent alike.
pub fn lobes(scene: &CompiledScene, record: &MaterialRecord) -> LobeFlags {
    let (surface, hit) = (surface(false, (0.5, 0.5)), HitLanes::one(&Hit::MISS));
    let point = ShadingPoint {
        tables: Tables { geometry: &scene.geometry, textures: &scene.textures },
        material: record,
        hit: &hit,
        surface: &surface,
        at: Coordinates::point([(0.5, 0.5); 2]),
        to_viewer: up(),
        mask: true,
    };
    LobeFlags { dispersion: false, ..point.has() }
}

/// The material without normal and bump maps.
pub fn at_rest(record: &MaterialRecord) -> MaterialRecord {
    MaterialRecord { normal: None, bump: None, coat_normal: None, ..*record }
}

/// The names of lobes.
pub fn lobe_names(has: &LobeFlags) -> Vec<&'static str> {
    let all = [
        (has.diffuse, "diffuse"),
        (has.specular, "microfacets"),
        (has.anisotropic, "anisotropy"),
        (has.metallic, "metal"),
        (has.transmission && !has.solid, "thin transmission"),
        (has.solid, "refraction"),
        (has.diffuse_transmission, "diffuse transmission"),
        (has.coat, "clear coat"),
        (has.sheen, "sheen"),
        (has.film, "thin film"),
    ];
    all.into_iter().filter(|(is_present, _)| *is_present).map(|(_, name)| name).collect()
}
