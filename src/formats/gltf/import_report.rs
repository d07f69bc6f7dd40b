//! The parts of a file that are left out: counted while it is read, and reported in a few lines at the end.

/// Counts of the parts left out.
#[derive(Default)]
pub(super) struct ImportReport {
    /// True if there are animations and no time was given.
    pub animations: bool,
    /// The number of primitives without triangles.
    pub points_and_lines: usize,
    /// The number of nodes hidden by a scale of 0.
    pub flat_nodes: usize,
    /// The number of materials whose gloss cannot be converted to roughness.
    pub glosses: usize,
    /// The number of textures that use a third or later set of coordinates.
    pub other_sets: usize,
    /// The number of closed meshes of glass without a volume.
    pub hollow_bodies: usize,
    /// The number of closed meshes whose surfaces face inwards and are invisible from behind.
    pub inside_out: usize,
}

impl ImportReport {
    /// Returns a line for each kind of loss.
    pub(super) fn lines(&self) -> impl Iterator<Item = String> {
        let mut lines = Vec::new();
        if self.animations {
            lines.push("animations: nodes stand as the file has them (`--time` shows a moment)".to_owned());
        }
        // The singular, the plural, and the rest of the sentence.
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
                "of glass without a volume (Blender exports it so): light goes straight through (`--solid-glass` bends it)",
            ),
            (
                self.inside_out,
                ["closed mesh is", "closed meshes are"],
                "inside out: they will look dark (`--double-sided` shows both sides)",
            ),
        ];
        let found = counted.iter().filter(|(count, ..)| *count > 0);
        lines.extend(found.map(|(count, [one, several], what)| {
            format!("{count} {} {what}", if *count == 1 { one } else { several })
        }));
        lines.into_iter()
    }
}
