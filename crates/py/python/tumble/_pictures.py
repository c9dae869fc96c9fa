"""Images: cameras, and PNG files."""

from __future__ import annotations

import struct
import zlib
from os import PathLike
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tumble._errors import InvalidValueError, PictureError
from tumble._keywords import hinted, hinted_fields

if TYPE_CHECKING:
    from tumble._native import World


@hinted_fields
class Camera(NamedTuple):
    """A pinhole camera at ``eye`` that looks at ``target``."""

    eye: ArrayLike
    """Shape (3,), m, world axes."""
    target: ArrayLike
    """The point in the center of the image, shape (3,), m."""
    up: ArrayLike = (0.0, 0.0, 1.0)
    """The direction that is up in the image, shape (3,)."""
    fov_deg: float = 40.0
    """Vertical field of view, degrees, above 0 and below 180."""


@hinted_fields
class Appearance(NamedTuple):
    """What a surface looks like: ``World.add_rigid``, ``RigidBody.appearance``. Names and defaults are those of scene files."""

    color: ArrayLike = (0.72, 0.72, 0.74)
    """Main color, sRGB, shape (3,), each 0 to 1."""
    second_color: ArrayLike = (1.0, 1.0, 1.0)
    """The other color of a pattern."""
    pattern: str = "plain"
    """``"plain"``, ``"checker"``, ``"grid"``, ``"solid_ball"``, ``"striped_ball"``, ``"wood"``, ``"felt"``, ``"rings"`` or ``"marble"``."""
    pattern_scale: float = 0.1
    """Size of a cell of the pattern, m."""
    pattern_offset: float = 0.0
    """Start of the pattern along the shape's z axis, m."""
    roughness: float = 0.5
    """0 mirror-like to 1 dull."""
    metallic: float = 0.0
    """0 dielectric to 1 metal."""
    clearcoat: float = 0.0
    """Strength of a clear coat, 0 to 1."""
    glow: bool = False
    """Whether it shows its colors as they are, without light and shadow."""
    texture: str | PathLike[str] | None = None
    """A PNG image over the main color, which tints it."""
    detail: str = "full"
    """``"full"``, ``"simplified"``, ``"wireframe"`` or ``"sphere_tree=LEVEL"``."""


@hinted
def save_png(path: str | PathLike[str], picture: ArrayLike) -> None:
    """Writes an image of ``World.render``, shape (height, width, 4), uint8, as a PNG file."""
    data = encode(picture)
    with open(path, "wb") as file:
        file.write(data)


def encode(picture: ArrayLike) -> bytes:
    """Returns an image, shape (height, width, 4), uint8, as the bytes of an sRGB PNG file."""
    pixels = np.ascontiguousarray(picture)
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 4 or 0 in pixels.shape:
        raise InvalidValueError(f"picture: expected uint8 of shape (height, width, 4), got {pixels.dtype} of {pixels.shape}")
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
    """Returns a PNG of a world for notebooks; None without a graphics adapter."""
    try:
        return encode(world.render(640, 400))
    except PictureError:
        return None
