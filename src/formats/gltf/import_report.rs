//! What is left out of a file: counted while it is read and reported in a few lines at the end.

/// Counts and names.
#[derive(Default)]
pub(super) struct ImportReport {
    /// Whether there are animations, and no moment of them was asked for.
    pub animations: bool,
    /// Primitives without triangles.
    pub points_and_lines: usize,
    /// Nodes that are hidden by a scale of 0.
    pub flat_nodes: usize,
    /// Materials whose gloss cannot be made roughness.
    pub glosses: usize,
    /// Textures that are looked up by a third set of coordinates or a later one.
    pub other_sets: usize,
    /// Closed meshes of glass that has no inside.
    pub hollow_bodies: usize,
    /// Closed meshes whose surfaces face inwards and are invisible from behind.
    pub inside_out: usize,
}

impl ImportReport {
    /// A line for each kind of loss.
    pub(super) fn lines(&self) -> impl Iterator<Item = String> {
        let mut lines = Vec::new();
        if self.animations {
            lines.push("animations: nodes stand as the file has them (--time shows a moment)".to_owned());
        }
        // The words for one, the words for several, and what is true of them.
        let counted = [
            (
                self.points_and_lines,
                [
                    "primitive without triangles (points, lines) is",
                    "primitives without triangles (points, lines) are",
                ],
                "left out",
            ),
            (
                self.flat_nodes,
                ["node has a scale of 0 and is left out", "nodes have a scale of 0 and are left out"],
                "with all below",
            ),
            (
                self.glosses,
                ["material shares", "materials share"],
                "a texture of gloss with others: only the factor counts",
            ),
            (
                self.other_sets,
                ["texture uses", "textures use"],
                "a third set of coordinates or a later one: the first is used instead",
            ),
            (
                self.hollow_bodies,
                ["closed mesh is", "closed meshes are"],
                "of glass without a volume (Blender exports it so): light goes straight through (--solid-glass bends it)",
            ),
            (
                self.inside_out,
                ["closed mesh is", "closed meshes are"],
                "inside out: seen from outside only far inner sides are there, where no light comes to (--double-sided \
                 shows both sides)",
            ),
        ];
        let found = counted.iter().filter(|(count, ..)| *count > 0);
        lines.extend(found.map(|(count, [one, several], what)| {
            format!("{count} {} {what}", if *count == 1 { one } else { several })
        }));
        lines.into_iter()
    }
}
