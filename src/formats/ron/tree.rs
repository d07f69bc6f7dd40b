//! The brackets of a text, parsed once into a tree: the spans of the values between them.

use std::cell::Cell;

use super::scan::{self, BracketToken, skip_blank, token};

/// The spans of all bracketed values of a text, in bytes.
#[derive(Debug, Default, PartialEq)]
pub(super) struct BracketTree {
    /// By the place of the opening bracket.
    nodes: Vec<BracketNode>,
    /// The start and end of the values, those between the same brackets one after another.
    values: Vec<[u32; 2]>,
    /// The node that was found last: mostly, the next one is near.
    last: Cell<usize>,
}

/// A pair of brackets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct BracketNode {
    /// The place of the opening bracket, and that after the closing one.
    span: [u32; 2],
    /// The first and the last value, exclusive.
    values: [u32; 2],
}

/// A tree and its brackets that are not closed yet. Places are in bytes.
#[derive(Default)]
pub(super) struct TreeBuilder {
    pub tree: BracketTree,
    /// The nodes of the open brackets, and the first pending value of each.
    open: Vec<(usize, usize)>,
    /// The values between open brackets.
    pending: Vec<[u32; 2]>,
}

impl TreeBuilder {
    /// Adds an opening bracket.
    pub(super) fn open(&mut self, at: usize) {
        self.open.push((self.tree.nodes.len(), self.pending.len()));
        self.tree.nodes.push(BracketNode { span: [at as u32; 2], ..BracketNode::default() });
    }

    /// Adds a value between the innermost brackets.
    pub(super) fn end_of_value(&mut self, start: usize, end: usize) {
        self.pending.push([start as u32, end as u32]);
    }

    /// Adds a closing bracket, after the last value if that has a start.
    pub(super) fn close(&mut self, last: Option<usize>, at: usize) {
        let Some((node, first)) = self.open.pop() else { return };
        let tree = &mut self.tree;
        let from = tree.values.len() as u32;
        tree.values.extend(self.pending.drain(first..));
        tree.values.extend(last.map(|start| [start as u32, at as u32]));
        let values = [from, tree.values.len() as u32];
        tree.nodes[node] = BracketNode { span: [tree.nodes[node].span[0], at as u32 + 1], values };
    }
}

impl BracketTree {
    /// Parses a text, which must be shorter than 4 GiB.
    pub(super) fn new(text: &str) -> BracketTree {
        let mut builder = TreeBuilder::default();
        // The start of the present value between each of the open brackets.
        let mut starts: Vec<usize> = Vec::new();
        let mut offset = 0;
        while offset < text.len() {
            let (found, length) = token(&text[offset..]);
            let after = offset + length;
            let value = |start: usize| {
                let value = skip_blank(&text[start..offset]);
                (!value.is_empty()).then_some(offset - value.len())
            };
            match (found, starts.last_mut()) {
                (BracketToken::Open(_), _) => {
                    builder.open(offset);
                    starts.push(after);
                }
                (BracketToken::Close(_), Some(start)) => {
                    builder.close(value(*start), offset);
                    starts.pop();
                }
                (BracketToken::Comma, Some(start)) => {
                    if let Some(first) = value(*start) {
                        builder.end_of_value(first, offset);
                    }
                    *start = after;
                }
                _ => {}
            }
            offset = after;
        }
        builder.tree
    }

    fn node(&self, text: &str, bracketed: &str) -> Option<BracketNode> {
        /// The number of nodes after the last one that are tested before all nodes are searched.
        const NEAR: usize = 4;
        let offset = scan::offset_of(text, bracketed)? as u32;
        let last = self.last.get();
        let mut near = self.nodes[last.min(self.nodes.len())..].iter().take(NEAR);
        let index = match near.position(|node| node.span[0] == offset) {
            Some(after) => last + after,
            None => self.nodes.binary_search_by_key(&offset, |node| node.span[0]).ok()?,
        };
        self.last.set(index);
        Some(self.nodes[index])
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
