//! Conversion of MTL materials.

use std::collections::{BTreeMap, HashMap};
use std::f32::consts::TAU;
use std::path::{Path, PathBuf};

use super::library::{Library, is_known};
use super::texture::Map;
use super::{ImageReader, first_of};
use crate::error::{Diagnostic, words};
use crate::formats::references::resolve;
use crate::math::Rgb;
use crate::world::{
    AlphaMode, Anisotropy, Assets, BlinnPhong, Channel, ColorInput, Image, ImageId, Material, MaterialId,
    NormalMap, Principled, ScalarInput, Texels, Texture, TextureId, Volume,
};

/// The keywords of the extension for physically based materials, which make a material one of these.
const PHYSICAL: [&str; 6] = ["Pr", "Pm", "map_Pr", "map_Pm", "map_Ps", "map_Pc"];
/// The keywords of the extension that do so if their number is above 0.
const PHYSICAL_ABOVE_0: [&str; 2] = ["Pc", "Ps"];

/// Keywords that no material uses.
const UNUSED: [&str; 10] =
    ["map_Ns", "map_Bump", "bump", "norm", "map_Kn", "disp", "decal", "refl", "map_Ps", "map_Pc"];

/// The roughness of a sheen's fibres, for which MTL has no number.
const SHEEN_ROUGHNESS: f32 = 0.5;

/// Adds materials to the asset store on first use, and each image once.
pub struct Materials<'a> {
    library: &'a Library,
    assets: &'a mut Assets,
    warnings: &'a mut Vec<Diagnostic>,
    images: ImageReader<'a>,
    ids: HashMap<usize, MaterialId>,
    loaded: HashMap<PathBuf, Option<ImageId>>,
    /// The lines of each library that are not used, with their keywords and materials.
    unused: BTreeMap<PathBuf, Vec<(usize, String)>>,
}

/// A material while it is converted.
struct MtlMaterial<'a> {
    source: &'a tobj::Material,
    file: &'a Path,
    lines: &'a HashMap<String, usize>,
}

impl<'a> MtlMaterial<'a> {
    /// The text after a keyword that tobj does not know.
    fn text(&self, keyword: &str) -> Option<&'a str> {
        self.source.unknown_param.get(keyword).map(String::as_str)
    }

    fn number(&self, keyword: &str) -> Option<f32> {
        self.text(keyword)?.parse().ok()
    }

    fn has(&self, keyword: &str) -> bool {
        self.lines.contains_key(keyword)
    }

    fn is_physical(&self) -> bool {
        let above_0 = |keyword: &&str| self.number(keyword).is_some_and(|number| number > 0.0);
        PHYSICAL.iter().any(|keyword| self.has(keyword)) || PHYSICAL_ABOVE_0.iter().any(above_0)
    }

    /// True for the models of glass. Blender writes model 9 for surfaces that are partly there.
    fn is_glass(&self) -> bool {
        match self.source.illumination_model {
            Some(4 | 6 | 7) => true,
            Some(9) => self.opacity().0 == 1.0,
            _ => false,
        }
    }

    /// The opacity and the line that gives it: `d`, or 1 − `Tr`.
    fn opacity(&self) -> (f32, &'static str) {
        match (self.source.dissolve, self.number("Tr")) {
            (Some(opacity), _) => (opacity, "d"),
            (None, Some(transparency)) => (1.0 - transparency, "Tr"),
            (None, None) => (1.0, "d"),
        }
    }
}

/// Parts of a surface that are absent.
struct CutOut {
    alpha: ScalarInput,
    alpha_mode: AlphaMode,
}

impl<'a> Materials<'a> {
    /// Creates a converter that has loaded nothing yet.
    pub fn new(
        library: &'a Library,
        assets: &'a mut Assets,
        warnings: &'a mut Vec<Diagnostic>,
        images: ImageReader<'a>,
    ) -> Self {
        let (ids, loaded, unused) = (HashMap::new(), HashMap::new(), BTreeMap::new());
        Self { library, assets, warnings, images, ids, loaded, unused }
    }

