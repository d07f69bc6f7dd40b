//! The choice of one of a file's scenes, variants or animations by name or number.

use crate::error::{did_you_mean, words};
use crate::world::names::is_same_name;

/// The most names in a message.
const MOST_NAMES: usize = 32;

/// The items of a file of which one can be chosen.
pub(super) struct Choice {
    /// The kind of the items.
    what: &'static str,
    names: Vec<Option<String>>,
}

impl Choice {
    /// A choice among items of the kind `what`, with their names.
    pub(super) fn of<'n>(what: &'static str, names: impl Iterator<Item = Option<&'n str>>) -> Choice {
        let named = |name: Option<&str>| name.filter(|name| !name.is_empty()).map(str::to_owned);
        Choice { what, names: names.map(named).collect() }
    }

    /// The name of an item, or its number if it has none.
    pub(super) fn called(&self, number: usize) -> String {
        let name = self.names.get(number).cloned().flatten();
        name.unwrap_or_else(|| number.to_string())
    }

    /// The names of all items, or their numbers.
    pub(super) fn all(&self) -> Vec<String> {
        (0..self.names.len()).map(|number| self.called(number)).collect()
    }

    /// Returns the number of the item with the name or, if none has it, the number `asked`. The error lists the items.
    pub(super) fn find(&self, asked: &str) -> Result<usize, String> {
        let is_asked = |name: &Option<String>| name.as_ref().is_some_and(|name| is_same_name(name, asked));
        let found = self.names.iter().position(is_asked);
        let found = found.or_else(|| asked.parse().ok().filter(|number| *number < self.names.len()));
        found.ok_or_else(|| {
            let Choice { what, names } = self;
            // Names that can be printed on a line as they are.
            let is_presentable = |name: &&str| name.len() <= 64 && !name.contains(char::is_control);
            let names = names.iter().filter_map(Option::as_deref).filter(is_presentable);
            let (asked, hint) = (words(asked), did_you_mean(asked, names.clone()));
            let Some(last) = self.names.len().checked_sub(1) else {
                return format!("there is no {what} \"{asked}\": the file has none");
            };
            let all: Vec<String> = names.take(MOST_NAMES).map(words).collect();
            let all = if all.is_empty() { String::new() } else { format!("{what}s: {}; ", all.join(", ")) };
            format!("there is no {what} \"{asked}\"{hint}; {all}by number there are 0 to {last}")
        })
    }

    /// A part of a command line that chooses an item: by its name if the shell takes that as it is, else by its number.
    /// None if the number is the name of another item.
    pub(super) fn option(&self, option: &str, number: usize) -> Option<String> {
        let is_plain = |name: &String| {
            !name.starts_with('-') && name.chars().all(|c| c.is_alphanumeric() || "-_.".contains(c))
        };
        let name = self.names.get(number)?.as_ref().filter(|name| is_plain(name));
        let chosen = name.cloned().unwrap_or_else(|| number.to_string());
        (self.find(&chosen) == Ok(number)).then(|| format!("{option} {chosen}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_chosen_by_name_before_number() {
        let choice =
            Choice::of("clip", [Some("1"), Some("walk"), None, Some("walk"), Some("sit down")].into_iter());
        assert_eq!(["1", "walk", "2", "3"].map(|asked| choice.find(asked)), [0, 1, 2, 3].map(Ok));
        assert_eq!(choice.all(), ["1", "walk", "2", "walk", "sit down"]);
        let options = [0, 1, 2, 3, 4].map(|number| choice.option("--clip", number));
        let expected = [Some("1"), Some("walk"), Some("2"), None, Some("4")];
        assert_eq!(options, expected.map(|chosen| chosen.map(|chosen| format!("--clip {chosen}"))));
        let reason = choice.find("wlak").unwrap_err();
        assert!(
            reason.contains("(did you mean \"walk\"?)") && reason.ends_with("by number there are 0 to 4"),
            "{reason}"
        );
        let reason = Choice::of("clip", std::iter::empty()).find("a").unwrap_err();
        assert_eq!(reason, "there is no clip \"a\": the file has none");
    }

    #[test]
    fn accents_may_be_composed_or_not() {
        let choice = Choice::of("scene", [Some("Kuche"), Some("Ku\u{308}che")].into_iter());
        assert_eq!(choice.find("K\u{fc}che"), Ok(1));
    }
}
