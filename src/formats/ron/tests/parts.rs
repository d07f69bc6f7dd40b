//! Tests of scenes in several files, and of variables.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::Fake;
use super::writing::assert_same;
use crate::error::{Diagnostic, LoadError, Severity};
use crate::formats::AssetFiles;
use crate::formats::ron::parse;
use crate::world::{Assets, DecodedImage, Mesh, Parent, Shape, World};

/// Scene files by their paths, and variables of the caller.
#[derive(Default)]
struct Parts {
    texts: BTreeMap<&'static str, String>,
    var: BTreeMap<String, String>,
    others: Fake,
}

impl AssetFiles for Parts {
    fn mesh(&mut self, path: &Path, a: &mut Assets, w: &mut Vec<Diagnostic>) -> Result<Arc<Mesh>, LoadError> {
        self.others.mesh(path, a, w)
    }

    fn model(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<crate::formats::gltf::GltfModel, LoadError> {
        self.others.model(path, assets, warnings)
    }

    fn image(&mut self, path: &Path) -> Result<DecodedImage, LoadError> {
        self.others.image(path)
    }

    fn read(&mut self, path: &Path) -> Result<Vec<u8>, LoadError> {
        let missing = || LoadError::invalid(path, "no such file");
        let text = path.to_str().and_then(|path| self.texts.get(path)).ok_or_else(missing)?;
        Ok(text.clone().into_bytes())
    }

    fn variables(&self) -> BTreeMap<String, String> {
        self.var.clone()
    }
}

/// Reads `text` as scenes/test.ron, beside files of other texts, with variables of the caller.
fn read_with(text: &str, texts: &[(&'static str, &str)], var: &[(&str, &str)]) -> Result<World, LoadError> {
    let texts = texts.iter().map(|(path, text)| (*path, (*text).to_owned())).collect();
    let var = var.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    parse(text, Path::new("scenes/test.ron"), &mut Parts { texts, var, ..Parts::default() })
}

fn message(text: &str, texts: &[(&'static str, &str)], var: &[(&str, &str)]) -> String {
    read_with(text, texts, var).err().map(|error| error.to_string()).unwrap_or_default()
}

fn assert_equal(found: Result<World, LoadError>, expected: &str) {
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    assert_same(&found, &read_with(expected, &[], &[]).unwrap_or_else(|error| panic!("{error}")));
}

#[test]
fn variables_stand_for_any_value() {
    let text = r##"(
        variables: {
            "height": 1.5, "paint": (0.8, $green, 0.1), "green": 0.2, "glass": (ior: $index), "index": 1.5,
            "image": "wood.png", "file": Mesh("knot.ply"), "size": (64, 32), "keys": [(0, 1), (1, $height)],
            "tone": Aces, "eye": (camera: Pinhole(vertical_fov_degrees: 40)), "where": (translate: (0, $height, 0)),
            "on": true, "who": "ball", "dark": "#102030", "nothing": None, "unused": 5,
        },
        settings: (size: $size, tonemap: $tone, ambient: $nothing, background: $dark),
        materials: {"glass": $glass, "wood": (diffuse: Image($image))},
        entities: [
            $eye,
            (name: $who, shape: Sphere(radius_m: $height), material: (diffuse: $paint), transform: $where),
            (parent: $who, shape: $file, material: "wood", transform: (scale: Keys($keys))),
            (light: Area(power_w: Some($height), size_m: 1, visible: $on), transform: LookAt(from: (0, $height , 0), to: (1, 0, 0))),
            (shape: Sphere(radius_m: /* here */ $height /* there */), material: "glass"),
        ],
    )"##;
    let expected = r##"(
        settings: (size: (64, 32), tonemap: Aces, background: "#102030"),
        materials: {"glass": (ior: 1.5), "wood": (diffuse: Image("wood.png"))},
        entities: [
            (camera: Pinhole(vertical_fov_degrees: 40)),
            (name: "ball", shape: Sphere(radius_m: 1.5), material: (diffuse: (0.8, 0.2, 0.1)), transform: (translate: (0, 1.5, 0))),
            (parent: "ball", shape: Mesh("knot.ply"), material: "wood", transform: (scale: Keys([(0, 1), (1, 1.5)]))),
            (light: Area(power_w: 1.5, size_m: 1, visible: true), transform: LookAt(from: (0, 1.5, 0), to: (1, 0, 0))),
            (shape: Sphere(radius_m: 1.5), material: "glass"),
        ],
    )"##;
    assert_equal(read_with(text, &[], &[]), expected);
    let given = [("height", "2"), ("paint", "\"#ff0000\""), ("where", "(translate: (0, $height, 1))")];
    let expected = expected.replace("1.5", "2").replace("(0.8, 0.2, 0.1)", "\"#ff0000\"");
    let expected = expected
        .replace("ior: 2", "ior: 1.5")
        .replace("(0, 2, 0))),\n            (parent", "(0, 2, 1))),\n            (parent");
    assert_equal(read_with(text, &[], &given), &expected);
}

#[test]
fn a_dollar_within_strings_and_comments_is_no_variable() {
    let text = "(entities: [(name: \"$a\", /* $b */ shape: Sphere(radius_m: 1))]) // $c";
    assert_equal(read_with(text, &[], &[]), "(entities: [(name: \"$a\", shape: Sphere(radius_m: 1))])");
}

#[test]
fn a_scene_in_parts_is_the_scene_in_one_file() {
    let lamp = r#"(
        variables: {"power": 7, "size": 1},
        settings: (samples: 9),
        materials: {"brass": (diffuse: (0.5, 0.4, 0.1))},
        include: ["parts/base.ron"],
        entities: [
            (name: "bulb", light: Point(power_w: $power)),
            (name: "arm", shape: Mesh("arm.ply"), material: "brass", transform: (scale: $size)),
            (parent: "arm", shape: Sphere(radius_m: 0.1), material: "white"),
        ],
    )"#;
    let base = r#"(materials: {"iron": (diffuse: Image("iron.png"))},
        entities: [(name: "foot", parent: "arm", shape: Sphere(radius_m: $size), material: "iron")])"#;
    let texts = [("scenes/lamps/lamp.ron", lamp), ("scenes/lamps/parts/base.ron", base)];
    let scene = r#"(
        settings: (samples: 3),
        variables: {"size": 2},
        include: [
            (file: "lamps/lamp.ron", prefix: "left ", parent: "table", transform: (translate: (1, 0, 0))),
            (file: "lamps/lamp.ron", prefix: "right ", variables: {"power": 5, "size": $size}),
        ],
        materials: {"white": (diffuse: 1)},
        entities: [(name: "table", transform: (translate: (0, 1, 0))), (parent: "right bulb", shape: Sphere(radius_m: 1), material: "left brass")],
    )"#;
    let whole = r#"(
        settings: (samples: 3),
        materials: {
            "white": (diffuse: 1), "left brass": (diffuse: (0.5, 0.4, 0.1)), "right brass": (diffuse: (0.5, 0.4, 0.1)),
            "left iron": (diffuse: Image("lamps/parts/iron.png")), "right iron": (diffuse: Image("lamps/parts/iron.png")),
        },
        entities: [
            (name: "table", transform: (translate: (0, 1, 0))),
            (parent: "right bulb", shape: Sphere(radius_m: 1), material: "left brass"),
            (name: "placed", parent: "table", transform: (translate: (1, 0, 0))),
            (name: "left bulb", parent: "placed", light: Point(power_w: 7)),
            (name: "left arm", parent: "placed", shape: Mesh("lamps/arm.ply"), material: "left brass", transform: (scale: 2)),
            (parent: "left arm", shape: Sphere(radius_m: 0.1), material: "white"),
            (name: "right bulb", light: Point(power_w: 5)),
            (name: "right arm", shape: Mesh("lamps/arm.ply"), material: "right brass", transform: (scale: 2)),
            (parent: "right arm", shape: Sphere(radius_m: 0.1), material: "white"),
            (name: "left foot", parent: "left arm", shape: Sphere(radius_m: 2), material: "left iron"),
            (name: "right foot", parent: "right arm", shape: Sphere(radius_m: 2), material: "right iron"),
        ],
    )"#;
    let found = read_with(scene, &texts, &[]).unwrap_or_else(|error| panic!("{error}"));
    let expected = read_with(whole, &[], &[]).unwrap();
    let portrait = |world: &World| {
        let text = format!("{:?}", crate::formats::ron::portrait(world, Path::new("scenes/test.ron")));
        text.replace("entity 2", "placed")
    };
    assert_eq!(portrait(&found), portrait(&expected));
    let notes: Vec<_> = found.warnings.iter().filter(|it| it.code == "import").collect();
    assert!(notes.len() == 1 && notes[0].severity == Severity::Note, "{notes:?}");
    assert!(notes[0].to_string().contains("lamps/lamp.ron:3"), "{}", notes[0]);
    // What is saved is one file, and the same scene.
    let saved = crate::formats::ron::write(&found, Path::new("scenes/test.ron")).unwrap();
    let again = read_with(&saved, &[], &[]).unwrap();
    let parents = |world: &World| world.entities.query::<&Parent>().iter().count();
    assert_eq!((parents(&found), found.entities.len()), (parents(&again), again.entities.len()));
    assert!(!saved.contains('$') && !saved.contains("include"), "{saved}");
}

