//! The words of other programs (POV-Ray, pbrt, Mitsuba, Blender, three.js, F3D) and what to type here. Parts in backticks
//! are typed as they are; tests read each of them.

use std::borrow::Cow;

use super::colors;

/// Advice on a word of a scene file.
struct SceneWord {
    /// The words that have it.
    theirs: &'static [&'static str],
    /// A name that must be known in that place for the advice to apply.
    among: &'static str,
    advice: &'static str,
}

const fn word(theirs: &'static [&'static str], among: &'static str, advice: &'static str) -> SceneWord {
    SceneWord { theirs, among, advice }
}

const MESH: &str = "that is a Mesh: from a .ply, .obj, .stl or .glb file";
const GLASS: &str = "`Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5, volume: ())`";
const SCATTERING: &str = "of light after attenuation_distance_m, attenuation_color is left; how much of the rest is \
                          scattered, multiscatter_color says";
const COLOR: &str = "`base_color: (0.8, 0.2, 0.2)`";
const TURNED: &str = "`transform: (rotate_degrees: (0, 90, 0))`";
const LOOK: &str = "`transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))`";
const PLACED: &str = "`transform: (translate: (0, 1, 0))`";
const FOV: &str = "`vertical_fov_degrees: 45`";

const SCENE_WORDS: [SceneWord; 77] = [
    // Shapes.
    word(&["box", "Cube", "cube", "RoundedBox", "superellipsoid"], "Sphere", "`Box(size_m: (2, 1, 3))`"),
    word(&["Disk", "disk", "Ring", "Circle"], "Sphere", "`Disc(radius_m: 1)`"),
    word(&["sor", "surface_of_revolution", "Revolve"], "Sphere", "`Lathe(profile: [(0, 1), (1, 0)])`"),
    word(
        &["Extrude", "linear_extrude", "ExtrudeGeometry", "polygon", "Polygon"],
        "Sphere",
        "`Prism(outline: [(0, 0), (2, 0), (0, 1)])`",
    ),
    word(
        &["sphere_sweep", "curve", "Curve", "BezierCurve", "Spline", "TubeGeometry"],
        "Sphere",
        "`Tube(points: [(0, 0, 0), (1, 1, 0), (2, 0, 0)])`",
    ),
    word(&["Terrain", "Heightmap"], "Sphere", "`HeightField(image: \"file.png\")`"),
    word(&["blob", "Metaball", "isosurface"], "Sphere", MESH),
    word(
        &[
            "PlyMesh", "plymesh", "ObjMesh", "trianglemesh", "TriangleMesh", "Ply", "ply", "Obj", "obj",
            "mesh2",
        ],
        "Sphere",
        "`Mesh(\"mesh.ply\")`, or .obj",
    ),
    word(
        &["Rectangle", "rectangle", "Quad", "Square", "square"],
        "Sphere",
        "`Plane(corners: ((-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)))`",
    ),
    // Textures.
    word(
        &["Checker", "checker", "Checkerboard", "checkerboard", "Noise", "Voronoi"],
        "Image",
        "textures are pictures: `Image(\"file.png\")`",
    ),
    word(&["ImageTexture", "imagemap", "image_map", "Bitmap", "bitmap"], "Image", "`Image(\"file.png\")`"),
    // Materials.
    word(&["Dielectric", "dielectric", "Glass", "glass", "GlassBSDF", "ThinDielectric"], "Principled", GLASS),
    word(
        &[
            "Diffuse", "diffuse", "Matte", "matte", "Lambert", "Lambertian", "lambertian",
            "MeshLambertMaterial",
        ],
        "Principled",
        "`(diffuse: (0.5, 0.5, 0.5))`, or `Principled(metallic: 0, base_color: 0.5)`",
    ),
    word(
        &["metal", "Conductor", "conductor", "RoughConductor"],
        "Principled",
        "`Metal(\"gold\")`, or `Metal(name: \"gold\", roughness: 0.2)`",
    ),
    word(&["Mirror", "mirror"], "Principled", "`Principled(metallic: 1, roughness: 0)`"),
    word(
        &["Plastic", "plastic", "RoughPlastic", "CoatedDiffuse"],
        "Principled",
        "`Principled(metallic: 0, roughness: 0.3, base_color: (0.8, 0.2, 0.2))`",
    ),
    word(
        &["Emission", "emissive", "Emissive", "EmissionBSDF"],
        "Principled",
        "`Principled(base_color: 0, emission: 10)`",
    ),
    word(
        &[
            "PrincipledBSDF", "Standard", "MeshStandardMaterial", "MeshPhysicalMaterial", "Disney", "disney",
            "Pbr",
        ],
        "Principled",
        "`Principled(metallic: 0, base_color: 0.8)`",
    ),
    word(
        &["Phong", "phong", "MeshPhongMaterial", "Blinn"],
        "BlinnPhong",
        "`BlinnPhong(diffuse: 0.5, specular: 0.5, shininess: 50)`",
    ),
    word(
        &["diffuse", "diffuse_color", "baseColor", "baseColorFactor", "base", "Kd", "kd", "pigment", "rgb"],
        "base_color",
        COLOR,
    ),
    word(
        &["emissive", "emissiveFactor", "emission_color", "emission_strength", "Le"],
        "emission",
        "`emission: (10, 8, 6)`",
    ),
    word(&["metalness", "metallicFactor"], "metallic", "`metallic: 1`"),
    word(
        &["roughnessFactor", "uroughness", "glossiness", "smoothness"],
        "roughness",
        "`roughness: 0.5`: 0 is a mirror",
    ),
    word(&["subsurface", "subsurface_weight"], "base_color", "a volume with a multiscatter_color"),
    word(&["thin"], "base_color", "glass is thin if it has no volume"),
    word(&["scattering", "sigma_a", "sigma_s", "sigma_t"], "attenuation_color", SCATTERING),
    // Lights.
    word(
        &["AreaLight", "area", "RectAreaLight", "rect_light", "RectLight", "Quad"],
        "Area",
        "`Area(size_m: (1, 1), power_w: 100)`",
    ),
    word(&["PointLight", "point", "light_source", "OmniLight"], "Point", "`Point(power_w: 100)`"),
    word(
        &["SpotLight", "spot", "spotlight"],
        "Spot",
        "`Spot(power_w: 100, inner_degrees: 25, outer_degrees: 30)`",
    ),
    word(
        &["Sun", "sun", "SunLight", "DirectionalLight", "distant", "Distant", "parallel"],
        "Directional",
        "`Directional(irradiance: 3, angle_degrees: 0.53)`, or `Sky()`",
    ),
    word(
        &[
            "EnvironmentLight", "envmap", "EnvMap", "infinite", "Infinite", "HDRI", "Hdri", "Dome",
            "DomeLight", "constant", "World", "HemisphereLight",
        ],
        "Environment",
        "`Environment(image: \"sky.hdr\")`, or `Environment(radiance: 1)`",
    ),
    word(&["AmbientLight", "Ambient", "ambient"], "Environment", "`Environment(radiance: 0.2)`"),
    word(&["IES", "Ies", "goniometric"], "Photometric", "`Photometric(profile: \"lamp.ies\", power_w: 100)`"),
    word(
        &["penumbra", "cone_angle", "beam_angle", "spot_size", "spot_blend"],
        "inner_degrees",
        "`inner_degrees: 25, outer_degrees: 30`: from the axis to the side",
    ),
    word(&["candela", "cd"], "power_w", "`power_w: Candela(100)`"),
    word(&["lumens", "lumen", "lm"], "power_w", "`power_w: Lumens(800)`"),
    word(&["lux", "illuminance"], "irradiance", "`irradiance: Lux(100000)`"),
    word(&["nits", "luminance"], "emission", "`emission: Nits(500)`"),
    word(
        &["temperature", "color_temperature", "kelvin", "blackbody"],
        "power_w",
        "`power_w: Kelvin(3000, 100)`",
    ),
    word(&["strength", "energy"], "power_w", "`power_w: 100`, in watts"),
    word(&["visible"], "falloff", "only Area lights can be seen"),
    word(&["direction"], "angle_degrees", "its transform says where it shines to: LookAt(from: …, to: …)"),
    // Cameras.
    word(
        &["Perspective", "perspective", "PerspectiveCamera", "thinlens"],
        "Pinhole",
        "`Pinhole(vertical_fov_degrees: 45)`",
    ),
    word(
        &[
            "Spherical", "spherical", "Environment", "Equirectangular", "equirectangular", "Panoramic",
            "panoramic", "Latlong",
        ],
        "Pinhole",
        "`Panorama()`",
    ),
    word(&["FisheyeCamera", "fisheye", "Omnimax", "DomeMaster"], "Pinhole", "`Fisheye(fov_degrees: 180)`"),
    word(
        &["Realistic", "realistic", "Physical", "PhysicalCamera"],
        "Pinhole",
        "`Photographic(focal_length_mm: 50)`",
    ),
    word(
        &["OpenCV", "opencv", "Calibrated", "PinholeK"],
        "Pinhole",
        "`Intrinsics(fx: 500, fy: 500, cx: 320, cy: 240, size: (640, 480))`",
    ),
    word(
        &[
            "focal_length", "focal_length_mm", "focallength", "focalLength", "lens", "fstop", "f_stop",
            "f_number", "sensor_width",
        ],
        "vertical_fov_degrees",
        "`camera: Photographic(focal_length_mm: 50, f_stop: 2.8, focus_distance_m: 3)`",
    ),
    word(
        &["lens_shift", "shift_x", "shift_y"],
        "vertical_fov_degrees",
        "`camera: Photographic(shift: (0, 0.2))`",
    ),
    word(&["Ortho", "ortho", "OrthographicCamera"], "Orthographic", "`Orthographic(height_m: 2)`"),
    word(&["fov", "angle", "fovy", "yfov", "fov_degrees"], "vertical_fov_degrees", FOV),
    // Entities.
    word(&["position", "location", "origin", "translate", "translation"], "transform", PLACED),
    word(&["rotation", "rotate", "rotation_euler", "rotate_degrees", "quaternion"], "transform", TURNED),
    word(&["scale"], "transform", "`transform: (scale: 2)`"),
    word(&["look_at", "lookat", "LookAt", "target", "to_world", "toWorld"], "transform", LOOK),
    word(&["matrix"], "transform", "`transform: Matrix(((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)))`"),
    word(
        &["color", "colour", "base_color", "diffuse", "texture", "pigment", "bsdf", "albedo"],
        "overrides",
        "`material: Principled(base_color: (0.8, 0.2, 0.2))`",
    ),
    word(&["mesh", "geometry", "ply", "obj", "file"], "overrides", "`shape: Mesh(\"mesh.ply\")`, or .obj"),
    word(&["model", "glb"], "overrides", "`gltf: \"model.glb\"`"),
    word(
        &["emission", "emitter", "emissive"],
        "overrides",
        "`material: Principled(base_color: 0, emission: 10)`",
    ),
    word(
        &["type", "kind"],
        "overrides",
        "`shape: Sphere(radius_m: 1)`, `light: Point(power_w: 100)` or `camera: Pinhole(vertical_fov_degrees: 45)`",
    ),
    word(&["children"], "overrides", "the other way round: `parent: \"its name\"`"),
    // Scenes.
    word(
        &["objects", "shapes", "meshes", "nodes", "lights", "light"],
        "entities",
        "`entities: [(shape: Sphere(radius_m: 1)), (light: Point(power_w: 100))]`",
    ),
    word(
        &["camera", "cameras", "sensor"],
        "entities",
        "`entities: [(camera: Pinhole(vertical_fov_degrees: 45))]`",
    ),
    word(
        &["film", "integrator", "sampler", "render", "global_settings", "renderer"],
        "entities",
        "`settings: (samples: 64, size: (640, 480))`",
    ),
    word(&["background", "world", "sky"], "entities", "`settings: (background: (0.2, 0.3, 0.5))`"),
    // Settings.
    word(&["threads"], "max_depth", "that is said on the command line: `--threads 4`"),
    word(&["output", "filename"], "max_depth", "that is said on the command line: `-o image.png`"),
    word(
        &["crop", "region", "cropwindow"],
        "max_depth",
        "that is said on the command line: `--crop 0,0,320,240`",
    ),
    word(
        &["environment", "envmap", "hdri"],
        "max_depth",
        "it is an entity: (light: Environment(image: \"sky.hdr\"))",
    ),
    word(&["denoise"], "max_depth", "that is said on the command line: `--denoise`"),
    word(&["fov"], "max_depth", "the camera has it: vertical_fov_degrees"),
    word(&["fps"], "max_depth", "that is said on the command line: `--fps 24`"),
    word(&["shutter"], "max_depth", "that is said on the command line: `--shutter 0.5`"),
    word(&["width", "height", "xresolution", "yresolution", "image_size"], "max_depth", "`size: (640, 480)`"),
    word(&["bounces", "max_bounces", "maxdepth", "maxDepth", "recursion"], "max_depth", "`max_depth: 8`"),
    word(&["tonemapping", "toneMapping", "tone_mapping", "view_transform"], "max_depth", "`tonemap: Aces`"),
];

