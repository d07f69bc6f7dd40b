//! Mikkelsen's tangents ("Simulation of Wrinkled Surfaces Revisited", 2008, section 3.3; mikktspace.com), which
//! normal maps assume.
//!
//! Corners of equal position, normal and texture coordinates are one *welded vertex*. Triangles around it that are
//! joined by edges, and turn the same way in the texture, are a *fan*; it shares the mean of their tangents, weighted
//! by their angles. All results equal those of the reference program with its two known faults corrected, bit for bit.

use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

use crate::math::{Vec2, Vec3, Vec4};
use crate::world::Mesh;

/// The largest number of triangles around a vertex: pairs of these are compared.
pub(super) const MOST_AROUND: u32 = 1024;
/// Bytes used per corner.
pub(super) const CORNER_BYTES: u64 = 112;

const NONE: u32 = u32::MAX;

/// More than [`MOST_AROUND`] triangles meet in a vertex.
pub(super) struct Crowded;

/// Each corner's tangent, with the sign of the bitangent in w, or nothing if its place in the texture says nothing. The
/// texture's second axis points down, as in glTF.
pub(super) fn corner_tangents(mesh: &Mesh, uvs: &[Vec2]) -> Result<Vec<Option<Vec4>>, Crowded> {
    let welded = Welded::new(mesh, uvs);
    if welded.around().into_iter().any(|count| count > MOST_AROUND) {
        return Err(Crowded);
    }
    let mut faces: Vec<MappedTriangle> = welded
        .faces
        .par_iter()
        .map(|corners| MappedTriangle::new(corners.map(|id| &welded.vertices[id as usize])))
        .collect();
    let fans = Fans::new(&mut faces, &welded);
    let parts: Vec<Vec<(u32, Vec4)>> = fans
        .ends
        .par_chunks(4096)
        .enumerate()
        .map(|(chunk, ends)| {
            let mut begin = if chunk == 0 { 0 } else { fans.ends[chunk * 4096 - 1] };
            let mut made = Vec::new();
            let mut fan = Fan::default();
            for &end in ends {
                fan.evaluate(&fans.corners[begin as usize..end as usize], &faces, &welded, &mut made);
                begin = end;
            }
            made
        })
        .collect();
    let mut tangents = vec![None; faces.len() * 3];
    for (corner, tangent) in parts.into_iter().flatten() {
        tangents[corner as usize] = Some(tangent);
    }
    lend_to_degenerate(&faces, &welded, &mut tangents);
    Ok(tangents)
}

/// A vertex as the algorithm distinguishes them.
#[derive(Clone, Copy)]
struct WeldedVertex {
    position: Vec3,
    normal: Vec3,
    uv: Vec2,
}

impl WeldedVertex {
    fn bits(&self) -> [u32; 8] {
        let ([a, b, c], [d, e, f]) = (self.position.to_array(), self.normal.to_array());
        [a, b, c, d, e, f, self.uv.x, self.uv.y].map(f32::to_bits)
    }
}

/// The mesh over its welded vertices.
struct Welded {
    vertices: Vec<WeldedVertex>,
    faces: Vec<[u32; 3]>,
}

impl Welded {
    fn new(mesh: &Mesh, uvs: &[Vec2]) -> Self {
        let vertex = |vertex: u32, normal: Vec3| {
            let vertex = vertex as usize;
            // Adding zero removes negative zeros, which would count as other positions.
            WeldedVertex { position: mesh.positions[vertex] + Vec3::ZERO, normal, uv: uvs[vertex] }
        };
        let own: Vec<Option<Vec3>> = (0..mesh.positions.len())
            .into_par_iter()
            .map(|vertex| mesh.normals.get(vertex).and_then(|normal| normal.try_normalize()))
            .collect();
        let mut welder = Welder::new(mesh.positions.len());
        let ids: Vec<u32> = own
            .iter()
            .enumerate()
            .map(|(number, normal)| match normal {
                Some(normal) => welder.id(vertex(number as u32, *normal)),
                None => NONE,
            })
            .collect();
        let faces = mesh
            .triangles
            .iter()
            .map(|corners| {
                corners.map(|corner| match ids[corner as usize] {
                    NONE => {
                        let [a, b, c] = corners.map(|vertex| mesh.positions[vertex as usize]);
                        welder.id(vertex(corner, (b - a).cross(c - a).normalize_or(Vec3::Z)))
                    }
                    id => id,
                })
            })
            .collect();
        Self { vertices: welder.vertices, faces }
    }

