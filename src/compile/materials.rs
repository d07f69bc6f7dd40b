//! Compiles materials to records.

use std::collections::HashMap;

use super::classic;
use crate::math::{NONE, Rgb};
use crate::scene::MaterialRecord;
use crate::scene::bodies::{Bodies, Body};
use crate::scene::material::{
    BumpParam, ColorParam, Coverage, Medium, NormalParam, ScalarParam, ThinFilmParam, WhittedParams,
};
use crate::world::assets::{Assets, NamedMaterial};
use crate::world::{
    self, AlphaMode, BlinnPhong, BumpMap, ColorInput, Highlight, Iridescence, MaterialId, NormalMap,
    ScalarInput, Transport,
};

/// The records for a transport, and their human-readable names.
pub(super) fn compile(assets: &Assets, transport: Transport) -> (Vec<MaterialRecord>, Vec<String>) {
    let record = |material: &world::Material| match material {
        world::Material::BlinnPhong(material) => {
            match from_dissolve(material).filter(|_| transport == Transport::Path) {
                Some(veil) => veil,
                None => from_blinn_phong(material),
            }
        }
        world::Material::Principled(material) => from_principled(material, assets),
    };
    let finished = |(named, looks_up_vertices): (&NamedMaterial, bool)| {
        let record = record(&named.material);
        MaterialRecord {
            textured: record.looks_up(),
            vertices_are_factors: !looks_up_vertices,
            passes_shadow_rays: transport == Transport::Path && record.lets_straight_on(),
            ..record
        }
    };
    let records = assets.materials.iter().zip(assets.looks_up_vertices()).map(finished);
    let ids = (0..assets.materials.len() as u32).map(MaterialId);
    (records.collect(), ids.map(|id| assets.material_name(id).into_owned()).collect())
}

/// Numbers the bodies that materials enclose under a transport.
pub(super) fn number_bodies(materials: &mut [MaterialRecord], transport: Transport) -> Bodies {
    Bodies::number(materials, |material| {
        let &MaterialRecord {
            encloses,
            priority,
            dispersion,
            passes_shadow_rays: straight,
            classic: WhittedParams { ior, .. },
            ..
        } = material;
        let (index, exists) = match transport {
            Transport::Path => (material.index(), encloses),
            Transport::Whitted => (ior, encloses && ior > 0.0),
        };
        exists.then_some(Body { material: 0, priority, index, dispersion, passes_shadow_rays: straight })
    })
}

/// A variant of a material's record.
#[derive(PartialEq, Eq, Hash)]
enum RecordVariant {
    /// Without a front.
    TwoSided,
    /// A thin sheet of this optical depth, stored as bits.
    Thin([u32; 3]),
    /// One that encloses nothing.
    Interface,
    /// A white one, for meshes with colours.
    White,
    /// One whose light belongs to a light group.
    InGroup(u32),
}

/// Records for sheets, beside those of the materials: they have no front, and may be thin where materials have a
/// volume.
pub(super) struct TwoSidedVariants<'a> {
    pub materials: &'a mut Vec<MaterialRecord>,
    pub names: &'a mut Vec<String>,
    pub transport: Transport,
    /// The number of records that are the materials' own.
    own: usize,
    /// Added records, by the original and the variant.
    known: HashMap<(MaterialId, RecordVariant), MaterialId>,
    /// The original materials of the added records, in order.
    added: Vec<u32>,
}

impl<'a> TwoSidedVariants<'a> {
    pub fn new(
        materials: &'a mut Vec<MaterialRecord>,
        names: &'a mut Vec<String>,
        transport: Transport,
    ) -> Self {
        let own = materials.len();
        Self { materials, names, transport, own, known: HashMap::new(), added: Vec::new() }
    }

    /// The original materials of the added records, which come last.
    pub fn end(self) -> Vec<u32> {
        self.added
    }

    /// The two-sided material of a sheet.
    pub fn of(&mut self, id: MaterialId) -> MaterialId {
        let record = self.materials[id.0 as usize];
        if !record.hides_back && !record.one_sided_emission {
            return id;
        }
        self.add(
            id,
            RecordVariant::TwoSided,
            MaterialRecord { hides_back: false, one_sided_emission: false, ..record },
        )
    }