#[test]
fn inner_values_win_over_outer_defaults_only_if_given() {
    let ball = "(variables: {\"r\": 1}, entities: [(shape: Sphere(radius_m: $r))])";
    let texts = [("scenes/ball.ron", ball)];
    let radius = |text: &str, var: &[(&str, &str)], expected: &str| {
        let expected = format!("(entities: [(shape: Sphere(radius_m: {expected}))])");
        assert_equal(read_with(text, &texts, var), &expected);
    };
    radius("(include: [\"ball.ron\"])", &[], "1");
    radius("(include: [\"ball.ron\"])", &[("r", "2")], "2");
    radius("(include: [\"ball.ron\"], variables: {\"r\": 3})", &[], "3");
    radius("(include: [\"ball.ron\"], variables: {\"r\": 3})", &[("r", "2")], "2");
    radius(
        "(include: [(file: \"ball.ron\", variables: {\"r\": 4})], variables: {\"r\": 3})",
        &[("r", "2")],
        "4",
    );
    radius("(include: [(file: $file)], variables: {\"file\": \"ball.ron\"})", &[], "1");
    radius("(include: $all, variables: {\"all\": [$one], \"one\": \"ball.ron\"})", &[], "1");
}

#[test]
fn mistakes_in_parts_are_reported_in_the_file_that_makes_them() {
    let mut wrong = Vec::new();
    let bad = "(entities: [\n  (shape: Shere(radius_m: 1)),\n  (shape: Sphere(radius_m: $r)),\n])";
    let lib = "(materials: {\"white\": (diffuse: 1)})";
    let own = "(entities: [(name: \"ball\", shape: Sphere(radius_m: 1))])";
    let texts = [
        ("scenes/bad.ron", bad),
        ("scenes/lib.ron", lib),
        ("scenes/own.ron", own),
        ("scenes/loop.ron", "(include: [\"loop.ron\"])"),
        ("scenes/a.ron", "(include: [\"b.ron\"])"),
        ("scenes/b.ron", "(include: [\n\"a.ron\"])"),
        ("scenes/open.ron", "(entities: ["),
        ("scenes/edits.ron", "(entities: [], edits: [\"Light.power_w *= 2\"])"),
    ];
    for (text, expected) in [
        // All at once, in the order of the files.
        (
            "(include: [\"bad.ron\"], variables: {\"r\": -1}, entities: [(shape: Cub)])",
            "scenes/test.ron:1:41: the shape's radius_m must be above 0, not -1 (for $r at scenes/bad.ron:3:28)\n\
             scenes/test.ron:1:65: unknown shape \"Cub\"; shapes: ALL\n\
             scenes/bad.ron:2:11: unknown shape \"Shere\" (did you mean \"Sphere\"?); shapes: ALL",
        ),
        (
            "(include: [\"bad.ron\"], variables: {\"rr\": 1})",
            "scenes/bad.ron:3:28: unknown variable $r (did you mean \"rr\"?): write variables: {\"r\": …}, or --var r=…",
        ),
        (
            "(include: [(file: \"open.ron\", prefix: \"a\"), \"open.ron\"])",
            "scenes/open.ron:1:12: this \"[\" is never closed",
        ),
        ("(include: [\"none.ron\"])", "scenes/test.ron:1:12: scenes/none.ron: no such file"),
        ("(include: [\"open.ron\"])", "scenes/open.ron:1:12: this \"[\" is never closed"),
        (
            "(include: [\"a.gltf\"])",
            "scenes/test.ron:1:12: an entity with gltf: \"…\" places a glTF file: include is for .ron files",
        ),
        ("(include: [\"a.pov\"])", "scenes/test.ron:1:12: included files are .ron files, not \".pov\""),
        ("(include: [(prefix: \"a\")])", "scenes/test.ron:1:12: an included file needs the field \"file\""),
        (
            "(include: [(fil: \"a.ron\")])",
            "scenes/test.ron:1:13: unknown field \"fil\" in an included file (did you mean \"file\"?); fields: file, prefix, parent, transform, variables",
        ),
        (
            "(include: [5])",
            "scenes/test.ron:1:12: expected an included file, as \"file.ron\" or (file: \"file.ron\", …), found 5",
        ),
        (
            "(include: \"a.ron\")",
            "scenes/test.ron:1:11: expected the included files in square brackets, found the string \"a.ron\"",
        ),
        (
            "(include: [\"loop.ron\"])",
            "scenes/loop.ron:1:12: a file cannot include itself: scenes/loop.ron includes scenes/loop.ron",
        ),
        (
            "(include: [\"test.ron\"])",
            "scenes/test.ron:1:12: a file cannot include itself: scenes/test.ron includes scenes/test.ron",
        ),
        (
            "(include: [\"a.ron\"])",
            "scenes/b.ron:2:1: a file cannot include itself: scenes/a.ron includes scenes/b.ron includes scenes/a.ron",
        ),
        (
            "(include: [\"edits.ron\"])",
            "scenes/edits.ron:1:23: edits are for whole scenes: write them in the file that includes this one",
        ),
        (
            "(include: [\"lib.ron\", \"lib.ron\"])",
            "scenes/lib.ron:1:14: there is already a material \"white\" (include: [(file: \"lib.ron\", prefix: \"…\")] keeps names apart)",
        ),
        (
            "(include: [\"own.ron\"], entities: [(name: \"ball\")])",
            "scenes/own.ron:1:20: there is already an entity \"ball\" at scenes/test.ron:1:42 (include: [(file: \"own.ron\", prefix: \"…\")] keeps names apart)",
        ),
        (
            "(include: [(file: \"own.ron\", parent: \"bal\")])",
            "scenes/test.ron:1:38: unknown parent \"bal\" (did you mean \"ball\"?)",
        ),
        (
            "(include: [(file: \"own.ron\", parent: \"ball\")])",
            "scenes/test.ron:1:38: an entity cannot be its own ancestor: \"ball\" is a child of \"ball\"",
        ),
        (
            "(include: [(file: \"own.ron\", transform: (scale: 0))])",
            "scenes/test.ron:1:49: a scale of 0 makes things flat: it must have an inverse",
        ),
    ] {
        let found = message(text, &texts, &[]).replace(&Shape::FORMS.join(", "), "ALL");
        if found != expected {
            wrong.push(format!("{text}:\n{found}\ninstead of\n{expected}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn mistakes_in_variables_of_the_caller_name_the_option_and_the_use() {
    let mut wrong = Vec::new();
    let text =
        "(variables: {\"height\": 1, \"paint\": 1}, entities: [\n (shape: Sphere(radius_m: $height))])";
    for (name, value, expected) in [
        (
            "heigth",
            "1",
            "var: unknown variable \"heigth\" (did you mean \"height\"?); variables: height, paint",
        ),
        (
            "height",
            "tall",
            "var: height=tall: expected a number, found tall (for $height at scenes/test.ron:2:27)",
        ),
        (
            "height",
            "0",
            "var: height=0: the shape's radius_m must be above 0, not 0 (for $height at scenes/test.ron:2:27)",
        ),
        ("height", "1, 2", "var: height=1, 2: expected the end of the value, found \",\""),
        ("height", "(1", "var: height=(1: this \"(\" is never closed"),
        (
            "height",
            "$heigh",
            "var: height=$heigh: unknown variable $heigh (did you mean \"height\"?): write variables: {\"heigh\": …}, or --var heigh=…",
        ),
        (
            "height",
            "$height",
            "var: height=$height: the value of $height depends on itself, or on more than 64 others in a row",
        ),
    ] {
        let found = message(text, &[], &[(name, value)]);
        if found != expected {
            wrong.push(format!("{name}={value}:\n{found}\ninstead of\n{expected}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(
        message("(entities: [])", &[], &[("a", "1")]),
        "var: unknown variable \"a\"; the scene has no variables"
    );
    // A variable that is only used, and one that is defined and not used, may be given.
    assert!(read_with("(entities: [(shape: Sphere(radius_m: $r))])", &[], &[("r", " 1 // m")]).is_ok());
    assert!(read_with(text, &[], &[("paint", "2")]).is_ok());
}

#[test]
fn files_and_values_that_multiply_or_nest_too_deeply_are_refused() {
    // Each file includes the next one twice: 2^16 files.
    let names: Vec<&'static str> =
        (0..20).map(|number| &*Box::leak(format!("scenes/{number}.ron").into_boxed_str())).collect();
    let texts: Vec<(&'static str, String)> = names
        .iter()
        .enumerate()
        .map(|(number, name)| {
            let next = format!("\"{}.ron\"", number + 1);
            (*name, format!("(include: [(file: {next}, prefix: \"a\"), (file: {next}, prefix: \"b\")])"))
        })
        .collect();
    let texts: Vec<(&'static str, &str)> = texts.iter().map(|(name, text)| (*name, &text[..])).collect();
    let found = message("(include: [\"0.ron\"])", &texts, &[]);
    assert!(found.contains("a scene includes at most 1000 files"), "{found}");
    let single: Vec<(&'static str, String)> = texts
        .iter()
        .map(|(name, text)| (*name, text.replace(", prefix: \"a\"), (", "), /* (").replace("b\")", "*/")))
        .collect();
    let single: Vec<(&'static str, &str)> = single.iter().map(|(name, text)| (*name, &text[..])).collect();
    let found = message("(include: [\"0.ron\"])", &single, &[]);
    assert!(found.contains("more than 16 files include each other in a row"), "{found}");
    // Each variable has the one before ten times.
    let define = |number: usize| {
        let inner = format!("$v{}, ", number.saturating_sub(1)).repeat(10);
        format!("\"v{number}\": [{}],", if number == 0 { "1" } else { &inner })
    };
    let all: String = (0..14).map(define).collect();
    let found = message(&format!("(variables: {{{all}}}, entities: [])"), &[], &[]);
    assert!(found.contains("have more than 256 MiB: use fewer"), "{found}");
    // Each variable is nested in the one before, ten deep.
    let define = |number: usize| {
        let inner = if number == 0 { "1".to_owned() } else { format!("$v{}", number - 1) };
        format!("\"v{number}\": {}{inner}{},", "Add(a: ".repeat(10), ", b: 0)".repeat(10))
    };
    let scene = |count: usize| {
        let all: String = (0..count).map(define).collect();
        let ball = format!("(shape: Sphere(radius_m: 1), material: (diffuse: $v{}))", count - 1);
        format!("(variables: {{{all}}}, entities: [{ball}])")
    };
    assert!(read_with(&scene(12), &[], &[]).is_ok());
    let found = message(&scene(14), &[], &[]);
    assert!(found.ends_with("values are nested too deeply"), "{found}");
}
