//! Validation of a world: references must exist, and numbers must be in range. Readers of files produce only valid
//! worlds; programs may not, and all later stages rely on validity.

use hecs::Entity;

use crate::error::CompileError;
use crate::world::bounds::{self, check as check_fields, within};
use crate::world::fields::{self, Forms, Slot};
use crate::world::shapes::check_font;
use crate::world::transforms::entity_error;
use crate::world::{
    Assets, Camera, Combination, FocusOn, Image, Light, MaterialId, Mesh, Modifiers, Overrides, Parent,
    Procedure, Settings, Shape, Stereo, Strands, TextureSource, World,
};

/// Checks a world; the error describes the first fault.
pub(super) fn check(world: &World, order: &[Entity]) -> Result<(), CompileError> {
    check_settings(&world.settings)?;
    check_assets(&world.assets)?;
    for &entity in order {
        check_entity(world, entity).map_err(|reason| entity_error(world, entity, reason))?;
    }
    Ok(())
}

fn invalid(place: impl Into<String>, reason: impl Into<String>) -> CompileError {
    CompileError::Invalid { place: place.into(), reason: reason.into() }
}

/// Checks all settings; the error describes the first one that is out of its range.
pub fn check_settings(settings: &Settings) -> Result<(), CompileError> {
    settings.check().map_err(|reason| invalid("settings", reason))
}

fn check_assets(assets: &Assets) -> Result<(), CompileError> {
    let in_place = |what: &'static str, number: usize, name: &str| {
        let name = if name.is_empty() { String::new() } else { format!(" \"{name}\"") };
        move |reason: String| invalid(format!("{what} {number}{name}"), reason)
    };
    if assets.materials.is_empty() {
        return Err(invalid("materials", "the default one is missing: it is the first"));
    }
    for (number, mesh) in assets.meshes.iter().enumerate() {
        check_mesh(mesh, assets.materials.len()).map_err(in_place("mesh", number, &mesh.name))?;
    }
    for (number, image) in assets.images.iter().enumerate() {
        check_image(image).map_err(in_place("image", number, ""))?;
    }
    for (number, strands) in assets.strands.iter().enumerate() {
        check_strands(strands).map_err(in_place("strands", number, ""))?;
    }
    for (number, font) in assets.fonts.iter().enumerate() {
        check_font(font).map_err(in_place("font", number, ""))?;
    }
    for (number, texture) in assets.textures.iter().enumerate() {
        let place = in_place("texture", number, "");
        match texture.source {
            TextureSource::Image(id) => exists("image", id.0, assets.images.len()),
            TextureSource::Procedure(id) => exists("procedure", id.0, assets.procedures.len())
                .and_then(|()| check_procedure(&assets.procedures[id.0 as usize], number)),
        }
        .map_err(&place)?;
        if texture.uv_set > 1 {
            return Err(place(format!("uv_set is {}: it must be 0 or 1", texture.uv_set)));
        }
    }
    for (number, named) in assets.materials.iter().enumerate() {
        let place = in_place("material", number, named.name.as_deref().unwrap_or(""));
        let mut material = named.material.clone();
        let part = material.part();
        let mut found = Ok(());
        fields::for_each_texture(part, &mut |id, _| {
            if found.is_ok() {
                found = exists("texture", id.0, assets.textures.len());
            }
        });
        found.map_err(&place)?;
        check_fields(part).map_err(place)?;
    }
    Ok(())
}

/// Checks a procedure, that of texture number `number`.
fn check_procedure(procedure: &Procedure, number: usize) -> Result<(), String> {
    let mut found = Ok(());
    procedure.for_each_input(&mut |id| {
        if id.0 as usize >= number {
            found = Err(format!("it uses texture {}: its inputs must be textures before it", id.0));
        }
    });
    found?;
    match procedure.clone() {
        Procedure::Pattern(mut texture) => {
            bounds::check_form(&mut texture.pattern)?;
            check_fields(&mut texture.placement)
        }
        Procedure::Combination(Combination::Curve { stops, .. }) if stops.is_empty() => {
            Err("a curve needs stops".into())
        }
        Procedure::Combination(mut combination) => bounds::check_form(&mut combination),
    }
}

fn exists(what: &str, id: u32, count: usize) -> Result<(), String> {
    if (id as usize) < count {
        return Ok(());
    }
    Err(format!("{what} {id} does not exist: there are {count}, and the first has the number 0"))
}

