//! Makes everything in assets/ and the generated scene, the same bytes every time: `cargo run --release --example
//! generate-assets [folder instead of the repository]`. With `gallery` in place of a folder, renders images of all
//! scenes instead; with `fields`, images that show the effect of the fields of a scene, or the one of a name that follows.
//!
//! All shapes and images are this project's own designs, made by calculation.

mod cabinet;
mod clock;
mod dial;
mod dynamo;
mod fields;
mod fractal;
mod gallery;
mod gears;
mod glass;
mod knot;
mod letters;
mod mesh;
mod noise;
mod outline;
mod solids;
mod sphereflake;
mod stage;
mod terrain;
#[cfg(test)]
mod tests;
mod textures;
mod triangulate;

use std::error::Error;
use std::path::Path;

use mesh::Polygons;

fn main() -> Result<(), Box<dyn Error>> {
    let given = std::env::args().nth(1);
    let scenes = || Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    match given.as_deref() {
        Some("gallery") => return gallery::make(&scenes()),
        Some("fields") => return fields::make(&scenes(), std::env::args().nth(2).as_deref()),
        _ => {}
    }
    let root = Path::new(given.as_deref().unwrap_or(env!("CARGO_MANIFEST_DIR")));
    let (assets, scenes) = (root.join("assets"), root.join("scenes"));
    std::fs::create_dir_all(&assets)?;
    std::fs::create_dir_all(&scenes)?;
    let terrain = terrain::Terrain::new(168);
    let mut meshes: Vec<(&str, Polygons)> = vec![
        ("knot", knot::torus_knot(2.0, 3.0, 1.0).smoothed(60.0)),
        ("wine_glass", glass::wine_glass().smoothed(60.0).scaled(0.001)),
        ("flask", glass::flask().smoothed(60.0).scaled(0.001)),
        ("wine", glass::wine().smoothed(60.0).scaled(0.001)),
        ("tumbler", glass::tumbler().smoothed(60.0).scaled(0.001)),
        ("drink", glass::drink().smoothed(60.0).scaled(0.001)),
        ("ice_cube", glass::ice_cube().smoothed(60.0).scaled(0.001)),
        ("pool", glass::pool(1.2).smoothed(40.0)),
        ("lens", glass::lens().smoothed(40.0).scaled(0.001)),
        ("brilliant", glass::brilliant().flat()),
        ("fractal", fractal::julia()),
        ("terrain", terrain.solid().smoothed(60.0)),
        ("cyclorama", stage::cyclorama().smoothed(30.0)),
        ("screwdriver_handle", stage::screwdriver_handle().smoothed(40.0).scaled(0.001)),
        ("screwdriver_blade", stage::screwdriver_blade().smoothed(40.0).scaled(0.001)),
        ("table_top", stage::table_top().smoothed(40.0)),
    ];
    meshes.extend(cabinet::stages());
    meshes.extend(clock::parts());
    meshes.extend(dynamo::parts());
    for (name, mesh) in &meshes {
        mesh.save(&assets.join(format!("{name}.ply")))?;
        println!("{name}.ply: {} triangles", mesh.triangle_count());
    }
    textures::save_all(&assets, &terrain)?;
    std::fs::write(assets.join("letters.ttf"), letters::file())?;
    std::fs::write(scenes.join("sphereflake.ron"), sphereflake::scene())?;
    println!("where the going train of the clock runs:");
    for arbor in clock::train() {
        let (at, (teeth, _, turn)) = (arbor.at, arbor.wheel);
        let (leaves, leaves_turn) = arbor.pinion;
        println!(
            "    {}: at ({:.3}, {:.3}) mm, {teeth} teeth turned {turn:.3}°, {leaves} leaves turned {leaves_turn:.3}°",
            arbor.name, at.x, at.y
        );
    }
    Ok(())
}
