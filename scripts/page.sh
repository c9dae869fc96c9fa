#!/bin/sh
# A page that runs shipped scenes in a web browser, in one file that needs no server: target/page/tumble.html (crates/page).
#   scripts/page.sh [FILE, target/page/tumble.html]
# Needs: rustup target add wasm32-unknown-unknown; python3. Ends with code 3, and says so, if the target is not installed.
. "$(dirname "$0")/env.sh"

triple=wasm32-unknown-unknown
file="${1:-target/page/tumble.html}"
if ! rustup target list --installed 2>/dev/null | grep -qx "$triple"; then
    echo "the page is not made: rustup target add $triple" >&2
    exit 3
fi
cargo build --locked --quiet --release -p tumble-page --target "$triple" --target-dir target/bits || exit 1
mkdir -p "$(dirname "$file")"
python3 - "target/bits/$triple/release/tumble_page.wasm" "$file" <<'END'
import base64, gzip, os, pathlib, sys

module, file = map(pathlib.Path, sys.argv[1:])
web = pathlib.Path("crates/page/web")
page = (web / "page.html").read_text()
parts = {
    "@MODULE@": base64.b64encode(gzip.compress(module.read_bytes(), mtime=0)).decode(),
    "@DRAW@": (web / "draw.js").read_text(),
    "@PAGE@": (web / "page.js").read_text(),
}
for mark, text in parts.items():
    assert page.count(mark) == 1, mark
    page = page.replace(mark, text)
unfinished = file.with_name(f".{file.name}.{os.getpid()}")
unfinished.write_text(page)
unfinished.replace(file)
print(f"{file}: {file.stat().st_size / 1e6:.1f} MB, the module alone {module.stat().st_size / 1e6:.1f} MB")
END
