#!/bin/sh
# A server and its facets in network namespaces of their own, over sealed UDP, with a bad network between them; prints the table of latency and loss.
#   sudo scripts/netns.sh [--frames 6000] [--bytes 16384] [--facets 1] [--rate 60] [--loss 0.05] [--reorder 0.1] [--duplicate 0.02] [--delay-ms 1]
# The bad network is a relay process in a third namespace.
runtime="${XDG_RUNTIME_DIR:-}"
. "$(dirname "$0")/env.sh"

frames=6000 bytes=16384 facets=1 rate=60 loss=0.05 reorder=0.1 duplicate=0.02 delay=1
while [ $# -gt 0 ]; do
    case "$1" in
        --frames) frames=$2 ;;
        --bytes) bytes=$2 ;;
        --facets) facets=$2 ;;
        --rate) rate=$2 ;;
        --loss) loss=$2 ;;
        --reorder) reorder=$2 ;;
        --duplicate) duplicate=$2 ;;
        --delay-ms) delay=$2 ;;
        *)
            sed -n '2,5p' "$0" >&2
            exit 2
            ;;
    esac
    [ $# -ge 2 ] || { echo "error: $1 needs a value" >&2; exit 2; }
    shift 2
done
[ "$(id -u)" -eq 0 ] || { echo "error: network namespaces need root; run it with sudo" >&2; exit 2; }
command -v ip >/dev/null || { echo "error: no ip command; on Debian: apt-get install iproute2" >&2; exit 1; }

cargo build --quiet --release --locked -p tumble-net --example link_trial
trial="$(realpath "${CARGO_TARGET_DIR:-target}")/release/examples/link_trial"
server="tumble-s$$" middle="tumble-m$$" facet="tumble-f$$"
key=$(mktemp)
children=""
finish() {
    # shellcheck disable=SC2086  # numbers
    [ -z "$children" ] || kill $children 2>/dev/null || true
    for space in "$server" "$middle" "$facet"; do ip netns del "$space" 2>/dev/null || true; done
    rm -f "$key"
    [ -n "$runtime" ] || rm -rf "$XDG_RUNTIME_DIR"
}
trap finish EXIT
trap 'exit 130' INT TERM
chmod 600 "$key"
head -c 32 /dev/urandom | od -An -tx1 | tr -d ' \n' >"$key"

# 10.77.1.1 server -- 10.77.1.2 middle 10.77.2.2 -- 10.77.2.1 facets
for space in "$server" "$middle" "$facet"; do
    ip netns add "$space"
    ip -n "$space" link set lo up
done
join() { # namespace, its address, the middle's address, a letter
    ip link add "tb$4$$" netns "$1" type veth peer name "tm$4$$" netns "$middle"
    ip -n "$1" address add "$2/24" dev "tb$4$$"
    ip -n "$middle" address add "$3/24" dev "tm$4$$"
    ip -n "$1" link set "tb$4$$" up
    ip -n "$middle" link set "tm$4$$" up
}
join "$server" 10.77.1.1 10.77.1.2 a
join "$facet" 10.77.2.1 10.77.2.2 b

# Replaces the shell it runs in, so that its number is the program's and `finish` ends it.
# shellcheck disable=SC2086  # words
within() { exec ip netns exec "$1" "$trial" --transport udp --key "$key" --bytes "$bytes" --address 10.77.1.1:7700 --role "$2" $3; }
target=10.77.2.2:7701
within "$middle" relay "--listen $target --loss $loss --reorder $reorder --duplicate $duplicate --delay-ms $delay" &
children="$children $!"
k=0
while [ "$k" -lt "$facets" ]; do
    within "$facet" facet "--facet $k --connect $target" &
    children="$children $!"
    k=$((k + 1))
done
echo "loss $loss, reorder $reorder, duplicate $duplicate each way, delay $delay ms, by a relay in its own namespace"
(within "$server" server "--facets $facets --frames $frames --rate $rate")
