//! Geometry for shading, indexed by primitive id.

use crate::math::NONE;

/// Vertices, triangles and spheres. The primitives of the world's tree are in world space, those of instanced subtrees
/// in the space of their mesh.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Positions of vertices.
    pub positions: Vec<[f32; 3]>,
    /// Shading normals of the parts that have them.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates of the parts that have them.
    pub uvs: Vec<[f32; 2]>,
    /// Second texture coordinates of the parts that have them.
    pub uvs1: Vec<[f32; 2]>,
    /// Tangents of the parts that have them, not of unit length, and the bitangent's sign.
    pub tangents: Vec<[f32; 4]>,
    /// Vertex colours of the parts that have them.
    pub colors: Vec<[f32; 3]>,
    /// Vertex alphas of the parts that have them.
    pub alphas: Vec<f32>,
    /// Positions in the object's space of the parts that have them.
    pub object_positions: Vec<[f32; 3]>,
    /// True if positions in the object's space are known.
    pub keeps_object_space: bool,
    /// True if some texture looks up what is at the vertices.
    pub has_vertex_textures: bool,
    /// Vertex indices by triangle id.
    pub triangles: Vec<[u32; 3]>,
    /// The part that each triangle belongs to.
    pub triangle_parts: Vec<u32>,
    /// Centres and radii by sphere id (without its flag).
    pub spheres: Vec<[f32; 4]>,
    /// World to object rotation of each sphere, by rows, for its texture coordinates.
    pub sphere_axes: Vec<[f32; 9]>,
    /// The part that each sphere belongs to.
    pub sphere_parts: Vec<u32>,
    /// Data shared by the primitives of one shape and material.
    pub parts: Parts,
    /// The number of triangles in world space; these come first.
    pub world_triangles: u32,
    /// The number of spheres in world space; these come first.
    pub world_spheres: u32,
    /// The number of triangles of the world, those of instances included.
    pub placed_triangles: u64,
    /// The ranges of triangles and of spheres of each instanced subtree.
    pub subtrees: Vec<[[u32; 2]; 2]>,
    /// The matrices of each instance, by rows: local to world, with the translation added after the rotation (12
    /// floats); world to local, with the translation subtracted before the rotation (12 floats).
    pub instances: Vec<[f32; 24]>,
    /// 1 for each instance, or −1 if its transform turns counter-clockwise into clockwise.
    pub instance_signs: Vec<f32>,
    /// The material that overrides all materials of an instance's subtree, or [`NONE`].
    pub instance_materials: Vec<u32>,
    /// The number of each instance's entity in the world, for messages.
    pub instance_entities: Vec<u32>,
}

/// Columns of [`Part`].
#[derive(Clone, Debug, Default)]
pub struct Parts {
    /// See [`Part::material`].
    pub material: Vec<u32>,
    /// See [`Part::normals`].
    pub normals: Vec<u32>,
    /// See [`Part::uvs`].
    pub uvs: Vec<u32>,
    /// See [`Part::uvs1`].
    pub uvs1: Vec<u32>,
    /// See [`Part::tangents`].
    pub tangents: Vec<u32>,
    /// See [`Part::colors`].
    pub colors: Vec<u32>,
    /// See [`Part::alphas`].
    pub alphas: Vec<u32>,
    /// See [`Part::object`].
    pub object: Vec<u32>,
    /// 1, or −1 if the part is [`Part::mirrored`].
    pub sign: Vec<f32>,
    /// The number of the part's entity in the world, for messages.
    pub entity: Vec<u32>,
}

/// Data shared by the primitives of one shape and material.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Index into the materials.
    pub material: u32,
    /// Added (wrapping) to a vertex index to get the index of its normal; [`NONE`] for flat shading.
    pub normals: u32,
    /// Added (wrapping) to a vertex index to get the index of its texture coordinates, or [`NONE`].
    pub uvs: u32,
    /// Added (wrapping) to a vertex index to get the index of its second texture coordinates, or [`NONE`].
    pub uvs1: u32,
    /// Added (wrapping) to a vertex index to get the index of its tangent, or [`NONE`].
    pub tangents: u32,
    /// Added (wrapping) to a vertex index to get the index of its colour, or [`NONE`].
    pub colors: u32,
    /// Added (wrapping) to a vertex index to get the index of its alpha, or [`NONE`].
    pub alphas: u32,
    /// Added (wrapping) to a vertex index to get the index of its position in the object's space; [`NONE`] if that is
    /// its position. Of a sphere, the bits of its radius in the object's space.
    pub object: u32,
    /// True if the part's transform turned counter-clockwise into clockwise.
    pub mirrored: bool,
    /// The number of the part's entity in the world.
    pub entity: u32,
}

