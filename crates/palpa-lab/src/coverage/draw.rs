//! Scenes drawn at random: bodies, tissues, lumps, tools, places and depths.

use std::fmt::Write as _;

use fastrand::Rng;

/// Largest number of skin vertices of a reference.
const MOST_VERTICES: usize = 60_000;
/// Range of the finest edges, in default lengths: a user's mesh may be coarser than the default.
const EDGES: (f64, f64) = (1.0, 1.6);

/// The tool that is bonded to the skin.
pub(super) const DISC: &str = "disc";

/// A drawn scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drawn {
    /// The scene's file.
    pub text: String,
    /// Shape of the tool.
    pub tool: &'static str,
    /// Body, number of layers and lumps.
    pub body: String,
}

/// Draws the scene of a seed: a block or a round limb with one to three layers, often with friction
/// or a lump, pressed with any tool by up to a fifth of its depth.
pub fn draw_scene(seed: u64) -> Drawn {
    let mut rng = Rng::with_seed(seed);
    let rng = &mut rng;
    let mut body = draw_body(rng);
    let n_layers = rng.usize(1..=3);
    let layers = draw_layers(rng, n_layers, body.depth);
    let has_lump = rng.f64() < 0.2 && body.depth > 16.0;
    let lump = if has_lump {
        draw_lump(rng, &body)
    } else {
        String::new()
    };
    let (shape, tool, reach, h) = draw_tool(rng);
    let edge = h * even(rng, EDGES.0, EDGES.1);
    // Not deeper than the tool's shape allows, and not less than a touch.
    let depth = (even(rng, 0.05, 0.22) * body.depth)
        .min(0.6 * reach)
        .max(0.6);
    let _ = write!(body.name, ", {n_layers} layers");
    if has_lump {
        body.name += ", a lump";
    }
    let (text, at) = (&body.text, &body.at);
    Drawn {
        text: format!(
            "{text}{layers}{lump}[tool]\n{tool}[mesh]\nnear_tool = \"{edge:.3} mm\"\nmax_vertices = {MOST_VERTICES}\n\
             [press]\nat = {at}\ndepth = \"{depth:.2} mm\"\nretract = false\nhold = \"0 s\"\n"
        ),
        tool: shape,
        body: body.name,
    }
}

/// A body, and where it is pressed.
struct Body {
    name: String,
    text: String,
    /// A point, as in a scene.
    at: String,
    /// Depth of the tissue there, mm.
    depth: f64,
}

fn draw_body(rng: &mut Rng) -> Body {
    let spacing = even(rng, 4.0, 8.0);
    if rng.bool() {
        let (width, depth) = (even(rng, 50.0, 80.0), even(rng, 12.0, 35.0));
        let at = [even(rng, -10.0, 10.0), even(rng, -10.0, 10.0), 0.0];
        let kind = format!(
            "kind = \"block\", size = [\"{width:.1} mm\", \"{width:.1} mm\", \"{depth:.1} mm\"]"
        );
        body("block", &kind, spacing, at, depth)
    } else {
        let (radius, bone) = (even(rng, 22.0, 42.0), even(rng, 6.0, 12.0));
        let length = even(rng, 80.0, 110.0);
        // A point above the limb: the press is at the skin nearest to it.
        let middle = length / 2.0 + even(rng, -8.0, 8.0);
        let at = [middle, even(rng, -8.0, 8.0), radius + 5.0];
        let kind = format!(
            "kind = \"cylinder\", length = \"{length:.0} mm\", radius = \"{radius:.1} mm\", bone_radius = \"{bone:.1} mm\""
        );
        body("limb", &kind, spacing, at, radius - bone)
    }
}

fn body(name: &str, kind: &str, spacing: f64, [x, y, z]: [f64; 3], depth: f64) -> Body {
    Body {
        name: name.to_owned(),
        text: format!("[body]\ngenerator = {{ {kind}, spacing = \"{spacing:.1} mm\" }}\n"),
        at: format!("[\"{x:.2} mm\", \"{y:.2} mm\", \"{z:.2} mm\"]"),
        depth,
    }
}

