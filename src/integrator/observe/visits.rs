//! The traversal work of observed rays.

use super::EventKind;
use crate::bvh::kernels::counters::Visits;
use crate::bvh::kernels::query::visits;
use crate::bvh::{Bvh, Stack};
use crate::math::{Ray, Vector};
use crate::simd::Isa;

/// Counts the work of the rays that events report. Each ray is traced by itself with the single-ray kernel, and ends at
/// the first surface, cut out or not. The kernel is always the portable one: another instruction set may visit nodes in
/// another order and end a ray earlier or later.
pub struct VisitCounter<'a> {
    bvh: &'a Bvh,
    stack: Stack,
}

impl<'a> VisitCounter<'a> {
    /// Creates a counter for the rays of a tree.
    pub fn new(bvh: &'a Bvh) -> Self {
        Self { bvh, stack: Stack::new(bvh) }
    }

    /// Returns the work of an event's ray; none if the event reports no ray.
    pub fn of(&mut self, event: &EventKind) -> Option<Visits> {
        let (origin, direction, t_max, any) = match event {
            EventKind::Ray { origin, direction, .. } => (origin, direction, f32::INFINITY, false),
            EventKind::Light { origin, direction, distance, .. } => (origin, direction, *distance, true),
            _ => return None,
        };
        let vector = |[x, y, z]: [f32; 3]| Vector { x, y, z };
        let ray = Ray { origin: vector(*origin), direction: vector(*direction), t_min: 0.0, t_max };
        Some(visits(Isa::PORTABLE, self.bvh, &ray, any, &mut self.stack))
    }
}
