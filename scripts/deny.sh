#!/bin/sh
# Licenses, bans and sources of all dependencies (deny.toml). cargo-deny is taken from PATH or built once into target/tools;
# the check is skipped visibly if neither works.
. "$(dirname "$0")/env.sh"
tools="$PWD/target/tools"
PATH="$PATH:$tools/bin"
export PATH
if ! command -v cargo-deny >/dev/null 2>&1; then
    echo "building cargo-deny into target/tools"
    CARGO_PROFILE_DEV_DEBUG=0 CARGO_TARGET_DIR="$tools/build" cargo install --quiet --locked --debug --root "$tools" cargo-deny@0.20.2
    rm -rf "$tools/build"
fi
if ! command -v cargo-deny >/dev/null 2>&1; then
    echo "SKIPPED: cargo-deny is not installed and could not be built; licenses and sources were not checked" >&2
    exit 0
fi
cargo deny --locked check --hide-inclusion-graph licenses bans sources
