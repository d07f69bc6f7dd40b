//! Open surfaces of glass: those with a thickness are thin sheets; three or more that meet in an edge are interfaces.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use hecs::Entity;

use super::memo::ByPtr;
use super::shape_meshes::ShapeMeshes;
use crate::error::Diagnostic;
use crate::error::words;
use crate::math::{DAffine3, Vec3};
use crate::world::boundary::{
    JoinedSurfaces, MOST_TESTED, MeshEdges, area, inside, is_crack, joined, six_volumes,
};
use crate::world::transforms::{WorldTransforms, point};
use crate::world::{Material, MaterialId, Mesh, Shape, World};

/// The winding number below which a surface is a sheet: half-way between those of a flat surface and of a body.
const BODY: f64 = 0.75;
/// The winding number above which a surface's holes are too small to make it a shell.
const HARDLY_OPEN: f64 = 0.99;

/// The least number of surfaces, and of their materials, that make interfaces.
const FEWEST: usize = 3;

/// All surfaces of glass, if any of them has a thickness or some of them may be interfaces.
#[derive(PartialEq)]
pub(super) struct OpenSurfaceInputs(Vec<GlassSurface>);

/// The part of an entity's shape that is glass.
struct GlassSurface {
    entity: u32,
    name: String,
    corners: SurfaceCorners,
    matrix: DAffine3,
    /// Its glass materials, and their thickness before the transform; none if they have no volume.
    materials: Vec<(MaterialId, Option<f32>)>,
    /// True if these are the mesh's own materials; it may have others.
    own: bool,
}

#[derive(PartialEq)]
enum SurfaceCorners {
    Mesh(ByPtr<Mesh>),
    /// A convex polygon.
    Fan(Vec<Vec3>),
}

impl PartialEq for GlassSurface {
    /// Compares matrices bit by bit.
    fn eq(&self, other: &Self) -> bool {
        let bits = |of: &Self| of.matrix.to_cols_array().map(f64::to_bits);
        (self.entity, &self.name, &self.corners, &self.materials, self.own, bits(self))
            == (other.entity, &other.name, &other.corners, &other.materials, other.own, bits(other))
    }
}

/// A surface that encloses nothing.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sheet {
    /// The number of its entity.
    pub entity: u32,
    /// Its human-readable name.
    name: String,
    /// Its glass materials, and the thickness of each in the world; none for interfaces.
    pub materials: Vec<(MaterialId, Option<f32>)>,
    open: usize,
    edges: usize,
}

impl OpenSurfaceInputs {
    /// The glass surfaces of a world.
    pub fn new(
        world: &World,
        order: &[Entity],
        transforms: &WorldTransforms,
        shapes: &ShapeMeshes,
    ) -> OpenSurfaceInputs {
        let glass = |id: MaterialId| glass(world, id);
        let of_glass: Vec<_> =
            (0..world.assets.materials.len() as u32).filter_map(|id| glass(MaterialId(id))).collect();
        let has_thickness = of_glass.iter().flatten().any(|thickness| *thickness > 0.0);
        if !has_thickness && of_glass.len() < FEWEST {
            return OpenSurfaceInputs(Vec::new());
        }
        let surface = |entity: Entity| {
            let shape = shapes.shape(world, entity)?;
            let given = world.entities.get::<&MaterialId>(entity).ok().map(|id| *id);
            let corners = match &shape {
                Shape::Mesh(id) => SurfaceCorners::Mesh(ByPtr(shapes.meshes.get(id.0 as usize)?.clone())),
                _ => SurfaceCorners::Fan(shape.flat_corners()?.1),
            };
            let of_triangles = match (&corners, given) {
                (SurfaceCorners::Mesh(mesh), None) => &mesh.0.triangle_materials[..],
                _ => &[],
            };
            let mut ids: Vec<_> = of_triangles.chunk_by(|a, b| a == b).map(|run| run[0]).collect();
            let own = !ids.is_empty();
            ids.extend(given);
            ids.sort_unstable();
            ids.dedup();
            let materials: Vec<_> = ids.into_iter().filter_map(|id| Some((id, glass(id)?))).collect();
            let matrix = shapes.placement(world, entity, &shape, &transforms[&entity]);
            let name = world.name_of(entity);
            let surface = GlassSurface { entity: entity.id(), name, corners, matrix, materials, own };
            Some(surface).filter(|surface| !surface.materials.is_empty())
        };
        let surfaces: Vec<GlassSurface> = order.iter().filter_map(|entity| surface(*entity)).collect();
        OpenSurfaceInputs(if has_thickness || surfaces.len() >= FEWEST { surfaces } else { Vec::new() })
    }
}

