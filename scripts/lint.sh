#!/bin/sh
# Compiler and clippy warnings, of the workspace and everything in it that is a target, as errors. Changes nothing.
. "$(dirname "$0")/env.sh"
cargo clippy --release --workspace --all-targets --locked -- -D warnings
