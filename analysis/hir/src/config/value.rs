//! Values of `mauve.toml` with their ranges, as what several keys need: names, CPUs and numbers.

use mauve_timing::CpuSet;
use toml::Spanned;
use toml::de::DeValue;

use super::Located;

pub(super) type SpannedValue<'a> = Spanned<DeValue<'a>>;

/// Returns the strings of a string or a list of strings, with their ranges.
pub(super) fn strings(value: &SpannedValue<'_>) -> Option<Vec<Located>> {
    let one = |value: &SpannedValue<'_>| Some((value.get_ref().as_str()?.to_owned(), value.span()));
    match value.get_ref() {
        DeValue::Array(values) => values.iter().map(one).collect(),
        _ => Some(vec![one(value)?]),
    }
}

/// Returns the names of [`strings`], if each has so many parts.
pub(super) fn names(value: &SpannedValue<'_>, (least, most): (usize, usize)) -> Option<Vec<Located>> {
    let is_name = |(name, _): &Located| {
        let parts = name.split('.');
        (least..=most).contains(&parts.clone().count()) && parts.into_iter().all(|part| !part.is_empty())
    };
    strings(value).filter(|names| names.iter().all(is_name))
}

/// Returns the CPUs in a list of their numbers, from 1; `None` for an empty list.
pub(super) fn cpus(value: &DeValue<'_>) -> Option<CpuSet> {
    let cpu = |number: u32| number.checked_sub(1).map(CpuSet::of).filter(|cpu| cpu.is_one());
    let numbers = value.as_array().filter(|numbers| !numbers.is_empty())?;
    numbers.iter().map(|number| cpu(integer(number.get_ref())?)).collect()
}

pub(super) fn integer(value: &DeValue<'_>) -> Option<u32> {
    value.as_integer().and_then(|it| u32::from_str_radix(it.as_str(), it.radix()).ok())
}

pub(super) fn number(value: &DeValue<'_>) -> Option<f64> {
    let text = match value {
        DeValue::Float(number) => number.as_str(),
        DeValue::Integer(number) => number.as_str(),
        _ => return None,
    };
    text.replace('_', "").parse().ok()
}
