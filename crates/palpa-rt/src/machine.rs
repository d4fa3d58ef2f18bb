//! What the last bits of a computation depend on: a log holds it, and a replay compares it.

use std::collections::BTreeMap;
use std::fmt::{self, Display};
use std::hint::black_box;

use serde_json::{Value, json};

/// The program and the machine that a log was made with. An empty text means that it is not known.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Machine {
    /// Version of Palpa.
    pub palpa: String,
    /// Compiler and target of the program.
    pub compiler: String,
    /// Version of each numerical library, by name.
    pub libraries: BTreeMap<String, String>,
    /// Features of the processor that the libraries choose their instructions by.
    pub cpu: String,
    /// Sizes of the data caches of levels 1 to 3, as the library of matrix products sees them.
    pub caches: String,
    /// Fingerprint of the system's elementary functions, whose last bits differ between systems.
    pub functions: String,
    /// Number of threads that share growth of the body and its static start. Steps of the tissue
    /// and the 1 kHz law use one thread each.
    pub threads: String,
}

/// What a difference between two machines can do to a force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Another version may compute in another way.
    Computation,
    /// Sums are rounded differently, and contact amplifies the last bits.
    LastBits,
    /// No bit of a result changes.
    None,
}

/// A difference between the machine of a log and this one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// What differs.
    pub what: String,
    /// In the log; empty if it is not recorded there.
    pub logged: String,
    /// Now; empty if it is not known.
    pub now: String,
    /// What it can do to a force.
    pub effect: Effect,
}

/// One line of the comparison.
struct Part {
    key: &'static str,
    what: &'static str,
    text: fn(&Machine) -> &String,
    effect: fn(&Machine) -> Effect,
}

/// The comparison: all that is text. Libraries are compared one by one.
const PARTS: [Part; 6] = [
    Part {
        key: "palpa",
        what: "version of Palpa",
        text: |m| &m.palpa,
        effect: |_| Effect::Computation,
    },
    Part {
        key: "compiler",
        what: "compiler",
        text: |m| &m.compiler,
        effect: |_| Effect::LastBits,
    },
    Part {
        key: "cpu",
        what: "features of the processor",
        text: |m| &m.cpu,
        effect: |_| Effect::LastBits,
    },
    Part {
        key: "caches",
        what: "cache sizes",
        text: |m| &m.caches,
        effect: Machine::effect_of_caches,
    },
    Part {
        key: "functions",
        what: "elementary functions of the system",
        text: |m| &m.functions,
        effect: |_| Effect::LastBits,
    },
    Part {
        key: "threads",
        what: "threads for growth and static steps",
        text: |m| &m.threads,
        // Sums have a fixed order, whichever thread computes a part of them.
        effect: |_| Effect::None,
    },
];

impl Machine {
    /// This machine, as far as this crate knows it: version, processor and elementary functions.
    pub fn here() -> Self {
        Self {
            palpa: env!("CARGO_PKG_VERSION").to_owned(),
            cpu: cpu_features(),
            functions: functions(),
            ..Self::default()
        }
    }

    /// The differences between the machine of a log, `self`, and this one.
    pub fn differences(&self, now: &Self) -> Vec<Difference> {
        let parts = PARTS.iter().map(|part| Difference {
            what: part.what.to_owned(),
            logged: (part.text)(self).clone(),
            now: (part.text)(now).clone(),
            effect: (part.effect)(self).max((part.effect)(now)),
        });
        let names: Vec<_> = if self.libraries.is_empty() || now.libraries.is_empty() {
            Vec::new()
        } else {
            (self.libraries.keys())
                .chain(
                    now.libraries
                        .keys()
                        .filter(|k| !self.libraries.contains_key(*k)),
                )
                .collect()
        };
        let version = |of: &Self, name: &String| of.libraries.get(name).cloned();
        let libraries = names.into_iter().map(|name| Difference {
            what: format!("library {name}"),
            logged: version(self, name).unwrap_or_default(),
            now: version(now, name).unwrap_or_default(),
            effect: Effect::LastBits,
        });
        let unknown = (self.libraries.is_empty() != now.libraries.is_empty()).then(|| {
            let all = |of: &Self| {
                let each = of.libraries.iter().map(|(k, v)| format!("{k} {v}"));
                each.collect::<Vec<_>>().join(", ")
            };
            Difference {
                what: "numerical libraries".to_owned(),
                logged: all(self),
                now: all(now),
                effect: Effect::LastBits,
            }
        });
        (parts.chain(libraries).chain(unknown))
            .filter(|d| d.logged != d.now)
            .collect()
    }