/// The thickness of a material of glass, if it has a volume; none of other materials.
fn glass(world: &World, id: MaterialId) -> Option<Option<f32>> {
    match &world.assets.materials.get(id.0 as usize)?.material {
        Material::Principled(material) => Some(Some(material.volume?.thickness)),
        Material::BlinnPhong(material) => material.ior.map(|_| None),
    }
}

impl GlassSurface {
    fn positions(&self) -> &[Vec3] {
        match &self.corners {
            SurfaceCorners::Mesh(mesh) => &mesh.0.positions,
            SurfaceCorners::Fan(corners) => corners,
        }
    }

    fn triangles(&self) -> Vec<[u32; 3]> {
        match &self.corners {
            SurfaceCorners::Mesh(mesh) if !self.own => mesh.0.triangles.clone(),
            SurfaceCorners::Mesh(mesh) => {
                let has_volume = |id: &MaterialId| self.materials.iter().any(|(other, _)| other == id);
                let pairs = mesh.0.triangles.iter().zip(&mesh.0.triangle_materials);
                pairs.filter(|(_, id)| has_volume(id)).map(|(triangle, _)| *triangle).collect()
            }
            SurfaceCorners::Fan(corners) => (2..corners.len() as u32).map(|i| [0, i - 1, i]).collect(),
        }
    }

    /// Its triangles in world space, front sides out.
    fn in_world(&self) -> Vec<[Vec3; 3]> {
        let positions: Vec<Vec3> = self.positions().iter().map(|p| point(&self.matrix, *p)).collect();
        let mirrored = self.matrix.matrix3.determinant() < 0.0;
        let corners = |[a, b, c]: [u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        let triangles = self.triangles().into_iter().map(corners);
        triangles.map(|triangle| triangle.map(|vertex| positions[vertex as usize])).collect()
    }

    /// A key that is equal for surfaces with the same edges before their transforms; none for polygons.
    fn key(&self) -> Option<(*const Mesh, Vec<MaterialId>)> {
        let own = || self.materials.iter().filter(|_| self.own).map(|(id, _)| *id).collect();
        match &self.corners {
            SurfaceCorners::Mesh(mesh) => Some((Arc::as_ptr(&mesh.0), own())),
            SurfaceCorners::Fan(_) => None,
        }
    }
}

/// A surface with a rim.
struct Rimmed<'a> {
    surface: &'a GlassSurface,
    edges: usize,
    /// In world space.
    open: Vec<[Vec3; 2]>,
}

/// The thin sheets and interfaces, in the order of their entities.
pub(super) fn find(inputs: &OpenSurfaceInputs) -> Vec<Sheet> {
    let mut known: HashMap<_, (usize, Vec<[Vec3; 2]>)> = HashMap::new();
    let mut rimmed = Vec::new();
    for surface in &inputs.0 {
        let edges = || {
            let triangles = surface.triangles();
            if triangles.len() > MOST_TESTED {
                return (0, Vec::new());
            }
            let MeshEdges { count, open } = MeshEdges::of(surface.positions(), triangles.into_iter());
            (count, open)
        };
        let (edges, open) = match surface.key() {
            Some(key) => known.entry(key).or_insert_with(edges).clone(),
            None => edges(),
        };
        if !is_crack(open.len(), edges) {
            let open = open.iter().map(|edge| edge.map(|end| point(&surface.matrix, end))).collect();
            rimmed.push(Rimmed { surface, edges, open });
        }
    }
    let mut sheets = Vec::new();
    let rims: Vec<&[[Vec3; 2]]> = rimmed.iter().map(|rimmed| &rimmed.open[..]).collect();
    for JoinedSurfaces { members, rim, crossed } in joined(&rims) {
        let is_interface = |member: &usize| {
            let mut thickness = rimmed[*member].surface.materials.iter().map(|(_, thickness)| *thickness);
            // Panes have a thickness.
            crossed.contains(member) && thickness.all(|it| it.unwrap_or(0.0) <= 0.0)
        };
        let (interfaces, others): (Vec<usize>, Vec<usize>) =
            members.iter().partition(|member| is_interface(member));
        sheets.extend(interfaces.iter().map(|member| interface(&rimmed[*member])));
        let has_volume =
            |member: &&Rimmed| member.surface.materials.iter().all(|(_, thickness)| thickness.is_some());
        let members: Vec<&Rimmed> = others.iter().map(|member| &rimmed[*member]).filter(has_volume).collect();
        let edges = members.iter().map(|member| member.edges).sum();
        if !is_crack(rim.len(), edges) {
            sheets.extend(sheets_of(&members, &rim));
        }
    }
    let place = |sheet: &Sheet| inputs.0.iter().position(|surface| surface.entity == sheet.entity);
    sheets.sort_by_key(place);
    sheets
}