    /// Pairs of a material and its replacement, for sheets of some thickness or for interfaces.
    pub fn in_place_of(&mut self, materials: &[(MaterialId, Option<f32>)]) -> Vec<[MaterialId; 2]> {
        let mut other = |id: MaterialId, thickness: Option<f32>| match thickness {
            Some(thickness) => self.thin(id, thickness),
            None => self.interface(id),
        };
        materials.iter().map(|(id, thickness)| [*id, other(*id, *thickness)]).collect()
    }

    /// The default material of a mesh with colours, which are its albedo: it is white.
    pub fn white(&mut self) -> MaterialId {
        let record = self.materials[MaterialId::DEFAULT.0 as usize];
        let white = ColorParam::constant([1.0; 3]);
        let classic = WhittedParams { diffuse: white, ..record.classic };
        let record = MaterialRecord { base_color: white, classic, ..record };
        self.add(MaterialId::DEFAULT, RecordVariant::White, record)
    }

    /// The material of an interface, which encloses nothing.
    fn interface(&mut self, id: MaterialId) -> MaterialId {
        let record = self.materials[id.0 as usize];
        self.add(
            id,
            RecordVariant::Interface,
            MaterialRecord { encloses: false, medium: Medium::CLEAR, ..record },
        )
    }

    /// The material of a sheet of a thickness in metres, filled with the medium of a body of this material. (Light that
    /// is scattered in it counts as transmitted: the sheet is thin.)
    fn thin(&mut self, id: MaterialId, thickness: f32) -> MaterialId {
        let record = self.materials[id.0 as usize];
        let Medium { extinction, albedo, .. } = record.medium;
        let depth = std::array::from_fn(|i| extinction[i] * (1.0 - albedo[i]) * thickness);
        let WhittedParams { kt, ior, .. } = record.classic;
        let left = |i: usize| kt[i] * libm::exp(-f64::from(depth[i])) as f32;
        let sheet = MaterialRecord {
            thin: true,
            dispersion: 0.0,
            encloses: false,
            medium: Medium::CLEAR,
            sheet_depth: depth,
            classic: WhittedParams {
                kt: std::array::from_fn(left),
                ior: if ior > 0.0 { 1.0 } else { 0.0 },
                ..record.classic
            },
            ..record
        };
        let straight = self.transport == Transport::Path && sheet.lets_straight_on();
        self.add(
            id,
            RecordVariant::Thin(depth.map(f32::to_bits)),
            MaterialRecord { passes_shadow_rays: straight, ..sheet },
        )
    }

    /// The material whose light belongs to a light group.
    fn in_group(&mut self, id: MaterialId, group: u32) -> MaterialId {
        let record = self.materials[id.0 as usize];
        if !record.emits() {
            return id;
        }
        self.add(id, RecordVariant::InGroup(group), MaterialRecord { group, ..record })
    }

    /// Puts the light of an entity into a light group, unless it is [`NONE`]: that of its material, or, without one, that
    /// of its mesh's own materials, whose replacements change.
    pub fn put_in_group(
        &mut self,
        group: u32,
        material: &mut Option<MaterialId>,
        own: &[MaterialId],
        replaced: &mut Vec<[MaterialId; 2]>,
    ) {
        if group == NONE {
            return;
        }
        if let Some(own) = material {
            *own = self.in_group(*own, group);
            return;
        }
        let mut own = own.to_vec();
        own.sort_unstable();
        own.dedup();
        for own in own {
            let before = in_place_of(own, replaced);
            let after = self.in_group(before, group);
            if after != before {
                replaced.retain(|[of, _]| *of != own);
                replaced.push([own, after]);
            }
        }
    }

