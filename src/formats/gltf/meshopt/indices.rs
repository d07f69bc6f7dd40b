//! Indices: triangles are coded by the edges that they share with earlier ones, other sequences by deltas.

use super::ByteSource;

/// A FIFO of the last sixteen items.
struct Recent<T> {
    items: [T; 16],
    next: usize,
}

impl<T: Copy + Default> Recent<T> {
    fn new() -> Self {
        Self { items: [T::default(); 16], next: 0 }
    }

    fn push(&mut self, item: T) {
        self.items[self.next & 15] = item;
        self.next = self.next.wrapping_add(1);
    }

    /// Returns the item of an age; 1 is the newest.
    fn get(&self, age: usize) -> T {
        self.items[self.next.wrapping_sub(age) & 15]
    }
}

/// The state carried from one triangle to the next.
struct DecoderState<'d> {
    data: ByteSource<'d>,
    edges: Recent<(u32, u32)>,
    vertices: Recent<u32>,
    /// The first vertex that has not been used yet.
    fresh: u32,
    /// The last vertex that was coded explicitly.
    last: u32,
}

/// Decodes `count` indices of triangles; none if the data are damaged.
pub(super) fn triangles(data: &[u8], count: usize) -> Option<Vec<u32>> {
    let data = data.strip_prefix(&[0xe1])?;
    let (codes, data) = data.split_at_checked(count / 3)?;
    let (data, table) = data.split_last_chunk::<16>()?;
    let mut state = DecoderState {
        data: ByteSource(data),
        edges: Recent::new(),
        vertices: Recent::new(),
        fresh: 0,
        last: 0,
    };
    let mut indices = Vec::with_capacity(count);
    for code in codes {
        let (high, low) = (usize::from(code >> 4), code & 15);
        let triangle = match (high, low) {
            (0..15, _) => state.beside(high, low)?,
            (_, 0..14) => state.fresh_triangle(0, table[usize::from(low)])?,
            _ => {
                let corners = state.data.byte()?;
                if corners == 0 {
                    state.fresh = 0;
                }
                state.fresh_triangle(if low == 14 { 0 } else { 15 }, corners)?
            }
        };
        indices.extend(triangle);
    }
    state.data.0.is_empty().then_some(indices)
}

impl DecoderState<'_> {
    /// Decodes a triangle over a recent edge.
    fn beside(&mut self, edge: usize, third: u8) -> Option<[u32; 3]> {
        let (a, b) = self.edges.get(edge + 1);
        let c = match third {
            0 => self.another(),
            1..13 => self.vertices.get(usize::from(third) + 1),
            13 => self.written(self.last.wrapping_sub(1)),
            14 => self.written(self.last.wrapping_add(1)),
            _ => self.explicit()?,
        };
        if third == 0 || third >= 13 {
            self.vertices.push(c);
        }
        self.edges.push((c, b));
        self.edges.push((a, c));
        Some([a, b, c])
    }

    /// Decodes a triangle without a recent edge. Codes of a corner: 0, a new vertex; 1 to 14, a recent vertex; 15, an
    /// explicit one.
    fn fresh_triangle(&mut self, first: u8, others: u8) -> Option<[u32; 3]> {
        let kinds = [first, others >> 4, others & 15];
        let mut corners = [0; 3];
        // "Recent" is relative to the state before this triangle.
        for (corner, kind) in corners.iter_mut().zip(kinds) {
            *corner = match kind {
                0 => self.another(),
                15 => 0,
                age => self.vertices.get(usize::from(age)),
            };
        }
        for (corner, kind) in corners.iter_mut().zip(kinds) {
            if kind == 15 {
                *corner = self.explicit()?;
            }
        }
        for (corner, kind) in corners.iter().zip(kinds) {
            if kind == 0 || kind == 15 {
                self.vertices.push(*corner);
            }
        }
        let [a, b, c] = corners;
        [(b, a), (c, b), (a, c)].into_iter().for_each(|edge| self.edges.push(edge));
        Some(corners)
    }

    fn another(&mut self) -> u32 {
        let vertex = self.fresh;
        self.fresh = vertex.wrapping_add(1);
        vertex
    }

    fn written(&mut self, vertex: u32) -> u32 {
        self.last = vertex;
        vertex
    }

    fn explicit(&mut self) -> Option<u32> {
        let change = unfold(self.data.number()?);
        Some(self.written(self.last.wrapping_add(change)))
    }
}

/// Decodes `count` indices of any kind; none if the data are damaged.
pub(super) fn sequence(data: &[u8], count: usize) -> Option<Vec<u32>> {
    let data = data.strip_prefix(&[0xd1])?;
    let (data, _) = data.split_last_chunk::<4>()?;
    let mut data = ByteSource(data);
    let mut bases = [0u32; 2];
    let mut indices = Vec::with_capacity(count.min(data.0.len()));
    for _ in 0..count {
        let number = data.number()?;
        let base = &mut bases[(number & 1) as usize];
        *base = base.wrapping_add(unfold(number >> 1));
        indices.push(*base);
    }
    data.0.is_empty().then_some(indices)
}

/// Zigzag decoding: maps 0, 1, 2, 3 … to 0, −1, 1, −2 …
fn unfold(number: u32) -> u32 {
    number >> 1 ^ (number & 1).wrapping_neg()
}
