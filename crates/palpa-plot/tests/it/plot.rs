//! Pictures are complete, in both formats.

use palpa_plot::{Axis, Band, Chart, Color, Guide, PALETTE, Picture, Series, panels};
use resvg::tiny_skia::Pixmap;

use crate::results;

/// Saves the picture, and returns the PNG as it is read back.
fn saved(picture: &Picture, name: &str) -> Pixmap {
    let [svg, png] = picture.save(&results("plot"), name).unwrap();
    assert_eq!(std::fs::read_to_string(svg).unwrap(), picture.svg());
    Pixmap::decode_png(&std::fs::read(png).unwrap()).unwrap()
}

fn has_color(pixels: &Pixmap, color: Color) -> bool {
    let wanted = color.to_string();
    pixels
        .pixels()
        .iter()
        .any(|p| format!("#{:02x}{:02x}{:02x}", p.red(), p.green(), p.blue()) == wanted)
}

/// A force that stiffens with depth.
fn curve(scale: f64, softening: f64) -> Vec<[f64; 2]> {
    (0..=64)
        .map(|i| f64::from(i) / 8.0)
        .map(|depth| [depth, scale * (depth / softening).exp_m1()])
        .collect()
}

#[test]
fn a_chart_shows_every_series_in_its_colour() {
    let loading = curve(0.35, 4.0);
    let back = loading
        .iter()
        .map(|&[x, f]| [x, f * (0.6 + 0.05 * x)])
        .collect();
    let spread = loading
        .iter()
        .map(|&[x, f]| [x, 0.85 * f, 1.2 * f])
        .collect();
    let measured = (0..9)
        .map(|i| [f64::from(i), 0.33 * (f64::from(i) / 4.1).exp_m1()])
        .collect();
    let picture = Chart::new(
        Axis::linear("indentation [mm]"),
        Axis::linear("force [N]").with_zero(),
    )
    .title("Force on the tool against indentation")
    .subtitle("forearm · disc of 8 mm radius · skin 1.5 mm, fat 4 mm, muscle to the bone")
    .band(Band::x(0.0, 1.5, "skin", PALETTE[1]))
    .band(Band::x(1.5, 5.5, "fat", PALETTE[4]))
    .series(Series::new("loading", loading).with_spread(spread))
    .series(Series::new("unloading", back).dashed())
    .series(Series::new("measured", measured).only_markers())
    .guide(Guide::y(2.0, "limit of the device"))
    .note([6.0, 0.35 * 1.5_f64.exp_m1()], "the tool meets the muscle")
    .draw();
    let pixels = saved(&picture, "chart");
    assert_eq!((pixels.width(), pixels.height()), (1920, 1200));
    for color in &PALETTE[..3] {
        assert!(has_color(&pixels, *color), "{color}");
    }
    assert!(!has_color(&pixels, PALETTE[5]), "there is no sixth series");
}

#[test]
fn logarithmic_axes_and_names_that_would_collide() {
    let counts = [
        27.0, 36.0, 48.0, 64.0, 125.0, 343.0, 1000.0, 4000.0, 16_000.0,
    ];
    let rates = |scale: f64, power: f64| -> Vec<[f64; 2]> {
        counts
            .iter()
            .map(|&n| [n, scale * f64::powf(n, power)])
            .collect()
    };
    let mut chart = Chart::new(Axis::log("nodes"), Axis::log("steps per second"))
        .title("Steps per second against the number of nodes")
        .guide(Guide::y(1000.0, "haptic rate, 1 kHz"));
    for (i, name) in ["sparse", "dense", "dense inverse", "thesis 2009"]
        .iter()
        .enumerate()
    {
        let series = Series::new(*name, rates(1e6, -1.2 - 0.02 * i as f64));
        chart = chart.series(series.with_markers());
    }
    let picture = chart.draw();
    let heights: Vec<f64> = ["sparse", "dense", "dense inverse", "thesis 2009"]
        .iter()
        .map(|name| height_of(picture.svg(), name))
        .collect();
    assert!(
        heights.windows(2).all(|h| h[1] - h[0] >= 17.9),
        "{heights:?}"
    );
    saved(&picture, "log");
}

/// The y of a text in an SVG.
fn height_of(svg: &str, text: &str) -> f64 {
    let end = svg.find(&format!(">{text}</text>")).unwrap();
    let element = &svg[svg[..end].rfind("<text").unwrap()..end];
    let y = element.split(" y=\"").nth(1).unwrap();
    y[..y.find('"').unwrap()].parse().unwrap()
}

#[test]
fn panels_stand_side_by_side() {
    let charts: Vec<Chart> = [
        ("uniform", 4.0),
        ("hard middle", 2.0),
        ("hard bottom", 3.0),
        ("one more", 5.0),
    ]
    .iter()
    .map(|&(title, softening)| {
        Chart::new(
            Axis::linear("displacement [mm]"),
            Axis::linear("force [N]").with_zero(),
        )
        .title(title)
        .subtitle("4 × 4 × 4 nodes, k = 1 and 90 dyn/cm")
        .line("n = 1", curve(1e-6, softening))
        .line("n = 4", curve(1.2e-6, softening))
        .series(Series::new("fit", vec![[0.0, 0.0], [8.0, 5e-6]]).dashed())
    })
    .collect();
    let pixels = saved(&panels("Force against displacement", &charts, 2), "panels");
    assert!(has_color(&pixels, PALETTE[0]) && has_color(&pixels, PALETTE[2]));
}

#[test]
fn odd_data_and_names_still_make_a_picture() {
    let picture = Chart::new(Axis::linear("a < b & c"), Axis::log("\u{7}log"))
        .title("nothing \"at\" <all>")
        .line(
            "gap",
            vec![
                [0.0, 1.0],
                [1.0, f64::NAN],
                [2.0, -1.0],
                [3.0, 1e300],
                [f64::INFINITY, 2.0],
            ],
        )
        .line("empty", Vec::new())
        .draw();
    saved(&picture, "odd");
}
