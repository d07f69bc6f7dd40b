//! Solids as PLY, OBJ and STL files.

use rayfront::math::DVec3;

use super::solid::Solid;

/// The colours that a file gives a surface.
#[derive(Clone, Copy, PartialEq)]
pub enum Paint {
    /// A colour for each vertex.
    Vertices,
    /// A picture, by its file name.
    Picture(&'static str),
    /// Nothing: white, or the default.
    None,
}

/// A number type of PLY files.
#[derive(Clone, Copy)]
pub enum Number {
    Float,
    Double,
    Byte,
}

impl Number {
    pub fn name(self) -> &'static str {
        match self {
            Number::Float => "float",
            Number::Double => "double",
            Number::Byte => "uchar",
        }
    }

    fn bytes(self, value: f64, big: bool) -> Vec<u8> {
        let mut bytes = match self {
            Number::Float => (value as f32).to_le_bytes().to_vec(),
            Number::Double => value.to_le_bytes().to_vec(),
            Number::Byte => vec![value as u8],
        };
        if big {
            bytes.reverse();
        }
        bytes
    }
}

/// A PLY file: `encoding` is `ascii`, `binary_little_endian` or `binary_big_endian`.
pub fn ply(solid: &Solid, encoding: &str, positions: Number, colors: Number, paint: Paint) -> Vec<u8> {
    let mut header = format!("ply\nformat {encoding} 1.0\n");
    if let Paint::Picture(name) = paint {
        header += &format!("comment TextureFile {name}\n");
    }
    header += &format!("element vertex {}\n", solid.positions.len());
    let mut kinds = vec![(positions, ["x", "y", "z"].as_slice())];
    if solid.has_normals {
        kinds.push((Number::Float, &["nx", "ny", "nz"]));
    }
    match paint {
        Paint::Vertices => kinds.push((colors, &["red", "green", "blue"])),
        Paint::Picture(_) => kinds.push((Number::Float, &["s", "t"])),
        Paint::None => {}
    }
    for (kind, name) in kinds.iter().flat_map(|(kind, names)| names.iter().map(move |name| (kind, name))) {
        header += &format!("property {} {name}\n", kind.name());
    }
    header += &format!(
        "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        solid.triangles.len()
    );
    let mut file = header.into_bytes();
    let big = encoding == "binary_big_endian";
    let mut row = |numbers: &[(Number, f64)]| {
        if encoding == "ascii" {
            let words: Vec<String> = numbers.iter().map(|(_, value)| format!("{value}")).collect();
            file.extend((words.join(" ") + "\n").into_bytes());
        } else {
            file.extend(numbers.iter().flat_map(|(kind, value)| kind.bytes(*value, big)));
        }
    };
    for (position, normal, [u, v], color) in solid.rows() {
        let mut numbers: Vec<_> = position.to_array().map(|value| (positions, value)).to_vec();
        if solid.has_normals {
            numbers.extend(normal.map(|value| (Number::Float, f64::from(value))));
        }
        match paint {
            Paint::Vertices => numbers.extend(color.map(|value| match colors {
                Number::Byte => (colors, f64::from(value)),
                _ => (colors, f64::from(value) / 255.0),
            })),
            // v points up.
            Paint::Picture(_) => {
                numbers.extend([u, 1.0 - v].map(|value| (Number::Float, f64::from(value))));
            }
            Paint::None => {}
        }
        row(&numbers);
    }
    for triangle in &solid.triangles {
        if encoding == "ascii" {
            file.extend(format!("3 {} {} {}\n", triangle[0], triangle[1], triangle[2]).into_bytes());
        } else {
            file.push(3);
            for index in triangle {
                file.extend(if big { index.to_be_bytes() } else { index.to_le_bytes() });
            }
        }
    }
    file
}

/// An OBJ file, whose faces may be smooth by a smoothing group; with a picture it names the library `block.mtl`.
pub fn obj(solid: &Solid, paint: Paint) -> Vec<u8> {
    objects(&[("", solid)], paint)
}

/// An OBJ file with several objects.
pub fn objects(solids: &[(&str, &Solid)], paint: Paint) -> Vec<u8> {
    let mut text = String::new();
    if let Paint::Picture(_) = paint {
        text += "mtllib block.mtl\nusemtl paint\n";
    }
    let mut first = 1;
    for (name, solid) in solids {
        if !name.is_empty() {
            text += &format!("o {name}\n");
        }
        add_object(&mut text, solid, paint, first);
        first += solid.positions.len() as u32;
    }
    text.into_bytes()
}

fn add_object(text: &mut String, solid: &Solid, paint: Paint, first: u32) {
    for (DVec3 { x, y, z }, [nx, ny, nz], [u, v], color) in solid.rows() {
        *text += &format!("v {x} {y} {z}");
        if paint == Paint::Vertices {
            let [r, g, b] = color.map(|value| f64::from(value) / 255.0);
            *text += &format!(" {r} {g} {b}");
        }
        if solid.has_normals {
            *text += &format!("\nvn {nx} {ny} {nz}");
        }
        *text += &format!("\nvt {u} {}\n", 1.0 - v);
    }
    if !solid.has_normals {
        *text += if solid.is_smooth { "s 1\n" } else { "s off\n" };
    }
    for triangle in &solid.triangles {
        let [a, b, c] = triangle.map(|index| index + first);
        *text += &if solid.has_normals {
            format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\n")
        } else {
            format!("f {a}/{a} {b}/{b} {c}/{c}\n")
        };
    }
}

/// An STL file.
pub fn stl(solid: &Solid, binary: bool) -> Vec<u8> {
    let corners = |triangle: &[u32; 3]| triangle.map(|index| solid.positions[index as usize]);
    if !binary {
        let mut text = "solid block\n".to_owned();
        for triangle in &solid.triangles {
            let [nx, ny, nz] = solid.normals[triangle[0] as usize];
            text += &format!("facet normal {nx} {ny} {nz}\nouter loop\n");
            for DVec3 { x, y, z } in corners(triangle) {
                text += &format!("vertex {x} {y} {z}\n");
            }
            text += "endloop\nendfacet\n";
        }
        return (text + "endsolid block\n").into_bytes();
    }
    let mut file = vec![0; 80];
    file.extend((solid.triangles.len() as u32).to_le_bytes());
    for triangle in &solid.triangles {
        let normal = solid.normals[triangle[0] as usize];
        file.extend(normal.iter().flat_map(|value| value.to_le_bytes()));
        for corner in corners(triangle) {
            file.extend(corner.as_vec3().to_array().iter().flat_map(|value| value.to_le_bytes()));
        }
        file.extend([0; 2]);
    }
    file
}
