//! Texts with a unit, and what they are in SI.

use palpa_scene::units::{
    Angle, Density, Force, Kind, Length, Pressure, Quantity, SpringConstant, Time, Velocity,
};
use proptest::prelude::*;

#[track_caller]
fn is<K: Kind>(_: fn(f64) -> Quantity<K>, text: &str, si: f64) {
    let quantity: Quantity<K> = text.parse().unwrap_or_else(|e| panic!("{e}"));
    let off = (quantity.si() - si).abs();
    assert!(
        off <= 4.0 * f64::EPSILON * si.abs(),
        "{text} is {} and not {si}",
        quantity.si()
    );
}

#[test]
fn units_become_si() {
    for (text, si) in [
        ("1.5 mm", 0.0015),
        ("1.5mm", 0.0015),
        ("  1.5   mm ", 0.0015),
        ("-3 mm", -0.003),
        ("+2e-3 m", 0.002),
        ("1e1 cm", 0.1),
        ("300 um", 0.0003),
        ("300 µm", 0.0003),
        ("300 μm", 0.0003),
        ("0.5 in", 0.0127),
        ("2 millimeters", 0.002),
        ("2 millimetres", 0.002),
        ("0 m", 0.0),
    ] {
        is(Length::from_si, text, si);
    }
    for (text, si) in [
        ("12 kPa", 12e3),
        ("0.2 MPa", 2e5),
        ("12 N/mm²", 12e6),
        ("12 N/mm^2", 12e6),
        ("12 N/mm2", 12e6),
        ("120 dyn/cm²", 12.0),
        ("0.5 bar", 5e4),
    ] {
        is(Pressure::from_si, text, si);
    }
    for (text, si) in [
        ("90 dyn/cm", 0.09),
        ("1.0 dyn/cm", 0.001),
        ("0.09 N/m", 0.09),
        ("2 N/mm", 2000.0),
        ("3 mN/mm", 3.0),
        ("5 kN/m", 5000.0),
        ("2 gf/cm", 1.96133),
    ] {
        is(SpringConstant::from_si, text, si);
    }
    is(Velocity::from_si, "10 mm/s", 0.01);
    is(Velocity::from_si, "600 mm/min", 0.01);
    is(Time::from_si, "0.5 s", 0.5);
    is(Time::from_si, "250 ms", 0.25);
    is(Angle::from_si, "180 deg", std::f64::consts::PI);
    is(Angle::from_si, "180 °", std::f64::consts::PI);
    is(Angle::from_si, "1.5 rad", 1.5);
    is(Force::from_si, "3 N", 3.0);
    is(Force::from_si, "1e5 dyn", 1.0);
    is(Density::from_si, "1060 kg/m³", 1060.0);
    is(Density::from_si, "1060 kg/m3", 1060.0);
    is(Density::from_si, "1.06 g/cm^3", 1060.0);
}

#[test]
fn what_is_no_quantity_is_refused_with_a_reason() {
    let mut said = String::new();
    let long = "1".repeat(200) + " mm";
    for text in [
        "12 kg",
        "12",
        "",
        " ",
        "mm",
        "nan mm",
        "inf mm",
        "-inf mm",
        "1e400 m",
        "1e308 km",
        "1,5 mm",
        "1.5 mm/s",
        "1.5 mm mm",
        "1.5 m m",
        "--3 mm",
        "1e mm",
        "0x10 mm",
        "½ mm",
        &long,
    ] {
        let error = text.parse::<Length>().unwrap_err();
        said += &format!("{error}\n");
    }
    for text in [
        "90 dyn",
        "90 /cm",
        "90 dyn/",
        "90 dyn/cm/cm",
        "90 Pa",
        "1e308 kN/nm",
    ] {
        let error = text.parse::<SpringConstant>().unwrap_err();
        said += &format!("{error}\n");
    }
    insta::assert_snapshot!(said);
}

#[test]
fn quantities_are_written_in_the_unit_that_reads_best() {
    assert_eq!(Length::from_si(0.0015).to_string(), "1.5 mm");
    assert_eq!(Length::from_si(0.07).to_string(), "70 mm");
    assert_eq!(Length::from_si(-0.12).to_string(), "-120 mm");
    assert_eq!(Length::from_si(5e-4).to_string(), "0.5 mm");
    assert_eq!(Length::from_si(1e-5).to_string(), "10 µm");
    assert_eq!(Length::from_si(2.5).to_string(), "2.5 m");
    assert_eq!(Length::from_si(0.0).to_string(), "0 m");
    assert_eq!(Pressure::from_si(12e3).to_string(), "12 kPa");
    assert_eq!(Pressure::from_si(2.5e6).to_string(), "2.5 MPa");
    assert_eq!(Velocity::from_si(0.01).to_string(), "10 mm/s");
    assert_eq!(Time::from_si(0.25).to_string(), "0.25 s");
    assert_eq!(SpringConstant::from_si(0.09).to_string(), "90 mN/m");
    assert_eq!(Density::from_si(1060.0).to_string(), "1060 kg/m³");
    assert_eq!(
        Angle::from_si(std::f64::consts::FRAC_PI_2).to_string(),
        "90 deg"
    );
}

fn back<K: Kind>(si: f64) -> f64 {
    let text = Quantity::<K>::from_si(si).to_string();
    text.parse::<Quantity<K>>()
        .unwrap_or_else(|e| panic!("{e}"))
        .si()
}

proptest! {
    #[test]
    fn what_is_written_is_read_to_the_bit(x in proptest::num::f64::NORMAL | proptest::num::f64::ZERO) {
        use palpa_scene::units::{AngleKind, DensityKind, LengthKind, PressureKind, SpringConstantKind, TimeKind, VelocityKind};
        prop_assert_eq!(back::<LengthKind>(x), x);
        prop_assert_eq!(back::<PressureKind>(x), x);
        prop_assert_eq!(back::<VelocityKind>(x), x);
        prop_assert_eq!(back::<TimeKind>(x), x);
        prop_assert_eq!(back::<SpringConstantKind>(x), x);
        prop_assert_eq!(back::<DensityKind>(x), x);
        prop_assert_eq!(back::<AngleKind>(x), x);
    }

    #[test]
    fn decimal_lengths_are_written_as_they_were(n in 1u32..500_000) {
        let text = format!("{} mm", f64::from(n) / 1000.0);
        let length: Length = text.parse().unwrap();
        if length.si() >= 1e-3 && length.si() < 1.0 {
            prop_assert_eq!(length.to_string(), text);
        }
    }
}

#[test]
fn rates_are_one_by_a_time_or_frequencies() {
    for (text, si) in [
        ("5 1/s", 5.0),
        ("5 Hz", 5.0),
        ("3/s", f64::NAN),
        ("30 1/min", 0.5),
        ("2 kHz", 2e3),
        ("2 1/ms", 2e3),
    ] {
        let rate = text.parse::<palpa_scene::units::Rate>();
        if si.is_nan() {
            assert!(rate.is_err(), "{text} became {rate:?}");
            continue;
        }
        let rate = rate.unwrap();
        assert!((rate.si() / si - 1.0).abs() < 1e-15, "{text} became {rate}");
        assert_eq!(rate.to_string().parse(), Ok(rate));
    }
}