    fn add(&mut self, id: MaterialId, variant: RecordVariant, record: MaterialRecord) -> MaterialId {
        *self.known.entry((id, variant)).or_insert_with(|| {
            self.materials.push(record);
            self.names.push(self.names[id.0 as usize].clone());
            let of = (id.0 as usize).checked_sub(self.own).map_or(id.0, |place| self.added[place]);
            self.added.push(of);
            MaterialId(self.materials.len() as u32 - 1)
        })
    }
}

/// The replacement of a material, or the material itself if it has none.
pub(super) fn in_place_of(own: MaterialId, replaced: &[[MaterialId; 2]]) -> MaterialId {
    replaced.iter().find(|[of, _]| *of == own).map_or(own, |[_, sheet]| *sheet)
}

pub(super) fn color(input: ColorInput) -> ColorParam {
    match input {
        ColorInput::Constant(color) => ColorParam::constant(color.to_array()),
        ColorInput::Texture(texture) => ColorParam { factor: [1.0; 3], texture: texture.0 },
    }
}

fn scalar(input: ScalarInput) -> ScalarParam {
    let (texture, channel) = match input.texture {
        None => (NONE, 0),
        Some((texture, channel)) => (texture.0, channel.index()),
    };
    ScalarParam { factor: input.factor, texture, channel }
}

fn coverage(mode: AlphaMode) -> Coverage {
    match mode {
        AlphaMode::Opaque => Coverage::Whole,
        AlphaMode::Mask { cutoff } => Coverage::Mask(cutoff),
        AlphaMode::Blend => Coverage::Blend,
    }
}

fn normal(map: Option<NormalMap>) -> Option<NormalParam> {
    map.map(|map| NormalParam { texture: map.texture.0, scale: map.scale })
}

fn bump(map: BumpMap) -> BumpParam {
    let heights = ScalarParam { factor: 1.0, texture: map.texture.0, channel: map.channel.index() };
    BumpParam { heights, metres: map.height_m }
}

/// Reflectance at normal incidence between air and a dielectric (PBRT 4th ed., 9.3.5).
fn reflectance(ior: f32) -> f32 {
    // KHR_materials_ior: 0 stands for a reflectance of 1.
    if ior == 0.0 {
        return 1.0;
    }
    let ratio = (ior - 1.0) / (ior + 1.0);
    ratio * ratio
}

/// The medium within a body.
fn medium(volume: world::Volume) -> Medium {
    let distance = f64::from(volume.attenuation_distance);
    let per_metre = |c: f32| {
        // An infinite distance means no extinction; black counts as 10⁻⁶.
        let is_limited = distance.is_finite() && distance > 0.0;
        if is_limited { (-libm::log(f64::from(c.clamp(1e-6, 1.0))) / distance) as f32 } else { 0.0 }
    };
    Medium {
        extinction: volume.attenuation_color.map(per_metre).to_array(),
        albedo: volume.multiscatter_color.map(single_scattering_albedo).to_array(),
        anisotropy: volume.scatter_anisotropy,
    }
}

/// The single-scattering albedo of a body that has this colour after many scatterings: the part of the extinction that
/// is scattering (Kulla and Conty 2017, in KHR_materials_volume_scatter).
fn single_scattering_albedo(color: f32) -> f32 {
    // The formula would leave two parts in 10⁵ for black.
    if color <= 0.0 {
        return 0.0;
    }
    let c = f64::from(color);
    let root = 4.09712 + 4.20863 * c - (9.59217 + 41.6808 * c + 17.7126 * c * c).sqrt();
    (1.0 - root * root).clamp(0.0, 1.0) as f32
}

