use std::sync::Arc;

use super::*;
use crate::compile::compile;
use crate::formats::{LoadOptions, load_with};
use crate::render::setup;
use crate::study::profile::flow;

const SCENES: [&str; 3] = [
    // Whitted's transport, with forks and two lights.
    "(settings: (size: (50, 40), transport: Whitted), materials: {
        \"glass\": BlinnPhong(ior: 1.5, kt: 1, kr: 0.5), \"paint\": BlinnPhong(diffuse: (0.8, 0.2, 0.1))},
      entities: [(camera: Pinhole(vertical_fov_degrees: 50), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
        (shape: Sphere(radius_m: 1.2), material: \"glass\"), (light: Point(power_w: 300), transform: (translate: (3, 4, 2))),
        (light: Point(power_w: 90), transform: (translate: (-3, 4, 2))),
        (shape: Plane(corners: ((-4, -1, -4), (-4, -1, 4), (4, -1, 4), (4, -1, -4))), material: \"paint\")])",
    // Paths with forks at glass, through materials side by side.
    "(settings: (size: (50, 40), transport: Path, max_depth: 4, sharing: Off), materials: {
        \"glass\": Principled(base_color: 1, metallic: 0, transmission: 1, roughness: 0, volume: ()), \"paint\": Principled(base_color: (0.8, 0.2, 0.1), metallic: 0),
        \"metal\": Principled(metallic: 1, roughness: 0.2)},
      entities: [(camera: Pinhole(vertical_fov_degrees: 50), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
        (shape: Sphere(radius_m: 1.2), material: \"glass\"), (shape: Sphere(radius_m: 0.7), material: \"metal\"),
        (light: Point(power_w: 300), transform: (translate: (3, 4, 2))),
        (shape: Plane(corners: ((-4, -1, -4), (-4, -1, 4), (4, -1, 4), (4, -1, -4))), material: \"paint\")])",
    // Path reuse.
    "(settings: (size: (50, 40), transport: Path, max_depth: 4, background: 0.5, sharing: 16), materials: {
        \"paint\": Principled(base_color: (0.8, 0.2, 0.1), metallic: 0), \"chalk\": Principled(base_color: 0.8, metallic: 0)},
      entities: [(camera: Pinhole(vertical_fov_degrees: 50), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
        (shape: Sphere(radius_m: 1.2), material: \"chalk\"),
        (shape: Plane(corners: ((-4, -1, -4), (-4, -1, 4), (4, -1, 4), (4, -1, -4))), material: \"paint\")])",
];

fn setup_of(text: &str) -> Arc<RenderSetup> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, text).unwrap();
    let world = load_with(&path, &LoadOptions::default()).unwrap();
    Arc::new(setup(compile(&world, None).unwrap(), &world.settings))
}

fn number(step: &Value, name: &str) -> usize {
    step[name].as_u64().unwrap() as usize
}

#[test]
fn steps_have_the_items_that_the_stages_report() {
    for text in SCENES {
        let setup = setup_of(text);
        let (options, _) = options(Options::default(), setup.size, [25, 20]);
        let steps = record(&setup, Session::of(setup.clone(), 4, options), options, 100.0).steps;
        let flows = flow::of_region(&setup, options, 1);
        for stage in [Stage::Intersect, Stage::Retire, Stage::Shade, Stage::Shadow, Stage::Connect] {
            let own = || steps.iter().filter(|step| step["stage"] == stage.name());
            let flow = &flows.stages[stage as usize];
            let sum = |name| own().map(|step| number(step, name) as u64).sum::<u64>();
            assert_eq!(sum("entering"), flow.entering, "{stage:?}: {text}");
            if stage != Stage::Intersect {
                assert_eq!(sum("leaving"), flow.leaving, "{stage:?}: {text}");
            }
        }
    }
}

#[test]
fn hits_are_sorted_into_groups_of_one_material() {
    for text in SCENES {
        let setup = setup_of(text);
        let (options, _) = options(Options::default(), setup.size, [25, 20]);
        let width = options.isa.lanes();
        let steps = record(&setup, Session::of(setup.clone(), 4, options), options, 100.0).steps;
        for step in steps.iter().filter(|step| step["stage"] == "shade") {
            let hits: Vec<u64> = step["items"].as_array().unwrap().iter().flat_map(Value::as_u64).collect();
            assert_eq!(hits.len(), number(step, "entering"));
            let mut left = hits.clone();
            for group in step["sorted"].as_array().unwrap() {
                let (material, lanes) = (group[0].as_u64().unwrap(), group[1].as_u64().unwrap() as usize);
                assert!((1..=width).contains(&lanes));
                for _ in 0..lanes {
                    let place = left.iter().position(|it| *it == material).expect("a hit of the material");
                    left.remove(place);
                }
            }
            assert!(left.is_empty());
            let least = hits.len().div_ceil(width);
            assert!(number(step, "unsorted") >= least);
        }
    }
}

#[test]
fn all_paths_end_and_none_wait_at_the_end() {
    let setup = setup_of(SCENES[1]);
    let (options, region) = options(Options::default(), setup.size, [25, 20]);
    assert_eq!(region, Region { x0: 0, y0: 0, x1: 32, y1: 32 });
    assert_eq!(block(setup.size, [49, 99]), Region { x0: 32, y0: 32, x1: 50, y1: 40 });
    let region = region.area();
    let steps = record(&setup, Session::of(setup.clone(), 4, options), options, 100.0).steps;
    let sum = |stage: &str, name: &str| {
        let own = steps.iter().filter(|step| step["stage"] == stage);
        own.map(|step| number(step, name)).sum::<usize>()
    };
    let forks =
        steps.iter().filter(|step| step["stage"] == "shade").map(|step| number(&step["queues"], "forks"));
    let forks: usize = forks.sum();
    assert_eq!(sum("generate", "entering"), region);
    assert_eq!(sum("advance", "ended"), region + forks);
    let last = steps.last().unwrap();
    assert_eq!((&last["stage"], number(&last["queues"], "wave")), (&json!("advance"), 0));
    assert_eq!(number(&last["queues"], "waiting"), 0);
    assert!(forks > 0 && steps.iter().any(|step| number(&step["queues"], "waiting") > 0), "{forks}");
}

#[test]
fn waves_of_any_size_have_steps_and_an_end() {
    for text in SCENES {
        let setup = setup_of(text);
        for wave in [1, 7, 100, 4096] {
            let (options, _) = options(Options { wave, ..Options::default() }, setup.size, [25, 20]);
            let recorder = record(&setup, Session::of(setup.clone(), 4, options), options, 100.0);
            let count = recorder.steps.len();
            assert!((5..=MOST_STEPS).contains(&count), "{wave}: {count}");
            assert!(recorder.is_cut || recorder.steps.last().unwrap()["queues"]["wave"] == 0);
            assert!(wave > 1 || setup.sharing.is_some() || recorder.is_cut);
        }
    }
}
