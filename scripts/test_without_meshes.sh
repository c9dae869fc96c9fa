#!/bin/sh
# The tests that look for the public test meshes, once more where there are none: in a clone at a path of its own, as a stranger has it.
# What is not committed is not in the clone.
# The clone shares the build folder, so that only the project's own crates are compiled again.
. "$(dirname "$0")/env.sh"

folder="$(mktemp -d)" || exit 1
trap 'rm -rf "$folder"' EXIT
trap 'exit 130' INT TERM
clone="$folder/a clone"
git clone --quiet --local . "$clone" || exit 1

# One filter per module of integration tests that names the folder of meshes, or the module that knows it.
modules() {
    grep -rlE 'shared_meshes|TUMBLE_MESHES' --include='*.rs' "crates/$1/tests/it" |
        sed -E 's|.*/tests/it/([a-z_]+)\.rs$|\1::|' | grep -vE '^(main|shared_meshes)::$' | sort -u
}

CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
TUMBLE_CACHE="$folder/trees"
export CARGO_TARGET_DIR TUMBLE_CACHE
unset TUMBLE_MESHES

cd "$clone" || exit 1
filters=""
for crate in collide core tumble; do
    found="$(modules "$crate")"
    [ -n "$found" ] || { echo "error: no test of crates/$crate looks for the meshes any more; take it out of $0" >&2; exit 1; }
    filters="$filters $found"
done
# shellcheck disable=SC2086  # one word per module
cargo test --release --workspace --locked --test it -- $filters
