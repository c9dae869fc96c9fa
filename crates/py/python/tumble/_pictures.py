"""Pictures: cameras, and the way of an array to a PNG file."""

from __future__ import annotations

import struct
import zlib
from os import PathLike
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tumble._errors import InvalidValueError, PictureError

if TYPE_CHECKING:
    from tumble._native import World


class Camera(NamedTuple):
    """A pinhole at ``eye`` that looks at ``target``."""

    eye: ArrayLike
    """Shape (3,), m, world axes."""
    target: ArrayLike
    """The point in the middle of the picture, shape (3,), m."""
    up: ArrayLike = (0.0, 0.0, 1.0)
    """What is upright in the picture, shape (3,)."""
    fov_deg: float = 40.0
    """Opening angle from the lower to the upper edge, degrees, above 0 and below 180."""


def save_png(path: str | PathLike[str], picture: ArrayLike) -> None:
    """Writes what ``World.render`` gave, shape (height, width, 4), uint8, as a PNG file."""
    data = encode(picture)
    with open(path, "wb") as file:
        file.write(data)


def encode(picture: ArrayLike) -> bytes:
    """A picture, shape (height, width, 4), uint8, as the bytes of a PNG file marked as sRGB."""
    pixels = np.ascontiguousarray(picture)
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 4 or 0 in pixels.shape:
        raise InvalidValueError(f"picture: wanted uint8 of shape (height, width, 4), and got {pixels.dtype} of {pixels.shape}")
    height, width, _ = pixels.shape
    # each row begins with its filter: 2, the difference to the row above
    above = np.vstack([np.zeros_like(pixels[:1]), pixels[:-1]])
    rows = np.empty((height, 1 + 4 * width), np.uint8)
    rows[:, 0] = 2
    rows[:, 1:] = (pixels - above).reshape(height, 4 * width)
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"sRGB", b"\0"), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, body) for kind, body in chunks)


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def repr_png(world: World) -> bytes | None:
    """What a notebook shows of a world; nothing where there is no graphics adapter."""
    try:
        return encode(world.render(640, 400))
    except PictureError:
        return None
