#!/bin/sh
# Layout, then compiler and clippy warnings, of the workspace and everything in it that is a target, as errors. Changes nothing.
. "$(dirname "$0")/env.sh"
cargo fmt --check || exit 1
cargo clippy --release --workspace --all-targets --locked --keep-going -- -D warnings
