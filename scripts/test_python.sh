#!/bin/sh
# The Python module: built as `pip install .` builds it, installed in an environment of its own (target/py-tests), tested, its types checked.
# The environment is filled by pip once, and again when crates/py/tests/requirements.txt changes; with it at hand no network is asked.
#   scripts/test_python.sh [words for pytest]
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

# What `make references` installed comes after what is installed here, if it is of the same Python.
site="$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')"
rm -f "$site/references.pth"
for folder in target/python/lib/"$(basename "$(dirname "$site")")"/site-packages; do
    # with the paths that its own .pth files add: Pinocchio's is one
    [ ! -d "$folder" ] || echo "import site; site.addsitedir('$PWD/$folder')" >"$site/references.pth"
done

PATH="$venv/bin:$PATH"
export PATH PIP_DISABLE_PIP_VERSION_CHECK=1 MPLBACKEND=Agg PYTHONSAFEPATH=1

# maturin is in the environment: nothing is fetched, and the dependencies are those of the workspace's release build.
"$python" -m pip install --quiet --no-build-isolation --no-deps --force-reinstall . || exit 1

# Outside the sources, so that what is installed is what is imported.
"$python" -m pytest --rootdir=. -p no:cacheprovider "$@" || exit 1
[ $# -eq 0 ] || exit 0
"$python" -m mypy || exit 1
"$python" -m mypy.stubtest tumble --mypy-config-file pyproject.toml --allowlist crates/py/tests/typed/stubtest_allowlist.txt