/// A surface between two of the bodies that meet in an edge: it refracts light as it would in air.
fn interface(rimmed: &Rimmed) -> Sheet {
    Sheet {
        entity: rimmed.surface.entity,
        name: rimmed.surface.name.clone(),
        materials: rimmed.surface.materials.iter().map(|(id, _)| (*id, None)).collect(),
        open: rimmed.open.len(),
        edges: rimmed.edges,
    }
}

/// The members of a group with a rim, if they are sheets.
fn sheets_of(members: &[&Rimmed], rim: &[[Vec3; 2]]) -> Vec<Sheet> {
    let triangles: Vec<Vec<[Vec3; 3]>> = members.iter().map(|member| member.surface.in_world()).collect();
    let areas: Vec<f64> =
        triangles.iter().map(|triangles| triangles.iter().map(|triangle| area(*triangle)).sum()).collect();
    let scales: Vec<f64> =
        members.iter().zip(&areas).map(|(member, area)| normal_scale(member.surface, *area)).collect();
    let all = triangles.concat();
    let (count, whole): (usize, f64) = (all.len(), areas.iter().sum());
    if count > MOST_TESTED || whole <= 0.0 {
        return Vec::new();
    }
    let thickness = |member: &Rimmed, scale: f64| -> Vec<(MaterialId, Option<f32>)> {
        let of = member.surface.materials.iter();
        of.map(|(id, thickness)| (*id, thickness.map(|it| (f64::from(it) * scale) as f32))).collect()
    };
    let materials: Vec<_> =
        members.iter().zip(&scales).map(|(member, scale)| thickness(member, *scale)).collect();
    let thinnest =
        materials.iter().flatten().filter_map(|(_, thickness)| *thickness).fold(f32::INFINITY, f32::min);
    // A surface without a thickness is no sheet.
    if thinnest <= 0.0 || thinnest.is_infinite() {
        return Vec::new();
    }
    let middle = rim.as_flattened().iter().sum::<Vec3>() / (2 * rim.len()) as f32;
    // The mean chord length of a body (Cauchy): 4 V / A.
    let within = 4.0 / 6.0 * six_volumes(middle, all.iter().copied()).abs() / whole;
    // In a surface that is much thinner than it is large, holes make an open shell.
    let is_thin = f64::from(thinnest) < 0.5 * within;
    if inside(&all) >= if is_thin { HARDLY_OPEN } else { BODY } {
        return Vec::new();
    }
    let sheet = |(member, materials): (&&Rimmed, Vec<(MaterialId, Option<f32>)>)| Sheet {
        entity: member.surface.entity,
        name: member.surface.name.clone(),
        materials,
        open: member.open.len(),
        edges: member.edges,
    };
    members.iter().zip(materials).map(sheet).collect()
}

/// The factor by which a transform stretches lengths along the normals of a surface with the area `in_world`.
fn normal_scale(surface: &GlassSurface, in_world: f64) -> f64 {
    let corners = |triangle: [u32; 3]| triangle.map(|vertex| surface.positions()[vertex as usize]);
    let before: f64 = surface.triangles().into_iter().map(|triangle| area(corners(triangle))).sum();
    surface.matrix.matrix3.determinant().abs() * before / in_world.max(f64::MIN_POSITIVE)
}

