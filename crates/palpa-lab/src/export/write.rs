//! The deck as text.

use std::io::{self, Write};

use palpa_mesh::Vec3;

use super::sets::Sliding;
use super::{Deck, Element};

const MM_PER_M: f64 = 1e3;
/// Node or element numbers per line; CalculiX accepts 16.
const PER_LINE: usize = 12;
/// Comment lines longer than this are folded; CalculiX reads 132 characters.
const COMMENT_WIDTH: usize = 110;
/// Largest difference at which a direction counts as an axis.
const ALONG_AXIS: f64 = 1e-12;
/// Largest travel of the tool in one increment, m. CalculiX chooses shorter increments by itself if
/// needed.
const LARGEST_INCREMENT: f64 = 1e-3;
/// Smallest increment that CalculiX may choose, as a share of the whole travel.
const SMALLEST_INCREMENT: f64 = 1e-6;

pub(super) fn write(deck: &Deck<'_>, out: &mut dyn Write) -> io::Result<()> {
    header(deck, out)?;
    writeln!(out, "*NODE, NSET=NALL")?;
    for (i, p) in deck.mesh.nodes.iter().enumerate() {
        let p = p * MM_PER_M;
        writeln!(out, "{},{:.10},{:.10},{:.10}", i + 1, p.x, p.y, p.z)?;
    }
    elements(deck, out)?;
    let sets = &deck.sets;
    set(out, "PATCH", &sets.patch)?;
    set(out, "BASE", &sets.base)?;
    set(out, "FIXED", &sets.fixed)?;
    for (i, face) in sets.cut_faces.iter().enumerate() {
        set(out, &format!("CUT{}", i + 1), face)?;
    }
    for (i, sliding) in sets.sliding.iter().enumerate() {
        set(out, &format!("SLIDE{}", i + 1), &sliding.nodes)?;
    }
    materials(deck, out)?;
    writeln!(out, "*BOUNDARY\nFIXED,1,3")?;
    for (i, group) in sets.sliding.iter().enumerate() {
        slide(out, i + 1, group)?;
    }
    step(deck, out)
}

