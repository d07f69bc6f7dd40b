//! The numbers of an emitter, a row each: which columns they are in, for each kind of emitter.

use crate::math::{Color, Rgb, Vec3, Vector};
use crate::simd::{Float, Int};

/// The number of columns.
const COLUMNS: usize = 13;

/// The numbers of one emitter.
pub type EmitterRow = [f32; COLUMNS];

/// A value that a row stores, in one column or three.
pub trait Column {
    /// The value in each lane.
    type Lanes<F: Float>;
    /// Reads the value of each lane's row.
    fn lanes<F: Float>(rows: &impl RowLanes<F>, at: u32) -> Self::Lanes<F>;
    /// Writes the value to the front of columns.
    fn write(self, columns: &mut [f32]);
}

impl Column for f32 {
    type Lanes<F: Float> = F;
    #[inline(always)]
    fn lanes<F: Float>(rows: &impl RowLanes<F>, at: u32) -> F {
        rows.number(at)
    }
    fn write(self, columns: &mut [f32]) {
        columns[0] = self;
    }
}

/// Implements [`Column`] for a type with three components.
macro_rules! triple {
    ($type:ident, $lanes:ident) => {
        impl Column for $type {
            type Lanes<F: Float> = $lanes<F>;
            #[inline(always)]
            fn lanes<F: Float>(rows: &impl RowLanes<F>, at: u32) -> $lanes<F> {
                let v = rows.vector(at);
                $lanes::new(v.x, v.y, v.z)
            }
            fn write(self, columns: &mut [f32]) {
                columns[..3].copy_from_slice(&self.to_array());
            }
        }
    };
}
triple!(Vec3, Vector);
triple!(Rgb, Color);

/// Declares the rows of kinds of emitters: each value with its type and its first column.
macro_rules! rows {
    ($($(#[$doc:meta])* $kind:ident { $($field:ident: $type:ty = $at:literal, $about:literal;)* })*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy)]
        pub struct $kind {
            $(#[doc = $about] pub $field: $type,)*
        }

        impl $kind {
            /// The values of a row.
            pub fn of(row: &EmitterRow) -> Self {
                Self { $($field: Self::$field::<f32>(row).into(),)* }
            }
            /// The row of these values.
            pub fn row(self) -> EmitterRow {
                let mut row = EmitterRow::default();
                self.write_to(&mut row);
                row
            }
            /// Writes these values into a row of other ones.
            pub fn write_to(self, row: &mut EmitterRow) {
                $(self.$field.write(&mut row[$at..]);)*
            }
            $(
                #[doc = $about]
                #[inline(always)]
                pub fn $field<F: Float>(rows: &impl RowLanes<F>) -> <$type as Column>::Lanes<F> {
                    <$type>::lanes(rows, $at)
                }
            )*
        }
    )*};
}

rows! {
    /// Any emitter.
    AnyRow {
        light: Rgb = 10, "Radiance or intensity; for parallel light its irradiance, for the environment black.";
    }
    /// A triangle or a parallelogram.
    PlanarRow {
        corner: Vec3 = 0, "A corner.";
        e1: Vec3 = 3, "The first edge from the corner.";
        e2: Vec3 = 6, "The second edge from the corner.";
        light: Rgb = 10, "Radiance.";
    }
    /// A sphere; if its points emit within a cone, also read as a cone.
    SphereRow {
        center: Vec3 = 0, "The centre.";
        radius: f32 = 9, "The radius.";
        light: Rgb = 10, "Radiance.";
    }
    /// The cone of a spotlight.
    ConeRow {
        axis: Vec3 = 3, "Its axis, away from the light.";
        cos_outer: f32 = 6, "The cosine of its outer angle.";
        scale: f32 = 7, "1 over the difference of the cosines of its angles.";
        smoothness: f32 = 8, "0 if light fades as t², 1 if as 3t² − 2t³.";
    }
    /// A point light; of a spotlight, also read as a cone.
    PointRow {
        position: Vec3 = 0, "The position.";
        falls: f32 = 9, "Positive if light falls off with distance, as photometric light always does.";
        light: Rgb = 10, "Intensity.";
    }
    /// A point light with a photometric profile; also read as a point light, and its axis as a cone's.
    PhotometricRow {
        position: Vec3 = 0, "The position.";
        axis: Vec3 = 3, "The profile's axis.";
        across: Vec3 = 6, "The direction of azimuth 0.";
        scale: f32 = 9, "1 over the profile's mean.";
        light: Rgb = 10, "Mean intensity.";
    }
    /// Parallel light.
    DirectionalRow {
        to_light: Vec3 = 0, "The direction to the light.";
        spread: f32 = 3, "1 − cosine of half its angle.";
        light: Rgb = 10, "Irradiance.";
    }
}

/// A row for each lane.
pub trait RowLanes<F: Float> {
    /// Reads one column.
    fn number(&self, at: u32) -> F;
    /// Reads three columns.
    fn vector(&self, at: u32) -> Vector<F>;
}

/// A different row in each lane.
pub struct GatheredRows<'a, F: Float> {
    table: &'a [f32],
    first: F::Int,
    mask: F::Mask,
}

impl<'a, F: Float> GatheredRows<'a, F> {
    /// Access to rows of a table by their indices.
    #[inline(always)]
    pub fn new(table: &'a [EmitterRow], index: F::Int, mask: F::Mask) -> Self {
        Self { table: table.as_flattened(), first: index * F::Int::splat(COLUMNS as u32), mask }
    }
}

impl<F: Float> RowLanes<F> for GatheredRows<'_, F> {
    #[inline(always)]
    fn number(&self, at: u32) -> F {
        F::gather(self.table, self.first + F::Int::splat(at), self.mask)
    }
    #[inline(always)]
    fn vector(&self, at: u32) -> Vector<F> {
        Vector::gather_flat(self.table, self.first + F::Int::splat(at), self.mask)
    }
}

/// One row for all lanes.
impl<F: Float> RowLanes<F> for EmitterRow {
    #[inline(always)]
    fn number(&self, at: u32) -> F {
        F::splat(self[at as usize])
    }
    #[inline(always)]
    fn vector(&self, at: u32) -> Vector<F> {
        Vector::splat(Vec3::from_slice(&self[at as usize..]))
    }
}