fn from_principled(m: &world::Principled, assets: &Assets) -> MaterialRecord {
    let classic = classic::from_principled(m, assets);
    let m = &without_unseen_boundary(m);
    let volume = m.volume.filter(|_| m.transmission.factor != 0.0 || m.diffuse_transmission.factor != 0.0);
    let solid = volume.is_some() && m.transmission.factor > 0.0;
    MaterialRecord {
        base_color: color(m.base_color),
        alpha: scalar(m.alpha),
        coverage: coverage(m.alpha_mode),
        // Light inside a body hits its back, which is not hidden.
        hides_back: !m.double_sided && volume.is_none(),
        metallic: scalar(m.metallic),
        edge_tint: m.edge_tint.to_array(),
        roughness: scalar(m.roughness),
        normal: normal(m.normal),
        bump: m.bump.map(bump),
        emission: color(m.emission),
        one_sided_emission: !m.double_sided,
        group: NONE,
        unlit: m.unlit,
        shadow_catcher: m.shadow_catcher && !m.unlit,
        caustics: m.caustics,
        // Below 1: a body less dense than its surroundings, such as air in glass.
        ior: if m.ior == 0.0 { 1e3 } else { bending(m.ior.max(1e-3), m.roughness) },
        specular: scalar(m.specular),
        specular_color: color(m.specular_color),
        f0: reflectance(m.ior),
        constant_fresnel: false,
        transmission: scalar(m.transmission),
        thin: !solid,
        dispersion: if solid { m.dispersion } else { 0.0 },
        passes_shadow_rays: false,
        encloses: volume.is_some(),
        body: 0,
        beside: 0,
        hidden: false,
        priority: volume.map_or(0, |volume| volume.priority),
        medium: volume.map_or(Medium::CLEAR, medium),
        sheet_depth: [0.0; 3],
        diffuse_transmission: scalar(m.diffuse_transmission),
        diffuse_transmission_color: color(m.diffuse_transmission_color),
        coat: scalar(m.clearcoat),
        coat_roughness: scalar(m.clearcoat_roughness),
        coat_normal: normal(m.clearcoat_normal).filter(|_| m.clearcoat.factor > 0.0),
        coat_f0: [0.04; 3],
        coat_f90: [1.0; 3],
        sheen_color: color(m.sheen_color),
        sheen_roughness: scalar(m.sheen_roughness),
        anisotropy: m.anisotropy.strength,
        anisotropy_direction: {
            let angle = m.anisotropy.rotation as f64;
            [libm::cos(angle) as f32, libm::sin(angle) as f32]
        },
        anisotropy_texture: m.anisotropy.texture.map_or(NONE, |t| t.0),
        film: (m.iridescence.factor.factor > 0.0).then(|| film(&m.iridescence)),
        classic,
        textured: false,
        vertices_are_factors: true,
    }
}

/// Smooths boundaries between equal indices, such as those of fog: however rough, they neither refract nor reflect.
fn without_unseen_boundary(m: &world::Principled) -> world::Principled {
    let is_solid = m.volume.is_some() && m.transmission.factor > 0.0;
    let mirrors = m.metallic.factor != 0.0 || m.iridescence.factor.factor != 0.0;
    if !is_solid || m.ior != 1.0 || mirrors {
        return m.clone();
    }
    let roughness = ScalarInput { factor: 0.0, texture: None };
    world::Principled { roughness, dispersion: 0.0, anisotropy: Default::default(), ..m.clone() }
}

/// An index that rough glass can have: at exactly 1 its microfacets refract nothing and would have no half vector.
fn bending(ior: f32, roughness: ScalarInput) -> f32 {
    const LEAST: f32 = 1e-4;
    if roughness.factor > 0.0 && (ior - 1.0).abs() < LEAST { 1.0 + LEAST } else { ior }
}

fn film(m: &Iridescence) -> ThinFilmParam {
    // Nothing interferes in a film of a tenth of a millimetre, and phases stay within floats.
    let thickness = |nm: f32| nm.clamp(0.0, 1e5);
    ThinFilmParam {
        factor: scalar(m.factor),
        ior: m.ior.clamp(1.0, 10.0),
        thickness: scalar(ScalarInput { factor: 1.0, texture: m.thickness }),
        thinnest: thickness(m.thickness_minimum),
        thickest: thickness(m.thickness_maximum),
    }
}

