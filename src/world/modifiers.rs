//! Changes of a mesh before it is rendered.

use super::assets::TextureId;
use super::fields::{Range, forms, radians};
use super::material::Channel;

/// Changes of an entity's mesh, in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Modifiers(pub Vec<Modifier>);

impl Modifiers {
    /// True if any of them uses a texture.
    pub(crate) fn has_textures(&self) -> bool {
        self.0.iter().any(|modifier| matches!(modifier, Modifier::Displace { .. }))
    }
}

forms! {
    /// The faces that a subdivision is for.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum SubdivisionScheme, "scheme" {
        /// Triangles.
        #[default]
        Loop,
        /// Quadrilaterals: two triangles that follow each other and share their first corner are one face again, as files
        /// and shapes cut it. What remains are triangles, which become three.
        CatmullClark,
    }
}

forms! {
    /// A change of a mesh.
    #[derive(Clone, Debug, PartialEq)]
    pub enum Modifier, "modifier" {
        /// Splits each face into four, `levels` times.
        Subdivide {
            /// how many times
            levels: u32 = 2, Whole(0, 8);
            /// for triangles (Loop 1987), or for quadrilaterals (Catmull and Clark 1978)
            scheme: SubdivisionScheme = SubdivisionScheme::Loop, Form;
            /// whether the surface becomes smooth; otherwise it keeps its shape
            smooth: bool = true, Flag;
            /// edges that are sharper stay sharp
            crease ["crease_degrees"]: f32 = radians(180.0), Degrees(Range::FromTo(0.0, 180.0));
        },
        /// Moves the vertices along their normals by the heights of a texture. The finer the mesh, the finer the
        /// relief: `Subdivide` it before.
        Displace {
            /// the heights
            texture: Option<(TextureId, Channel)> = None, ChannelMap(Channel::Red), required;
            /// between 0 and 1 of the texture, in metres of the object's space
            height_m: f32 = 0.0, Number(Range::Finite), required;
            /// value of the texture at which the surface stays where it is
            midlevel: f32 = 0.5, Number(Range::Finite);
        },
        /// Works out the normals anew.
        Normals {
            /// faces that meet at a smaller angle are shaded as one smooth surface; 0: all are flat
            smooth ["smooth_degrees"]: f32 = radians(30.0), Degrees(Range::FromTo(0.0, 180.0));
        },
    }
}