fn draw_layers(rng: &mut Rng, n_layers: usize, depth: f64) -> String {
    let mut text = String::new();
    let mut left = depth;
    for i in 0..n_layers {
        let is_skin = i == 0 && n_layers == 3;
        let young = if is_skin {
            log_even(rng, 20.0, 150.0)
        } else {
            log_even(rng, 4.0, 60.0)
        };
        let poisson = [0.45, 0.47, 0.49, 0.495][rng.usize(0..4)];
        let _ = writeln!(
            text,
            "[[layer]]\ntissue = {{ name = \"layer {i}\", young = \"{young:.1} kPa\", poisson = {poisson} }}"
        );
        if i + 1 < n_layers {
            let thickness = if is_skin {
                even(rng, 1.0, 2.5)
            } else {
                even(rng, 3.0, 12.0).min(0.4 * left)
            };
            left -= thickness;
            let _ = writeln!(text, "thickness = \"{thickness:.2} mm\"");
        } else {
            let _ = writeln!(text, "levels = {}", rng.usize(2..=4));
        }
    }
    text
}

fn draw_lump(rng: &mut Rng, body: &Body) -> String {
    let radius = even(rng, 0.18, 0.28) * body.depth;
    let depth = even(rng, radius + 2.0, body.depth - radius - 2.0);
    let young = log_even(rng, 50.0, 300.0);
    let at = &body.at;
    format!(
        "[[lump]]\nname = \"lump\"\nshape = \"sphere\"\nradius = \"{radius:.1} mm\"\nbelow = {at}\ndepth = \"{depth:.1} mm\"\n\
         tissue = {{ name = \"hard\", young = \"{young:.0} kPa\", poisson = 0.45 }}\n"
    )
}

/// A tool: its shape, its text, the size that limits the depth, and the default length of edges near
/// it, mm.
fn draw_tool(rng: &mut Rng) -> (&'static str, String, f64, f64) {
    let friction = if rng.f64() < 0.2 { 0.3 } else { 0.0 };
    let (shape, reach, h, sizes) = match rng.usize(0..10) {
        0..=2 => {
            let r = even(rng, 4.0, 11.0);
            let sizes = format!("radius = \"{r:.1} mm\"\n");
            return (DISC, format!("shape = \"{DISC}\"\n{sizes}"), r, r / 4.0);
        }
        3..=5 => {
            let r = even(rng, 4.0, 15.0);
            let sizes = format!("radius = \"{r:.1} mm\"\n");
            ("sphere", 0.7 * r, r / 4.0, sizes)
        }
        6 | 7 => {
            let (r, edge) = (even(rng, 5.0, 10.0), even(rng, 0.25, 0.5));
            let edge = edge * r;
            let sizes = format!("radius = \"{r:.1} mm\"\nedge_radius = \"{edge:.1} mm\"\n");
            ("flat-punch", r, (r / 4.0).min(0.8 * edge), sizes)
        }
        8 => {
            let (r, length) = (even(rng, 4.0, 8.0), even(rng, 8.0, 20.0));
            let sizes = format!("radius = \"{r:.1} mm\"\nlength = \"{length:.1} mm\"\n");
            ("capsule", 0.7 * r, r / 4.0, sizes)
        }
        _ => {
            let r = even(rng, 6.0, 9.0);
            let (long, flat) = (1.4 * r, 0.8 * r);
            let sizes = format!("radii = [\"{long:.1} mm\", \"{r:.1} mm\", \"{flat:.1} mm\"]\n");
            ("fingertip", 0.7 * r, r / 4.0, sizes)
        }
    };
    let text = format!("shape = \"{shape}\"\n{sizes}friction = {friction}\n");
    (shape, text, reach, h)
}

fn even(rng: &mut Rng, from: f64, to: f64) -> f64 {
    from + (to - from) * rng.f64()
}

fn log_even(rng: &mut Rng, from: f64, to: f64) -> f64 {
    even(rng, from.ln(), to.ln()).exp()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use palpa_scene::Scene;

    use super::*;

    #[test]
    fn every_drawn_scene_can_be_read() {
        let mut tools = Vec::new();
        for seed in 0..300 {
            let drawn = draw_scene(seed);
            let scene = Scene::parse(&drawn.text, Path::new("."))
                .unwrap_or_else(|e| panic!("seed {seed}: {e:#}\n{}", drawn.text));
            assert!(scene.press.depth > 0.0);
            tools.push(drawn.tool);
        }
        assert_eq!(draw_scene(7), draw_scene(7));
        for tool in ["disc", "sphere", "flat-punch", "capsule", "fingertip"] {
            assert!(tools.contains(&tool), "{tool}");
        }
    }
}
