//! Translates messages into terms of the Python module.

/// Command-line options that are arguments in Python, and true for those that take a value; the others are switches.
const OPTIONS: [(&str, bool); 17] = [
    ("crop", true),
    ("depth", true),
    ("double-sided", false),
    ("env", true),
    ("exposure", true),
    ("ground", false),
    ("hide", true),
    ("light-units", true),
    ("look-at", true),
    ("only", true),
    ("set", true),
    ("size", true),
    ("solid-glass", false),
    ("spp", true),
    ("time", true),
    ("tonemap", true),
    ("transport", true),
];

/// Option values that are words.
const WORDS: [&str; 7] = ["auto", "candela", "clamp", "path", "studio", "watt", "whitted"];

/// Replaces the options in a message by arguments: `--env studio` becomes `env="studio"`.
pub fn as_arguments(message: &str) -> String {
    let message = message.replace("rayfront ls lists", "World.parts() lists");
    let mut parts = message.split("--");
    let mut told = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let is_name = |c: char| c.is_ascii_lowercase() || c == '-';
        let (name, rest) = part.split_at(part.find(|c| !is_name(c)).unwrap_or(part.len()));
        let begins_word = told.chars().next_back().is_none_or(|c| c == ' ' || c == '(');
        let argument = name.replace('-', "_");
        let option = OPTIONS.iter().find(|(option, _)| begins_word && *option == name);
        let (word, after) = match rest.strip_prefix(' ') {
            Some(rest) => {
                rest.split_at(rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(rest.len()))
            }
            None => ("", rest),
        };
        match option {
            None if name == "allow-outside" && begins_word => {
                told += &format!("rayfront.allow_outside(){rest}")
            }
            None => told += &format!("--{part}"),
            Some((_, false)) => told += &format!("{argument}=True{rest}"),
            Some(_) if WORDS.contains(&word) => told += &format!("{argument}={word:?}{after}"),
            Some(_) if word.parse::<u32>().is_ok() => told += &format!("{argument}={word}{after}"),
            Some(_) => told += &format!("{argument}{rest}"),
        }
    }
    told
}