/// The numbers of the entities whose surfaces are thin sheets or interfaces.
pub(crate) fn thin_sheets(world: &World, order: &[Entity], transforms: &WorldTransforms) -> HashSet<u32> {
    // Without a view: whether a surface is open does not depend on its fineness.
    let of_glass = |entity: &Entity| {
        world.entities.get::<&MaterialId>(*entity).is_ok_and(|id| glass(world, *id).is_some())
    };
    let those: Vec<Entity> = order.iter().copied().filter(of_glass).collect();
    let Ok(shapes) = ShapeMeshes::new(world, &those, transforms, None, None) else { return HashSet::new() };
    let inputs = OpenSurfaceInputs::new(world, order, transforms, &shapes);
    find(&inputs).into_iter().map(|sheet| sheet.entity).collect()
}

/// Warnings about surfaces that are rendered as sheets, and as interfaces.
pub(super) fn told(sheets: &[Sheet]) -> Vec<Diagnostic> {
    const MOST: usize = 4;
    let listed = |one: &dyn Fn(&Sheet) -> Option<String>| {
        let names: Vec<String> = sheets.iter().filter_map(one).collect();
        let more = names.len().saturating_sub(MOST);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        (!names.is_empty()).then(|| format!("{}{more}", names[..names.len().min(MOST)].join(", ")))
    };
    let thin = listed(&|sheet: &Sheet| {
        let Sheet { name, open, edges, .. } = sheet;
        let thickness = f64::from(sheet.thickness()?);
        let thickness = (thickness * 1e6).round() / 1e6;
        Some(format!("{} ({thickness} m, {open} of {edges} edges open)", words(name)))
    });
    let thin = thin.map(|names| {
        let text = format!(
            "open surfaces with a volume enclose nothing, and are thin sheets that absorb by their thickness and bend no \
             light: {names}"
        );
        Diagnostic::warning("thin-sheet", text).fixed_by("close them to make bodies")
    });
    let interfaces =
        listed(&|sheet: &Sheet| sheet.thickness().is_none().then(|| words(&sheet.name).to_string()));
    let interfaces = interfaces.map(|names| {
        let text = format!(
            "open surfaces that meet in an edge are interfaces, and bend light by the index behind them over that in \
             front: {names}"
        );
        Diagnostic::warning("interface", text)
            .fixed_by("close each of them to make bodies, whose indices are their own")
    });
    thin.into_iter().chain(interfaces).collect()
}