/// Field names of other programs, and the corresponding fields of scene files.
const FIELDS: [(&str, &[&str]); 35] = [
    ("albedo", &["base_color", "diffuse"]),
    ("aperture_radius", &["lens_radius_m"]),
    ("coat", &["clearcoat"]),
    ("coat_roughness", &["clearcoat_roughness"]),
    ("coat_weight", &["clearcoat"]),
    ("color", &["base_color", "diffuse", "power_w", "radiance", "irradiance"]),
    ("colour", &["base_color", "diffuse", "power_w", "radiance", "irradiance"]),
    ("bump_map", &["bump"]),
    ("emissive", &["emission"]),
    ("eta", &["ior"]),
    ("eye", &["from"]),
    ("file", &["image", "profile"]),
    ("filename", &["image", "profile"]),
    ("focal_distance", &["focus_distance_m"]),
    ("fov", &["vertical_fov_degrees"]),
    ("integrator", &["transport"]),
    ("intensity", &["power_w", "irradiance", "radiance"]),
    ("location", &["translate"]),
    ("metalness", &["metallic"]),
    ("normal_map", &["normal"]),
    ("opacity", &["alpha"]),
    ("origin", &["translate", "from"]),
    ("ortho_scale", &["height_m"]),
    ("position", &["translate", "from"]),
    ("power", &["power_w", "irradiance", "radiance"]),
    ("quaternion", &["rotate_quaternion"]),
    ("reflectance", &["diffuse", "base_color"]),
    ("resolution", &["size"]),
    ("samples_per_pixel", &["samples"]),
    ("scaling", &["scale"]),
    ("spec_trans", &["transmission"]),
    ("spp", &["samples"]),
    ("strength", &["irradiance", "radiance"]),
    ("target", &["to"]),
    ("transparency", &["transmission", "kt"]),
];

