//! The machines that code is made for, and whether this is one of them.
//!
//! Code is made for a baseline that machines of the last fifteen years have (x86-64-v2; 64-bit ARM as it is), never for what the
//! compiling machine happens to offer, so that an executable runs elsewhere and does the same as in the compiler's process.

use std::fmt;

/// Architecture and calling convention.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u32)]
pub enum Target {
    /// 64-bit x86, System V.
    X86SystemV = 1,
    /// 64-bit x86, Windows.
    X86Windows = 2,
    /// 64-bit ARM.
    Arm = 3,
    /// 64-bit ARM, Apple.
    ArmApple = 4,
}

/// Instruction set extensions of [`Target::X86SystemV`] and [`Target::X86Windows`]: names that a code generator and a check
/// know them by.
pub const X86_BASELINE: [&str; 5] = ["sse3", "ssse3", "sse4.1", "sse4.2", "popcnt"];

impl Target {
    const ALL: [Target; 4] = [Target::X86SystemV, Target::X86Windows, Target::Arm, Target::ArmApple];

    /// The machine that this process runs on, if code can be made for it.
    pub fn host() -> Option<Self> {
        if cfg!(all(target_arch = "x86_64", windows)) {
            Some(Target::X86Windows)
        } else if cfg!(target_arch = "x86_64") {
            Some(Target::X86SystemV)
        } else if cfg!(all(target_arch = "aarch64", target_vendor = "apple")) {
            Some(Target::ArmApple)
        } else if cfg!(target_arch = "aarch64") {
            Some(Target::Arm)
        } else {
            None
        }
    }

    /// The number that stands for it in files.
    pub fn number(self) -> u32 {
        self as u32
    }

    /// The target with this number.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.number() == number)
    }

    /// The extensions its code may use, a bit each.
    pub fn features(self) -> u32 {
        match self {
            Target::X86SystemV | Target::X86Windows => (1 << X86_BASELINE.len()) - 1,
            Target::Arm | Target::ArmApple => 0,
        }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Target::X86SystemV => "64-bit x86 (System V)",
            Target::X86Windows => "64-bit x86 (Windows)",
            Target::Arm => "64-bit ARM",
            Target::ArmApple => "64-bit ARM (Apple)",
        })
    }
}

/// Extensions among `wanted` that this processor lacks.
pub fn missing(wanted: u32) -> Vec<String> {
    let bits = (0..u32::BITS).filter(|bit| wanted & (1 << bit) != 0);
    let name =
        |bit: u32| X86_BASELINE.get(bit as usize).map_or_else(|| format!("number {bit}"), |name| name.to_string());
    bits.filter(|&bit| !has(bit)).map(name).collect()
}

#[cfg(target_arch = "x86_64")]
fn has(bit: u32) -> bool {
    match bit {
        0 => std::arch::is_x86_feature_detected!("sse3"),
        1 => std::arch::is_x86_feature_detected!("ssse3"),
        2 => std::arch::is_x86_feature_detected!("sse4.1"),
        3 => std::arch::is_x86_feature_detected!("sse4.2"),
        4 => std::arch::is_x86_feature_detected!("popcnt"),
        _ => false,
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn has(_bit: u32) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_again_and_unknown_extensions_are_missing() {
        for target in Target::ALL {
            assert_eq!(Target::from_number(target.number()), Some(target));
        }
        assert_eq!(Target::from_number(0), None);
        assert_eq!(missing(1 << 31), ["number 31"]);
        assert!(missing(0).is_empty());
    }
}
