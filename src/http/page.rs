use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

/// The largest whole number that all of JSON's readers know.
pub const LAST_PLACE: i64 = (1 << 53) - 1;
/// Items of a page unless the client says how many.
const USUAL: u32 = 50;

/// Which page of a list.
#[derive(Debug, Clone, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct PageQuery {
    /// At most so many items.
    #[serde(default = "usual", deserialize_with = "limit")]
    #[param(minimum = 1, maximum = 200, default = 50)]
    pub limit: u32,
    /// Only what comes after an earlier page: its `next`.
    #[serde(default, deserialize_with = "place")]
    #[param(minimum = 0, maximum = 9007199254740991_i64, nullable = false)]
    pub after: Option<i64>,
}

/// A part of a list, the latest item first.
#[derive(Debug, Serialize, ToSchema)]
pub struct Page<T> {
    /// The items.
    pub items: Vec<T>,
    /// What to ask for as `after` to have the next part; missing on the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub next: Option<String>,
}

impl<T> Page<T> {
    /// The page of at most `limit` of these items, which are one more where there is a next page; each with its place in
    /// the list.
    pub fn of<P: std::fmt::Display>(limit: u32, mut rows: Vec<(P, T)>) -> Self {
        let more = rows.len() > limit as usize;
        rows.truncate(limit as usize);
        let next = rows.last().filter(|_| more).map(|(place, _)| place.to_string());
        Self { items: rows.into_iter().map(|(_, item)| item).collect(), next }
    }
}

/// How many items a page has unless the client says it.
pub fn usual() -> u32 {
    USUAL
}
fn place<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<i64>, D::Error> {
    match i64::deserialize(deserializer)? {
        place @ 0..=LAST_PLACE => Ok(Some(place)),
        other => Err(serde::de::Error::custom(format!("{other} is not the `next` of a page"))),
    }
}

/// Reads a page's limit.
pub fn limit<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    match u32::deserialize(deserializer)? {
        limit @ 1..=200 => Ok(limit),
        other => Err(serde::de::Error::custom(format!("{other} is not within 1 and 200"))),
    }
}
