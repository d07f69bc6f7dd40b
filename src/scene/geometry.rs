//! Geometry as shading sees it: by primitive id.

use crate::math::NONE;

/// Vertices, triangles and spheres. Those of the world's tree are in world space, those
/// of instanced subtrees in the space of their mesh.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Vertices.
    pub positions: Vec<[f32; 3]>,
    /// Shading normals of the parts that have them.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates of the parts that have them.
    pub uvs: Vec<[f32; 2]>,
    /// A second set of texture coordinates of the parts that have them.
    pub uvs1: Vec<[f32; 2]>,
    /// Tangents of the parts that have them, not of unit length, and the bitangent's sign.
    pub tangents: Vec<[f32; 4]>,
    /// Vertex colours of the parts that have them.
    pub colors: Vec<[f32; 3]>,
    /// Vertex alphas of the parts that have them.
    pub alphas: Vec<f32>,
    /// Vertex indices by triangle id.
    pub triangles: Vec<[u32; 3]>,
    /// The part of each triangle.
    pub triangle_parts: Vec<u32>,
    /// Centres and radii by sphere id (without its flag).
    pub spheres: Vec<[f32; 4]>,
    /// World to object rotation of each sphere, by rows, for its texture coordinates.
    pub sphere_axes: Vec<[f32; 9]>,
    /// The part of each sphere.
    pub sphere_parts: Vec<u32>,
    /// What the primitives of one shape and material share.
    pub parts: Parts,
    /// How many triangles lie in world space: the first ones.
    pub world_triangles: u32,
    /// How many spheres do.
    pub world_spheres: u32,
    /// Where the triangles and spheres of each subtree with instances begin and end.
    pub subtrees: Vec<[[u32; 2]; 2]>,
    /// For each instance the rows of its matrices: to world, with what is added to points after they are turned (12
    /// floats), and to local, with what is subtracted from points before they are turned (12 floats).
    pub instances: Vec<[f32; 24]>,
    /// 1, or −1 for instances whose transforms turn counter-clockwise into clockwise.
    pub instance_signs: Vec<f32>,
    /// The material that an instance gives to all of its subtree, or [`NONE`].
    pub instance_materials: Vec<u32>,
    /// The number of each instance's entity in the world, for people.
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
    /// 1 or, see [`Part::mirrored`], −1.
    pub sign: Vec<f32>,
    /// The entity's number in the world, for people.
    pub entity: Vec<u32>,
}

/// What the primitives of one shape and material share.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Index into the materials.
    pub material: u32,
    /// Added (wrapping) to a vertex index gives the index of its normal; [`NONE`]: flat.
    pub normals: u32,
    /// The same for texture coordinates.
    pub uvs: u32,
    /// The same for the second set.
    pub uvs1: u32,
    /// The same for tangents.
    pub tangents: u32,
    /// The same for colours.
    pub colors: u32,
    /// The same for alphas.
    pub alphas: u32,
    /// Whether its transform turned counter-clockwise into clockwise.
    pub mirrored: bool,
    /// The entity's number in the world.
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
        self.parts.sign.push(if part.mirrored { -1.0 } else { 1.0 });
        self.parts.entity.push(part.entity);
        self.parts.material.len() as u32 - 1
    }

    /// A part by its index.
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
            mirrored: parts.sign[at] < 0.0,
            entity: parts.entity[at],
        }
    }

    /// Whether a tree over one is a tree over the other: all that can be hit is in the same places, in the same
    /// order.
    pub fn has_the_tree_of(&self, other: &Geometry) -> bool {
        (self.world_triangles, self.world_spheres) == (other.world_triangles, other.world_spheres)
            && self.triangles == other.triangles
            && same_bits(&self.spheres, &other.spheres)
            && same_bits(&self.instances, &other.instances)
            && same_bits(&self.positions, &other.positions)
    }

    /// What the acceleration structure is built from.
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

    /// Whether a primitive's transform turned counter-clockwise into clockwise; an instance's does not count.
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

    /// The part of a primitive.
    pub fn part_of(&self, primitive: u32) -> u32 {
        if primitive & crate::bvh::SPHERE != 0 {
            self.sphere_parts[(primitive & !crate::bvh::SPHERE) as usize]
        } else {
            self.triangle_parts[primitive as usize]
        }
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.positions[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.uvs[..])
            + size_of_val(&self.uvs1[..])
            + size_of_val(&self.tangents[..])
            + size_of_val(&self.colors[..])
            + size_of_val(&self.alphas[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.triangle_parts[..])
            + size_of_val(&self.spheres[..])
            + size_of_val(&self.sphere_axes[..])
            + size_of_val(&self.sphere_parts[..])
            + size_of_val(&self.instances[..])
    }
}

/// Whether columns are the same to the bit: the sign of a zero counts, and so does NaN.
fn same_bits<const N: usize>(a: &[[f32; N]], b: &[[f32; N]]) -> bool {
    let pairs = || a.as_flattened().iter().zip(b.as_flattened());
    a.len() == b.len() && pairs().all(|(a, b)| a.to_bits() == b.to_bits())
}
