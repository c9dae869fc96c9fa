#!/bin/sh
# The same bits on every machine: hashes of the states of all shipped scenes (crates/scene/examples/state_hashes.rs), computed by builds for several targets, as
# one table. The first target is the reference; for 0.02 s it must have the hashes of crates/scene/tests/same_bits.txt. Targets whose tools are not
# installed are listed as not run. Builds for further targets are kept in target/bits.
#   scripts/same_bits.sh [SECONDS of simulated time, 0.1] [names of targets, all]
# Debian: apt-get install qemu-user gcc-aarch64-linux-gnu nodejs; rustup target add aarch64-unknown-linux-gnu wasm32-wasip1; rustup toolchain install nightly
# Writes target/same_bits/NAME.txt for each target, and prints the table of docs/same_bits.md. Fails if a hash differs.
. "$(dirname "$0")/env.sh"

seconds="${1:-0.1}"
[ $# -eq 0 ] || shift
chosen="${*:-x86-64 no-avx native-cpu opt-2 one-unit nightly aarch64 wasm32}"
out="target/same_bits"
mkdir -p "$out"
program=examples/state_hashes
failed=0

# build NAME FOLDER [cargo words]: builds the program for a target.
build() {
    name="$1" folder="$2"
    shift 2
    cargo "$@" --locked --quiet -p tumble-scene --example state_hashes --target-dir "$folder" >"$out/$name.log" 2>&1
}

# compare NAME WHAT THREADS COMMAND…: runs the program, compares each line that the reference has, and prints a row of the table.
compare() {
    name="$1" what="$2" threads="$3"
    shift 3
    start="$(date +%s)"
    if ! timeout 3600 "$@" "$seconds" "$threads" >"$out/$name.txt" 2>"$out/$name.log"; then
        echo "| $what | failed: $(tail -1 "$out/$name.log" | cut -c1-80) | |"
        failed=1
        return
    fi
    took=$(($(date +%s) - start))
    [ -f "$out/reference.txt" ] || cp "$out/$name.txt" "$out/reference.txt"
    lines="$(wc -l <"$out/$name.txt")"
    same="$(sort "$out/$name.txt" "$out/reference.txt" | uniq -d | wc -l)"
    echo "| $what | $same of $lines | $took |"
    if [ "$same" -ne "$lines" ] || [ "$lines" -eq 0 ]; then
        failed=1
        sort "$out/$name.txt" | comm -23 - "$out/reference.sorted" 2>/dev/null | sed 's/^/    differs: /' >&2
    fi
}

# skip WHAT WHY
skip() { echo "| $1 | not run: $2 | |"; }

has() { command -v "$1" >/dev/null 2>&1; }
has_target() { rustup target list --installed 2>/dev/null | grep -qx "$1"; }

rm -f "$out/reference.txt"
echo "| target | hashes that agree | s |"
echo "|---|---|---|"
# the reference is always computed
build x86-64 target build --release || { cat "$out/x86-64.log" >&2; exit 1; }
compare x86-64 "this machine ($(uname -m), $(rustc -V | cut -d' ' -f2)), 1 and 8 threads" 8 "target/release/$program"
sort "$out/reference.txt" >"$out/reference.sorted"
if [ "$seconds" = 0.02 ] && ! awk '$4 == 1' "$out/reference.txt" | diff - crates/scene/tests/same_bits.txt >&2; then
    echo "error: this machine has other hashes than crates/scene/tests/same_bits.txt" >&2
    failed=1
fi
for name in $chosen; do
    case "$name" in
    x86-64) ;;
    no-avx)
        what="x86-64 without AVX (qemu-x86_64, Nehalem)"
        if has qemu-x86_64; then compare "$name" "$what" 1 qemu-x86_64 -cpu Nehalem "target/release/$program"; else skip "$what" "no qemu-x86_64"; fi
        ;;
    native-cpu)
        what="RUSTFLAGS=-Ctarget-cpu=native"
        if RUSTFLAGS="-Ctarget-cpu=native" build "$name" target/bits-native build --release; then compare "$name" "$what" 1 "target/bits-native/release/$program"; else skip "$what" "does not build"; fi
        ;;
    opt-2)
        what="opt-level 2, 16 codegen units"
        if CARGO_PROFILE_RELEASE_OPT_LEVEL=2 CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 build "$name" target/bits-opt2 build --release; then compare "$name" "$what" 1 "target/bits-opt2/release/$program"; else skip "$what" "does not build"; fi
        ;;
    one-unit)
        what="opt-level 1, 1 codegen unit"
        if CARGO_PROFILE_RELEASE_OPT_LEVEL=1 CARGO_PROFILE_RELEASE_CODEGEN_UNITS=1 build "$name" target/bits-unit build --release; then compare "$name" "$what" 1 "target/bits-unit/release/$program"; else skip "$what" "does not build"; fi
        ;;
    nightly)
        what="rustc nightly"
        if ! cargo +nightly -V >/dev/null 2>&1; then
            skip "$what" "no nightly toolchain"
        elif build "$name" target/bits-nightly +nightly build --release; then
            compare "$name" "rustc $(rustc +nightly -V | cut -d' ' -f2)" 1 "target/bits-nightly/release/$program"
        else
            skip "$what" "does not build"
        fi
        ;;
    aarch64)
        what="aarch64 (qemu-aarch64)"
        triple=aarch64-unknown-linux-gnu
        if ! has qemu-aarch64 || ! has aarch64-linux-gnu-gcc || ! has_target $triple; then
            skip "$what" "no qemu-aarch64, aarch64-linux-gnu-gcc or rustup target $triple"
        elif CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc build "$name" target/bits build --release --target $triple; then
            compare "$name" "$what" 1 qemu-aarch64 -L /usr/aarch64-linux-gnu "target/bits/$triple/release/$program"
        else
            skip "$what" "does not build"
        fi
        ;;
    wasm32)
        what="wasm32-wasip1 (node $(node --version 2>/dev/null))"
        if ! has node || ! has_target wasm32-wasip1; then
            skip "$what" "no node or rustup target wasm32-wasip1"
        elif build "$name" target/bits build --release --target wasm32-wasip1; then
            compare "$name" "$what" 1 node scripts/wasi.mjs "target/bits/wasm32-wasip1/release/$program.wasm"
        else
            skip "$what" "does not build"
        fi
        ;;
    *)
        echo "error: no target '$name'; there are x86-64 no-avx native-cpu opt-2 one-unit nightly aarch64 wasm32" >&2
        exit 2
        ;;
    esac
done
exit $failed
