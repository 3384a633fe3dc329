//! The start of a text that somebody sent.

/// The first 80 characters of `text`, with `…` where there are more: short enough for an error message.
pub fn excerpt(text: &str) -> String {
    const LENGTH_MAX: usize = 80;
    let mut start: String = text.chars().take(LENGTH_MAX).collect();
    if start.len() < text.len() {
        start.push('…');
    }
    start
}