/// Options of other programs, without their hyphens, and what to type here.
#[cfg_attr(not(feature = "cli"), allow(dead_code, reason = "only the program has options"))]
const OPTIONS: [(&[&str], &str); 32] = [
    (&["width", "height", "w", "h", "W", "H", "xres", "yres"], "`--size 1280x720`"),
    (&["fovy", "camera-view-angle", "field-of-view"], "`--fov 40`"),
    (&["lens", "focal"], "`--focal-length 85`"),
    (&["aperture", "f-number", "fnumber"], "`--f-stop 2.8`"),
    (&["no-background", "film-transparent", "alpha", "rgba"], "`--transparent`"),
    (
        &[
            "camera-position", "eye", "look-from", "lookfrom", "camera-focal-point", "lookat",
            "camera-direction",
        ],
        "`--look-at 0,1,5 0,0,0`",
    ),
    (
        &["camera-azimuth-angle", "azimuth", "camera-elevation-angle", "elevation", "rotate", "camera-orbit"],
        "`--orbit 30,15`",
    ),
    (&["camera-zoom-factor"], "`--zoom 2`"),
    (&["camera-orthographic", "orthographic"], "`--set 'Camera.camera = Orthographic(height_m: 2)'`"),
    (&["roughness", "metallic", "color", "opacity"], "`--set 'Material.roughness = 0.3'`"),
    (
        &["light-intensity", "light-strength", "intensity", "hdri-ambient"],
        "`--env-strength 2`, or `--set 'Light.power_w *= 2'`",
    ),
    (&["hdri-rotation", "rotate-env", "env-rotation"], "`--env-turn 90`"),
    (&["no-hdri", "no-env", "background-skybox"], "`--env none`"),
    (&["grid", "floor", "ground-plane"], "`--ground`"),
    (&["shadow-catcher", "shadow", "shadow-intensity", "catcher"], "`--ground shadow`"),
    (
        &["engine", "E", "renderer", "integrator", "raytracing", "pathtracing", "use-path-tracing"],
        "`--transport path`",
    ),
    (&["raytracing-samples", "samples-per-pass", "pixelsamples"], "`--spp 64`"),
    (&["raytracing-denoise", "denoiser", "oidn"], "`--denoise`"),
    (&["animation-time", "at-time"], "`--time 1.5`"),
    (
        &["animation", "a", "render-anim", "frame-start", "frame-end", "frame-range"],
        "`--frames 1-48 -o frame.####.png`",
    ),
    (&["f", "render-frame"], "`--frames 12 -o frame.####.png`"),
    (&["F", "render-format", "format", "output-format", "type"], "the name's ending says it: `-o image.exr`"),
    (&["t", "j", "jobs", "nthreads", "num-threads", "cpus"], "`--threads 4`"),
    (&["gamma", "tone-mapping", "tonemapping", "view-transform", "colorspace"], "`--tonemap aces`"),
    (&["brightness", "exposure-value", "ev"], "`--exposure 1.5`"),
    (&["cropwindow", "crop-window", "region", "border"], "`--crop 100,50,200,150`"),
    (
        &["clip", "near", "far", "clip-start", "clip-end", "near-clip", "far-clip", "znear", "zfar"],
        "no distance is cut off: cameras see all that is before them",
    ),
    (&["time-limit", "timeout", "max-seconds", "timelimit"], "`--max-time 10m`"),
    (&["noise-threshold", "adaptive-threshold"], "`--until noise=1%`"),
    (
        &["interactive", "gui", "preview-window", "viewer"],
        "rayfront view shows the scene on a page; `--preview` shows it in the terminal",
    ),
    (
        &["verbose", "v", "debug", "stats"],
        "`--json` prints all figures; rayfront profile shows where time goes",
    ),
    (&["gpu", "device", "cuda", "optix", "hip"], "all processors are used: `--threads 4` uses fewer"),
];