/// A surface that transmits the same part of each colour without refraction, as `d` in an OBJ's library means it: that
/// part of the surface is absent. (Otherwise the path transport takes materials with an index of refraction for glass,
/// which has no `diffuse`.)
pub(super) fn from_dissolve(m: &BlinnPhong) -> Option<MaterialRecord> {
    m.is_dissolved().then(|| {
        // The part that is present reflects and emits all of the light.
        let there = 1.0 - m.kt.r;
        let whole =
            |color: ColorParam| ColorParam { factor: color.factor.map(|c| (c / there).min(1.0)), ..color };
        let record =
            from_blinn_phong(&BlinnPhong { ior: None, kr: ColorInput::Constant(Rgb::BLACK), ..m.clone() });
        MaterialRecord {
            base_color: whole(record.base_color),
            specular_color: whole(record.specular_color),
            emission: ColorParam { factor: record.emission.factor.map(|c| c / there), ..record.emission },
            alpha: ScalarParam::constant(there),
            coverage: Coverage::Blend,
            ..record
        }
    })
}

/// The classic model with its energy bounded: a Lambertian lobe of albedo kd; the highlight as a GGX lobe of the same
/// width (α² = 2/(s + 2), Walter and others 2007) and constant reflectance ks; the mirror image as a smooth lobe of
/// reflectance kr. Materials with an ior are smooth glass.
pub(super) fn from_blinn_phong(m: &BlinnPhong) -> MaterialRecord {
    let none = ScalarParam::constant(0.0);
    let one = ScalarParam::constant(1.0);
    let is_black = |input: ColorInput| matches!(input, ColorInput::Constant(c) if c.is_black());
    let width = (2.0 / (m.shininess as f64 + 2.0)).sqrt().sqrt() as f32;
    let mirror = !is_black(m.kr);
    let emits = !is_black(m.specular);
    let glass = m.ior.is_some();
    // One of the two is the base's own reflection; with a mirror the highlight lies above it. Glass shows lights by its
    // own reflection.
    let (reflection, roughness) = if mirror || glass { (m.kr, 0.0) } else { (m.specular, width) };
    let layer = match m.specular {
        ColorInput::Constant(c) if mirror && emits && !glass => c,
        _ => Rgb::BLACK,
    };
    let white = ColorParam::constant([1.0; 3]);
    MaterialRecord {
        base_color: if glass { ColorParam::constant(m.kt.to_array()) } else { color(m.diffuse) },
        alpha: scalar(m.alpha),
        coverage: coverage(m.alpha_mode),
        hides_back: false,
        metallic: none,
        edge_tint: [1.0; 3],
        roughness: ScalarParam::constant(roughness),
        normal: None,
        bump: None,
        emission: color(m.emission),
        one_sided_emission: false,
        group: NONE,
        unlit: false,
        shadow_catcher: false,
        caustics: m.caustics,
        ior: m.ior.unwrap_or(1.5),
        specular: if mirror || emits || glass { one } else { none },
        specular_color: if glass { white } else { color(reflection) },
        f0: if glass { reflectance(m.ior.unwrap_or(1.5)) } else { 1.0 },
        constant_fresnel: !glass,
        transmission: if glass { one } else { none },
        thin: false,
        dispersion: 0.0,
        passes_shadow_rays: false,
        encloses: m.ior.is_some(),
        body: 0,
        beside: 0,
        hidden: false,
        priority: m.priority,
        medium: Medium::CLEAR,
        sheet_depth: [0.0; 3],
        diffuse_transmission: none,
        diffuse_transmission_color: white,
        coat: if layer.is_black() { none } else { one },
        coat_roughness: ScalarParam::constant(width),
        coat_normal: None,
        coat_f0: layer.to_array(),
        coat_f90: layer.to_array(),
        sheen_color: ColorParam::constant([0.0; 3]),
        sheen_roughness: none,
        anisotropy: 0.0,
        anisotropy_direction: [1.0, 0.0],
        anisotropy_texture: NONE,
        film: None,
        classic: WhittedParams {
            diffuse: color(m.diffuse),
            specular: color(m.specular),
            shininess: m.shininess,
            phong: m.highlight == Highlight::Phong,
            kr: color(m.kr),
            kt: m.kt.to_array(),
            ior: m.ior.unwrap_or(0.0),
        },
        textured: false,
        vertices_are_factors: true,
    }
}
