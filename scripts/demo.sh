#!/bin/sh
# A demo scene from end to end: simulated, recorded, summed up, pictured; then an example of the Python package, in an environment of its own.
. "$(dirname "$0")/env.sh"

scene="${1:-billiards}"
mkdir -p out
rm -f "out/$scene.mcap" "out/$scene.png" "out/$scene.json"

stage set-up scripts/setup.sh
# One build of the crates serves the command, the Python package below and the tests.
stage build cargo build --release --locked -p tumble
built="${CARGO_TARGET_DIR:-target}/release"
stage run "$built/tumble" run "$scene" --record "out/$scene.mcap" --screenshot "out/$scene.png" --summary "out/$scene.json"

echo
echo "In $(pwd):"
for made in mcap:"the recording, for Foxglove" png:"the picture of the last frame" json:"the summary"; do
    file="out/$scene.${made%%:*}"
    if [ -s "$file" ]; then
        printf '  %-22s %s, %s kB\n' "$file" "${made#*:}" "$(($(wc -c <"$file") / 1024 + 1))"
    else
        printf '  %-22s not made; the reason stands above\n' "$file"
    fi
done

# What pip lacks (a network, the first time) leaves out Python alone.
python_example() {
    python="target/py-demo/bin/python"
    [ -x "$python" ] || python3 -m venv target/py-demo || return
    "$python" -c 'import maturin, numpy' 2>/dev/null ||
        timeout 300 "$python" -m pip install --quiet --disable-pip-version-check --timeout 20 --retries 2 'maturin>=1.16,<2' numpy </dev/null || return
    PATH="$PWD/target/py-demo/bin:$PATH" "$python" -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --force-reinstall . || return
    "$python" examples/pendulum_energy.py
}

echo
echo "==> python: examples/pendulum_energy.py"
if python_example; then
    echo "For programs of your own: . target/py-demo/bin/activate"
else
    echo "The Python package was left out; the reason stands above." >&2
fi
