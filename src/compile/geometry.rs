//! Compiles shapes to vertex, triangle and sphere arrays, and builds the tree over them.
//!
//! A mesh that is placed once is transformed to world space and lies in the world's tree. So is one that is placed
//! several times, copy by copy, while copies are few ([`Settings::copied_triangles`]); other meshes get a subtree of
//! their own, shared by their instances. So do spheres that a transform turns into ellipsoids: all are instances of one
//! unit sphere.
//!
//! [`Settings::copied_triangles`]: crate::world::Settings::copied_triangles

mod size;

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use hecs::Entity;

use super::copies::Copies;
use super::light_groups::LightGroups;
use super::lights::LightMesh;
use super::materials::{TwoSidedVariants, in_place_of};
use super::memo::{self, ByPtr, debug_text};
use super::open_surfaces::Sheet;
use super::shape_meshes::{ShapeMeshes, fan_mesh, flat_mesh};
use crate::bvh::{Bvh, Child, ChildKind, Instance, Root};
use crate::error::CompileError;
use crate::math::{Aabb, DAffine3, DMat3, NONE, Vec3};
use crate::scene::{CompiledScene, Geometry, Part};
use crate::world::transforms::{WorldTransforms, entity_error, normal_matrix, point, uniform_scale};
use crate::world::{MaterialId, Mesh, MeshId, Procedure, Shape, World, check_plane};

/// The compiled shapes.
#[derive(Clone)]
pub(super) struct CompiledGeometry {
    pub geometry: Arc<Geometry>,
    /// The triangles of each instance.
    pub placed: Arc<Vec<Range<u32>>>,
    /// The triangles of each copy of a mesh that is placed several times.
    pub copies: Arc<Vec<Range<u32>>>,
}

/// A world with the places and meshes of its shapes.
#[derive(Clone, Copy)]
pub(super) struct PlacedWorld<'a> {
    pub world: &'a World,
    pub order: &'a [Entity],
    pub transforms: &'a WorldTransforms,
    pub copies: &'a Copies,
    pub shapes: &'a ShapeMeshes,
    pub groups: &'a LightGroups,
}

/// All inputs of geometry and trees.
#[derive(PartialEq)]
pub(super) struct GeometryInputs {
    shapes: Vec<PlacedShape>,
    panels: Vec<LightMesh>,
    meshes: Vec<ByPtr<Mesh>>,
    copied_triangles: u32,
    /// True if some texture is in the object's space.
    keeps_object_space: bool,
    /// True if some texture looks up what is at the vertices.
    has_vertex_textures: bool,
}

/// An entity that rays can hit.
struct PlacedShape {
    entity: u32,
    shape: Shape,
    matrix: DAffine3,
    /// The places of its copies, if there are any.
    copies: Option<Arc<Vec<DAffine3>>>,
    material: Option<MaterialId>,
    /// Pairs of one of the mesh's own materials and the sheet's record that replaces it.
    replaced: Vec<[MaterialId; 2]>,
}

impl PlacedShape {
    /// Its matrix at each of its places.
    fn matrices(&self) -> impl Iterator<Item = DAffine3> {
        (0..self.places())
            .map(|at| self.copies.as_ref().map_or(self.matrix, |copies| copies[at] * self.matrix))
    }

    fn places(&self) -> usize {
        self.copies.as_ref().map_or(1, |copies| copies.len())
    }

    /// The record of triangles with a material of their mesh.
    fn record(&self, own: MaterialId) -> MaterialId {
        self.material.unwrap_or_else(|| in_place_of(own, &self.replaced))
    }
}

impl PartialEq for PlacedShape {
    /// Compares matrices and numbers bit by bit.
    fn eq(&self, other: &Self) -> bool {
        let matrix = |of: &Self| of.matrix.to_cols_array().map(f64::to_bits);
        let same_shape = match (&self.shape, &other.shape) {
            (Shape::Mesh(a), Shape::Mesh(b)) => a == b,
            (a, b) => a == b && debug_text(a) == debug_text(b),
        };
        (self.entity, self.material, &self.replaced, matrix(self))
            == (other.entity, other.material, &other.replaced, matrix(other))
            && same_shape
            && self.copies == other.copies
    }
}

