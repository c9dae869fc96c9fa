#!/bin/sh
# The workspace compiles with the Rust that it declares (`rust-version` of Cargo.toml).
. "$(dirname "$0")/env.sh"
declared="$(sed -n 's/^rust-version = "\([0-9.]*\)".*/\1/p' Cargo.toml)"
case "$(rustc -V)" in
    "rustc $declared".*)
        echo "rustc $declared is in use: the build of the tests was the check"
        exit 0
        ;;
esac
if ! command -v rustup >/dev/null 2>&1; then
    echo "SKIPPED: $(rustc -V) is in use, and there is no rustup to install $declared" >&2
    exit 0
fi
rustup toolchain install "$declared" --profile minimal || exit 1
CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}/msrv" cargo "+$declared" check --workspace --locked
