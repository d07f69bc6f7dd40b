//! Mending: what an image can do without is replaced or left out, and reported, instead of refusing the file.

use std::collections::{HashMap, HashSet};
use std::fmt::Display;

use serde::de::DeserializeOwned;
use serde_json::Value;
use serde_path_to_error::{Path, Segment};

/// The most members of an item that are mended; an item with more is refused.
const MOST_MENDED: usize = 64;

/// The faults that were mended, grouped by kind: faults are of one kind if they differ in numbers only.
#[derive(Debug, Default)]
pub(super) struct Mended {
    groups: Vec<FaultGroup>,
    /// Indices into `groups` by the text of a fault, without its numbers.
    kinds: HashMap<String, usize>,
    known: HashSet<String>,
}

#[derive(Debug)]
struct FaultGroup {
    place: String,
    what: String,
    count: usize,
}

impl Mended {
    /// Adds a fault: its place in the JSON, and the problem with its consequence. A repeated fault counts once.
    pub(super) fn add(&mut self, place: impl Display, what: impl Display) {
        let (place, what) = (place.to_string(), what.to_string());
        let fault = format!("{place}: {what}");
        let kind = without_numbers(&fault);
        if !self.known.insert(fault) {
            return;
        }
        match self.kinds.get(&kind) {
            Some(group) => self.groups[*group].count += 1,
            None => {
                self.kinds.insert(kind, self.groups.len());
                self.groups.push(FaultGroup { place, what, count: 1 });
            }
        }
    }

    /// Returns a line for each kind, which names the first fault.
    pub(super) fn lines(&self) -> impl Iterator<Item = String> {
        self.groups.iter().map(|FaultGroup { place, what, count }| match count {
            1 => format!("{place}: {what}"),
            2 => format!("{place} and 1 more place: {what}"),
            _ => format!("{place} and {} more places: {what}", count - 1),
        })
    }
}

/// Replaces each number by one sign, so that texts which differ in numbers only become equal.
fn without_numbers(text: &str) -> String {
    let mut kind = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '0'..='9' if kind.ends_with('#') => {}
            '0'..='9' => kind.push('#'),
            _ => kind.push(c),
        }
    }
    kind
}

/// A fault that cannot be mended.
pub(super) struct Unmendable {
    /// A JSON pointer.
    pub place: String,
    pub reason: String,
}

/// Deserializes a value of the JSON at `at`. Members that are not as expected are removed from it, if `is_optional`
/// holds for their names, so that their defaults count.
pub(super) fn read<T: DeserializeOwned>(
    value: &mut Value,
    at: &str,
    is_optional: &dyn Fn(&str) -> bool,
    mended: &mut Mended,
) -> Result<T, Unmendable> {
    for _ in 0..MOST_MENDED {
        let error = match serde_path_to_error::deserialize(&*value) {
            Ok(read) => return Ok(read),
            Err(error) => error,
        };
        let place = pointer(error.path());
        let reason = match value.pointer(&place) {
            Some(Value::Null) => "this is null or NaN".to_owned(),
            _ => {
                let reason = error.inner().to_string().escape_debug().to_string().replace("\\\"", "\"");
                reason.replace("index into child of root", "the number of an item")
            }
        };
        let members: Vec<String> = members(error.path()).collect();
        if let Some(resized) = members.last().and_then(|member| resized::<T>(value, member)) {
            mended.add(format_args!("{at}{place}"), format_args!("{reason}: {resized}"));
            continue;
        }
        let is_optional = |member: &&String| member.rsplit('/').next().is_some_and(is_optional);
        // The innermost member that its object can do without.
        let mut innermost_first = members.iter().rev().filter(is_optional);
        let Some(without) = innermost_first.find_map(|member| without::<T>(value, member)) else {
            return Err(Unmendable { place: format!("{at}{place}"), reason });
        };
        *value = without;
        mended
            .add(format_args!("{at}{place}"), format_args!("{reason}: left out, as if it were not written"));
    }
    Err(Unmendable { place: at.to_owned(), reason: "too many of its values are not as expected".to_owned() })
}

/// Tries to give a list of numbers the three or four numbers that are expected. Returns a text if that succeeds.
fn resized<T: DeserializeOwned>(value: &mut Value, member: &str) -> Option<&'static str> {
    let Some(Value::Array(numbers)) = value.pointer(member) else { return None };
    if numbers.len() < 3 || numbers.len() > 4 || !numbers.iter().all(Value::is_number) {
        return None;
    }
    let mut tried = value.clone();
    let Some(Value::Array(numbers)) = tried.pointer_mut(member) else { return None };
    let what = if numbers.len() == 4 {
        numbers.pop();
        "the first three count"
    } else {
        numbers.push(Value::from(1));
        "1 is taken for the fourth"
    };
    let still_fails = match serde_path_to_error::deserialize::<_, T>(&tried) {
        Ok(_) => false,
        Err(error) => members(error.path()).any(|failing| failing == member),
    };
    (!still_fails).then(|| {
        *value = tried;
        what
    })
}

