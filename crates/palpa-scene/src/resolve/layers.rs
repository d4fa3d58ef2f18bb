//! The layers: their tissues and thicknesses.

use super::tissues::tissue;
use super::{Reader, direction};
use crate::error::Site;
use crate::file::{LayerTable, ThicknessSpec, ThicknessTable};
use crate::limits;
use crate::scene::Layer;
use crate::units::Length;
use crate::{SceneError, Thickness};

/// Default least thickness of a layer whose thickness is not known beforehand, m.
const MIN_THICKNESS: f64 = 0.5e-3;

impl Reader<'_> {
    pub(super) fn layers(&self, tables: Vec<LayerTable>) -> Result<Vec<Layer>, SceneError> {
        let at = self.site("layer");
        let n = tables.len();
        if n == 0 {
            return Err(at.invalid(
                "the scene has no layer; add for instance [[layer]] with tissue = \"muscle\" and \
                 thickness = \"20 mm\"",
            ));
        }
        if n > limits::MAX_LAYERS {
            let most = limits::MAX_LAYERS;
            let message = format!("{n} layers are more than the {most} allowed; merge thin layers");
            return Err(at.index(most).invalid(message));
        }
        let mut layers = Vec::with_capacity(n);
        let mut n_levels = 0;
        for (i, table) in tables.into_iter().enumerate() {
            let at = at.index(i);
            let layer = self.layer(&at, table)?;
            if layer.thickness.is_none() && i + 1 < n {
                return Err(at.invalid(
                    "the layer has no thickness, and only the last layer may go without (it reaches \
                     down to the bone); give `thickness`",
                ));
            }
            n_levels += layer.levels;
            if n_levels > limits::MAX_LEVELS {
                let most = limits::MAX_LEVELS;
                let message =
                    format!("{n_levels} levels together are more than the {most} allowed");
                return Err(at.key("levels").invalid(message + "; use fewer levels"));
            }
            layers.push(layer);
        }
        Ok(layers)
    }

    fn layer(&self, at: &Site<'_>, table: LayerTable) -> Result<Layer, SceneError> {
        let thickness_at = at.key("thickness");
        let thickness = match table.thickness {
            None => None,
            Some(ThicknessSpec::Uniform(length)) => {
                let length = thickness_at.within(length, &limits::THICKNESS)?;
                Some(Thickness::Uniform(length.si()))
            }
            Some(ThicknessSpec::Varying(table)) => Some(self.varying(&thickness_at, table)?),
        };
        let smallest = thickness.as_ref().and_then(Thickness::smallest);
        let min_thickness = match table.min_thickness {
            None => smallest.map_or(MIN_THICKNESS, |smallest| smallest / 5.0),
            Some(length) => {
                let at = at.key("min_thickness");
                let length = at.within(length, &limits::MIN_THICKNESS)?;
                if let Some(smallest) = smallest.filter(|&smallest| smallest < length.si()) {
                    let smallest = Length::from_si(smallest);
                    return Err(at.invalid(format!(
                        "{length} is more than the layer's thickness of {smallest}; make it smaller"
                    )));
                }
                length.si()
            }
        };
        Ok(Layer {
            tissue: tissue(&at.key("tissue"), table.tissue)?,
            thickness,
            thickness_status: table.thickness_status,
            thickness_source: table.thickness_source,
            levels: at.key("levels").within(table.levels, &limits::LEVELS)? as usize,
            min_thickness,
            prestress: at
                .key("prestress")
                .within(table.prestress, &limits::PRESTRESS)?
                .si(),
        })
    }

    fn varying(&self, at: &Site<'_>, table: ThicknessTable) -> Result<Thickness, SceneError> {
        let (axis, rows) = match (table.axis, table.table, table.file) {
            (None, None, Some(file)) => {
                return Ok(Thickness::File(self.path(&at.key("file"), &file)?));
            }
            (Some(axis), Some(rows), None) => (axis, rows),
            _ => {
                return Err(at.invalid(
                    "a varying thickness takes either `axis` with `table`, or `file`; give one of these",
                ));
            }
        };
        let axis = direction(&at.key("axis"), axis)?;
        let at = at.key("table");
        if rows.is_empty() || rows.len() > limits::MAX_ROWS {
            let (n, most) = (rows.len(), limits::MAX_ROWS);
            return Err(at.invalid(format!("a table of {n} rows; give 1 to {most} rows")));
        }
        let mut table: Vec<[f64; 2]> = Vec::with_capacity(rows.len());
        for (i, [position, thickness]) in rows.into_iter().enumerate() {
            let at = at.index(i);
            let position = at.index(0).within(position, &limits::COORDINATE)?;
            let thickness = at.index(1).within(thickness, &limits::THICKNESS)?;
            if table.last().is_some_and(|row| row[0] >= position.si()) {
                return Err(at.index(0).invalid(format!(
                    "the position {position} is not beyond the one before; sort the table by position"
                )));
            }
            table.push([position.si(), thickness.si()]);
        }
        Ok(Thickness::Along { axis, table })
    }
}
