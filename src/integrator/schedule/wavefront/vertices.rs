//! The queue of Whitted vertices.

use crate::integrator::path::columns::Columns;
use crate::integrator::transport::whitted::WhittedVertex;
use crate::math::{Color, Vector};
use crate::shading::blinn_phong::BlinnPhongParams;
use crate::simd::{Float, Int, Mask};

/// Bytes of a vertex.
pub const VERTEX_BYTES: usize = Columns::<17, 1>::ITEM;

/// The data of each hit that the lights need (see [`WhittedVertex`]).
pub struct VertexQueue(pub Columns<17, 1>);

impl VertexQueue {
    /// Stores vertices from place `at` on.
    #[inline(always)]
    pub fn store<F: Float>(&mut self, at: usize, vertex: &WhittedVertex<F>) {
        let (p, g, n) = (vertex.position, vertex.geometric_normal, vertex.normal);
        let (d, s) = (vertex.model.diffuse, vertex.model.specular);
        let floats = [
            p.x, p.y, p.z, vertex.offset, g.x, g.y, g.z, n.x, n.y, n.z, d.r, d.g, d.b, s.r, s.g, s.b,
            vertex.model.shininess,
        ];
        let phong = F::Int::select(vertex.model.phong, F::Int::splat(1), F::Int::splat(0));
        self.0.pack::<F>(at, F::Mask::first(F::WIDTH), floats, [phong]);
    }

    /// Loads the vertices from `at` on.
    #[inline(always)]
    pub fn load<F: Float>(&self, at: usize) -> WhittedVertex<F> {
        let q = &self.0;
        let phong: F::Int = self.0.integer(0, at);
        WhittedVertex {
            position: Vector::new(q.float(0, at), q.float(1, at), q.float(2, at)),
            offset: q.float(3, at),
            geometric_normal: Vector::new(q.float(4, at), q.float(5, at), q.float(6, at)),
            normal: Vector::new(q.float(7, at), q.float(8, at), q.float(9, at)),
            model: BlinnPhongParams {
                diffuse: Color::new(q.float(10, at), q.float(11, at), q.float(12, at)),
                specular: Color::new(q.float(13, at), q.float(14, at), q.float(15, at)),
                shininess: q.float(16, at),
                phong: phong.eq(F::Int::splat(1)),
            },
        }
    }
}