    /// The number of triangles that meet in each vertex.
    fn around(&self) -> Vec<u32> {
        let mut around = vec![0; self.vertices.len()];
        self.faces.as_flattened().iter().for_each(|id| around[*id as usize] += 1);
        around
    }
}

/// Numbers vertices by their bits: a hash table that goes on to the next free place.
struct Welder {
    vertices: Vec<WeldedVertex>,
    places: Vec<u32>,
}

impl Welder {
    fn new(vertices: usize) -> Self {
        Self {
            vertices: Vec::with_capacity(vertices),
            places: vec![NONE; (2 * vertices).next_power_of_two()],
        }
    }

    fn id(&mut self, vertex: WeldedVertex) -> u32 {
        if 2 * self.vertices.len() >= self.places.len() {
            self.places = vec![NONE; 2 * self.places.len().max(8)];
            for id in 0..self.vertices.len() as u32 {
                let place = self.place_of(&self.vertices[id as usize]);
                self.places[place] = id;
            }
        }
        let place = self.place_of(&vertex);
        if self.places[place] == NONE {
            self.places[place] = self.vertices.len() as u32;
            self.vertices.push(vertex);
        }
        self.places[place]
    }

    /// The place that holds the vertex, or that is free for it.
    fn place_of(&self, vertex: &WeldedVertex) -> usize {
        let bits = vertex.bits();
        let mut place = xxh3_64(bytemuck::bytes_of(&bits)) as usize & (self.places.len() - 1);
        while self.places[place] != NONE && self.vertices[self.places[place] as usize].bits() != bits {
            place = (place + 1) & (self.places.len() - 1);
        }
        place
    }
}

/// One triangle.
struct MappedTriangle {
    /// Unit vectors along growing u and v, or zero.
    along: [Vec3; 2],
    /// Two of its corners lie in one place: it is left out, and gets a neighbour's tangents.
    degenerate: bool,
    /// Its texture coordinates give no direction: it joins any fan and adds nothing.
    joins_any: bool,
    /// It turns the same way in space and in the texture.
    preserves: bool,
}

impl MappedTriangle {
    fn new([a, b, c]: [&WeldedVertex; 3]) -> Self {
        let degenerate = a.position == b.position || b.position == c.position || c.position == a.position;
        let [d, e] = [b.position - a.position, c.position - a.position];
        let [p, q] = [b.uv - a.uv, c.uv - a.uv];
        let area = p.x * q.y - p.y * q.x;
        let preserves = area > 0.0;
        let mut face = Self { along: [Vec3::ZERO; 2], degenerate, joins_any: true, preserves };
        if !degenerate && is_normal(area.abs()) {
            let sign = if preserves { 1.0 } else { -1.0 };
            // Equations 18 and 19 of the reference program.
            let along = [q.y * d - p.y * e, -q.x * d + p.x * e];
            face.along = along.map(|way| normalized(way) * sign);
            face.joins_any = along.iter().any(|way| !is_normal(way.length() / area.abs()));
        }
        face
    }
}

/// The program's test for numbers that are not zero.
fn is_normal(x: f32) -> bool {
    x > f32::MIN_POSITIVE
}

fn normalized(v: Vec3) -> Vec3 {
    if v.to_array().iter().any(|x| is_normal(x.abs())) { v * v.length().recip() } else { v }
}

/// The unit vector of a vector's part across a normal.
fn across(v: Vec3, normal: Vec3) -> Vec3 {
    normalized(v - normal.dot(v) * normal)
}

/// The corners of each fan, one fan after another.
struct Fans {
    corners: Vec<u32>,
    ends: Vec<u32>,
}

