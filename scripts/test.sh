#!/bin/sh
# Everything that can fail, in the profile that users run: set-up, build, tests, doc tests, the Python module, documentation.
#   scripts/test.sh          all of them
#   scripts/test.sh --slow   and again at their full length those that TUMBLE_SLOW=1 lengthens, and geometry and dynamics with assertions
. "$(dirname "$0")/env.sh"

case "${1:-}" in
    "" | --slow) ;;
    *)
        echo "usage: scripts/test.sh [--slow]" >&2
        exit 2
        ;;
esac

# Sphere trees that tests build stay in this checkout.
TUMBLE_CACHE="$PWD/target/trees"
export TUMBLE_CACHE

tests="--release --workspace --locked --lib --bins --tests --examples"

stage set-up scripts/setup.sh
# shellcheck disable=SC2086  # words, not one argument
stage build cargo test $tests --no-run
# shellcheck disable=SC2086
stage tests cargo test $tests --no-fail-fast
# shellcheck disable=SC2086
[ "${1:-}" != --slow ] || stage "slow tests" env TUMBLE_SLOW=1 cargo test $tests --no-fail-fast -- determinism full_length
[ "${1:-}" != --slow ] || stage assertions cargo test --profile checked --locked -p tumble-collide -p tumble-core -p tumble-behaviors -p tumble-scene --no-fail-fast
stage "doc tests" cargo test --no-fail-fast --release --workspace --locked --doc
stage python scripts/test_python.sh
stage docs python3 scripts/check_docs.py

echo
stages
echo "All tests passed."
