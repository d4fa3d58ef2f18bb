//! `palpa verify --error-bars`: the error bars of drawn presses, against finer meshes.

use anyhow::bail;
use palpa_lab::coverage::{self, Case, Summary, draw};
use palpa_plot::output::OutDir;
use serde::Serialize;

use super::Outcome;
use crate::cli::Context;
use crate::table::Table;

const TABLE: &str = "error_bars.csv";

/// What the command reports.
#[derive(Debug, Serialize)]
struct Report<'a> {
    summary: Option<&'a Summary>,
    cases: &'a [Case],
}

/// Runs the first `n_cases` drawn presses that are not in the table of the folder yet.
pub(super) fn run(n_cases: u64, context: &Context) -> anyhow::Result<Outcome> {
    if n_cases == 0 {
        bail!("--error-bars needs at least one press");
    }
    let out = context.out_dir()?;
    let mut cases = coverage::read(&out.path().join(TABLE))?;
    context.begin_recording();
    let progress = context.progress(n_cases as usize, "pressing");
    for seed in 0..n_cases {
        progress.set_position(seed);
        if cases.iter().any(|case| case.seed == seed) {
            continue;
        }
        let Some(case) = coverage::run(seed, || !context.is_interrupted())? else {
            break;
        };
        progress.suspend(|| context.say(line(&case)))?;
        cases.push(case);
        cases.sort_by_key(|case| case.seed);
        write_table(out, &cases)?;
    }
    drop(progress);
    cases.retain(|case| case.seed < n_cases);
    let summary = Summary::of(&cases);
    let report = Report {
        summary: summary.as_ref(),
        cases: &cases,
    };
    out.write_json("error_bars.json", &report)?;
    context.json(&report)?;
    if let Some(summary) = &summary {
        draw(&cases, summary).save(out, "error_bars")?;
        say(context, out, &cases, summary)?;
    }
    Ok(if context.is_interrupted() {
        Outcome::Interrupted
    } else if summary.is_some_and(|summary| summary.is_good()) {
        Outcome::Done
    } else {
        Outcome::NotGood
    })
}

fn write_table(out: &OutDir, cases: &[Case]) -> anyhow::Result<()> {
    let mut table = out.table(TABLE)?;
    for case in cases {
        table.push(case)?;
    }
    table.finish()?;
    Ok(())
}

/// One case for people.
fn line(case: &Case) -> String {
    let share = |n: Option<f64>| match (n, case.force_n) {
        (Some(n), Some(force)) => format!("{:+.2} %", 100.0 * n / force),
        _ => "none".to_owned(),
    };
    let Case {
        seed, tool, body, ..
    } = case;
    let (error, bar) = (share(case.error_n()), share(case.error_bar_n()));
    let bar = bar.trim_start_matches('+');
    let missing = &case.missing;
    format!("{seed}: {tool} on {body}: true error {error}, bar ±{bar} {missing}")
        .trim_end()
        .to_owned()
}

fn say(context: &Context, out: &OutDir, cases: &[Case], summary: &Summary) -> anyhow::Result<()> {
    let mut table = Table::new([
        "tool",
        "presses",
        "inside",
        "median true error",
        "extrapolated",
        "median bar",
    ])
    .with_left_names();
    let all = std::iter::once(("all", cases.to_vec()));
    let each = coverage::tools(cases).into_iter().map(|tool| {
        let own = cases.iter().filter(|case| case.tool == tool);
        (tool, own.cloned().collect())
    });
    for (name, own) in each.chain(all) {
        let Some(of) = Summary::of(&own) else {
            continue;
        };
        table.push([
            name.to_owned(),
            of.n_judged.to_string(),
            format!("{:.1} %", 100.0 * of.coverage),
            format!("{:.2} %", 100.0 * of.median_error),
            of.median_extrapolated_error
                .map_or_else(|| "–".to_owned(), |error| format!("{:.2} %", 100.0 * error)),
            format!("±{:.2} %", 100.0 * of.median_bar),
        ]);
    }
    context.say(table)?;
    context.say(format_args!(
        "{} of {} presses have a bar and a reference; the median bar is {:.1} true errors wide; probes take {:.1} times as long \
         as the press to the deepest. Picture: {}",
        summary.n_judged,
        summary.n_cases,
        summary.median_width,
        summary.median_cost,
        out.path().join("error_bars.png").display()
    ))
}