/// A value without a member; none if the object that has it needs it.
fn without<T: DeserializeOwned>(value: &Value, member: &str) -> Option<Value> {
    let (parent, key) = member.rsplit_once('/')?;
    let mut tried = value.clone();
    tried.pointer_mut(parent)?.as_object_mut()?.remove(&unescaped(key))?;
    let is_needed =
        serde_path_to_error::deserialize::<_, T>(&tried).is_err_and(|error| pointer(error.path()) == parent);
    (!is_needed).then_some(tried)
}

/// A path as a JSON pointer.
fn pointer(path: &Path) -> String {
    let part = |segment: &Segment| match segment {
        Segment::Seq { index } => format!("/{index}"),
        Segment::Map { key } => format!("/{}", escaped(key)),
        Segment::Enum { .. } | Segment::Unknown => String::new(),
    };
    path.iter().map(part).collect()
}

/// The JSON pointers of all members of objects on a path, outermost first.
fn members(path: &Path) -> impl Iterator<Item = String> {
    let mut pointers = Vec::new();
    let mut pointer = String::new();
    for segment in path.iter() {
        match segment {
            Segment::Seq { index } => pointer += &format!("/{index}"),
            Segment::Map { key } => {
                pointer += &format!("/{}", escaped(key));
                pointers.push(pointer.clone());
            }
            Segment::Enum { .. } | Segment::Unknown => {}
        }
    }
    pointers.into_iter()
}

fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

fn unescaped(key: &str) -> String {
    key.replace("~1", "/").replace("~0", "~")
}

#[cfg(test)]
mod tests {
    use gltf::json::{Camera, Material};
    use serde_json::json;

    use super::*;

    fn mend<T: DeserializeOwned>(mut value: Value) -> (Result<T, String>, Vec<String>) {
        let mut mended = Mended::default();
        let read = read(&mut value, "/items/0", &|name| name != "znear", &mut mended);
        (read.map_err(|fault| format!("{}: {}", fault.place, fault.reason)), mended.lines().collect())
    }

    #[test]
    fn members_that_are_not_as_expected_are_removed_or_resized() {
        let (read, lines) = mend::<Material>(json!({
            "name": 5, "alphaMode": "MASK", "emissiveFactor": [0.25, 0.5, 0.75, 1], "doubleSided": "yes",
            "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1], "metallicFactor": null, "roughnessFactor": 0.5},
            "normalTexture": {"scale": 2}, "extras": {"a": [1, {}]},
        }));
        let read = read.unwrap();
        let pbr = &read.pbr_metallic_roughness;
        assert_eq!(pbr.base_color_factor.0, [0.5, 0.25, 1.0, 1.0]);
        assert_eq!((pbr.metallic_factor.0, pbr.roughness_factor.0), (1.0, 0.5));
        assert_eq!((read.emissive_factor.0, read.double_sided), ([0.25, 0.5, 0.75], false));
        assert!(read.name.is_none() && read.normal_texture.is_none());
        assert_eq!(lines.len(), 6, "{lines:?}");
        let has = |text: &str| assert!(lines.iter().any(|line| line.starts_with(text)), "{text}: {lines:?}");
        has("/items/0/emissiveFactor: invalid length 4");
        has("/items/0/pbrMetallicRoughness/metallicFactor: this is null or NaN: left out");
        has("/items/0/normalTexture: missing field");
        assert!(lines.iter().any(|line| line.ends_with("1 is taken for the fourth")), "{lines:?}");
    }

    #[test]
    fn required_members_are_refused_with_their_place() {
        let (read, lines) =
            mend::<Camera>(json!({"type": "perspective", "perspective": {"yfov": 1, "znear": "x"}}));
        // The whole lens is optional.
        assert!(read.unwrap().perspective.is_none() && lines.len() == 1, "{lines:?}");
        assert!(lines[0].starts_with("/items/0/perspective/znear: invalid type"), "{lines:?}");
        let mut value = json!({"type": "perspective", "perspective": {"yfov": 1, "znear": "x"}});
        let fault = super::read::<Camera>(&mut value, "/cameras/3", &|_| false, &mut Mended::default());
        assert_eq!(fault.err().unwrap().place, "/cameras/3/perspective/znear");
        assert!(mend::<Camera>(json!(5)).0.unwrap_err().starts_with("/items/0: invalid type"));
    }

    #[test]
    fn faults_of_one_kind_are_one_line() {
        let mut mended = Mended::default();
        for number in [3, 3, 10, 7] {
            mended.add(format_args!("/materials/{number}/alphaMode"), "unknown");
        }
        mended.add("/materials/3/name", "unknown");
        let lines: Vec<String> = mended.lines().collect();
        assert_eq!(
            lines,
            ["/materials/3/alphaMode and 2 more places: unknown", "/materials/3/name: unknown"]
        );
    }
}