impl GeometryInputs {
    /// The inputs from a world. Fails for planes that are not flat and convex.
    pub(super) fn new(
        placed: &PlacedWorld,
        panels: Vec<LightMesh>,
        open: &HashMap<u32, &Sheet>,
        sheets: &mut TwoSidedVariants,
    ) -> Result<GeometryInputs, CompileError> {
        let PlacedWorld { world, order, transforms, copies, shapes: made, groups } = *placed;
        let mut shapes = Vec::new();
        for &entity in order {
            let Ok(authored) = world.entities.get::<&Shape>(entity) else { continue };
            let Some(shape) = made.shape(world, entity) else { continue };
            let mut material = world.entities.get::<&MaterialId>(entity).ok().map(|m| *m);
            let mut replaced =
                open.get(&entity.id()).map_or(Vec::new(), |sheet| sheets.in_place_of(&sheet.materials));
            if material.is_none() && is_colored_by_vertices(&shape, world) {
                replaced.push([MaterialId::DEFAULT, sheets.white()]);
            }
            material = material.map(|own| in_place_of(own, &replaced));
            if let Shape::Plane { corners } = shape {
                check_plane(corners).map_err(|(_, reason)| entity_error(world, entity, reason))?;
            }
            if authored.is_sheet() {
                // A plane's corners may go around either way: it is a sheet, visible from both sides.
                material = Some(sheets.of(material.unwrap_or(MaterialId::DEFAULT)));
            }
            let own = match &shape {
                Shape::Mesh(id) => &made.meshes[id.0 as usize].triangle_materials[..],
                _ => &[],
            };
            sheets.put_in_group(groups.of(entity), &mut material, own, &mut replaced);
            let matrix = made.placement(world, entity, &shape, &transforms[&entity]);
            let copies = copies.of(entity).cloned();
            shapes.push(PlacedShape { entity: entity.id(), shape, matrix, copies, material, replaced });
        }
        let settings = &world.settings;
        Ok(GeometryInputs {
            shapes,
            panels,
            meshes: memo::all(&made.meshes),
            copied_triangles: settings.copied_triangles,
            keeps_object_space: world.assets.procedures.iter().any(Procedure::is_in_object_space),
            has_vertex_textures: world.assets.procedures.iter().any(Procedure::is_at_vertices),
        })
    }

    fn mesh(&self, id: MeshId) -> &Mesh {
        &self.meshes[id.0 as usize].0
    }

    /// The number of corners of each flat shape, those of visible lights among them.
    fn flat_shapes(&self) -> impl Iterator<Item = usize> {
        let shapes = self.shapes.iter().flat_map(|placed| {
            let corners = placed.shape.flat_corners().map(|(_, corners)| corners.len());
            corners.into_iter().flat_map(|count| std::iter::repeat_n(count, placed.places()))
        });
        shapes.chain(self.panels.iter().map(|panel| panel.corners.len()))
    }
}

/// True if a mesh has colours, and a material of its own for some of its triangles at most.
fn is_colored_by_vertices(shape: &Shape, world: &World) -> bool {
    let Shape::Mesh(id) = shape else { return false };
    world.assets.meshes.get(id.0 as usize).is_some_and(|mesh| {
        let materials = &mesh.triangle_materials;
        !mesh.colors.is_empty() && (materials.is_empty() || materials.contains(&MaterialId::DEFAULT))
    })
}