    /// Returns the asset id of a material of the library.
    pub fn id_of(&mut self, number: Option<usize>) -> MaterialId {
        let library = self.library;
        let found = number.and_then(|number| {
            let (source, file) = (library.materials.get(number)?, library.files.get(number)?);
            Some((number, MtlMaterial { source, file, lines: library.lines.get(number)? }))
        });
        let Some((number, source)) = found else { return MaterialId::DEFAULT };
        if let Some(&id) = self.ids.get(&number) {
            return id;
        }
        let material = if source.is_physical() || self.normal_map(&source).is_some() {
            Material::Principled(Box::new(self.physical(&source)))
        } else {
            Material::BlinnPhong(self.classic(&source))
        };
        let id = self.assets.add_material(Some(source.source.name.clone()), material);
        self.ids.insert(number, id);
        id
    }

    /// Reports the lines that materials in use do not use, once for each library.
    pub fn tell_unused(self) {
        for (file, mut lines) in self.unused.into_iter().filter(|(_, lines)| !lines.is_empty()) {
            lines.sort_unstable();
            lines.dedup();
            let parts: Vec<String> =
                lines.iter().map(|(line, what)| format!("{what} (line {line})")).collect();
            let what = format!("not supported and ignored: {}", first_of(&parts));
            self.warnings.push(Diagnostic::at_line("import", &file, lines[0].0, what));
        }
    }

    /// `d` (or 1 − `Tr`) is the opacity. The rest of the light, or all of it for glass models (illum 4, 6, 7 and 9)
    /// with an opacity of 1, is transmitted, tinted by `Tf`. Glass refracts with the index `Ni`, or 1.5 if that is not
    /// above 1; other transparent surfaces do not refract (1.0). The mirror models (3, 5 and 8) reflect by `Ks`; models
    /// 0 and 1 have no highlights. A `Kd` of zero with a `map_Kd` counts as one: exporters write that. Where `map_d` or
    /// the alpha of `map_Kd` is below 1, that part of the surface is absent.
    fn classic(&mut self, of: &MtlMaterial) -> BlinnPhong {
        self.note_unused(of, &UNUSED);
        let source = of.source;
        let illum = source.illumination_model.unwrap_or(2);
        let is_glass = of.is_glass();
        let cut_out = self.cut_out(of, is_glass);
        let (opacity, _) = of.opacity();
        let through = if cut_out.is_some() {
            0.0
        } else if opacity < 1.0 {
            1.0 - opacity
        } else if is_glass {
            1.0
        } else {
            0.0
        };
        let defaults = BlinnPhong::default();
        let diffuse = self.input(source.diffuse, source.diffuse_texture.as_deref(), of.file, 1.0 - through);
        let specular = self.input(source.specular, source.specular_texture.as_deref(), of.file, 1.0);
        let kr = match illum {
            3 | 5 | 8 => specular.unwrap_or_default(),
            4 | 6 | 7 if cut_out.is_none() => ColorInput::Constant(Rgb::WHITE),
            _ => ColorInput::default(),
        };
        // Exporters write an index for every surface, so only glass uses it.
        let bend =
            if is_glass { source.optical_density.filter(|ior| *ior > 1.0).unwrap_or(1.5) } else { 1.0 };
        let dull = ColorInput::Constant(Rgb::splat(0.8 * (1.0 - through)));
        let CutOut { alpha, alpha_mode } =
            cut_out.unwrap_or(CutOut { alpha: defaults.alpha, alpha_mode: defaults.alpha_mode });
        BlinnPhong {
            diffuse: diffuse.unwrap_or(dull),
            specular: specular.filter(|_| illum >= 2).unwrap_or_default(),
            shininess: source.shininess.unwrap_or(defaults.shininess),
            kr,
            kt: if through > 0.0 { tint(of) * through } else { defaults.kt },
            ior: (through > 0.0).then_some(bend),
            emission: self.emission(of),
            alpha,
            alpha_mode,
            ..defaults
        }
    }

