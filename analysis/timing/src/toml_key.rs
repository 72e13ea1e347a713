//! The form in which the keys of a TOML file are declared: `mauve.toml` and timing tables. Readers, completion, hovers and the JSON
//! schemas follow a declaration.

/// A key, whose value is of a kind `K`. `default` and `examples` are JSON.
#[allow(missing_docs)]
pub struct TomlKey<K: 'static> {
    pub name: &'static str,
    pub kind: K,
    pub default: Option<&'static str>,
    pub examples: &'static str,
    pub documentation: &'static str,
}

/// The name of a key that stands for all names, such as those of deployments.
pub const ANY_NAME: &str = "Name";

/// The kinds of values that the keys of a file have.
pub trait ValueKind: Sized + 'static {
    /// Returns the keys of a table.
    fn keys(&self) -> &'static [TomlKey<Self>];

    /// Returns the header of a table with its brackets, such as `[[platform.other]]`, and what stands there; none if it has no header of
    /// its own.
    fn header(&self) -> Option<(&'static str, &'static str)>;
}

/// Returns the key of this name, otherwise the one for all names.
pub fn key_named<'k, K>(keys: &'k [TomlKey<K>], name: &str) -> Option<&'k TomlKey<K>> {
    let named = |name: &str| keys.iter().find(|it| it.name == name);
    named(name).or_else(|| named(ANY_NAME))
}

/// Returns the keys below the header of a table, such as `platform.other` or `types.ArRobotPtr`.
pub fn keys_below<K: ValueKind>(keys: &'static [TomlKey<K>], header: &str) -> &'static [TomlKey<K>] {
    if header.is_empty() {
        return keys;
    }
    let (name, rest) = header.split_once('.').unwrap_or((header, ""));
    let Some(found) = key_named(keys, name) else { return &[] };
    let below = found.kind.keys();
    if found.name == name {
        return keys_below(below, rest);
    }
    // A name may have dots; a table below its keys is a value of them.
    let is_value = rest.rsplit('.').next().is_some_and(|last| below.iter().any(|it| it.name == last));
    if is_value { &[] } else { below }
}

/// Returns the keys that may be written below a header: tables with a name have headers of their own, and so have sections.
pub fn keys_to_write<K: ValueKind>(
    keys: &'static [TomlKey<K>],
    header: &str,
) -> impl Iterator<Item = &'static TomlKey<K>> {
    let has_own = |key: &TomlKey<K>| key.kind.header().is_some_and(|(label, _)| label.ends_with(".Name]"));
    let is_section = move |key: &TomlKey<K>| header.is_empty() && key.kind.header().is_some();
    let is_written = move |key: &&TomlKey<K>| key.name != ANY_NAME && !has_own(key) && !is_section(key);
    keys_below(keys, header).iter().filter(is_written)
}

/// Returns the headers, those of sections first, each with what stands there.
pub fn headers<K: ValueKind>(keys: &'static [TomlKey<K>]) -> Vec<(&'static str, &'static str)> {
    let own = keys.iter().filter_map(|it| it.kind.header());
    own.chain(keys.iter().flat_map(|it| headers(it.kind.keys()))).collect()
}
