"""maturin, and then no path of the machine that built the wheel.

Panic messages name the source files of the crates from the registry by absolute paths, which hold the builder's home. Building with
``--remap-path-prefix`` would compile every crate a second time under other flags, so the finished library is edited instead: each such prefix is
overwritten by a neutral one of the same length, and the wheel's list of hashes is written anew.

The sources name no home of the project. Where ``TUMBLE_REPOSITORY`` holds its address, the wheel's metadata names it as a URL.
"""

import base64
import hashlib
import os
import sys
import zipfile
from pathlib import Path

import maturin
from maturin import (  # noqa: F401  hooks of PEP 517 and PEP 660 that stay as they are
    build_editable,
    build_sdist,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """PEP 517: maturin's wheel without paths of this machine."""
    name = maturin.build_wheel(wheel_directory, config_settings, metadata_directory)
    scrub(Path(wheel_directory) / name, private_prefixes())
    return name


def private_prefixes():
    """Folders whose names are nobody's business, the longest first: registries of crates, their home, the checkout."""
    cargo = Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo"))
    registries = sorted(cargo.glob("registry/src/*"))
    folders = [*registries, cargo, Path.cwd(), Path.home()]
    return [str(folder).encode() for folder in folders if len(str(folder)) > len("/cargo")]


def urls():
    """Lines of metadata for the address in ``TUMBLE_REPOSITORY``, if there is one."""
    address = os.environ.get("TUMBLE_REPOSITORY", "").strip()
    if not address:
        return b""
    if not address.startswith("https://") or any(c.isspace() for c in address):
        raise SystemExit(f"TUMBLE_REPOSITORY is {address!r}; expected an address that begins with https://")
    return f"Project-URL: Repository, {address}\n".encode()


def scrub(wheel, prefixes):
    """Overwrites the prefixes in all files of a wheel, in place, and adds the project's URLs to its metadata."""
    with zipfile.ZipFile(wheel) as archive:
        entries = [(info, archive.read(info)) for info in archive.infolist()]
    record = next(info.filename for info, _ in entries if info.filename.endswith(".dist-info/RECORD"))
    lines = []
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for info, data in entries:
            if info.filename == record:
                continue
            for prefix in prefixes:
                data = data.replace(prefix, b"/cargo".ljust(len(prefix), b"/"))
            if info.filename.endswith(".dist-info/METADATA"):
                data = data.replace(b"\nRequires-Python:", b"\n" + urls() + b"Requires-Python:", 1)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            lines.append(f"{info.filename},sha256={digest},{len(data)}\n")
            archive.writestr(info, data)
        archive.writestr(record, "".join(lines) + f"{record},,\n")


if __name__ == "__main__":
    for each in sys.argv[1:]:
        scrub(Path(each), private_prefixes())