/// Checks a mesh of a world that has `materials` materials; the error describes the first fault.
pub fn check_mesh(mesh: &Mesh, materials: usize) -> Result<(), String> {
    let Mesh {
        name: _,
        source: _,
        origin,
        positions,
        normals,
        uvs,
        uvs1,
        tangents,
        colors,
        alphas,
        triangles,
        triangle_materials,
    } = mesh;
    if !origin.is_finite() {
        return Err("its origin must be finite".to_owned());
    }
    let vertices = positions.len();
    let columns = [
        ("normals", normals.len(), vertices),
        ("uvs", uvs.len(), vertices),
        ("uvs1", uvs1.len(), vertices),
        ("tangents", tangents.len(), vertices),
        ("colors", colors.len(), vertices),
        ("alphas", alphas.len(), vertices),
        ("triangle_materials", triangle_materials.len(), triangles.len()),
    ];
    if let Some((what, given, wanted)) =
        columns.iter().find(|(_, given, wanted)| *given != 0 && given != wanted)
    {
        return Err(format!("{what} has {given} elements: it must have {wanted}, or none"));
    }
    // Comparing only the largest index is fast for millions of triangles.
    let largest = triangles.iter().flatten().copied().max();
    if largest.is_some_and(|index| index as usize >= vertices) {
        let outside = |triangle: &&[u32; 3]| triangle.iter().any(|index| *index as usize >= vertices);
        let triangle = triangles.iter().find(outside).copied().unwrap_or_default();
        return Err(format!("a triangle has the vertices {triangle:?}, but there are {vertices} vertices"));
    }
    let is_finite = positions.iter().all(|p| p.is_finite())
        && normals.iter().all(|n| n.is_finite())
        && uvs.iter().chain(uvs1).all(|uv| uv.is_finite())
        && tangents.iter().all(|t| t.is_finite());
    if !is_finite {
        return Err("positions, normals, tangents and texture coordinates must be finite".into());
    }
    let largest = triangle_materials.iter().map(|id| id.0).max();
    largest.map_or(Ok(()), |id| exists("material", id, materials))
}

fn check_strands(strands: &Strands) -> Result<(), String> {
    let Strands { source: _, points, radii_m, ends } = strands;
    if !points.iter().all(|point| point.is_finite()) {
        return Err("its points must be finite".to_owned());
    }
    if !radii_m.is_empty() && radii_m.len() != points.len() {
        return Err(format!(
            "radii_m has {} elements: it must have {}, or none",
            radii_m.len(),
            points.len()
        ));
    }
    if !radii_m.iter().all(|radius| *radius >= 0.0 && radius.is_finite()) {
        return Err("its radii must be at least 0, and finite".to_owned());
    }
    let is_in_order = ends.is_sorted() && ends.last().is_none_or(|end| *end as usize <= points.len());
    is_in_order.then_some(()).ok_or_else(|| "its ends must ascend up to the number of points".to_owned())
}

fn check_image(image: &Image) -> Result<(), String> {
    let Image { source: _, width, height, texels } = image;
    let count = texels.count();
    if *width == 0 || *height == 0 || count != *width as usize * *height as usize {
        return Err(format!(
            "it has {count} texels: {width} x {height} pixels take as many, and at least one"
        ));
    }
    Ok(())
}

fn check_entity(world: &World, entity: Entity) -> Result<(), String> {
    let World { entities, assets, .. } = world;
    if let Ok(parent) = entities.get::<&Parent>(entity)
        && !entities.contains(parent.0)
    {
        return Err("its parent is not an entity of this world".into());
    }
    let material = |id: MaterialId| exists("material", id.0, assets.materials.len());
    if let Ok(id) = entities.get::<&MaterialId>(entity) {
        material(*id)?;
    }
    if let Ok(overrides) = entities.get::<&Overrides>(entity) {
        overrides.0.iter().try_for_each(|(_, id)| material(*id))?;
    }
    if let Ok(shape) = entities.get::<&Shape>(entity) {
        check_form(&mut Shape::clone(&shape), assets)?;
        shape.check(assets).map_err(|fault| fault.reason)?;
    }
    if let Ok(modifiers) = entities.get::<&Modifiers>(entity) {
        modifiers.0.iter().try_for_each(|modifier| check_form(&mut modifier.clone(), assets))?;
    }
    if let Ok(light) = entities.get::<&Light>(entity) {
        if let Light::Spot { inner_angle, outer_angle, .. } = *light {
            within("inner_degrees", inner_angle.to_degrees(), 0.0, outer_angle.to_degrees())?;
        }
        check_form(&mut Light::clone(&light), assets)?;
    }
    if let Ok(stereo) = entities.get::<&Stereo>(entity) {
        check_fields(&mut Stereo::clone(&stereo))?;
    }
    if let Ok(focused) = entities.get::<&FocusOn>(entity)
        && !entities.contains(focused.0)
    {
        return Err("what it focuses on is not an entity of this world".into());
    }
    let Ok(camera) = entities.get::<&Camera>(entity) else { return Ok(()) };
    check_form(&mut Camera::clone(&camera), assets)?;
    camera.check_angle()
}