/// The advice without the marks of what is typed.
fn shown(advice: &str) -> Cow<'_, str> {
    advice.replace('`', "").into()
}

/// Returns advice on a word in a place where these names are known.
pub(super) fn advice(name: &str, known: &[&str]) -> Option<Cow<'static, str>> {
    let found = SCENE_WORDS.iter().find(|word| word.theirs.contains(&name) && known.contains(&word.among));
    found.map(|word| shown(word.advice))
}

/// Returns the one of the known names that other programs call `name`.
pub(super) fn same_field<'k>(name: &str, known: &[&'k str]) -> Option<&'k str> {
    let ours = FIELDS.iter().filter(|(theirs, _)| *theirs == name).flat_map(|(_, ours)| *ours);
    ours.into_iter().find_map(|ours| known.iter().find(|known| *known == ours).copied())
}

/// Returns advice on an option of another program, with its hyphens.
#[cfg_attr(not(feature = "cli"), allow(dead_code, reason = "only the program has options"))]
pub(crate) fn option_advice(option: &str) -> Option<Cow<'static, str>> {
    let name = option.trim_start_matches('-').split('=').next().unwrap_or_default();
    let found = OPTIONS.iter().find(|(theirs, _)| theirs.contains(&name));
    found.map(|(_, advice)| shown(advice))
}

