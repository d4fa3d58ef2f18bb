//! The page of `web/dist` is put into the binary: built anew, it is put in anew.

fn main() {
    println!("cargo::rerun-if-changed=../../web/dist");
    println!("cargo::rerun-if-changed=build.rs");
}