fn header(deck: &Deck<'_>, out: &mut dyn Write) -> io::Result<()> {
    // Adding zero turns -0 into 0.
    let direction = deck.export.travel.normalize().add_scalar(0.0);
    let (x, y, z) = (direction.x, direction.y, direction.z);
    let units = "units: mm, N, MPa".to_owned();
    let force = format!(
        "the force on the body is the total RF of set PATCH; what the tool feels is its part along ({x:.9}, {y:.9}, {z:.9})"
    );
    let lumps = "a prism is a lump's if its middle is".to_owned();
    let has_lumps = !deck.export.lumps.is_empty();
    let lines = (deck.export.title.iter().cloned())
        .chain([units, force])
        .chain(has_lumps.then_some(lumps))
        .chain(deck.notes.iter().map(|note| format!("note: {note}")));
    for line in lines {
        let mut width = 0;
        write!(out, "**")?;
        for word in line.split_whitespace() {
            if width > 0 && width + word.len() > COMMENT_WIDTH {
                write!(out, "\n**  ")?;
                width = 0;
            }
            write!(out, " {word}")?;
            width += word.len() + 1;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn elements(deck: &Deck<'_>, out: &mut dyn Write) -> io::Result<()> {
    let kind = match deck.export.element {
        Element::C3d15 => "C3D15",
        Element::C3d6 => "C3D6",
    };
    for (i, card) in deck.cards.iter().enumerate() {
        let mut of_material = (deck.mesh.elements.iter().enumerate())
            .filter(|(e, _)| deck.mesh.material[*e] == i)
            .peekable();
        if of_material.peek().is_none() {
            continue;
        }
        writeln!(out, "*ELEMENT, TYPE={kind}, ELSET={}", card.name)?;
        for (e, nodes) in of_material {
            write!(out, "{}", e + 1)?;
            for node in nodes {
                write!(out, ",{}", node + 1)?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}

/// A set of nodes; an empty one is left out, since CalculiX refuses it.
fn set(out: &mut dyn Write, name: &str, nodes: &[usize]) -> io::Result<()> {
    if nodes.is_empty() {
        return Ok(());
    }
    writeln!(out, "*NSET, NSET={name}")?;
    for line in nodes.chunks(PER_LINE) {
        for node in line {
            write!(out, "{},", node + 1)?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn materials(deck: &Deck<'_>, out: &mut dyn Write) -> io::Result<()> {
    for (i, card) in deck.cards.iter().enumerate() {
        if !deck.mesh.material.contains(&i) {
            continue;
        }
        writeln!(out, "*MATERIAL, NAME={}\n*{}", card.name, card.keyword)?;
        for line in &card.lines {
            writeln!(out, "{line}")?;
        }
        writeln!(out, "*SOLID SECTION, ELSET={0}, MATERIAL={0}", card.name)?;
    }
    Ok(())
}

/// Writes the supports of sliding nodes: along the global axes if possible, else in a local frame.
fn slide(out: &mut dyn Write, number: usize, group: &Sliding) -> io::Result<()> {
    let axis_of = |h: &Vec3| (0..3).find(|&i| (h[i].abs() - 1.0).abs() < ALONG_AXIS);
    let axes: Option<Vec<usize>> = group.held.iter().map(axis_of).collect();
    if let Some(axes) = axes {
        writeln!(out, "*BOUNDARY")?;
        for axis in axes {
            writeln!(out, "SLIDE{number},{0},{0}", axis + 1)?;
        }
        return Ok(());
    }
    let first = group.held[0];
    let second = group.held.get(1).copied().unwrap_or_else(|| {
        let across = first.cross(&Vec3::ith(first.iamin(), 1.0));
        across.normalize()
    });
    writeln!(out, "*TRANSFORM, NSET=SLIDE{number}, TYPE=R")?;
    let numbers: Vec<String> = (first.iter().chain(second.iter()))
        .map(|x| format!("{x:.12}"))
        .collect();
    writeln!(out, "{}", numbers.join(","))?;
    writeln!(out, "*BOUNDARY\nSLIDE{number},1,{}", group.held.len())
}

fn step(deck: &Deck<'_>, out: &mut dyn Write) -> io::Result<()> {
    let n = deck.export.n_results;
    let increment = (LARGEST_INCREMENT / deck.export.travel.norm()).min(1.0 / n as f64);
    let travel = (deck.export.travel * MM_PER_M).add_scalar(0.0);
    writeln!(out, "*TIME POINTS, NAME=RESULTS")?;
    for i in 1..=n {
        writeln!(out, "{:.12},", i as f64 / n as f64)?;
    }
    let geometry = if deck.is_linear { "" } else { ", NLGEOM" };
    writeln!(out, "*STEP{geometry}, INC={}", 1000 + 20 * n)?;
    writeln!(
        out,
        "*STATIC\n{increment:.12},1.,{SMALLEST_INCREMENT},{increment:.12}"
    )?;
    // Allows a residual of 0.1 % of the mean force and a correction of 0.5 %; Newton's last step
    // leaves far less.
    writeln!(out, "*CONTROLS, PARAMETERS=FIELD\n1e-3,5e-3")?;
    writeln!(out, "*BOUNDARY")?;
    for axis in 0..3 {
        writeln!(out, "PATCH,{0},{0},{1:.12}", axis + 1, travel[axis])?;
    }
    for name in ["PATCH", "BASE"] {
        writeln!(
            out,
            "*NODE PRINT, NSET={name}, TOTALS=ONLY, TIME POINTS=RESULTS\nRF"
        )?;
    }
    writeln!(out, "*NODE FILE, TIME POINTS=RESULTS\nU,RF")?;
    writeln!(out, "*EL FILE, TIME POINTS=RESULTS\nS")?;
    writeln!(out, "*END STEP")
}