impl Fans {
    /// Walks around the vertices. Triangles that join any fan take the first one's direction.
    fn new(faces: &mut [MappedTriangle], welded: &Welded) -> Self {
        let neighbours = neighbours(faces, welded);
        let mut fans = Self { corners: Vec::with_capacity(faces.len() * 3), ends: Vec::new() };
        // The fan of each corner.
        let mut fan_of = vec![NONE; faces.len() * 3];
        let mut open: Vec<u32> = Vec::new();
        for seed in 0..faces.len() as u32 * 3 {
            let face = &faces[seed as usize / 3];
            if face.degenerate || face.joins_any || fan_of[seed as usize] != NONE {
                continue;
            }
            let (fan, preserves) = (fans.ends.len() as u32, face.preserves);
            let vertex = welded.faces.as_flattened()[seed as usize];
            let begin = fans.corners.len();
            open.push(seed / 3);
            while let Some(number) = open.pop() {
                let corners = welded.faces[number as usize];
                let at = (0..3).find(|at| corners[*at] == vertex);
                // Edges of the vertex lead here.
                let Some(at) = at else { continue };
                let corner = 3 * number as usize + at;
                if fan_of[corner] != NONE {
                    continue;
                }
                let face = &mut faces[number as usize];
                let first = 3 * number as usize;
                if face.joins_any && fan_of[first..first + 3].iter().all(|fan| *fan == NONE) {
                    face.preserves = preserves;
                }
                if face.preserves == preserves {
                    fan_of[corner] = fan;
                    fans.corners.push(corner as u32);
                    let next = [neighbours[first + (at + 2) % 3], neighbours[corner]];
                    open.extend(next.into_iter().filter(|next| *next != NONE));
                }
            }
            // Sums are in the order of triangles.
            fans.corners[begin..].sort_unstable();
            fans.ends.push(fans.corners.len() as u32);
        }
        fans
    }
}

/// The triangle behind each edge, which begins at the corner of its number. Where several meet, each is joined to the
/// next one that runs the other way.
fn neighbours(faces: &[MappedTriangle], welded: &Welded) -> Vec<u32> {
    let ids = welded.faces.as_flattened();
    let ends = |edge: u32| {
        let from = edge - edge % 3;
        (ids[edge as usize], ids[(from + (edge + 1 - from) % 3) as usize])
    };
    let edges = || (0..ids.len() as u32).filter(|edge| !faces[*edge as usize / 3].degenerate);
    // Edges by the lower of their vertices.
    let mut first = vec![0u32; welded.vertices.len() + 1];
    for edge in edges() {
        let (a, b) = ends(edge);
        first[a.min(b) as usize + 1] += 1;
    }
    for vertex in 1..first.len() {
        first[vertex] += first[vertex - 1];
    }
    let mut next = first.clone();
    let mut sorted = vec![(0u32, 0u32); first[welded.vertices.len()] as usize];
    for edge in edges() {
        let (a, b) = ends(edge);
        let place = &mut next[a.min(b) as usize];
        sorted[*place as usize] = (a.max(b), edge);
        *place += 1;
    }
    let mut neighbours = vec![NONE; ids.len()];
    for vertex in 0..welded.vertices.len() {
        let around = &mut sorted[first[vertex] as usize..first[vertex + 1] as usize];
        around.sort_unstable();
        for (number, (far, edge)) in around.iter().enumerate() {
            if neighbours[*edge as usize] != NONE {
                continue;
            }
            let (a, b) = ends(*edge);
            let other = around[number + 1..]
                .iter()
                .take_while(|(other, _)| other == far)
                .find(|(_, other)| ends(*other) == (b, a) && neighbours[*other as usize] == NONE);
            if let Some((_, other)) = other {
                neighbours[*edge as usize] = other / 3;
                neighbours[*other as usize] = edge / 3;
            }
        }
    }
    neighbours
}

/// Work space for one fan after another.
#[derive(Default)]
struct Fan {
    members: Vec<Member>,
}

/// One triangle of a fan.
struct Member {
    /// Its directions, made perpendicular to the vertex's normal.
    along: [Vec3; 2],
    /// Its part of the sum.
    weighted: Vec3,
    joins_any: bool,
}

impl Member {
    /// False for triangles that run in opposite directions.
    fn agrees(&self, other: &Self) -> bool {
        let near = |axis: usize| self.along[axis].dot(other.along[axis]) > -1.0;
        self.joins_any || other.joins_any || (near(0) && near(1))
    }
}

