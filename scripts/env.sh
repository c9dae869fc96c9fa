# Sourced by the other scripts: where things are, and what every build and run here shares.

cd "$(dirname "$0")/.." || exit 1

# rustup's default place, for shells that have not read its profile yet.
if ! command -v cargo >/dev/null 2>&1 && [ -x "${HOME:-}/.cargo/bin/cargo" ]; then
    PATH="$HOME/.cargo/bin:$PATH"
    export PATH
fi

# Mesa's Vulkan complains on every start where this is not set to a private folder.
if [ -z "${XDG_RUNTIME_DIR:-}" ]; then
    XDG_RUNTIME_DIR="$(mktemp -d)" || exit 1
    chmod 0700 "$XDG_RUNTIME_DIR"
    export XDG_RUNTIME_DIR
    trap 'rm -rf "$XDG_RUNTIME_DIR"' EXIT
    trap 'exit 130' INT
    trap 'exit 143' TERM
fi

started="$(date +%s)"
times=""

# stage NAME COMMAND…: runs a step, says how long it took, and ends the script with the step's exit code if it fails.
stage() {
    stage_name="$1"
    shift
    echo "==> $stage_name"
    stage_start="$(date +%s)"
    stage_code=0
    "$@" || stage_code=$?
    stage_time="$(($(date +%s) - stage_start))"
    if [ "$stage_code" -ne 0 ]; then
        echo "==> $stage_name FAILED with exit code $stage_code after $stage_time s" >&2
        exit "$stage_code"
    fi
    echo "==> $stage_name: $stage_time s"
    times="$times  $(printf '%-12s %5d s' "$stage_name" "$stage_time")
"
}

# The times of all stages so far.
stages() {
    printf '%s  %-12s %5d s\n' "$times" all "$(($(date +%s) - started))"
}

# What `make references` installed, for the tests that compare with it.
if [ -z "${TUMBLE_PYTHON:-}" ] && [ -x target/python/bin/python ]; then
    export TUMBLE_PYTHON="$PWD/target/python/bin/python"
fi
