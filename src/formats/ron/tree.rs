//! The brackets of a text, parsed once into a tree: the spans of the values between them.

use super::scan::{self, BracketToken, skip_blank, token};

/// The spans of all bracketed values of a text, in bytes.
#[derive(Debug, Default)]
pub(super) struct BracketTree {
    /// By the place of the opening bracket.
    nodes: Vec<BracketNode>,
    /// The start and end of the values, those between the same brackets one after another.
    values: Vec<[u32; 2]>,
}

/// A pair of brackets.
#[derive(Clone, Copy, Debug, Default)]
struct BracketNode {
    /// The place of the opening bracket, and that after the closing one.
    span: [u32; 2],
    /// The first and the last value, exclusive.
    values: [u32; 2],
}

impl BracketTree {
    /// Parses a text, which must be shorter than 4 GiB.
    pub(super) fn new(text: &str) -> BracketTree {
        let mut tree = BracketTree::default();
        // The open brackets: their nodes, their first pending value, and the start of the present value.
        let mut open: Vec<(usize, usize, usize)> = Vec::new();
        let mut pending: Vec<[u32; 2]> = Vec::new();
        let mut offset = 0;
        while offset < text.len() {
            let (found, length) = token(&text[offset..]);
            let after = offset + length;
            if let (BracketToken::Comma | BracketToken::Close(_), Some((_, _, start))) =
                (&found, open.last_mut())
            {
                let value = skip_blank(&text[*start..offset]);
                if !value.is_empty() {
                    pending.push([(offset - value.len()) as u32, offset as u32]);
                }
                *start = after;
            }
            match found {
                BracketToken::Open(_) => {
                    open.push((tree.nodes.len(), pending.len(), after));
                    tree.nodes.push(BracketNode { span: [offset as u32; 2], ..BracketNode::default() });
                }
                BracketToken::Close(_) => {
                    if let Some((node, first, _)) = open.pop() {
                        let from = tree.values.len() as u32;
                        tree.values.extend(pending.drain(first..));
                        let node = &mut tree.nodes[node];
                        (node.span[1], node.values) = (after as u32, [from, tree.values.len() as u32]);
                    }
                }
                _ => {}
            }
            offset = after;
        }
        tree
    }

    fn node(&self, text: &str, bracketed: &str) -> Option<BracketNode> {
        let offset = scan::offset_of(text, bracketed)? as u32;
        let found = self.nodes.binary_search_by_key(&offset, |node| node.span[0]).ok()?;
        Some(self.nodes[found])
    }

    /// The values between the brackets that `bracketed`, a slice of the tree's `text`, begins with; none if it does not
    /// begin with one. They have no blanks before them.
    pub(super) fn values<'t>(
        &self,
        text: &'t str,
        bracketed: &str,
    ) -> impl ExactSizeIterator<Item = &'t str> {
        let [first, end] = self.node(text, bracketed).map_or([0, 0], |node| node.values);
        let values = &self.values[first as usize..end as usize];
        values.iter().map(|[start, end]| &text[*start as usize..*end as usize])
    }

    /// The text after the brackets that `bracketed` begins with.
    pub(super) fn after<'t>(&self, text: &'t str, bracketed: &str) -> Option<&'t str> {
        Some(&text[self.node(text, bracketed)?.span[1] as usize..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<&str> {
        BracketTree::new(text).values(text, text).collect()
    }

    #[test]
    fn values_are_split_at_commas_outside_brackets_and_strings() {
        assert_eq!(
            values("(1, (2, 3) ,/* , */ \"4,)\", r#\"\"),\"#, ',' , br\"\\\",) // x"),
            ["1", "(2, 3) ", "\"4,)\"", "r#\"\"),\"#", "',' ", "br\"\\\""]
        );
        for none in ["( )", "", "5", "(", ")"] {
            assert!(values(none).is_empty(), "{none}");
        }
    }

    #[test]
    fn nested_values_are_found_by_their_slices() {
        let text = "(a: [1, (b: 2, c: {}), 3], d: ()) rest";
        let tree = BracketTree::new(text);
        let list = &text[text.find('[').unwrap()..];
        let all: Vec<_> = tree.values(text, list).collect();
        assert_eq!(all, ["1", "(b: 2, c: {})", "3"]);
        assert_eq!(tree.values(text, all[1]).collect::<Vec<_>>(), ["b: 2", "c: {}"]);
        assert_eq!(tree.after(text, text), Some(" rest"));
        assert_eq!(tree.after(text, list), Some(", d: ()) rest"));
    }
}
