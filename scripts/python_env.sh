#!/bin/sh
# The environment of Python's tests and linters, target/py-tests: filled by pip once, and again when crates/py/tests/requirements.txt
# changes; with it at hand no network is asked.
. "$(dirname "$0")/env.sh"

venv="$PWD/target/py-tests"
python="$venv/bin/python"
wanted="crates/py/tests/requirements.txt"

if ! python3 -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
    echo "error: no Python 3.10 or newer with the module venv; on Debian: apt-get install python3 python3-venv" >&2
    exit 1
fi

if ! cmp -s "$wanted" "$venv/requirements.txt"; then
    [ -x "$python" ] || python3 -m venv "$venv" || exit 1
    if ! timeout 600 "$python" -m pip install --quiet --disable-pip-version-check --timeout 20 --retries 2 -r "$wanted" </dev/null; then
        echo "error: pip could not install what $wanted lists; the tests of the Python module need it once." >&2
        exit 1
    fi
    cp "$wanted" "$venv/requirements.txt"
fi
