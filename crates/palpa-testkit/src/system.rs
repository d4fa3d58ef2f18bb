//! Texts of the operating system, which tests must not depend on.

const MARK: &str = " (os error ";

/// `text` with `[system error]` in place of the operating system's own words for an error, from the
/// last `: ` before them to their number: Linux says `Not a directory (os error 20)`, and every
/// system something else.
pub fn without_system_errors(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(MARK) {
        let begin = rest[..at].rfind(": ").map_or(0, |colon| colon + 2);
        let number = &rest[at + MARK.len()..];
        let end = number.find(')').map_or(number.len(), |close| close + 1);
        out.push_str(&rest[..begin]);
        out.push_str("[system error]");
        rest = &number[end..];
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::without_system_errors;

    #[test]
    fn the_words_of_every_system_are_the_same() {
        for words in [
            "Not a directory (os error 20)",
            "The system cannot find the path specified. (os error 3)",
        ] {
            let text = format!("error: cannot read a.ply: {words}; check it\nerror: b: {words}");
            assert_eq!(
                without_system_errors(&text),
                "error: cannot read a.ply: [system error]; check it\nerror: b: [system error]"
            );
        }
        assert_eq!(without_system_errors("a: b (c)"), "a: b (c)");
    }
}
