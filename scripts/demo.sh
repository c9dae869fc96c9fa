#!/bin/sh
# A demo scene from end to end: simulated, recorded, summed up, pictured.
. "$(dirname "$0")/env.sh"

scene="${1:-billiards}"
mkdir -p out
rm -f "out/$scene.mcap" "out/$scene.png" "out/$scene.json"

stage set-up scripts/setup.sh
stage build cargo build --release --locked -p tumble
stage run cargo run --release --locked --quiet -- run "$scene" --record "out/$scene.mcap" --picture "out/$scene.png" --summary "out/$scene.json"

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
