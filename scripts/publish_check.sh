#!/bin/sh
# Every published crate, packed as `cargo publish` does it, and compiled from the packages alone; nothing is uploaded.
# The packages are compiled as one workspace with the profile of the checkout: `cargo publish` would compile every dependency
# once per crate.
. "$(dirname "$0")/env.sh"

target="${CARGO_TARGET_DIR:-$PWD/target}"
packages="$target/package/workspace"

cargo publish --dry-run --no-verify --workspace --locked ||
    echo "The registry could not be asked, or refuses the crates; they are packed and compiled all the same." >&2
rm -rf "$target/package"
# shellcheck disable=SC2046  # one word per crate
cargo package --no-verify --locked --offline --target-dir "$target" \
    $(grep -L '^publish = false' crates/*/Cargo.toml | sed -E 's|.*crates/(.*)/Cargo.toml|-p tumble-\1|; s|tumble-tumble|tumble|') || exit 1

mkdir -p "$packages"
for crate in "$target"/package/*.crate; do
    tar -xzf "$crate" -C "$packages" || exit 1
done
{
    echo '[workspace]'
    echo 'resolver = "3"'
    echo 'members = ["tumble-*"]'
    echo '[patch.crates-io]'
    for folder in "$packages"/tumble-*; do
        name="$(basename "$folder" | sed 's/-[0-9.]*$//')"
        echo "$name = { path = \"$(basename "$folder")\" }"
    done
} >"$packages/Cargo.toml"
sed -n '/^\[profile.release\]/,/^\[profile.checked\]/p' Cargo.toml | sed '$d' >>"$packages/Cargo.toml"
cp Cargo.lock "$packages/"
CARGO_TARGET_DIR="$target" cargo check --release --offline --workspace --manifest-path "$packages/Cargo.toml" || exit 1
# the library alone: geometry, dynamics and scenes, without pictures, network and command
CARGO_TARGET_DIR="$target" cargo check --release --offline -p tumble --lib --no-default-features --manifest-path "$packages/Cargo.toml"