    /// The extension for physically based materials: `Pr` is the roughness (by `Ns` if there is none), `Pm` the
    /// metalness, `Pc` and `Pcr` a clear coat and its roughness, `Ps` a sheen, `aniso` and `anisor` an anisotropy and
    /// its angle in turns, `norm` a map of normals, as is a `map_Bump` with normals in it, which alone makes a material one
    /// of these. A map replaces its number.
    fn physical(&mut self, of: &MtlMaterial) -> Principled {
        let source = of.source;
        let (used, normal) = self.normal_map(of).unzip();
        let used = used.unwrap_or_default();
        let unused: Vec<&str> = UNUSED.into_iter().filter(|key| *key != used).collect();
        self.note_unused(of, &unused);
        let is_glass = of.is_glass();
        let (opacity, _) = of.opacity();
        let covered = CutOut { alpha: ScalarInput::constant(opacity), alpha_mode: AlphaMode::Blend };
        let cut_out = self.cut_out(of, is_glass).or((opacity < 1.0 && !is_glass).then_some(covered));
        let is_glass = is_glass && cut_out.is_none();
        let defaults = Principled::default();
        let color = self.input(source.diffuse, source.diffuse_texture.as_deref(), of.file, 1.0);
        let width = 2.0 / (source.shininess.unwrap_or(BlinnPhong::default().shininess) + 2.0);
        let CutOut { alpha, alpha_mode } =
            cut_out.unwrap_or(CutOut { alpha: defaults.alpha, alpha_mode: defaults.alpha_mode });
        let constant = |key: &str| ScalarInput::constant(of.number(key).unwrap_or(0.0));
        let sheen = constant("Ps").factor;
        Principled {
            base_color: if is_glass {
                ColorInput::Constant(tint(of))
            } else {
                color.unwrap_or(ColorInput::Constant(Rgb::splat(0.8)))
            },
            alpha,
            alpha_mode,
            metallic: self.scalar(of, "Pm", "map_Pm", 0.0),
            roughness: self.scalar(of, "Pr", "map_Pr", width.sqrt().sqrt()),
            normal,
            emission: self.emission(of),
            double_sided: true,
            ior: source.optical_density.filter(|ior| *ior > 1.0).unwrap_or(1.5),
            transmission: ScalarInput::constant(if is_glass { 1.0 } else { 0.0 }),
            volume: is_glass.then(Volume::default),
            clearcoat: constant("Pc"),
            clearcoat_roughness: constant("Pcr"),
            sheen_color: ColorInput::Constant(Rgb::splat(sheen)),
            sheen_roughness: ScalarInput::constant(if sheen > 0.0 { SHEEN_ROUGHNESS } else { 0.0 }),
            anisotropy: Anisotropy {
                strength: constant("aniso").factor,
                rotation: constant("anisor").factor * TAU,
                ..Anisotropy::default()
            },
            ..defaults
        }
    }

    fn emission(&mut self, of: &MtlMaterial) -> ColorInput {
        self.input(of.source.emissive, of.text("map_Ke"), of.file, 1.0).unwrap_or_default()
    }

    /// The absent parts of a surface: by `map_d`, else by the alpha of `map_Kd` if that is below 1 anywhere. A `d` of
    /// zero beside a map counts as one; on its own, it leaves nothing of the surface.
    fn cut_out(&mut self, of: &MtlMaterial, is_glass: bool) -> Option<CutOut> {
        let source = of.source;
        let (opacity, keyword) = of.opacity();
        let given = source.dissolve_texture.as_deref().or_else(|| of.text("map_Tr"));
        let of_color = source.diffuse_texture.as_deref();
        let map = self.alpha_map(of.file, given, false).or_else(|| self.alpha_map(of.file, of_color, true));
        if map.is_none() && (opacity > 0.0 || is_glass) {
            return None;
        }
        if map.is_none() {
            let (line, name) = (of.lines.get(keyword).copied().unwrap_or(1), words(&source.name));
            let value = if keyword == "d" { 0 } else { 1 };
            let what = format!("material \"{name}\" has {keyword} {value}: nothing of it is there");
            self.warnings.push(Diagnostic::at_line("import", of.file, line, what));
        }
        let factor = if map.is_some() && opacity == 0.0 { 1.0 } else { opacity };
        Some(CutOut { alpha: ScalarInput { factor, texture: map }, alpha_mode: AlphaMode::Blend })
    }

    /// The texture and channel of a map of opacity. Of an image with transparent parts it is the alpha, else the first
    /// channel; the map of a colour only counts if it has transparent parts.
    fn alpha_map(&mut self, file: &Path, text: Option<&str>, is_color: bool) -> Option<(TextureId, Channel)> {
        let map = Map::parse(text?)?;
        let image = self.image(&resolve(file, map.file))?;
        let has_alpha = has_alpha(&self.assets.images[image.0 as usize]);
        let channel = match map.channel.filter(|_| !is_color) {
            Some(channel) => channel,
            None if has_alpha => Channel::Alpha,
            None if is_color => return None,
            None => Channel::Red,
        };
        Some((self.assets.add_texture(map.numbers(image)), channel))
    }

