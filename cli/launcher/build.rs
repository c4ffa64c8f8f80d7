//! Links the launcher at a fixed address.  A program that may stand anywhere has eighteen thousand addresses to be put right at each
//! start, which takes longer than many a run of an executable.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux") {
        println!("cargo:rustc-link-arg-bin=hyd-launcher=-no-pie");
    }
}
