//! Known answers: matte white, smooth metals, and materials that are wrong on purpose.

use super::*;
use crate::compile::compile;
use crate::world::Transport;

/// The scene of a sphere of a material, and the material's number.
fn scene_of(material: &str) -> (CompiledScene, u32) {
    let text = format!(
        r#"(entities: [
            (name: "camera", camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 0, 4), to: (0, 0, 0))),
            (name: "lamp", light: Point(power_w: 1), transform: (translate: (3, 3, 3))),
            (name: "ball", shape: Sphere(radius_m: 1), material: {material}),
        ])"#
    );
    let mut files = crate::formats::asset_files::Files::new(
        crate::world::SourceFiles::default(),
        crate::formats::LoadOptions::default(),
    );
    let path = std::path::Path::new("furnace.ron");
    let mut world = crate::formats::ron::parse(&text, path, &mut files).expect("a scene");
    world.settings.transport = Transport::Path;
    let id = select::material(&world, "ball").expect("a material");
    (compile(&world, None).expect("a compiled scene"), id.0)
}

fn report(material: &str, samples: u32) -> FurnaceReport {
    let (scene, id) = scene_of(material);
    measure(&scene, id, &FurnacePlan { samples, inside: false, uv: None }).expect("a report")
}

#[test]
fn matte_white_returns_all_light_at_all_angles() {
    let report = report("Principled(base_color: 1, metallic: 0, specular: 0)", 4096);
    assert_eq!((report.runs.len(), &report.lobes[..]), (1, &["diffuse"][..]));
    let run = &report.runs[0];
    assert_eq!(run.faults(false), Vec::<String>::new());
    for row in &run.rows {
        for channel in row.own.mean {
            assert!((channel - 1.0).abs() < 1e-5, "{}°: {channel}", row.degrees);
        }
        assert!(row.density.is_some_and(|check| check.agrees()), "{row:?}");
    }
    assert!(run.reciprocity.is_some_and(|reciprocity| reciprocity.largest < 1e-5), "{run:?}");
}

#[test]
fn smooth_metal_returns_its_fresnel_reflectance() {
    let base = [0.9, 0.5, 0.1];
    let report = report("Principled(base_color: (0.9, 0.5, 0.1), metallic: 1, roughness: 0)", 1024);
    let run = &report.runs[0];
    assert_eq!(run.reciprocity, None);
    for row in &run.rows {
        let cos = libm::cos(row.degrees.to_radians());
        for (mean, f0) in row.own.mean.into_iter().zip(base) {
            let schlick = f0 + (1.0 - f0) * libm::pow(1.0 - cos, 5.0);
            assert!((mean - schlick).abs() < 2e-3, "{}°: {mean} {schlick}", row.degrees);
        }
        assert_eq!(row.density, None, "mirrors have no density");
    }
    let roughness: Vec<f32> = report.runs.iter().map(|run| run.roughness).collect();
    assert_eq!(roughness, [0.0, 0.1, 0.25, 0.5, 0.75, 1.0]);
}

#[test]
fn material_that_gains_energy_is_reported() {
    let (mut scene, id) = scene_of("Principled(base_color: 1, metallic: 0, specular: 0)");
    scene.materials[id as usize].base_color = ColorParam::constant([1.04, 0.5, 0.5]);
    let report =
        measure(&scene, id, &FurnacePlan { samples: 1024, inside: false, uv: None }).expect("a report");
    let faults = report.runs[0].faults(report.is_directed);
    assert!(faults.len() == 1 && faults[0].starts_with("gains 4.0 % at"), "{faults:?}");
}

#[test]
fn faults_of_a_broken_surface_are_all_named() {
    let albedo = |mean: f64| MeasuredAlbedo { mean: [mean; 3], error: [0.001; 3] };
    let wrong = DensityCheck { chi_square: 900.0, cells: 100, largest: 12.0, ..DensityCheck::default() };
    let row = |degrees, own, white| FurnaceRow { degrees, own, white: Some(white), density: Some(wrong) };
    let run = FurnaceRun {
        roughness: 0.5,
        is_own: true,
        rows: vec![row(0.0, albedo(0.5), albedo(0.97)), row(85.0, albedo(1.004), albedo(1.2))],
        reciprocity: Some(Reciprocity { largest: 0.5, mean: 0.1 }),
    };
    assert_eq!(
        run.faults(false),
        [
            "in white, gains 20.0 % at 85°",
            "in white, loses 3.0 % at 0°",
            "directions do not follow the reported density at 0°, 85°",
            "not reciprocal: exchanged directions differ by 10.0 % in the mean, at most 50 %",
        ]
    );
    // Of a body that refracts, no reciprocity is expected.
    assert_eq!(run.faults(true), run.faults(false)[..3]);
}

/// A model whose parts do not depend on each other loses no light in white that it should not.
#[test]
fn blinn_phong_materials_have_no_white_version() {
    let report =
        report("(diffuse: (0.3, 0.2, 0.1), specular: (0.5, 0.4, 0.2), shininess: 50, kr: 0.2)", 1024);
    let faults = report.runs[0].faults(report.is_directed);
    assert!(faults.iter().all(|fault| !fault.contains("in white")), "{faults:?}");
    assert!(report.runs[0].rows.iter().all(|row| row.white.is_none()));
}

#[test]
fn rough_glass_is_measured_from_both_sides() {
    let (scene, id) =
        scene_of("Principled(base_color: 1, metallic: 0, transmission: 1, roughness: 0.3, volume: ())");
    for inside in [false, true] {
        let report = measure(&scene, id, &FurnacePlan { samples: 2048, inside, uv: None }).expect("a report");
        assert!(report.is_directed && report.lobes.contains(&"refraction"), "{report:?}");
        for row in &report.runs[0].rows[..5] {
            assert!((row.own.mean[1] - 1.0).abs() < 0.05, "{inside} {row:?}");
        }
    }
    let (scene, id) = scene_of("Principled(base_color: 0.5, metallic: 0)");
    let error =
        measure(&scene, id, &FurnacePlan { samples: 16, inside: true, uv: None }).expect_err("opaque");
    assert!(error.contains("leave out --inside"), "{error}");
}
