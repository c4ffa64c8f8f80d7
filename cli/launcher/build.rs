//! Links the launcher at a fixed address.  A program that may stand anywhere has eighteen thousand addresses to be put right at each
//! start, which takes longer than many a run of an executable.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let is = |key: &str, wanted: &str| std::env::var(key).is_ok_and(|value| value == wanted);
    if is("CARGO_CFG_TARGET_OS", "linux") && is("CARGO_CFG_TARGET_ENV", "gnu") {
        println!("cargo:rustc-link-arg-bin=hyd-launcher=-no-pie");
    }
}
