//! Values that were given to entities although they are no components: a program's compiler cannot detect that, and
//! they would silently have no effect.

use hecs::Entity;

use crate::error::CompileError;
use crate::world::transforms::entity_error;
use crate::world::{
    BlinnPhong, ColorInput, Image, ImageId, Material, Mesh, MeshId, Principled, Settings, Texture, TextureId,
    World,
};

/// Fails for the first value that belongs elsewhere; the error names the right place.
pub(super) fn check(world: &World) -> Result<(), CompileError> {
    const MATERIAL: &str =
        "materials belong to the assets: give the entity the MaterialId that assets.add_material returns";
    const MESH: &str =
        "meshes belong to the assets: give the entity Shape::Mesh of the MeshId that assets.add_mesh returns";
    const IMAGE: &str = "images and textures belong to the assets, and to materials by their ids";
    none::<Material>(world, "Material", MATERIAL)?;
    none::<BlinnPhong>(world, "BlinnPhong", MATERIAL)?;
    none::<Principled>(world, "Principled", MATERIAL)?;
    none::<ColorInput>(world, "ColorInput", MATERIAL)?;
    none::<Mesh>(world, "Mesh", MESH)?;
    none::<MeshId>(world, "MeshId", "a component is Shape::Mesh of it")?;
    none::<Image>(world, "Image", IMAGE)?;
    none::<ImageId>(world, "ImageId", IMAGE)?;
    none::<Texture>(world, "Texture", IMAGE)?;
    none::<TextureId>(world, "TextureId", IMAGE)?;
    none::<Settings>(world, "Settings", "they belong to the world: world.settings")
}

fn none<T: hecs::Component>(world: &World, name: &str, remedy: &str) -> Result<(), CompileError> {
    match world.entities.query::<(Entity, &T)>().iter().next() {
        Some((entity, _)) => Err(entity_error(world, entity, format!("a {name} is no component: {remedy}"))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::compile;
    use crate::world::{Camera, Shape};

    #[test]
    fn values_that_are_no_components_are_refused_by_name() {
        let refused = |give: &dyn Fn(&mut World, Entity)| {
            let mut world = World::default();
            world.entities.spawn((Camera::Pinhole { vertical_fov: 1.0 },));
            let ball = world.entities.spawn((Shape::Sphere { radius_m: 1.0 },));
            give(&mut world, ball);
            compile(&world, None).map(|_| ()).map_err(|error| error.to_string())
        };
        assert_eq!(refused(&|_, _| ()), Ok(()));
        // A program's own components are allowed.
        assert_eq!(refused(&|world, ball| world.entities.insert_one(ball, 1.0f32).unwrap()), Ok(()));
        let material = refused(&|world, ball| {
            world.entities.insert_one(ball, Material::BlinnPhong(BlinnPhong::default())).unwrap();
        });
        let error = material.unwrap_err();
        assert!(error.contains("entity 1") && error.contains("assets.add_material"), "{error}");
        let mesh = refused(&|world, ball| world.entities.insert_one(ball, Mesh::default()).unwrap());
        assert!(mesh.unwrap_err().contains("assets.add_mesh"));
    }
}