/// Compiles the shapes. Also returns the tree: that of `before`, if it is over the same shapes.
pub(super) fn compile(
    inputs: &GeometryInputs,
    before: Option<&CompiledScene>,
) -> Result<(CompiledGeometry, Arc<Bvh>), CompileError> {
    let mut builder = GeometryBuilder::default();
    builder.geometry.keeps_object_space = inputs.keeps_object_space;
    builder.geometry.has_vertex_textures = inputs.has_vertex_textures;
    let (mut placed, mut copies) = (Vec::new(), Vec::new());
    let uses = size::count_uses(inputs);
    let copied = size::choose_copied(inputs, &uses);
    let _claim = size::check(inputs, &uses, &copied)?;
    builder.reserve(inputs, &uses, &copied);
    for placed_shape in &inputs.shapes {
        let PlacedShape { entity, shape, material: own, replaced, .. } = placed_shape;
        let (entity, own) = (*entity, *own);
        let part = |material: MaterialId| Part { entity, ..plain_part(material) };
        for matrix in placed_shape.matrices() {
            let matrix = &matrix;
            match shape {
                Shape::Sphere { radius_m } => match uniform_scale(matrix) {
                    Some(scale) => {
                        let part =
                            Part { object: radius_m.to_bits(), ..part(own.unwrap_or(MaterialId::DEFAULT)) };
                        builder.sphere(matrix, *radius_m as f64 * scale, part)
                    }
                    None => {
                        let to_world = *matrix * DAffine3::from_scale(glam::DVec3::splat(*radius_m as f64));
                        let material = own.unwrap_or(MaterialId::DEFAULT);
                        let radius = if inputs.keeps_object_space { radius_m.to_bits() } else { 0 };
                        placed.push((InstancedTree::UnitSphere(radius), to_world, material, entity));
                    }
                },
                Shape::Mesh(id) if copied[id.0 as usize] => {
                    let first = builder.geometry.triangles.len() as u32;
                    builder.mesh(inputs.mesh(*id), matrix, |own_material| {
                        part(placed_shape.record(own_material))
                    });
                    if uses[id.0 as usize] > 1 {
                        copies.push(first..builder.geometry.triangles.len() as u32);
                    }
                }
                Shape::Mesh(id) => {
                    let material = own.unwrap_or(MaterialId(NONE));
                    let replaced = if own.is_none() { &replaced[..] } else { &[] };
                    placed.push((InstancedTree::Mesh(*id, replaced), *matrix, material, entity));
                }
                // Parametric shapes have become meshes.
                _ => {
                    builder.mesh(&flat_mesh(shape), matrix, |_| part(own.unwrap_or(MaterialId::DEFAULT)));
                }
            }
        }
    }
    for panel in &inputs.panels {
        let mesh = fan_mesh(&panel.corners);
        let part = Part { entity: panel.entity.id(), ..plain_part(MaterialId(panel.material)) };
        builder.mesh(&mesh, &DAffine3::IDENTITY, |_| part);
    }
    let (geometry, placed, bvh) = builder.finish(inputs, placed, before);
    let (geometry, placed, copies) = (Arc::new(geometry), Arc::new(placed), Arc::new(copies));
    Ok((CompiledGeometry { geometry, placed, copies }, bvh))
}

fn plain_part(material: MaterialId) -> Part {
    Part {
        material: material.0,
        normals: NONE,
        uvs: NONE,
        uvs1: NONE,
        tangents: NONE,
        colors: NONE,
        alphas: NONE,
        object: NONE,
        mirrored: false,
        entity: 0,
    }
}

/// A tree that instances share.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum InstancedTree<'a> {
    /// A mesh, and records in place of its own materials.
    Mesh(MeshId, &'a [[MaterialId; 2]]),
    /// The bits of the radius in the object's space, if that matters.
    UnitSphere(u32),
}

#[derive(Default)]
struct GeometryBuilder {
    geometry: Geometry,
}

impl GeometryBuilder {
    /// Reserves room for all meshes up front: an array that grows holds its content twice while it does.
    fn reserve(&mut self, inputs: &GeometryInputs, uses: &[u32], copied: &[bool]) {
        let places = |(uses, copied): (&u32, &bool)| if *copied { *uses } else { (*uses).min(1) } as usize;
        let times = uses.iter().zip(copied).map(places);
        let total = |count: fn(&Mesh) -> usize| -> usize {
            let meshes = inputs.meshes.iter().zip(times.clone());
            meshes.map(|(ByPtr(mesh), times)| times * count(mesh)).sum()
        };
        // Room for shapes that are not meshes.
        let more = inputs.flat_shapes().sum::<usize>();
        let g = &mut self.geometry;
        g.positions.reserve_exact(total(|mesh| mesh.positions.len()) + more);
        g.normals.reserve_exact(total(|mesh| mesh.normals.len()) + more);
        g.uvs.reserve_exact(total(|mesh| mesh.uvs.len()) + more);
        g.uvs1.reserve_exact(total(|mesh| mesh.uvs1.len()));
        g.tangents.reserve_exact(total(|mesh| mesh.tangents.len()));
        g.colors.reserve_exact(total(|mesh| mesh.colors.len()));
        g.alphas.reserve_exact(total(|mesh| mesh.alphas.len()));
        let triangles = total(|mesh| mesh.triangles.len()) + more;
        g.triangles.reserve_exact(triangles);
        g.triangle_parts.reserve_exact(triangles);
    }