impl Sheet {
    /// The largest thickness of its materials; none for an interface.
    fn thickness(&self) -> Option<f32> {
        self.materials.iter().filter_map(|(_, thickness)| *thickness).reduce(f32::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::compile;
    use crate::math::{Quat, Rgb};
    use crate::world::boundary::tests::torus;
    use crate::world::{Camera, Principled, ScalarInput, Transform, Volume};

    const FLAT: [[f32; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

    fn mesh(triangles: &[[Vec3; 3]]) -> Mesh {
        let count = triangles.len() as u32;
        Mesh {
            positions: triangles.as_flattened().to_vec(),
            triangles: (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..Mesh::default()
        }
    }

    /// The sides of a cube of 2 m, each of two triangles.
    fn cube() -> Vec<[Vec3; 3]> {
        let turned = |turn: Quat| FLAT.map(|[x, y]| turn * Vec3::new(x, y, 1.0));
        let quarter = std::f32::consts::FRAC_PI_2;
        let around = (0..4).map(|i| Quat::from_rotation_y(i as f32 * quarter));
        let ends = [1.0, -1.0].map(|sign| Quat::from_rotation_x(sign * quarter));
        let sides = around.chain(ends).map(turned);
        // Removes the rounding errors of the rotations.
        let whole = |corners: [Vec3; 4]| corners.map(|corner| corner.round());
        sides.map(whole).flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
    }

    /// The numbers of the meshes that are sheets and their thickness in the world; each mesh is given with a scale.
    fn sheets(thickness: f32, shapes: &[(&[[Vec3; 3]], Vec3)]) -> Vec<(u32, f32)> {
        let mut world = World::default();
        let one = ScalarInput::constant(1.0);
        let volume = Volume { thickness, attenuation_color: Rgb::splat(0.5), ..Volume::default() };
        let glass = Principled { transmission: one, volume: Some(volume), ..Principled::default() };
        let glass = world.assets.add_material(None, Material::Principled(Box::new(glass)));
        for (triangles, scale) in shapes {
            let id = world.assets.add_mesh(mesh(triangles));
            let (translation, rotation) = (Vec3::X, Quat::from_rotation_z(0.3));
            let place = Transform::Trs { translation: translation.as_dvec3(), rotation, scale: *scale };
            world.entities.spawn((Shape::Mesh(id), glass, place));
        }
        world.entities.spawn((Camera::Pinhole { vertical_fov: 1.0 },));
        let order = world.in_order();
        let transforms = crate::world::transforms::to_world(&world, &order).unwrap();
        let shapes = ShapeMeshes::new(&world, &order, &transforms, None, None).unwrap();
        let found = find(&OpenSurfaceInputs::new(&world, &order, &transforms, &shapes));
        let told = compile(&world, None).unwrap().warnings;
        let is_told = told.iter().any(|warning| warning.code == "thin-sheet");
        assert_eq!(is_told, !found.is_empty(), "{told:?}");
        found.iter().map(|sheet| (sheet.entity, sheet.materials[0].1.unwrap_or(-1.0))).collect()
    }

    #[test]
    fn open_surfaces_are_sheets_and_bodies_with_small_holes_are_not() {
        let (cube, ring) = (cube(), torus(40, 20));
        let one = Vec3::ONE;
        assert_eq!(sheets(0.1, &[(&cube, one), (&ring, one)]), []);
        assert_eq!(sheets(0.1, &[(&cube[..2], one), (&cube, one)]), [(0, 0.1)], "a pane");
        assert_eq!(sheets(0.0, &[(&cube[..2], one)]), [], "nobody knows how thick");
        assert_eq!(sheets(0.1, &[(&cube[..10], one)]), [(0, 0.1)], "a box without a lid");
        assert_eq!(sheets(2.0, &[(&cube[..10], one)]), [], "as thick as that box");
        assert_eq!(sheets(0.1, &[(&ring[..ring.len() - 4], one)]), [], "a small hole");
        assert_eq!(sheets(0.1, &[(&ring[..ring.len() / 2], one)]), [(0, 0.1)], "half a ring");
    }

    #[test]
    fn surfaces_that_close_each_other_are_a_body() {
        let (cube, one) = (cube(), Vec3::ONE);
        let sides: Vec<_> = cube.chunks(2).map(|side| (side, one)).collect();
        assert_eq!(sheets(0.1, &sides), []);
        assert_eq!(sheets(0.1, &sides[..5]).len(), 5);
        assert_eq!(sheets(0.1, &[(&cube[..4], one), (&cube[4..], one)]), []);
        // Two adjacent surfaces make one sheet.
        let beside: Vec<_> = cube[..2].iter().map(|t| t.map(|corner| corner + 2.0 * Vec3::X)).collect();
        assert_eq!(sheets(0.1, &[(&cube[..2], one), (&beside, one)]).len(), 2);
        // Three panes that meet in an edge are no interfaces: they have a thickness.
        let found = sheets(0.1, &[(&cube[..2], one), (&beside, one), (&cube[2..4], one)]);
        assert_eq!(found.len(), 3);
        assert!(found.iter().all(|(_, thickness)| (thickness - 0.1).abs() < 1e-6), "{found:?}");
    }

    #[test]
    fn sheet_thickness_scales_with_the_transform() {
        let pane = &cube()[..2];
        for (scale, expected) in [
            (Vec3::splat(3.0), 0.3),
            (Vec3::new(1.0, 1.0, 3.0), 0.3),
            (Vec3::new(5.0, 2.0, 1.0), 0.1),
            (Vec3::new(-1.0, 1.0, 1.0), 0.1),
        ] {
            let [(_, found)] = sheets(0.1, &[(pane, scale)])[..] else { panic!("no sheet") };
            assert!((found / expected - 1.0).abs() < 1e-5, "{scale}: {found}");
        }
    }
}