impl Geometry {
    /// Adds a part and returns its index.
    pub fn add_part(&mut self, part: Part) -> u32 {
        self.parts.material.push(part.material);
        self.parts.normals.push(part.normals);
        self.parts.uvs.push(part.uvs);
        self.parts.uvs1.push(part.uvs1);
        self.parts.tangents.push(part.tangents);
        self.parts.colors.push(part.colors);
        self.parts.alphas.push(part.alphas);
        self.parts.object.push(part.object);
        self.parts.sign.push(if part.mirrored { -1.0 } else { 1.0 });
        self.parts.entity.push(part.entity);
        self.parts.material.len() as u32 - 1
    }

    /// The part with an index.
    pub fn part(&self, index: u32) -> Part {
        let (parts, at) = (&self.parts, index as usize);
        Part {
            material: parts.material[at],
            normals: parts.normals[at],
            uvs: parts.uvs[at],
            uvs1: parts.uvs1[at],
            tangents: parts.tangents[at],
            colors: parts.colors[at],
            alphas: parts.alphas[at],
            object: parts.object[at],
            mirrored: parts.sign[at] < 0.0,
            entity: parts.entity[at],
        }
    }

    /// True if an acceleration structure over `other` is also valid for `self`: all primitives and instances have the
    /// same positions and order.
    pub fn has_the_tree_of(&self, other: &Geometry) -> bool {
        (self.world_triangles, self.world_spheres) == (other.world_triangles, other.world_spheres)
            && self.triangles == other.triangles
            && same_bits(&self.spheres, &other.spheres)
            && same_bits(&self.instances, &other.instances)
            && same_bits(&self.positions, &other.positions)
    }

    /// The arrays from which the acceleration structure is built.
    pub fn shapes(&self) -> crate::bvh::PrimitiveArrays<'_> {
        crate::bvh::PrimitiveArrays {
            positions: &self.positions,
            triangles: &self.triangles,
            spheres: &self.spheres,
        }
    }

    /// The material of a hit.
    pub fn material_of(&self, primitive: u32, instance: u32) -> u32 {
        if instance != NONE {
            let own = self.instance_materials[instance as usize];
            if own != NONE {
                return own;
            }
        }
        self.parts.material[self.part_of(primitive) as usize]
    }

    /// True if the transform of a primitive's part turned counter-clockwise into clockwise; the instance's transform is
    /// ignored.
    pub fn is_mirrored(&self, primitive: u32) -> bool {
        primitive & crate::bvh::SPHERE == 0 && self.parts.sign[self.part_of(primitive) as usize] < 0.0
    }

    /// The number of a hit's entity in the world.
    pub fn entity_of(&self, primitive: u32, instance: u32) -> u32 {
        match self.instance_entities.get(instance as usize) {
            Some(entity) => *entity,
            None => self.parts.entity[self.part_of(primitive) as usize],
        }
    }

    /// The index of a primitive's part.
    pub fn part_of(&self, primitive: u32) -> u32 {
        if primitive & crate::bvh::SPHERE != 0 {
            self.sphere_parts[(primitive & !crate::bvh::SPHERE) as usize]
        } else {
            self.triangle_parts[primitive as usize]
        }
    }

    /// The size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.positions[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.uvs[..])
            + size_of_val(&self.uvs1[..])
            + size_of_val(&self.tangents[..])
            + size_of_val(&self.colors[..])
            + size_of_val(&self.alphas[..])
            + size_of_val(&self.object_positions[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.triangle_parts[..])
            + size_of_val(&self.spheres[..])
            + size_of_val(&self.sphere_axes[..])
            + size_of_val(&self.sphere_parts[..])
            + size_of_val(&self.instances[..])
    }
}

/// True if two columns have identical bits; thus 0 differs from −0, and NaN equals itself.
fn same_bits<const N: usize>(a: &[[f32; N]], b: &[[f32; N]]) -> bool {
    let pairs = || a.as_flattened().iter().zip(b.as_flattened());
    a.len() == b.len() && pairs().all(|(a, b)| a.to_bits() == b.to_bits())
}
