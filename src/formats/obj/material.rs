//! Conversion of MTL materials.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::error::{Diagnostic, LoadError};
use crate::math::Rgb;
use crate::world::{Assets, BlinnPhong, ColorInput, ImageId, Material, MaterialId};

use super::library::Library;
use super::refer;
use super::texture::Map;

/// Adds materials to the asset store on first use, and each image once.
pub struct Materials<'a> {
    library: &'a Library,
    assets: &'a mut Assets,
    warnings: &'a mut Vec<Diagnostic>,
    images: &'a mut dyn FnMut(&Path) -> Result<ImageId, LoadError>,
    ids: HashMap<usize, MaterialId>,
    loaded: HashMap<PathBuf, Option<ImageId>>,
}

impl<'a> Materials<'a> {
    /// Creates a converter that has loaded nothing yet.
    pub fn new(
        library: &'a Library,
        assets: &'a mut Assets,
        warnings: &'a mut Vec<Diagnostic>,
        images: &'a mut dyn FnMut(&Path) -> Result<ImageId, LoadError>,
    ) -> Self {
        Self { library, assets, warnings, images, ids: HashMap::new(), loaded: HashMap::new() }
    }

    /// Returns the asset id of a material of the library.
    pub fn id_of(&mut self, number: Option<usize>) -> MaterialId {
        let library = self.library;
        let Some((number, source, file)) = number
            .and_then(|number| Some((number, library.materials.get(number)?, library.files.get(number)?)))
        else {
            return MaterialId::DEFAULT;
        };
        if let Some(&id) = self.ids.get(&number) {
            return id;
        }
        let material = self.lower(source, file);
        let id = self.assets.add_material(Some(source.name.clone()), Material::BlinnPhong(material));
        self.ids.insert(number, id);
        id
    }

    /// `d` (or 1 − `Tr`) is the opacity. The rest of the light, or all of it for glass models (illum 4, 6, 7 and 9)
    /// with an opacity of 1, is transmitted, tinted by `Tf`. Glass refracts with the index `Ni`, or 1.5 if that is not
    /// above 1; other transparent surfaces do not refract (1.0). The mirror models (3, 5 and 8) reflect by `Ks`; models
    /// 0 and 1 have no highlights. A `Kd` of zero with a `map_Kd` counts as one: exporters write that.
    fn lower(&mut self, source: &tobj::Material, file: &Path) -> BlinnPhong {
        self.warn_of_ignored(source, file);
        let illum = source.illumination_model.unwrap_or(2);
        let is_glass = matches!(illum, 4 | 6 | 7 | 9);
        let unknown = |key: &str| source.unknown_param.get(key).map(String::as_str);
        let opacity = source.dissolve.or_else(|| Some(1.0 - unknown("Tr")?.parse::<f32>().ok()?));
        let opacity = opacity.unwrap_or(1.0).clamp(0.0, 1.0);
        let through = if opacity < 1.0 {
            1.0 - opacity
        } else if is_glass {
            1.0
        } else {
            0.0
        };
        let defaults = BlinnPhong::default();
        let diffuse = self.input(source.diffuse, source.diffuse_texture.as_deref(), file, 1.0 - through);
        let specular = self.input(source.specular, source.specular_texture.as_deref(), file, 1.0);
        let kr = match illum {
            3 | 5 | 8 => specular.unwrap_or_default(),
            4 | 6 | 7 => ColorInput::Constant(Rgb::WHITE),
            _ => ColorInput::default(),
        };
        let tint = unknown("Tf").and_then(three).unwrap_or(Rgb::WHITE);
        // Exporters write an index for every surface, so only glass uses it.
        let bend =
            if is_glass { source.optical_density.filter(|ior| *ior > 1.0).unwrap_or(1.5) } else { 1.0 };
        let dull = ColorInput::Constant(Rgb::splat(0.8 * (1.0 - through)));
        BlinnPhong {
            diffuse: diffuse.unwrap_or(dull),
            specular: specular.filter(|_| illum >= 2).unwrap_or_default(),
            shininess: source.shininess.map_or(defaults.shininess, |exponent| exponent.max(0.0)),
            kr,
            kt: if through > 0.0 { tint * through } else { defaults.kt },
            ior: (through > 0.0).then_some(bend),
            emission: self.input(source.emissive, unknown("map_Ke"), file, 1.0).unwrap_or_default(),
            ..defaults
        }
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
            && let Some(image) = self.image(&refer(file, map.file))
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
        let image = (self.images)(path)
            .map_err(|error| self.warnings.push(Diagnostic::warning("image-left-out", error.to_string())))
            .ok();
        self.loaded.insert(path.to_owned(), image);
        image
    }

    fn warn_of_ignored(&mut self, source: &tobj::Material, file: &Path) {
        let known = [
            ("map_d", source.dissolve_texture.is_some()),
            ("map_Ns", source.shininess_texture.is_some()),
            ("map_Bump", source.normal_texture.is_some()),
        ];
        let mut ignored: Vec<&str> =
            known.iter().filter(|(_, present)| *present).map(|(key, _)| *key).collect();
        let others = ["norm", "disp", "decal", "refl", "map_Kn", "map_Pr", "map_Pm"];
        ignored.extend(others.iter().filter(|key| source.unknown_param.contains_key(**key)));
        if !ignored.is_empty() {
            let (name, ignored) = (&source.name, ignored.join(", "));
            let what = format!("material {name:?}: not supported and ignored: {ignored}");
            self.warnings.push(Diagnostic::in_file("import", file, &what));
        }
    }
}

/// Parses three finite numbers.
fn three(text: &str) -> Option<Rgb> {
    let mut numbers = text.split_whitespace().map(|word| word.parse().ok().filter(|n: &f32| n.is_finite()));
    Some(Rgb::new(numbers.next()??, numbers.next()??, numbers.next()??))
}
