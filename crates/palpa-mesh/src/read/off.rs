//! OFF: a header word, three counts, vertices, then faces as `n i₁ … iₙ`.

use super::text::{decode, lines, point, shorten};
use super::{Builder, Fault, Parsed, Place};

pub(super) fn parse(bytes: &[u8], builder: &mut Builder) -> Parsed<()> {
    let (text, _) = decode(bytes);
    let mut lines = lines(&text).filter(|(_, line)| !line.is_empty());

    let (line, header) = lines
        .next()
        .ok_or_else(|| Fault::new(Place::File, "empty; expected the word OFF"))?;
    let mut words = header.split_whitespace();
    let kind = words.next().unwrap_or("");
    // C, N, ST: colours, normals and texture after the coordinates. 4OFF and nOFF have other
    // dimensions.
    if !matches!(
        kind,
        "OFF" | "COFF" | "NOFF" | "CNOFF" | "STOFF" | "STCOFF" | "STNOFF" | "STCNOFF"
    ) || words.clone().next() == Some("BINARY")
    {
        let problem = format!(
            "{:?} is not read; save it as plain ASCII OFF",
            shorten(header)
        );
        return Err(Fault::new(Place::Line(line), problem));
    }
    // The counts are in the header line or in the next line.
    let rest: Vec<&str> = words.collect();
    let (line, counts) = if rest.is_empty() {
        let (line, text) = lines.next().ok_or_else(|| {
            Fault::new(Place::File, "ends before the counts of vertices and faces")
        })?;
        (line, text.split_whitespace().collect())
    } else {
        (line, rest)
    };
    let count = |i: usize| counts.get(i).and_then(|w| w.parse::<usize>().ok());
    let (Some(n_points), Some(n_faces)) = (count(0), count(1)) else {
        let problem = "expected the counts of vertices and faces as whole numbers";
        return Err(Fault::new(Place::Line(line), problem));
    };
    // The shortest vertex is "0 0 0\n", the shortest face "3 0 1 2\n". Counts that cannot fit into
    // the file are refused at once.
    for (n, least, what) in [(n_points, 6, "vertices"), (n_faces, 2, "faces")] {
        if n > text.len() / least + 1 {
            let problem = format!(
                "{n} {what} are announced, more than {} bytes can hold",
                text.len()
            );
            return Err(Fault::new(Place::Line(line), problem));
        }
    }

    let short = |what: &str, i: usize, n: usize| {
        Fault::new(
            Place::File,
            format!("ends after {i} of {n} {what}; the file is cut off"),
        )
    };
    for i in 0..n_points {
        let (line, text) = lines.next().ok_or_else(|| short("vertices", i, n_points))?;
        builder
            .points
            .push(point(&mut text.split_whitespace(), line)?);
    }
    let mut corners = Vec::new();
    for i in 0..n_faces {
        let (line, text) = lines.next().ok_or_else(|| short("faces", i, n_faces))?;
        let place = Place::Line(line);
        let mut words = text.split_whitespace().map(|w| {
            w.parse::<i64>()
                .map_err(|_| Fault::new(place, format!("{:?} is not a whole number", shorten(w))))
        });
        let n_corners = words.next().transpose()?.unwrap_or(0);
        corners.clear();
        // Colours may follow, so exactly `n_corners` words are read. The words in the line limit
        // this number.
        for _ in 0..n_corners {
            let index = words.next().transpose()?.ok_or_else(|| {
                Fault::new(
                    place,
                    format!("a face of {n_corners} corners names {}", corners.len()),
                )
            })?;
            corners.push(builder.vertex(index, place)?);
        }
        builder.face(&corners, place)?;
    }
    Ok(())
}
