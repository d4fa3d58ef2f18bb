//! Notes on a scene, as pages receive them.

use palpa::Note;
use palpa_viewer::control;
use serde_json::{Map, Value};

/// The note as its kind, its numbers, and its English words.
pub(crate) fn shown(note: &Note) -> control::Note {
    let mut values = match serde_json::to_value(note) {
        Ok(Value::Object(values)) => values,
        _ => Map::new(),
    };
    let kind = match values.remove("kind") {
        Some(Value::String(kind)) => kind,
        _ => String::new(),
    };
    control::Note {
        kind,
        values,
        text: note.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_note_is_shown_by_its_kind_and_numbers() {
        let shown = shown(&Note::CoarserForTouch { edge: 0.003 });
        assert_eq!(shown.kind, "coarser_for_touch");
        assert_eq!(shown.values["edge"], 0.003);
        assert!(shown.text.contains("3.0 mm"), "{}", shown.text);
        assert_eq!(
            super::shown(&Note::PressOnCutFace).kind,
            "press_on_cut_face"
        );
    }

    #[test]
    fn tools_in_a_note_are_kinds_and_numbers() {
        let by = palpa_scene::ContactTool {
            shape: palpa_scene::ContactShape::Sphere { radius: 0.004 },
            friction: 0.0,
            axis: None,
        };
        let shown = shown(&Note::ToolReplaced {
            tool: palpa_scene::Tool::Disc { radius: 0.005 },
            by: palpa_scene::Tool::Contact(by),
        });
        assert_eq!(shown.values["tool"]["kind"], "disc");
        assert_eq!(shown.values["tool"]["radius"], 0.005);
        assert_eq!(shown.values["by"]["shape"]["kind"], "sphere");
        assert!(
            shown
                .text
                .contains("bonded disc, radius 5.0 mm was replaced by a sphere"),
            "{}",
            shown.text
        );
    }
}
