//! The machine of a log against this one.

use palpa_rt::{Effect, Machine};

/// A machine of which everything is known.
fn machine(cpu: &str) -> Machine {
    let library = |(name, version): (&str, &str)| (name.to_owned(), version.to_owned());
    Machine {
        palpa: "0.1.0".to_owned(),
        compiler: "rustc 1.95.0 for x86_64-unknown-linux-gnu".to_owned(),
        libraries: [("faer", "0.24.4"), ("pulp", "0.22.3")].map(library).into(),
        cpu: cpu.to_owned(),
        caches: "32 KiB, 1024 KiB, 4096 KiB".to_owned(),
        functions: "00".to_owned(),
        threads: "2".to_owned(),
    }
}

/// Differences after `change`: in words, and what they can change.
fn after(cpu: &str, change: impl Fn(&mut Machine)) -> Vec<(String, Effect)> {
    let mut logged = machine(cpu);
    change(&mut logged);
    let differences = logged.differences(&machine(cpu));
    (differences.iter().map(|d| (d.to_string(), d.effect))).collect()
}

const WIDE: &str = "x86_64 avx avx2 fma";
const NARROW: &str = "x86_64 sse4.1";

#[test]
fn each_difference_is_named_with_what_it_can_change() {
    let last_bits = "the last bits of forces may differ";
    for (change, said, effect) in [
        (
            (|m| m.palpa = "0.0.9".to_owned()) as fn(&mut Machine),
            "version of Palpa: 0.0.9 in the log, 0.1.0 now; another version may compute \
             differently, and forces with it"
                .to_owned(),
            Effect::Computation,
        ),
        (
            |m| m.compiler.clear(),
            format!(
                "compiler: not recorded in the log, rustc 1.95.0 for x86_64-unknown-linux-gnu now; \
                 {last_bits}"
            ),
            Effect::LastBits,
        ),
        (
            |m| {
                m.libraries.insert("faer".to_owned(), "0.23.0".to_owned());
            },
            format!("library faer: 0.23.0 in the log, 0.24.4 now; {last_bits}"),
            Effect::LastBits,
        ),
        (
            |m| {
                m.libraries.remove("pulp");
            },
            format!("library pulp: not recorded in the log, 0.22.3 now; {last_bits}"),
            Effect::LastBits,
        ),
        (
            |m| m.libraries.clear(),
            format!(
                "numerical libraries: not recorded in the log, faer 0.24.4, pulp 0.22.3 now; \
                 {last_bits}"
            ),
            Effect::LastBits,
        ),
        (
            |m| m.cpu = "x86_64 avx".to_owned(),
            format!("features of the processor: x86_64 avx in the log, {WIDE} now; {last_bits}"),
            Effect::LastBits,
        ),
        (
            |m| m.functions = "01".to_owned(),
            format!("elementary functions of the system: 01 in the log, 00 now; {last_bits}"),
            Effect::LastBits,
        ),
        (
            |m| m.threads = "4".to_owned(),
            "threads for growth and static steps: 4 in the log, 2 now; this changes no force"
                .to_owned(),
            Effect::None,
        ),
    ] {
        assert_eq!(after(WIDE, change), [(said, effect)]);
    }
    assert_eq!(after(WIDE, |_| ()), []);
}

#[test]
fn caches_divide_the_sums_of_the_portable_kernel_only() {
    let smaller = |m: &mut Machine| m.caches = "32 KiB, 256 KiB, 2048 KiB".to_owned();
    let effects = |cpu, change: &dyn Fn(&mut Machine)| -> Vec<_> {
        after(cpu, change)
            .into_iter()
            .map(|(_, effect)| effect)
            .collect()
    };
    assert_eq!(effects(WIDE, &smaller), [Effect::None]);
    assert_eq!(effects(NARROW, &smaller), [Effect::LastBits]);
    assert_eq!(effects("aarch64", &smaller), [Effect::LastBits]);
}

#[test]
fn this_machine_is_known_and_the_same_each_time() {
    let here = Machine::here();
    assert_eq!(here, Machine::here());
    assert_eq!(here.palpa, env!("CARGO_PKG_VERSION"));
    assert!(!here.cpu.is_empty());
    assert_eq!(here.functions.len(), 16);
}
