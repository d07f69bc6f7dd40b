//! `EXT_mesh_gpu_instancing`: many instances of a node's mesh.

use gltf::json;
use gltf::json::accessor::{ComponentType, Type};

use super::accessor::{self, Rule};
use super::extensions::node::Instancing;
use super::{Import, pose};
use crate::error::LoadError;
use crate::math::{DAffine3, Vec3};
use crate::world::Transform;

const F32: &[ComponentType] = &[ComponentType::F32];
const SIGNED: &[ComponentType] = &[ComponentType::F32, ComponentType::I8, ComponentType::I16];
const VECTOR: Rule = Rule { types: &[Type::Vec3], components: F32, always_normalized: false };
const ROTATION: Rule = Rule { types: &[Type::Vec4], components: SIGNED, always_normalized: true };
/// The approximate size of an instance in bytes.
const INSTANCE_BYTES: u64 = 256;

impl Import<'_> {
    /// The transforms of a node's instances; none if it is not instanced.
    pub(super) fn instances(
        &self,
        node: &json::Node,
        at: &str,
    ) -> Result<Option<Vec<(Transform, DAffine3)>>, LoadError> {
        let document = self.document;
        let extensions = node.extensions.as_ref().map(|extensions| &extensions.others);
        let name = "EXT_mesh_gpu_instancing";
        let Some(read) = document.strict_extension::<Instancing>(extensions, name, at)? else {
            return Ok(None);
        };
        let at = format!("{at}/extensions/{name}/attributes");
        let mut count = None;
        let translations = self.column::<3>(&read, "TRANSLATION", &VECTOR, &at, &mut count)?;
        let rotations = self.column::<4>(&read, "ROTATION", &ROTATION, &at, &mut count)?;
        let scales = self.column::<3>(&read, "SCALE", &VECTOR, &at, &mut count)?;
        // Other attributes are application-specific.
        let Some(count) = count else { return Ok(None) };
        document.charge(count as u64 * INSTANCE_BYTES, &at)?;
        let mut instances = Vec::with_capacity(count);
        for number in 0..count {
            let [translation, scale] = [(&translations, Vec3::ZERO), (&scales, Vec3::ONE)]
                .map(|(column, usual)| column.get(number).map_or(usual, |v| Vec3::from_array(*v)));
            let rotation = rotations.get(number).copied().unwrap_or([0.0, 0.0, 0.0, 1.0]);
            if !(accessor::is_finite(&translation.to_array()) && accessor::is_finite(&scale.to_array())) {
                document.mend(&at, format_args!("instance {number} is not finite: it is left out"));
                continue;
            }
            let rotation = pose::rotation(document, rotation, &format!("{at}/ROTATION")).normalize();
            let translation = translation.as_dvec3();
            let matrix = DAffine3::from_scale_rotation_translation(scale.as_dvec3(), rotation, translation);
            instances.push((Transform::Trs { translation, rotation: rotation.as_quat(), scale }, matrix));
        }
        Ok(Some(instances))
    }

    /// Reads an attribute of all instances. All attributes must have the same number of elements.
    fn column<const N: usize>(
        &self,
        read: &Instancing,
        name: &str,
        rule: &Rule,
        at: &str,
        count: &mut Option<usize>,
    ) -> Result<Vec<[f32; N]>, LoadError> {
        let Some(index) = read.attributes.get(name) else { return Ok(Vec::new()) };
        let place = format!("{at}/{name}");
        let column = accessor::floats::<N>(self.document, *index, rule, &place)?;
        let expected = *count.get_or_insert(column.len());
        if column.len() != expected {
            let reason = format!("there are {} of these and {expected} of others", column.len());
            return Err(self.document.error(place, reason));
        }
        Ok(column)
    }
}