    /// On processors with AVX2 and FMA the kernel of matrix products divides sums at fixed places,
    /// and only rows and columns by the caches. The portable kernel divides the sums by them too.
    fn effect_of_caches(&self) -> Effect {
        let has = |feature| self.cpu.split(' ').any(|f| f == feature);
        if has("x86_64") && has("avx2") && has("fma") {
            Effect::None
        } else {
            Effect::LastBits
        }
    }

    /// The machine as a part of a log's header.
    pub(crate) fn to_json(&self) -> Value {
        let mut json = json!({ "libraries": self.libraries });
        for part in &PARTS {
            json[part.key] = (part.text)(self).clone().into();
        }
        json
    }

    /// The machine in a log's header. What is missing there is not known.
    pub(crate) fn from_json(json: &Value) -> Self {
        let text = |key: &str| json[key].as_str().unwrap_or_default().to_owned();
        let libraries = json["libraries"].as_object().into_iter().flatten();
        Self {
            palpa: text("palpa"),
            compiler: text("compiler"),
            libraries: libraries
                .map(|(name, v)| (name.clone(), v.as_str().unwrap_or_default().to_owned()))
                .collect(),
            cpu: text("cpu"),
            caches: text("caches"),
            functions: text("functions"),
            threads: text("threads"),
        }
    }
}

impl Effect {
    fn max(self, other: Self) -> Self {
        match (self, other) {
            (Self::Computation, _) | (_, Self::Computation) => Self::Computation,
            (Self::LastBits, _) | (_, Self::LastBits) => Self::LastBits,
            (Self::None, Self::None) => Self::None,
        }
    }

    /// The effect as one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Computation => "computation",
            Self::LastBits => "last_bits",
            Self::None => "none",
        }
    }
}

impl Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let or = |text: &str, unknown: &str| {
            if text.is_empty() {
                unknown.to_owned()
            } else {
                text.to_owned()
            }
        };
        write!(
            f,
            "{}: {} in the log, {} now; {}",
            self.what,
            or(&self.logged, "not recorded"),
            or(&self.now, "not known"),
            match self.effect {
                Effect::Computation =>
                    "another version may compute differently, and forces with it",
                Effect::LastBits => "the last bits of forces may differ",
                Effect::None => "this changes no force",
            }
        )
    }
}

/// Features of this machine's processor that results may depend on.
fn cpu_features() -> String {
    #[cfg(target_arch = "x86_64")]
    {
        // Those by which `pulp`, `faer` and its kernels, and the law choose their instructions.
        let all = [
            ("sse4.1", std::arch::is_x86_feature_detected!("sse4.1")),
            ("avx", std::arch::is_x86_feature_detected!("avx")),
            ("avx2", std::arch::is_x86_feature_detected!("avx2")),
            ("fma", std::arch::is_x86_feature_detected!("fma")),
            ("bmi2", std::arch::is_x86_feature_detected!("bmi2")),
            ("avx512f", std::arch::is_x86_feature_detected!("avx512f")),
            ("avx512bw", std::arch::is_x86_feature_detected!("avx512bw")),
            ("avx512cd", std::arch::is_x86_feature_detected!("avx512cd")),
            ("avx512dq", std::arch::is_x86_feature_detected!("avx512dq")),
            ("avx512vl", std::arch::is_x86_feature_detected!("avx512vl")),
        ];
        let have = all.iter().filter(|(_, has)| *has).map(|(name, _)| *name);
        let have: Vec<_> = std::iter::once("x86_64").chain(have).collect();
        have.join(" ")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        std::env::consts::ARCH.to_owned()
    }
}

/// Fingerprint of the elementary functions that come from the system: bits of their values at a
/// few thousand arguments, as one number. There is no version that could be asked for instead.
fn functions() -> String {
    const ARGUMENTS: u32 = 512;
    const OF: [fn(f64) -> f64; 10] = [
        f64::exp,
        f64::exp_m1,
        f64::ln,
        f64::ln_1p,
        f64::cbrt,
        f64::sin,
        f64::cos,
        f64::acos,
        |x| x.powf(0.37),
        |x| x.atan2(0.3) + x.hypot(0.7),
    ];
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for function in OF {
        for i in 1..=ARGUMENTS {
            // In (0, 1), where all of them are defined. The compiler must not compute them itself.
            let x = black_box(f64::from(i) / f64::from(ARGUMENTS + 1));
            hash = (hash ^ function(x).to_bits()).wrapping_mul(0x0100_0000_01b3);
        }
    }
    format!("{hash:016x}")
}
