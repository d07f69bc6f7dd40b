//! What of a file is left out, counted while it is read and told in a few lines at the end.

/// Counts and names.
#[derive(Default)]
pub(super) struct Losses {
    pub animations: bool,
    pub skins: bool,
    pub morph_targets: bool,
    /// Primitives.
    pub points_and_lines: usize,
    /// Nodes that a scale of 0 hides.
    pub flat_nodes: usize,
    /// Materials that are blended or cut out.
    pub see_through: Vec<String>,
    pub rotated_textures: usize,
    /// Materials whose textures use several sets of coordinates.
    pub other_sets: usize,
    pub transmission_textures: usize,
}

impl Losses {
    /// A line for each kind of loss.
    pub(super) fn lines(&self) -> impl Iterator<Item = String> {
        let ignored =
            [("animations", self.animations), ("skins", self.skins), ("morph targets", self.morph_targets)];
        let ignored: Vec<&str> =
            ignored.iter().filter(|(_, present)| *present).map(|(what, _)| *what).collect();
        let mut lines = Vec::new();
        if !ignored.is_empty() {
            lines.push(format!("not supported, shown at rest: {}", ignored.join(", ")));
        }
        let counted = [
            (self.points_and_lines, "primitives without triangles (points, lines) are left out"),
            (self.flat_nodes, "nodes have a scale of 0 and are left out with their children"),
            (self.rotated_textures, "textures are rotated, which is not supported: they are not"),
            (self.other_sets, "materials use two sets of texture coordinates: all is looked up by the first"),
            (
                self.transmission_textures,
                "textures of transmission are not supported: only the factor counts",
            ),
        ];
        lines.extend(
            counted.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")),
        );
        if !self.see_through.is_empty() {
            lines.push(format!(
                "alphaMode is not supported, these materials are opaque: {}",
                first_of(&self.see_through)
            ));
        }
        lines.into_iter()
    }
}

/// The first few of what may be thousands, on one line.
fn first_of(names: &[String]) -> String {
    const MOST: usize = 8;
    let shown: Vec<String> = names
        .iter()
        .take(MOST)
        .map(|name| name.chars().take(64).flat_map(char::escape_debug).collect())
        .collect();
    match names.len().saturating_sub(MOST) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}