impl Fan {
    /// Adds the tangents of a fan's corners.
    fn evaluate(
        &mut self,
        corners: &[u32],
        faces: &[MappedTriangle],
        welded: &Welded,
        made: &mut Vec<(u32, Vec4)>,
    ) {
        let member = |corner: &u32| {
            let (number, at) = ((corner / 3) as usize, (corner % 3) as usize);
            let (face, ids) = (&faces[number], welded.faces[number]);
            let [vertex, next, previous] =
                [at, (at + 1) % 3, (at + 2) % 3].map(|at| &welded.vertices[ids[at] as usize]);
            let normal = vertex.normal;
            let along = face.along.map(|way| across(way, normal));
            let [d, e] = [previous, next].map(|end| across(end.position - vertex.position, normal));
            let angle = libm::acos(f64::from(d.dot(e).clamp(-1.0, 1.0))) as f32;
            Member { along, weighted: angle * along[0], joins_any: face.joins_any }
        };
        self.members.clear();
        self.members.extend(corners.iter().map(member));
        let sign = if faces[corners[0] as usize / 3].preserves { -1.0 } else { 1.0 };
        let members = &self.members;
        let mean = |wanted: &dyn Fn(&Member) -> bool| {
            let adding = members.iter().filter(|member| !member.joins_any && wanted(member));
            normalized(adding.fold(Vec3::ZERO, |sum, member| sum + member.weighted)).extend(sign)
        };
        let all_agree = members
            .iter()
            .enumerate()
            .all(|(number, member)| members[number..].iter().all(|other| member.agrees(other)));
        let shared = if all_agree { Some(mean(&|_| true)) } else { None };
        made.extend(corners.iter().zip(members).map(|(corner, member)| {
            (*corner, shared.unwrap_or_else(|| mean(&|other| member.agrees(other))))
        }));
    }
}

/// Gives each corner of a triangle without area the tangent of the first other corner in its vertex.
fn lend_to_degenerate(faces: &[MappedTriangle], welded: &Welded, tangents: &mut [Option<Vec4>]) {
    if faces.iter().all(|face| !face.degenerate) {
        return;
    }
    let ids = welded.faces.as_flattened();
    let mut lenders = vec![NONE; welded.vertices.len()];
    for corner in (0..ids.len()).rev().filter(|corner| !faces[corner / 3].degenerate) {
        lenders[ids[corner] as usize] = corner as u32;
    }
    for corner in (0..ids.len()).filter(|corner| faces[corner / 3].degenerate) {
        if let Some(lender) = tangents.get(lenders[ids[corner] as usize] as usize) {
            tangents[corner] = *lender;
        }
    }
}

#[cfg(test)]
mod tests {
    use bevy_mikktspace::{Geometry, Ops, TangentSpace};
    use proptest::prelude::*;

    use super::*;

    /// Our arc cosine, so that bits can be compared.
    struct Libm;

    impl Ops for Libm {
        fn sqrt(x: f32) -> f32 {
            x.sqrt()
        }

        fn acos(x: f32) -> f32 {
            libm::acos(f64::from(x)) as f32
        }
    }

