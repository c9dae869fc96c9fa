#!/bin/sh
# Format, compiler, clippy and rustdoc warnings of the whole workspace, ruff and mypy for Python: all are errors. Changes no source file.
. "$(dirname "$0")/env.sh"
scripts/python_env.sh || exit 1
cargo fmt --check || exit 1
cargo clippy --release --workspace --all-targets --locked --keep-going -- -D warnings || exit 1
RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps --locked --keep-going || exit 1
target/py-tests/bin/ruff check || exit 1
target/py-tests/bin/mypy
