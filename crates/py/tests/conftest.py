"""What the tests share."""

import os
from pathlib import Path

import pytest


@pytest.fixture
def root():
    """The checkout."""
    return Path(__file__).resolve().parents[3]


@pytest.fixture
def command(root):
    """The program `tumble`."""
    program = Path(os.environ.get("TUMBLE_COMMAND", root / "target" / "release" / "tumble"))
    if not program.is_file():
        pytest.skip(f"SKIPPED: {program} is not built; `cargo build --release -p tumble` builds it")
    return program