    /// A mesh as the reference program reads it.
    struct Reference<'m> {
        mesh: &'m Mesh,
        tangents: Vec<Option<Vec4>>,
    }

    impl Geometry<Libm> for Reference<'_> {
        fn num_faces(&self) -> usize {
            self.mesh.triangles.len()
        }

        fn num_vertices_of_face(&self, _: usize) -> usize {
            3
        }

        fn position(&self, face: usize, corner: usize) -> [f32; 3] {
            (self.mesh.positions[self.mesh.triangles[face][corner] as usize] + Vec3::ZERO).to_array()
        }

        fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
            let triangle = self.mesh.triangles[face];
            let own =
                self.mesh.normals.get(triangle[corner] as usize).and_then(|normal| normal.try_normalize());
            let [a, b, c] = triangle.map(|vertex| self.mesh.positions[vertex as usize]);
            own.unwrap_or_else(|| (b - a).cross(c - a).normalize_or(Vec3::Z)).to_array()
        }

        fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
            self.mesh.uvs[self.mesh.triangles[face][corner] as usize].to_array()
        }

        fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
            self.tangents[face * 3 + corner] = space.map(|space| {
                let [x, y, z, sign] = space.tangent_encoded();
                Vec4::new(x, y, z, -sign)
            });
        }
    }

    fn assert_equals_the_reference(mesh: &Mesh) {
        let mut reference = Reference { mesh, tangents: vec![None; mesh.triangles.len() * 3] };
        bevy_mikktspace::generate_tangents(&mut reference).unwrap();
        let Ok(ours) = corner_tangents(mesh, &mesh.uvs) else { panic!("crowded") };
        let bits = |tangents: &[Option<Vec4>]| -> Vec<Option<[u32; 4]>> {
            tangents.iter().map(|tangent| tangent.map(|t| t.to_array().map(f32::to_bits))).collect()
        };
        assert_eq!(bits(&ours), bits(&reference.tangents));
    }

    proptest! {
        /// Few places, directions and texture coordinates: vertices weld, triangles lose their area, edges join three,
        /// and textures are mirrored, turned and squeezed.
        #[test]
        fn tangents_equal_those_of_the_reference_program(
            vertices in prop::collection::vec(((0..3i8, 0..3i8, 0..2i8), (-1..2i8, -1..2i8, 0..2i8), (-2..3i8, -2..3i8)), 3..40),
            picks in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<prop::sample::Index>()), 1..80),
            has_normals in any::<bool>(),
        ) {
            let vec3 = |(x, y, z): (i8, i8, i8)| Vec3::new(f32::from(x), f32::from(y), f32::from(z));
            let mesh = Mesh {
                positions: vertices.iter().map(|vertex| vec3(vertex.0)).collect(),
                normals: if has_normals { vertices.iter().map(|vertex| vec3(vertex.1)).collect() } else { Vec::new() },
                uvs: vertices.iter().map(|(_, _, (u, v))| Vec2::new(f32::from(*u), f32::from(*v)) * 0.3).collect(),
                triangles: picks
                    .iter()
                    .map(|(a, b, c)| [a, b, c].map(|pick| pick.index(vertices.len()) as u32))
                    .collect(),
                ..Mesh::default()
            };
            assert_equals_the_reference(&mesh);
        }
    }

    /// A bent sheet of `side` squared quads, whose texture is mirrored in the middle and torn in places.
    fn sheet(side: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for number in 0..(side + 1) * (side + 1) {
            let (x, y) = ((number % (side + 1)) as f32, (number / (side + 1)) as f32);
            mesh.positions.push(Vec3::new(x, y, (x * 0.7).sin() + (y * 0.9).cos()));
            mesh.normals.push(Vec3::new((x * 0.3).cos(), (y * 0.2).sin(), 2.0));
            mesh.uvs.push(Vec2::new((x - (side / 2) as f32).abs(), y * y * 0.01));
        }
        for number in 0..side * side {
            let a = number / side * (side + 1) + number % side;
            mesh.triangles.extend([[a, a + 1, a + side + 2], [a, a + side + 2, a + side + 1]]);
            if number % 7 == 0 {
                // A corner of its own, with another place in the texture.
                let copy = mesh.positions.len() as u32;
                mesh.positions.push(mesh.positions[a as usize]);
                mesh.normals.push(mesh.normals[a as usize]);
                mesh.uvs.push(Vec2::new(0.3, -0.5));
                mesh.triangles.last_mut().unwrap()[0] = copy;
            }
        }
        mesh
    }

    #[test]
    fn tangents_of_a_large_mesh_equal_those_of_the_reference_program() {
        assert_equals_the_reference(&sheet(100));
    }

    #[test]
    fn fans_of_too_many_triangles_are_refused() {
        let fan = |triangles: u32| {
            let rim = |number: u32| Vec3::new((number as f32).cos(), (number as f32).sin(), 1.0);
            let mut mesh = Mesh { positions: vec![Vec3::ZERO], ..Mesh::default() };
            mesh.positions.extend((0..=triangles).map(rim));
            mesh.normals = vec![Vec3::Z; mesh.positions.len()];
            mesh.uvs = mesh.positions.iter().map(|position| position.truncate()).collect();
            mesh.triangles = (1..=triangles).map(|number| [0, number, number + 1]).collect();
            mesh
        };
        assert_equals_the_reference(&fan(MOST_AROUND));
        let crowded = fan(MOST_AROUND + 1);
        assert!(corner_tangents(&crowded, &crowded.uvs).is_err());
    }
}
