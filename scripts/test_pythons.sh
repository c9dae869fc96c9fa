#!/bin/sh
# The one wheel of the Python module on every Python from 3.10 on that is at hand (python3.10, python3.11, … on the path, and those of pyenv): each gets
# an environment of its own (target/py-tests-VERSION), the wheel, and the tests.
#   scripts/test_pythons.sh [words for pytest]
. "$(dirname "$0")/env.sh"

wanted="crates/py/tests/requirements.txt"
wheels="target/wheels/tested"
builder="target/py-tests/bin/python"
[ -x "$builder" ] || { echo "error: run scripts/test_python.sh first; it makes $builder, which builds the wheel." >&2; exit 1; }

export PIP_DISABLE_PIP_VERSION_CHECK=1 MPLBACKEND=Agg PYTHONSAFEPATH=1
rm -rf "$wheels"
PATH="$PWD/target/py-tests/bin:$PATH" "$builder" -m pip wheel --quiet --no-build-isolation --no-deps --wheel-dir "$wheels" . || exit 1

failed=""
for version in 3.10 3.11 3.12 3.13 3.14; do
    found=""
    for python in "$(command -v "python$version")" "${HOME:-}"/.pyenv/versions/"$version".*/bin/python; do
        if [ -x "$python" ] && "$python" -c "import sys, venv, ensurepip; sys.exit('%d.%d' % sys.version_info[:2] != '$version')" 2>/dev/null; then
            found="$python"
        fi
    done
    if [ -z "$found" ]; then
        echo "==> Python $version: none at hand"
        continue
    fi
    venv="target/py-tests-$version"
    if ! cmp -s "$wanted" "$venv/requirements.txt"; then
        [ -x "$venv/bin/python" ] || "$found" -m venv "$venv" || exit 1
        timeout 600 "$venv/bin/python" -m pip install --quiet --timeout 20 --retries 2 -r "$wanted" </dev/null || exit 1
        cp "$wanted" "$venv/requirements.txt"
    fi
    "$venv/bin/python" -m pip install --quiet --no-deps --force-reinstall "$wheels"/tumble-*.whl || exit 1
    echo "==> Python $version ($("$venv/bin/python" -V))"
    "$venv/bin/python" -m pytest --rootdir=. -p no:cacheprovider "$@" || failed="$failed $version"
done
[ -z "$failed" ] || { echo "error: the tests failed on:$failed" >&2; exit 1; }
