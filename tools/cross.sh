#!/usr/bin/env bash
# cargo check of all crates for systems that this machine is not: TARGETS, or
# Windows and Linux on ARM.
#
# The standard library of a target is taken from rustup; where rustup does not have it, it is checked from source: that of
# the toolchain, or that of Debian's rustc-web and rust-web-src, unpacked below target/ and not installed. A check needs no linker
# and no C compiler. The exit code is 3 if a target cannot be had, and another one if a crate does not compile.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
read -ra targets <<<"${TARGETS:-x86_64-pc-windows-gnu aarch64-unknown-linux-gnu}"
folder="$(mkdir -p "${CARGO_TARGET_DIR:-target}/cross" && cd "${CARGO_TARGET_DIR:-target}/cross" && pwd)"
debian="$folder/debian"

# Whether the toolchain has the standard library of the target $1.
has_target() {
    compgen -G "$(rustc --print target-libdir --target "$1")/libcore-*.rlib" >/dev/null
}

# Debian's compiler with the source of its standard library, into $debian. Its version need not be
# the toolchain's: it compiles everything here.
unpack_debian() {
    [ -x "$debian/rustc" ] && is_new_enough "$("$debian/rustc" --version | cut -d ' ' -f 2)" && return
    command -v apt-get dpkg >/dev/null || return 1
    rm -rf "$debian" && mkdir -p "$debian/packages"
    # The lists of packages of a fresh machine are empty or old.
    if ! offers_compiler; then
        apt-get update >/dev/null 2>&1 || return 1
        offers_compiler || return 1
    fi
    local std llvm
    std=$(depends_of libstd-rust-web-dev 'libstd-rust-web-[0-9.]+') && llvm=$(depends_of "$std" 'libllvm[0-9]+') || return 1
    echo "cross: rustup does not have every target; unpacking Debian's $std with its source"
    # binutils-mingw-w64 has the dlltool that makes import libraries for Windows.
    (cd "$debian/packages" && apt-get download rustc-web rust-web-src libstd-rust-web-dev "$std" "$llvm" libz3-4 \
        binutils-mingw-w64-x86-64 >/dev/null 2>&1) || return 1
    local package
    mkdir "$debian/root"
    # LLVM's own source and the manuals are most of it, and not needed.
    for package in "$debian"/packages/*.deb; do
        dpkg --fsys-tarfile "$package" |
            tar -x -C "$debian/root" --anchored --no-wildcards-match-slash --exclude './usr/src/*/src' \
                --exclude './usr/share' || return 1
    done
    rm -r "$debian/packages"
    printf '#!/bin/sh\nLD_LIBRARY_PATH="%s" exec "%s" "$@"\n' \
        "$debian/root/usr/lib/x86_64-linux-gnu" "$debian/root/usr/bin/rustc" >"$debian/rustc.new"
    chmod +x "$debian/rustc.new"
    "$debian/rustc.new" --version && mv "$debian/rustc.new" "$debian/rustc"
}

# Whether the lists of packages have a compiler that is new enough for the workspace.
offers_compiler() {
    is_new_enough "$(apt-cache show --no-all-versions rust-web-src 2>/dev/null | sed -n 's/^Version: //p')"
}

# Whether $1, the version of a compiler, is what the workspace asks for or later.
is_new_enough() {
    dpkg --compare-versions "$1" ge "$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' Cargo.toml)"
}

# The first package that matches $2 among those that $1 depends on.
depends_of() {
    apt-cache depends "$1" 2>/dev/null | grep -oE "\b$2\b" | head -n 1 | grep .
}

# The workspace's profile optimises dependencies, which a check does not need.
quick=(--config 'profile.dev.package."*".opt-level=0')

with_std=() from_source=()
for target in "${targets[@]}"; do
    if has_target "$target"; then with_std+=(--target "$target"); else from_source+=(--target "$target"); fi
done

if [ ${#with_std[@]} -gt 0 ]; then
    echo "cross: cargo check ${with_std[*]}"
    cargo check --workspace "${quick[@]}" "${with_std[@]}"
fi

if [ ${#from_source[@]} -gt 0 ]; then
    # `-Z build-std` is cargo's way to compile the standard library; RUSTC_BOOTSTRAP lets a
    # stable cargo take it.
    check=(cargo check --workspace -Z build-std=std,panic_unwind "${quick[@]}" "${from_source[@]}")
    export RUSTC_BOOTSTRAP=1 CARGO_TARGET_DIR="$folder/target"
    if [ -f "$(rustc --print sysroot)/lib/rustlib/src/rust/library/Cargo.lock" ]; then
        echo "cross: with the toolchain's source: ${check[*]}"
        "${check[@]}"
    elif unpack_debian; then
        echo "cross: with Debian's source: ${check[*]}"
        PATH="$PATH:$debian/root/usr/bin" RUSTC="$debian/rustc" "${check[@]}"
    else
        echo "cross: NOT checked: ${from_source[*]//--target/}: there is no standard library for it here. Add it with
    rustup target add${from_source[*]//--target/}
or its source with
    rustup component add rust-src" >&2
        exit 3
    fi
fi
echo "cross: good: ${targets[*]}"
