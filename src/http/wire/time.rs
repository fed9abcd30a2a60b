use jiff::Timestamp;

/// Milliseconds since 1970 as RFC 3339 has times; what no calendar has becomes its end.
pub fn rfc3339(milliseconds: i64) -> String {
    let farthest = if milliseconds < 0 { Timestamp::MIN } else { Timestamp::MAX };
    Timestamp::from_millisecond(milliseconds).unwrap_or(farthest).to_string()
}