fn check_form(form: &mut dyn Forms, assets: &Assets) -> Result<(), String> {
    let mut found = Ok(());
    for field in form.fields() {
        fields::textures(field, &mut |id, _| {
            found = found.clone().and(exists("texture", id.0, assets.textures.len()))
        });
    }
    found?;
    for field in form.fields() {
        match field.slot {
            Slot::Mesh(id) => exists("mesh", id.0, assets.meshes.len())?,
            Slot::Strands(id) => exists("strands", id.0, assets.strands.len())?,
            Slot::Font(id) => exists("font", id.0, assets.fonts.len())?,
            _ => {}
        }
    }
    for id in fields::images(form.fields()) {
        exists("image", id.0, assets.images.len())?;
    }
    bounds::check_form(form)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::compile;
    use crate::math::Rgb;
    use crate::math::{Vec2, Vec3};
    use crate::world::PixelFilter;
    use crate::world::Texels;
    use crate::world::{
        ColorInput, ConeEdge, Falloff, FisheyeMapping, ImageId, Material, MeshId, Pattern, Principled,
        ScalarInput, Texture, TextureId, Transform,
    };

    fn world() -> World {
        let mut world = World::default();
        world.entities.spawn((Camera::Pinhole { vertical_fov: 1.0 }, Transform::IDENTITY));
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let mesh = Mesh { positions, triangles: vec![[0, 1, 2]], name: "sheet".into(), ..Mesh::default() };
        let mesh = world.assets.add_mesh(mesh);
        world.entities.spawn((Shape::Mesh(mesh), Transform::IDENTITY, MaterialId::DEFAULT));
        let texels = Texels::Rgba8(vec![[9; 4]; 6]);
        let image = world.assets.add_image(Image { source: None, width: 3, height: 2, texels });
        world.assets.add_texture(Texture::new(image));
        world
    }

    /// Every fault is reported with its place, and nothing panics.
    #[test]
    fn compile_reports_each_fault_of_a_world_with_its_place() {
        assert!(compile(&world(), None).is_ok());
        type Mistake = (&'static str, fn(&mut World));
        fn of_mesh(world: &mut World) -> &mut Mesh {
            std::sync::Arc::make_mut(&mut world.assets.meshes[0])
        }
        fn sheen(world: &mut World, id: u32) {
            let sheen_color = ColorInput::Texture(TextureId(id));
            let material = Principled { sheen_color, ..Principled::default() };
            world.assets.add_material(Some("velvet".into()), Material::Principled(Box::new(material)));
        }
        fn photographic(shift: f32) -> Camera {
            let (focal_length_mm, sensor_width_mm, f_stop, focus_distance_m) = (50.0, 36.0, None, 1.0);
            let (shift, aperture, pattern) = (Vec2::splat(shift), None, Pattern::Jittered);
            Camera::Photographic {
                focal_length_mm,
                sensor_width_mm,
                f_stop,
                focus_distance_m,
                shift,
                tilt_degrees: Vec2::ZERO,
                aperture,
                pattern,
            }
        }
        fn spawn<T: hecs::Component>(world: &mut World, component: T) {
            world.entities.spawn((component, Transform::IDENTITY));
        }
        let mistakes: [Mistake; 30] = [
            ("settings: width is 0", |w| w.settings.size[0] = 0),
            ("settings: samples is 0", |w| w.settings.samples = 0),
            ("materials: the default one", |w| w.assets.materials.clear()),
            ("mesh 0 \"sheet\": a triangle has the vertices [0, 1, 3]", |w| of_mesh(w).triangles[0][2] = 3),
            ("mesh 0 \"sheet\": normals has 1", |w| of_mesh(w).normals = vec![Vec3::X]),
            ("mesh 0 \"sheet\": uvs1 has 2", |w| of_mesh(w).uvs1 = vec![Vec2::X; 2]),
            ("must be finite", |w| of_mesh(w).positions[1].y = f32::NAN),
            ("material 7 does not exist", |w| of_mesh(w).triangle_materials = vec![MaterialId(7)]),
            ("image 0: it has 6 texels", |w| std::sync::Arc::make_mut(&mut w.assets.images[0]).width = 4),
            ("texture 0: image 5 does not exist", |w| {
                w.assets.textures[0].source = TextureSource::Image(ImageId(5))
            }),
            ("texture 0: uv_set is 2", |w| w.assets.textures[0].uv_set = 2),
            ("material 1 \"velvet\": texture 1 does not exist", |w| sheen(w, 1)),
            ("material 1: base_color is [NaN", |w| {
                let base_color = ColorInput::Constant(Rgb::splat(f32::NAN));
                let paint = Principled { base_color, ..Principled::default() };
                w.assets.add_material(None, Material::Principled(Box::new(paint)));
            }),
            ("material 1: roughness is 2", |w| {
                let paint = Principled { roughness: ScalarInput::constant(2.0), ..Principled::default() };
                w.assets.add_material(None, Material::Principled(Box::new(paint)));
            }),
            ("settings: the filter's radius is 0", |w| w.settings.filter = PixelFilter::Tent { radius: 0.0 }),
            ("entity 2: haze is -1", |w| {
                let (sun, sun_angle) = (1.0, 0.01);
                spawn(
                    w,
                    Light::Sky {
                        elevation: 0.5,
                        azimuth: 0.0,
                        haze: -1.0,
                        radiance: Rgb::WHITE,
                        sun,
                        sun_angle,
                    },
                )
            }),
            ("entity 2: mesh 1 does not exist", |w| spawn(w, Shape::Mesh(MeshId(1)))),
            ("entity 2: radius_m is -1", |w| spawn(w, Shape::Sphere { radius_m: -1.0 })),
            ("entity 2: material 1 does not exist", |w| spawn(w, MaterialId(1))),
            ("entity 2: vertical_fov_degrees is 2578", |w| spawn(w, Camera::Pinhole { vertical_fov: 45.0 })),
            ("entity 2: height_m is 0", |w| spawn(w, Camera::Orthographic { height_m: 0.0 })),
            ("entity 2: power_w is [-1.0", |w| {
                spawn(
                    w,
                    Light::Point { power_w: Rgb::splat(-1.0), falloff: Falloff::Constant, radius_m: 0.0 },
                )
            }),
            ("entity 2: texture 4 does not exist", |w| {
                spawn(w, Light::Photometric { power_w: Rgb::WHITE, profile: TextureId(4) })
            }),
            ("entity 2: image 4 does not exist", |w| {
                spawn(w, Light::Environment { radiance: Rgb::WHITE, image: Some(ImageId(4)) })
            }),
            ("entity 2: inner_degrees is 57.29578: it must be 0 to 28.64789", |w| {
                let (power_w, falloff) = (Rgb::WHITE, Falloff::Constant);
                let (edge, radius_m) = (ConeEdge::default(), 0.0);
                spawn(w, Light::Spot { power_w, inner_angle: 1.0, outer_angle: 0.5, edge, falloff, radius_m })
            }),
            ("entity 2: shift is", |w| spawn(w, photographic(f32::NAN))),
            (
                "entity 2: fov_degrees must be above 0 and at most 180 with mapping: Orthographic, not 200",
                |w| {
                    let (fov, mapping) = (200f32.to_radians(), FisheyeMapping::Orthographic);
                    spawn(w, Camera::Fisheye { fov, mapping, circular: true })
                },
            ),
            ("entity 2: eye_distance_m is -1", |w| {
                spawn(w, Stereo { eye_distance_m: -1.0, ..Stereo::default() })
            }),
            ("what it focuses on is not an entity", |w| {
                let gone = w.entities.spawn(());
                let _ = w.entities.despawn(gone);
                spawn(w, FocusOn(gone));
            }),
            ("its parent is not an entity", |w| {
                let gone = w.entities.spawn(());
                let _ = w.entities.despawn(gone);
                spawn(w, Parent(gone));
            }),
        ];
        for (message, mistake) in mistakes {
            let mut wrong = world();
            mistake(&mut wrong);
            let told = compile(&wrong, None).err().map(|error| error.to_string());
            assert!(told.as_ref().is_some_and(|told| told.contains(message)), "{message}: {told:?}");
        }
        // A texture that exists.
        let mut right = world();
        sheen(&mut right, 0);
        assert!(compile(&right, None).is_ok());
    }
}