/// Returns what to write for a text that is no colour: its name in quotes, or the file of a picture.
pub(super) fn color_advice(text: &str) -> Option<String> {
    let text = text.trim_matches('"');
    if colors::named(text).is_some() {
        return Some(format!("\"{}\"", text.to_ascii_lowercase()));
    }
    let endings = ["png", "jpg", "jpeg", "tga", "bmp", "webp", "hdr", "exr"];
    let ending = text.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
    let is_picture = ending.is_some_and(|ending| endings.contains(&&ending[..]));
    is_picture.then(|| format!("Image(\"{text}\"), where a picture can stand"))
}

/// The parts of all advice that are typed on command lines.
#[cfg(test)]
pub(crate) fn typed_options() -> impl Iterator<Item = &'static str> {
    let scenes = SCENE_WORDS.iter().map(|word| word.advice);
    let typed = scenes.chain(OPTIONS.iter().map(|(_, advice)| *advice)).flat_map(typed);
    typed.filter(|part| part.starts_with('-'))
}

/// The parts of an advice in backticks.
#[cfg(test)]
fn typed(advice: &'static str) -> impl Iterator<Item = &'static str> {
    advice.split('`').skip(1).step_by(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::ron::tests::read;

    /// A scene with what is typed in the place where `among` is known.
    fn scene(among: &str, typed: &str) -> String {
        let entity = match among {
            "Sphere" => format!("shape: {typed}"),
            "Image" => format!("material: Principled(base_color: {typed})"),
            "Principled" | "BlinnPhong" => format!("material: {typed}"),
            "base_color" | "emission" | "metallic" | "roughness" => format!("material: Principled({typed})"),
            "Area" | "Point" | "Spot" | "Directional" | "Environment" | "Photometric" => {
                format!("light: {typed}")
            }
            "power_w" => format!("light: Point({typed})"),
            "inner_degrees" => format!("light: Spot(power_w: 1, {typed})"),
            "irradiance" => format!("light: Directional({typed})"),
            "Pinhole" | "Orthographic" => format!("camera: {typed}"),
            "vertical_fov_degrees" if typed.starts_with("camera") => typed.to_owned(),
            "vertical_fov_degrees" => format!("camera: Pinhole({typed})"),
            "transform" | "overrides" => typed.to_owned(),
            "entities" if typed.starts_with("entities") => return format!("({typed})"),
            "entities" => return format!("({typed}, entities: [])"),
            "max_depth" => return format!("(settings: ({typed}), entities: [])"),
            other => panic!("{other}: no place for {typed}"),
        };
        format!("(entities: [({entity}), (name: \"its name\")])")
    }

    #[test]
    fn everything_that_advice_says_to_type_is_read() {
        let (mut count, mut wrong) = (0, Vec::new());
        for word in &SCENE_WORDS {
            for part in typed(word.advice).filter(|part| !part.starts_with('-')) {
                count += 1;
                if let Err(error) = read(&scene(word.among, part)) {
                    wrong.push(format!("{:?}: {part}: {error}", word.theirs));
                }
            }
            // A word that is known needs no advice; and each word has one advice in a place.
            assert!(!word.theirs.contains(&word.among), "{}", word.among);
            assert!(word.advice.matches('`').count().is_multiple_of(2), "{}", word.advice);
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        assert!(count > 40, "{count}");
    }

    #[test]
    fn colours_get_what_to_write() {
        let advice = |text: &str| color_advice(text).unwrap_or_default();
        assert_eq!(advice("Red"), "\"red\"");
        assert_eq!(advice("\"a b.PNG\""), "Image(\"a b.PNG\"), where a picture can stand");
        assert_eq!((advice("reddish"), advice("tex.txt")), Default::default());
    }
}
