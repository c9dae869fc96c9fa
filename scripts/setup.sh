#!/bin/sh
# Installs what is missing, and only that: a C compiler (zstd and lz4 are C), make, a software Vulkan driver (for pictures), an X server without a
# screen and hands for it (for tests of windows), Python's venv, the crates of Cargo.lock. Where all is there, it asks no network and no apt. What only
# pictures and windows need may stay missing.
. "$(dirname "$0")/env.sh"

export DEBIAN_FRONTEND=noninteractive

has_compiler() {
    command -v cc >/dev/null 2>&1 && echo 'int main(void) { return 0; }' | cc -x c - -o /dev/null 2>/dev/null
}

has_vulkan_loader() {
    ls /usr/lib/*/libvulkan.so.1 /usr/lib/libvulkan.so.1 /usr/lib64/libvulkan.so.1 /usr/local/lib/libvulkan.so.1 2>/dev/null | grep -q .
}

# Mesa's software driver; a driver that the user chose by hand counts too.
has_vulkan_driver() {
    [ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] && return 0
    ls /usr/share/vulkan/icd.d/lvp_icd*.json /etc/vulkan/icd.d/lvp_icd*.json /usr/local/share/vulkan/icd.d/lvp_icd*.json 2>/dev/null | grep -q .
}

# What tests of windows run.
has_window_tools() {
    command -v Xvfb >/dev/null 2>&1 && command -v xdotool >/dev/null 2>&1 && command -v import >/dev/null 2>&1
}

# What a window loads when it opens.
has_window_libraries() {
    for library in libX11 libX11-xcb libXcursor libXi libxkbcommon-x11; do
        ls /usr/lib/*/$library.so.? /usr/lib/$library.so.? /usr/lib64/$library.so.? 2>/dev/null | grep -q . || return 1
    done
}

# Debian splits venv off; its absence shows as a missing ensurepip.
has_venv() {
    python3 -c 'import venv, ensurepip' >/dev/null 2>&1
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif [ -t 0 ]; then
        sudo "$@"
    else
        sudo -n "$@"
    fi
}

# Installs packages; never waits long for a network, a lock or a question.
apt() {
    set -- -o Acquire::http::Timeout=20 -o Acquire::https::Timeout=20 -o Acquire::Retries=1 -o DPkg::Lock::Timeout=60 "$@"
    as_root timeout --foreground 600 apt-get -q -y "$@" </dev/null
}

install_packages() {
    if ! command -v apt-get >/dev/null 2>&1; then
        echo "There is no apt-get here; install by hand what these Debian packages hold: $*" >&2
    elif [ "$(id -u)" -ne 0 ] && ! command -v sudo >/dev/null 2>&1; then
        echo "There is no root or sudo; as root, run: apt-get install $*" >&2
    else
        echo "installing $*"
        apt install --no-install-recommends "$@" && return
        apt update && apt install --no-install-recommends "$@" && return
        echo "apt-get could not install $*" >&2
    fi
}

missing=""
has_compiler || missing="$missing gcc libc6-dev"
command -v make >/dev/null 2>&1 || missing="$missing make"
has_vulkan_loader || missing="$missing libvulkan1"
has_vulkan_driver || missing="$missing mesa-vulkan-drivers"
has_venv || missing="$missing python3 python3-venv"
# shellcheck disable=SC2086  # one word per package
[ -z "$missing" ] || install_packages $missing

missing=""
has_window_tools || missing="$missing xvfb xdotool imagemagick"
has_window_libraries || missing="$missing libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0"
# shellcheck disable=SC2086
[ -z "$missing" ] || install_packages $missing

if ! has_compiler; then
    echo "error: no C compiler (cc) that links; on Debian: apt-get install gcc libc6-dev" >&2
    exit 1
fi
if ! { has_vulkan_loader && has_vulkan_driver; }; then
    echo "No Vulkan software driver: where no graphics card helps out, pictures and their tests are left out; everything else works." >&2
fi
if ! { has_window_tools && has_window_libraries; }; then
    echo "No Xvfb, xdotool or import, or no X libraries: tests of windows are left out." >&2
fi
if ! command -v cargo >/dev/null 2>&1; then
    echo "error: no cargo; a Rust toolchain comes from https://rustup.rs" >&2
    exit 1
fi

wanted="$(sed -n 's/^rust-version = "1\.\([0-9]*\).*"/\1/p' Cargo.toml)"
found="$(rustc -V | sed -n 's/^rustc 1\.\([0-9]*\).*/\1/p')"
if [ "${found:-0}" -lt "${wanted:-0}" ]; then
    echo "error: Rust 1.$wanted or newer is required, and $(rustc -V) is here; run: rustup update stable" >&2
    exit 1
fi

# With every crate of the lock file at hand this asks no network.
cargo fetch --locked --quiet --target "$(rustc -vV | sed -n 's/^host: //p')"
