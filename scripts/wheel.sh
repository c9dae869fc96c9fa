#!/bin/sh
# A wheel to hand on, in target/wheels/manylinux: tagged manylinux with the oldest glibc that its symbols allow (maturin finds it), without paths of this
# machine, installed in a folder of its own and tried.
#   scripts/wheel.sh
#   TUMBLE_REPOSITORY=https://… scripts/wheel.sh   names the project's home in the metadata; the sources name none
# Needs target/py-tests, which scripts/test_python.sh makes. An older glibc than this machine's: build on a system that has it, such as a manylinux image.
. "$(dirname "$0")/env.sh"

python="$PWD/target/py-tests/bin/python"
wheels="target/wheels/manylinux"
[ -x "$python" ] || { echo "error: run scripts/test_python.sh first; it makes $python, which builds the wheel." >&2; exit 1; }

rm -rf "$wheels"
"$python" -m maturin build --quiet --locked --auditwheel check --out "$wheels" || exit 1
wheel="$(ls "$wheels"/tumble-*.whl)"
case "$wheel" in
*manylinux*) ;;
*)
    echo "error: $wheel is not tagged manylinux: it needs libraries or symbols that no manylinux version has; maturin's messages above name them." >&2
    exit 1
    ;;
esac
"$python" crates/py/build/tumble_build.py "$wheel" || exit 1
"$python" -m pip install --quiet --disable-pip-version-check --no-deps --target "$wheels/tried" "$wheel" || exit 1
PYTHONPATH="$PWD/$wheels/tried" "$python" scripts/wheel_check.py "$wheel" || exit 1
rm -rf "$wheels/tried"
echo "$wheel"