    /// The map of normals of a material, and its keyword. Most programs name one by `map_Bump`, which is for heights: the
    /// blue of normals tells.
    fn normal_map(&mut self, of: &MtlMaterial) -> Option<(&'static str, NormalMap)> {
        if let Some(text) = of.text("norm") {
            return Some(("norm", self.normals(of.file, text, true)?));
        }
        let key = if of.has("map_Bump") { "map_Bump" } else { "bump" };
        Some((key, self.normals(of.file, of.source.normal_texture.as_deref()?, false)?))
    }

    fn normals(&mut self, file: &Path, text: &str, is_sure: bool) -> Option<NormalMap> {
        let map = Map::parse(text)?;
        let image = self.image(&resolve(file, map.file))?;
        let is_normals = is_sure || holds_normals(&self.assets.images[image.0 as usize]);
        is_normals
            .then(|| NormalMap { texture: self.assets.add_texture(map.numbers(image)), scale: map.strength })
    }

    /// A number, or a map in its place.
    fn scalar(&mut self, of: &MtlMaterial, keyword: &str, map: &str, usual: f32) -> ScalarInput {
        if let Some(map) = of.text(map).and_then(Map::parse)
            && let Some(image) = self.image(&resolve(of.file, map.file))
        {
            let texture: Texture = map.numbers(image);
            let channel = map.channel.unwrap_or(Channel::Red);
            return ScalarInput { factor: 1.0, texture: Some((self.assets.add_texture(texture), channel)) };
        }
        ScalarInput::constant(of.number(keyword).unwrap_or(usual))
    }

    /// A colour times a texture; none if there is neither.
    fn input(
        &mut self,
        color: Option<[f32; 3]>,
        map: Option<&str>,
        file: &Path,
        factor: f32,
    ) -> Option<ColorInput> {
        let color = color.map(Rgb::from);
        if let Some(map) = map.and_then(Map::parse)
            && let Some(image) = self.image(&resolve(file, map.file))
        {
            let color = color.filter(|color| !color.is_black()).unwrap_or(Rgb::WHITE);
            return Some(ColorInput::Texture(self.assets.add_texture(map.texture(image, color * factor))));
        }
        color.map(|color| ColorInput::Constant(color * factor))
    }

    fn image(&mut self, path: &Path) -> Option<ImageId> {
        if let Some(loaded) = self.loaded.get(path) {
            return *loaded;
        }
        let image = match (self.images)(path) {
            Ok(image) => Some(self.assets.add_image(image.report(self.warnings))),
            Err(error) => {
                self.warnings.push(Diagnostic::warning("image-left-out", error.to_string()));
                None
            }
        };
        self.loaded.insert(path.to_owned(), image);
        image
    }

    /// Notes the lines of some keywords, and of those that MTL does not have.
    fn note_unused(&mut self, of: &MtlMaterial, keywords: &[&str]) {
        let unused = of.lines.iter().filter(|(word, _)| keywords.contains(&word.as_str()) || !is_known(word));
        let unused = unused.map(|(word, line)| (*line, words(word)));
        self.unused.entry(of.file.to_owned()).or_default().extend(unused);
    }
}

/// The tint of light that goes through.
fn tint(of: &MtlMaterial) -> Rgb {
    of.text("Tf").and_then(three).unwrap_or(Rgb::WHITE)
}

fn has_alpha(image: &Image) -> bool {
    match &image.texels {
        Texels::Rgba8(texels) => texels.iter().any(|texel| texel[3] < u8::MAX),
        Texels::Rgba16(texels) => texels.iter().any(|texel| texel[3] < u16::MAX),
        Texels::Rgb32(_) => false,
    }
}

/// True if an image's mean colour is that of normals that mostly point up.
fn holds_normals(image: &Image) -> bool {
    let count = image.texels.count();
    let sums = (0..count).map(|at| image.texels.stored(at)).fold([0.0; 4], |sums: [f64; 4], texel| {
        std::array::from_fn(|channel| sums[channel] + texel[channel])
    });
    let [r, g, b, _] = sums.map(|sum| sum / count.max(1) as f64);
    let is_middle = |c: f64| (0.35..=0.65).contains(&c);
    is_middle(r) && is_middle(g) && b > 0.7
}

/// Parses three finite numbers.
fn three(text: &str) -> Option<Rgb> {
    let mut numbers = text.split_whitespace().map(|word| word.parse().ok().filter(|n: &f32| n.is_finite()));
    Some(Rgb::new(numbers.next()??, numbers.next()??, numbers.next()??))
}