    fn sphere(&mut self, matrix: &DAffine3, radius: f64, part: Part) {
        let part = self.geometry.add_part(part);
        let center = matrix.translation.as_vec3();
        self.geometry.spheres.push([center.x, center.y, center.z, radius as f32]);
        let axis = |v: glam::DVec3| v.normalize().as_vec3().to_array();
        let m = matrix.matrix3;
        let axes = [axis(m.x_axis), axis(m.y_axis), axis(m.z_axis)];
        self.geometry.sphere_axes.push(std::array::from_fn(|i| axes[i / 3][i % 3]));
        self.geometry.sphere_parts.push(part);
    }

    /// Adds a transformed mesh. `part` returns the part of triangles with some material.
    fn mesh(&mut self, mesh: &Mesh, matrix: &DAffine3, part: impl Fn(MaterialId) -> Part) {
        let g = &mut self.geometry;
        let first = g.positions.len() as u32;
        let base = |used: bool, next: usize| if used { (next as u32).wrapping_sub(first) } else { NONE };
        let moved = *matrix != DAffine3::IDENTITY;
        let shared = Part {
            normals: base(!mesh.normals.is_empty(), g.normals.len()),
            uvs: base(!mesh.uvs.is_empty(), g.uvs.len()),
            uvs1: base(!mesh.uvs1.is_empty(), g.uvs1.len()),
            tangents: base(!mesh.tangents.is_empty(), g.tangents.len()),
            colors: base(!mesh.colors.is_empty(), g.colors.len()),
            alphas: base(!mesh.alphas.is_empty(), g.alphas.len()),
            object: base(moved && g.keeps_object_space, g.object_positions.len()),
            mirrored: matrix.matrix3.determinant() < 0.0,
            ..plain_part(MaterialId::DEFAULT)
        };
        if !moved {
            g.positions.extend(mesh.positions.iter().map(|p| p.to_array()));
        } else {
            if g.keeps_object_space {
                g.object_positions.extend(mesh.positions.iter().map(|p| p.to_array()));
            }
            g.positions.extend(mesh.positions.iter().map(|p| point(matrix, *p).to_array()));
        }
        let normals = relative(normal_matrix(matrix));
        g.normals.extend(mesh.normals.iter().map(|n| transform_normal(&normals, *n)));
        g.uvs.extend(mesh.uvs.iter().map(|uv| uv.to_array()));
        g.uvs1.extend(mesh.uvs1.iter().map(|uv| uv.to_array()));
        let along = relative(matrix.matrix3);
        g.tangents.extend(mesh.tangents.iter().map(|t| {
            let [x, y, z] = (along * t.truncate().as_dvec3()).as_vec3().to_array();
            [x, y, z, t.w]
        }));
        g.colors.extend(mesh.colors.iter().map(|c| c.to_array()));
        g.alphas.extend_from_slice(&mesh.alphas);
        g.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
        let mut parts = std::collections::HashMap::new();
        let mut part_of = |g: &mut Geometry, material: MaterialId| {
            *parts.entry(material).or_insert_with(|| {
                let Part { material, entity, .. } = part(material);
                g.add_part(Part { material, entity, ..shared })
            })
        };
        if mesh.triangle_materials.is_empty() {
            let part = part_of(g, MaterialId::DEFAULT);
            g.triangle_parts.resize(g.triangles.len(), part);
        } else {
            for material in &mesh.triangle_materials {
                let part = part_of(g, *material);
                g.triangle_parts.push(part);
            }
        }
    }

