//! Text for a press with either model.

use palpa_mesh::growth::GrowthReport;
use palpa_scene::{MaterialStatus, Scene, Status};

use crate::cli::Context;
use crate::table::Table;
use palpa::build::in_mm;

/// One sentence on how far the stiffnesses can be trusted.
pub(super) fn status_line(materials: &[MaterialStatus]) -> String {
    let named = |status: Status| -> Vec<&str> {
        let of_status = materials.iter().filter(|m| m.status == status);
        let mut names: Vec<&str> = of_status.map(|m| m.tissue.as_str()).collect();
        names.dedup();
        names
    };
    let parts: Vec<String> = [
        (Status::Measured, "measured"),
        (Status::Literature, "from literature"),
        (Status::Assumed, "ASSUMED"),
        (Status::Given, "given by the scene"),
    ]
    .into_iter()
    .filter_map(|(status, word)| {
        let names = named(status);
        (!names.is_empty()).then(|| format!("{word}: {}", names.join(", ")))
    })
    .collect();
    format!("stiffness {}", parts.join("; "))
}

/// How far a number can be trusted, in a word.
pub(super) fn status_word(status: Status) -> String {
    format!("{status:?}").to_lowercase()
}

/// Prints the layers as grown, and the compromises that growth had to make.
pub(super) fn say_layers(
    context: &Context,
    scene: &Scene,
    grown: &GrowthReport,
    materials: &[MaterialStatus],
) -> anyhow::Result<()> {
    let mut table = Table::new(["layer", "levels", "thickness mm", "stiffness", "status"]);
    for ((layer, material), spec) in grown.layers.iter().zip(materials).zip(&scene.layers) {
        let t = &layer.thickness;
        table.push([
            layer.name.clone(),
            spec.levels.to_string(),
            format!(
                "{:.2} ({:.2}–{:.2})",
                t.median * 1e3,
                t.min * 1e3,
                t.max * 1e3
            ),
            match (material.young, material.spring) {
                (Some(young), _) => format!("E {:.1} kPa", young / 1e3),
                (_, Some(spring)) => format!("k {spring:.3e} N/m per bar"),
                _ => String::new(),
            },
            status_word(material.status),
        ]);
    }
    context.say(table)?;
    if let Some(worst) = &grown.worst_thinning {
        context.say(format!(
            "layers are thinner than asked under {:.1} % of the skin's area, because there is too little room; worst at \
             ({}) mm: {:.0} % of the thickness",
            100.0 * grown.thinned_share,
            in_mm(worst.at.into()),
            100.0 * worst.value
        ))?;
    }
    if let (Some(spread), Some(worst)) = (&grown.stand_off, &grown.worst_stand_off) {
        context.say(format!(
            "distance of the rigid core from the bone: median {:.1} mm, 95 % below {:.1} mm, largest {:.1} mm under the \
             skin at ({}) mm",
            spread.median * 1e3,
            spread.p95 * 1e3,
            worst.value * 1e3,
            in_mm(worst.at.into())
        ))?;
    }
    Ok(())
}
