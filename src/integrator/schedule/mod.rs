//! Schedules: the order in which a worker moves rays through the functions of a transport. [`recursive`] goes depth first,
//! pixel by pixel, and [`wavefront`] breadth first, queue by queue; the film is the same.

pub mod recursive;
pub mod wavefront;
pub mod work;
pub mod worker;