    /// Adds instances and builds the trees, unless those of `before` are over the same shapes.
    fn finish(
        mut self,
        inputs: &GeometryInputs,
        placed: Vec<(InstancedTree<'_>, DAffine3, MaterialId, u32)>,
        before: Option<&CompiledScene>,
    ) -> (Geometry, Vec<Range<u32>>, Arc<Bvh>) {
        let (triangles, spheres) = (self.geometry.triangles.len() as u32, self.geometry.spheres.len() as u32);
        (self.geometry.world_triangles, self.geometry.world_spheres) = (triangles, spheres);
        let mut numbers = HashMap::new();
        let mut subtrees: Vec<[Range<u32>; 2]> = Vec::new();
        let mut instances = Vec::with_capacity(placed.len());
        for (subtree, matrix, material, entity) in placed {
            let number = *numbers.entry(subtree).or_insert_with(|| {
                subtrees.push(self.subtree(inputs, subtree));
                subtrees.len() - 1
            });
            // An empty mesh has no tree.
            if subtrees[number].iter().all(|range| range.is_empty()) {
                continue;
            }
            // The root is set once the tree is built.
            let instance =
                Instance::new(&matrix, Root { child: Child::new(ChildKind::Node, 0), bounds: Aabb::EMPTY });
            let mut rows = [0.0; 24];
            rows[..12].copy_from_slice(instance.to_world.as_flattened());
            for ((row, turned), place) in
                rows[12..].chunks_exact_mut(4).zip(instance.to_local).zip(instance.place())
            {
                row.copy_from_slice(&[turned[0], turned[1], turned[2], place]);
            }
            self.geometry.instances.push(rows);
            self.geometry.instance_signs.push(if matrix.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 });
            self.geometry.instance_materials.push(material.0);
            self.geometry.instance_entities.push(entity);
            instances.push((number, instance));
        }
        let ends = |range: &Range<u32>| [range.start, range.end];
        self.geometry.subtrees = subtrees.iter().map(|[t, s]| [ends(t), ends(s)]).collect();
        let ranges: Vec<Range<u32>> =
            instances.iter().map(|(number, _)| subtrees[*number][0].clone()).collect();
        self.geometry.placed_triangles =
            u64::from(triangles) + ranges.iter().map(|range| range.len() as u64).sum::<u64>();
        let is_same = |before: &&CompiledScene| {
            before.geometry.subtrees == self.geometry.subtrees
                && self.geometry.has_the_tree_of(&before.geometry)
                && subtrees_in_order(&before.bvh.instances).eq(instances.iter().map(|(number, _)| *number))
        };
        let bvh = match before.filter(is_same) {
            Some(before) => before.bvh.clone(),
            None => {
                let bvh = Bvh::after(before.map(|before| &*before.bvh));
                Arc::new(self.with_trees(bvh, &subtrees, &instances))
            }
        };
        (self.geometry, ranges, bvh)
    }

    /// Adds the trees that instances share, then the world's.
    fn with_trees(&self, mut bvh: Bvh, subtrees: &[[Range<u32>; 2]], instances: &[(usize, Instance)]) -> Bvh {
        let shapes = self.geometry.shapes();
        let mut build = |[triangles, spheres]: &[Range<u32>; 2]| {
            bvh.add_tree(&shapes, triangles.clone(), spheres.clone())
        };
        let roots: Vec<Option<Root>> = subtrees.iter().map(&mut build).collect();
        for (number, instance) in instances {
            let Some(root) = &roots[*number] else { continue };
            bvh.instances.push(Instance { root: *root, ..instance.clone() });
        }
        bvh.add_root(&shapes, 0..self.geometry.world_triangles, 0..self.geometry.world_spheres);
        bvh
    }

    /// Adds the triangles and spheres of a shared tree, and returns them.
    fn subtree(&mut self, inputs: &GeometryInputs, subtree: InstancedTree) -> [Range<u32>; 2] {
        let (triangles, spheres) = (self.geometry.triangles.len() as u32, self.geometry.spheres.len() as u32);
        match subtree {
            InstancedTree::UnitSphere(object) => {
                let part = Part { object, ..plain_part(MaterialId::DEFAULT) };
                self.sphere(&DAffine3::IDENTITY, 1.0, part)
            }
            InstancedTree::Mesh(id, replaced) => {
                self.mesh(inputs.mesh(id), &DAffine3::IDENTITY, |own| plain_part(in_place_of(own, replaced)));
            }
        }
        let (t, s) = (self.geometry.triangles.len() as u32, self.geometry.spheres.len() as u32);
        [triangles..t, spheres..s]
    }
}

/// Numbers of the instances' subtrees, in the order of their first use.
fn subtrees_in_order(instances: &[Instance]) -> impl Iterator<Item = usize> {
    let mut numbers = HashMap::new();
    instances.iter().map(move |instance| {
        let next = numbers.len();
        *numbers.entry(instance.root.child.0).or_insert(next)
    })
}

/// The matrix divided by its largest scale, so that products with unit vectors fit into floats.
fn relative(matrix: DMat3) -> DMat3 {
    let largest = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.length()).into_iter();
    matrix * (1.0 / largest.fold(f64::MIN_POSITIVE, f64::max))
}

/// A normal in the new space, not normalized: interpolated between vertices, it must have the direction that an
/// instance gets, which interpolates first and transforms then. A zero normal stays zero, for flat shading.
fn transform_normal(matrix: &DMat3, normal: Vec3) -> [f32; 3] {
    let n = *matrix * normal.as_dvec3().normalize_or_zero();
    n.as_vec3().to_array()
}
