//! The report of a case for people: its figures; many similar figures are shown by the worst one.

use palpa_lab::verify::{Case, Findings, Row};

use crate::cli::Context;
use crate::table::Table;
use palpa_lab::verify::tolerance::share;

/// Largest number of figures of a case that is shown in full.
const SHOWN_IN_FULL: usize = 24;
/// Figures that differ in numbers only are shown as one if there are more than this.
const MOST_ALIKE: usize = 3;

/// Prints a case.
pub(super) fn say_case(context: &Context, case: &Case, found: &Findings) -> anyhow::Result<()> {
    context.say(format_args!(
        "{}: {} ({})",
        case.name, case.title, case.source
    ))?;
    context.say(table(&found.rows))?;
    context.say("")
}

fn table(rows: &[Row]) -> Table<7> {
    let header = [
        "  figure",
        "reference",
        "ours",
        "error",
        "tolerance",
        "nodes",
        "pass",
    ];
    let mut table = Table::new(header).with_left_names();
    for line in condensed(rows) {
        let row = line.worst;
        table.push([
            format!("  {}", line.name),
            number(row.reference),
            number(row.computed),
            signed_share(row.rel_error),
            share(row.tolerance),
            row.nodes.to_string(),
            if row.pass { "ok" } else { "FAIL" }.to_owned(),
        ]);
    }
    table
}

/// A figure, or several similar figures shown by the worst of them.
struct Line<'a> {
    name: String,
    worst: &'a Row,
}

/// The lines of a case. In a long case, figures that pass and differ in numbers only share one
/// line.
fn condensed(rows: &[Row]) -> Vec<Line<'_>> {
    let mut groups: Vec<(String, Vec<&Row>)> = Vec::new();
    for row in rows {
        // A failed figure is shown by itself.
        let key = if rows.len() <= SHOWN_IN_FULL || !row.pass {
            row.quantity.clone()
        } else {
            format!("{} ({})", pattern(&row.quantity), share(row.tolerance))
        };
        match groups.iter_mut().find(|(k, _)| *k == key) {
            Some((_, group)) => group.push(row),
            None => groups.push((key, vec![row])),
        }
    }
    let mut lines = Vec::new();
    for (_, group) in groups {
        if group.len() <= MOST_ALIKE {
            lines.extend(group.iter().map(|row| Line {
                name: row.quantity.clone(),
                worst: row,
            }));
        } else if let Some(worst) = group.iter().max_by(|a, b| used(a).total_cmp(&used(b))) {
            lines.push(Line {
                name: format!("{}  worst of {}", pattern(&worst.quantity), group.len()),
                worst,
            });
        }
    }
    lines
}

/// The share of its tolerance that a figure uses.
fn used(row: &Row) -> f64 {
    row.rel_error.abs() / row.tolerance
}

/// The text with an ellipsis for every number.
fn pattern(text: &str) -> String {
    let mut pattern = String::new();
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        // Digits in a word, as in "A1", are part of it.
        if !c.is_ascii_digit() || pattern.ends_with(char::is_alphabetic) {
            pattern.push(c);
            continue;
        }
        while chars.peek().is_some_and(char::is_ascii_digit)
            || (chars.peek() == Some(&'.')
                && chars.clone().nth(1).is_some_and(|c| c.is_ascii_digit()))
        {
            chars.next();
        }
        pattern.push('…');
    }
    pattern
}

/// The number with five significant digits.
fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if !value.is_finite() {
        value.to_string()
    } else if (1e-3..1e5).contains(&size) {
        let decimals = (4 - size.log10().floor() as i32).clamp(0, 7) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.3e}")
    }
}

fn signed_share(value: f64) -> String {
    if value.abs() < 5e-5 {
        format!("{value:+.1e}")
    } else {
        format!("{:+.2} %", value * 1e2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(quantity: &str, rel_error: f64) -> Row {
        Row::with_error("case", quantity, [1.0, 1.0 + rel_error], rel_error, 0.02, 5)
    }

    #[test]
    fn numbers_become_ellipses_and_words_stay() {
        assert_eq!(
            pattern("nu 0.45: force at 12 mm, N (A1, 3 terms)."),
            "nu …: force at … mm, N (A1, … terms)."
        );
    }

    #[test]
    fn a_short_case_is_shown_in_full() {
        let rows: Vec<Row> = (0..24).map(|i| row(&format!("at {i} mm"), 0.0)).collect();
        assert_eq!(condensed(&rows).len(), 24);
    }

    #[test]
    fn alike_figures_are_shown_by_their_worst_and_failures_by_themselves() {
        let mut rows: Vec<Row> = (0..40)
            .map(|i| row(&format!("at {i} mm"), 1e-4 * f64::from(i)))
            .collect();
        rows.push(row("at 50 mm", -0.03));
        rows.push(row("another", 0.01));
        let lines = condensed(&rows);
        let names: Vec<&str> = lines.iter().map(|line| line.name.as_str()).collect();
        assert_eq!(names, ["at … mm  worst of 40", "at 50 mm", "another"]);
        assert_eq!(lines[0].worst.quantity, "at 39 mm");
        let text = table(&rows).to_string();
        assert!(text.contains("-3.00 %") && text.contains("FAIL"), "{text}");
    }

    #[test]
    fn figures_have_five_digits_and_errors_their_scale() {
        assert_eq!(
            [1.23456789, 0.0123456789, 123456.0, 0.0].map(number),
            ["1.2346", "0.012346", "1.235e5", "0"]
        );
        assert_eq!(signed_share(-2e-13), "-2.0e-13");
        assert_eq!(signed_share(0.01234), "+1.23 %");
        assert_eq!([1e-9, 0.005, 0.03].map(share), ["1e-9", "0.5 %", "3 %"]);
    }
}
