//! The report of one tick: faults, limits, forces and energy.

use crate::{MAX_TOOLS, Vec3};
use core::fmt;
use core::ops::{BitOr, BitOrAssign};

macro_rules! flags {
    ($(#[$doc:meta])* $name:ident { $($(#[$flag_doc:meta])* $flag:ident = $bit:expr, $text:expr;)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, Default)]
        pub struct $name(u16);

        impl $name {
            /// No flag set.
            pub const NONE: Self = Self(0);
            $($(#[$flag_doc])* pub const $flag: Self = Self(1 << $bit);)*

            /// Whether all flags of `other` are set.
            pub const fn contains(self, other: Self) -> bool {
                self.0 & other.0 == other.0
            }

            /// Whether no flag is set.
            pub const fn is_empty(self) -> bool {
                self.0 == 0
            }

            /// The flags as a bit mask, for records.
            pub const fn bits(self) -> u16 {
                self.0
            }

            /// The flags of a bit mask; unknown bits are dropped.
            pub const fn from_bits(bits: u16) -> Self {
                Self(bits & (0 $(| 1 << $bit)*))
            }

            /// Calls `f` with the words for each flag that is set.
            pub fn for_each_name(self, mut f: impl FnMut(&'static str)) {
                $(if self.contains(Self::$flag) { f($text); })*
            }
        }

        impl BitOr for $name {
            type Output = Self;
            fn bitor(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }
        }

        impl BitOrAssign for $name {
            fn bitor_assign(&mut self, other: Self) {
                self.0 |= other.0;
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let mut set = f.debug_set();
                self.for_each_name(|name| { set.entry(&format_args!("{name}")); });
                set.finish()
            }
        }
    };
}

flags! {
    /// Why the force is ramped to zero. A fault is set in every tick in which its cause lasts.
    Faults {
        /// There was no patch yet.
        NO_PATCH = 0, "no patch yet";
        /// The newest patch is too old.
        STALE_PATCH = 1, "stale patch";
        /// The newest patch holds values that cannot be a contact.
        BAD_PATCH = 2, "patch not usable";
        /// The time since the last tick was longer than the local model may be held, or many
        /// ticks were late.
        MISSED_DEADLINE = 3, "missed deadline";
        /// The clock went back, stood still, or was not a number.
        BAD_CLOCK = 4, "bad clock";
        /// A device gave no reading.
        DEVICE_LOST = 5, "device lost";
        /// A device gave a reading that is not a number.
        BAD_READING = 6, "reading not a number";
        /// A device repeats the same reading.
        DEVICE_STALLED = 7, "device stalled";
        /// A position jumped faster than a hand can move.
        DEVICE_JUMPED = 8, "device jumped";
        /// The contact problem gave no finite force.
        NO_SOLUTION = 9, "contact not solved";
    }
}

flags! {
    /// Which limits a force met.
    Limits {
        /// Largest force of the device.
        FORCE = 0, "force";
        /// Largest moment of the device.
        TORQUE = 1, "torque";
        /// Largest rate of change of the force.
        SLEW = 2, "slew";
        /// The ramp held the force back.
        RAMP = 3, "ramp";
        /// The energy observer injected damping.
        ENERGY = 4, "energy";
        /// The coupling softened a contact that is too stiff for the device.
        STIFFNESS = 5, "stiffness";
        /// The difference in force to a new patch was larger than the transfer bridges.
        TRANSFER = 6, "transfer";
        /// The sweeps ended before the tolerance was met.
        SWEEPS = 7, "sweeps";
    }
}

/// The report of one tick on one tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolReport {
    /// Force of the tissue on the tool by the local model, N, before transfer, ramp, damping and
    /// limits.
    pub tissue_force: Vec3,
    /// Its moment about the tool's position, N m.
    pub tissue_torque: Vec3,
    /// Commanded force, N.
    pub force: Vec3,
    /// Transfer from the previous patch, N; part of the force.
    pub transfer: Vec3,
    /// Estimated velocity, m/s.
    pub velocity: Vec3,
    /// Stiffness of the tissue against the tool, N/m; 0 without contact.
    pub stiffness: f64,
    /// Displacement of the tool from the device by the coupling, m. The tissue's next step uses the
    /// position of the tool: at the position of the device, the tissue would be pressed deeper, and
    /// be stiffer, than it is felt.
    pub stretch: Vec3,
    /// Share of the tissue's stiffness that the coupling takes away; 0 if the full stiffness is
    /// felt.
    pub softening: f64,
    /// Damping that the energy observer injected, N s/m.
    pub damping: f64,
    /// Energy taken from the hand since the start, J.
    pub energy_in: f64,
    /// Energy given to the hand since the start, J.
    pub energy_out: f64,
    /// Bank of the energy observer, J; negative if energy was generated.
    pub bank: f64,
    /// Energy that the local model stores, J.
    pub stored: f64,
    /// Energy by which the patch that arrived in this tick changed the stored energy at the same
    /// pose, J; 0 in other ticks.
    pub jump: f64,
    /// The limits that were met.
    pub limits: Limits,
    /// Faults of this tool's device.
    pub faults: Faults,
}

impl ToolReport {
    /// Report of an unused tool.
    pub const ZERO: Self = Self {
        tissue_force: Vec3::new(0.0, 0.0, 0.0),
        tissue_torque: Vec3::new(0.0, 0.0, 0.0),
        force: Vec3::new(0.0, 0.0, 0.0),
        transfer: Vec3::new(0.0, 0.0, 0.0),
        velocity: Vec3::new(0.0, 0.0, 0.0),
        stiffness: 0.0,
        stretch: Vec3::new(0.0, 0.0, 0.0),
        softening: 0.0,
        damping: 0.0,
        energy_in: 0.0,
        energy_out: 0.0,
        bank: 0.0,
        stored: 0.0,
        jump: 0.0,
        limits: Limits::NONE,
        faults: Faults::NONE,
    };
}

/// The report of one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickReport {
    /// Clock of the tick, s.
    pub now: f64,
    /// Number of the patch that the force comes from.
    pub patch_id: u64,
    /// Whether that patch arrived in this tick.
    pub is_new_patch: bool,
    /// Time since the poses of the patch were taken, s.
    pub patch_age: f64,
    /// Number of candidates that touch.
    pub n_active: u32,
    /// Number of touching candidates that slide.
    pub n_sliding: u32,
    /// Sweeps over the contacts.
    pub sweeps: u32,
    /// Change of the contact forces in the last sweep as a share of their sum.
    pub residual: f64,
    /// Share of the force that the ramp lets through; below 1 after a fault.
    pub gain: f64,
    /// Energy budget, J: energy that the loop may give out beyond the energy it took in.
    pub energy_budget: f64,
    /// Faults of this tick, over all tools.
    pub faults: Faults,
    /// Limits met, over all tools.
    pub limits: Limits,
    /// The tools; entries without a device are [`ToolReport::ZERO`].
    pub tools: [ToolReport; MAX_TOOLS],
}

impl TickReport {
    /// Report of a tick that did nothing.
    pub const ZERO: Self = Self {
        now: 0.0,
        patch_id: 0,
        is_new_patch: false,
        patch_age: 0.0,
        n_active: 0,
        n_sliding: 0,
        sweeps: 0,
        residual: 0.0,
        gain: 0.0,
        energy_budget: 0.0,
        faults: Faults::NONE,
        limits: Limits::NONE,
        tools: [ToolReport::ZERO; MAX_TOOLS],
    };
}
