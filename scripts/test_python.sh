#!/bin/sh
# The Python module: built as `pip install .` builds it, installed in an environment of its own (target/py-tests), tested, its types checked.
#   scripts/test_python.sh [words for pytest]
. "$(dirname "$0")/env.sh"

scripts/python_env.sh || exit 1
venv="$PWD/target/py-tests"
python="$venv/bin/python"

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

# Outside the sources, so that the installed package is imported.
"$python" -m pytest --rootdir=. -p no:cacheprovider "$@" || exit 1
[ $# -eq 0 ] || exit 0
"$python" -m mypy.stubtest tumble --mypy-config-file pyproject.toml --allowlist crates/py/tests/typed/stubtest_allowlist.txt
