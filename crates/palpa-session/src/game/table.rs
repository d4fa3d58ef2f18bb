//! The results of a series as a table, with answers.

use std::fmt::Write as _;

use palpa_viewer::control::{Level, SeriesInfo};

const HEAD: &str = "scene,series_seed,round,n_rounds,seed,level,n_lumps,lump,\
    lump_x_mm,lump_y_mm,lump_z_mm,lump_radius_mm,lump_depth_mm,lump_young_kpa,lump_times,\
    mark_x_mm,mark_y_mm,mark_z_mm,error_mm,tolerance_mm,verdict,other_side,pressed_over_lump,felt_share,\
    stray_marks,time_s,contact_s,presses,max_force_n,mean_force_n,area_share,score";

/// Name of a level in tables.
fn name(level: Level) -> &'static str {
    match level {
        Level::Easy => "easy",
        Level::Medium => "medium",
        Level::Hard => "hard",
    }
}

/// A row for each lump of each round that is revealed; a round has as many rows as lumps. Cells of a
/// lump without a mark are empty.
pub(super) fn table(scene: &str, series: &SeriesInfo) -> String {
    let mut out = format!("{HEAD}\n");
    let scene = if scene.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", scene.replace('"', "\"\""))
    } else {
        scene.to_owned()
    };
    for (round, info) in (1..).zip(&series.rounds) {
        let result = &info.result;
        for (k, found) in (1..).zip(&result.lumps) {
            let [x, y, z] = found.lump.centre.map(|c| 1e3 * c);
            let mark = found.mark.and_then(|mark| info.marks.get(mark as usize));
            let mark = mark.map_or(",,".to_owned(), |mark| {
                let [x, y, z] = mark.map(|c| 1e3 * c);
                format!("{x:.2},{y:.2},{z:.2}")
            });
            let error = found
                .error
                .map_or(String::new(), |e| format!("{:.2}", 1e3 * e));
            let felt = found
                .felt
                .map_or(String::new(), |share| format!("{share:.4}"));
            let verdict = match (found.is_found, found.mark) {
                (true, _) => "found",
                (false, Some(_)) => "missed",
                (false, None) => "unmarked",
            };
            let yes = |is: bool| if is { "yes" } else { "no" };
            let _ = writeln!(
                out,
                "{scene},{},{round},{},{},{},{},{k},{x:.2},{y:.2},{z:.2},{:.2},{:.2},{:.2},{:.2},\
                 {mark},{error},{:.2},{verdict},{},{},{felt},{},{:.1},{:.1},{},{:.3},{:.3},{:.3},{}",
                series.seed,
                series.n_rounds,
                info.seed,
                name(info.level),
                result.lumps.len(),
                1e3 * found.radius,
                1e3 * found.depth,
                1e-3 * found.lump.stiffness,
                found.times,
                1e3 * found.tolerance,
                yes(found.is_other_side),
                yes(found.is_explored),
                result.n_stray_marks,
                info.seconds,
                result.contact_seconds,
                result.n_presses,
                result.max_force,
                result.mean_force,
                result.covered,
                result.score.total,
            );
        }
    }
    out
}
