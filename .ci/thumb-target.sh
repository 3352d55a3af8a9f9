#!/usr/bin/env bash
# Makes the firmware's target available and prints the toolchain argument to build it with: nothing
# for rustup's own, or "+debian" for Debian 12's, where rustup cannot download.
# SOFTGRIP_THUMB=rustup or SOFTGRIP_THUMB=debian allows one of the two ways only.
set -euo pipefail

target=thumbv7em-none-eabihf
way=${SOFTGRIP_THUMB:-either}

case $way in
either | rustup)
    if timeout 300 rustup target add "$target" >&2; then
        exit 0
    fi
    if [ "$way" = rustup ]; then
        echo "rustup could not add $target" >&2
        exit 1
    fi
    echo "rustup could not add $target: taking Debian's compiler" >&2
    ;;
debian) ;;
*)
    echo "SOFTGRIP_THUMB is '$way': must be 'rustup' or 'debian', or unset for either" >&2
    exit 2
    ;;
esac

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi
}

# Debian 12's security archive follows recent compilers for its web browsers. Its `rust-lld`, from
# rust-web-llvm, is a link into lld-22.
export DEBIAN_FRONTEND=noninteractive
as_root apt-get update -q >&2
as_root apt-get install -qy --no-install-recommends \
    rustc-web cargo-web rust-web-src rust-web-clippy rust-web-llvm lld-22 >&2
rustup toolchain link debian /usr >&2

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
mkdir "$scratch/src"
echo '#![no_std]' >"$scratch/src/lib.rs"

finds_core() {
    rustc +debian --target "$target" --crate-type lib --emit metadata --out-dir "$scratch" "$scratch/src/lib.rs" 2>/dev/null
}

# There is no `core` for the target in there, but its source is.
if ! finds_core; then
    printf '[package]\nname = "empty"\nedition = "2024"\n[workspace]\n' >"$scratch/Cargo.toml"
    # RUSTC_BOOTSTRAP allows -Z here. The image is linked with LTO, which needs the bitcode.
    (
        cd "$scratch"
        env -u CARGO_TARGET_DIR RUSTC_BOOTSTRAP=1 RUSTFLAGS=-Cembed-bitcode=yes \
            cargo +debian build --release -Zbuild-std=core,alloc --target "$target" >&2
    )
    libraries=$(rustc +debian --print target-libdir --target "$target")
    built=$scratch/target/$target/release/deps
    as_root mkdir -p "$libraries"
    as_root rm -f "$libraries"/lib{core,alloc,compiler_builtins}-*.rlib
    as_root cp "$built"/lib{core,alloc,compiler_builtins}-*.rlib "$libraries"
    finds_core || {
        echo "Debian's compiler does not find core for $target in $libraries" >&2
        exit 1
    }
fi
echo +debian
