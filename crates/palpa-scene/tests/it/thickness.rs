//! Thickness files.

use palpa_scene::{LengthUnit, ThicknessSample, read_thickness};

fn read(text: &str, unit: LengthUnit) -> Result<Vec<ThicknessSample>, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fat.csv");
    std::fs::write(&path, text).unwrap();
    read_thickness(&path, unit).map_err(|e| {
        e.to_string()
            .replace(&folder.path().display().to_string(), "scan")
    })
}

#[test]
fn samples_are_read_in_the_unit_of_the_body_whatever_the_order_of_columns() {
    let samples = read(
        "thickness, x, y, z\n4, 1000, 0, -500\n# note\n5.5, 0, 0, 0\n",
        LengthUnit::Mm,
    )
    .unwrap();
    let expected = [
        ThicknessSample {
            point: [1.0, 0.0, -0.5],
            thickness: 0.004,
        },
        ThicknessSample {
            point: [0.0; 3],
            thickness: 0.0055,
        },
    ];
    assert_eq!(samples, expected);
}

#[test]
fn what_is_no_thickness_file_is_refused() {
    let mut said = String::new();
    for text in [
        "",
        "x,y,z,thickness\n",
        "x,y,z\n1,2,3\n",
        "x,y,z,thickness\n1,2,3\n",
        "x,y,z,thickness\n1,2,3,thin\n",
        "x,y,z,thickness\n0,0,0,0.001\n0,0,0,4\n",
        "x,y,z,thickness\n0,0,0,-0.001\n",
        "x,y,z,thickness\n0,0,0,nan\n",
        "x,y,z,thickness\ninf,0,0,0.001\n",
    ] {
        said += &format!("{text:?}\n  {}\n", read(text, LengthUnit::M).unwrap_err());
    }
    insta::assert_snapshot!(said);
}

#[test]
fn a_missing_file_is_named() {
    let error = read_thickness("no/such.csv".as_ref(), LengthUnit::M).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("no/such.csv: cannot be read: "),
        "{error}"
    );
}
