"""Reading of recordings as arrays or as worlds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path, PurePath
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tumble._errors import InvalidValueError, UnknownNameError
from tumble._native import World, read_recording, show_contacts

_CONTACT = np.dtype([("bodies", "<u4", (2,)), ("point", "<f8", (3,)), ("normal", "<f8", (3,)), ("depth", "<f8"), ("force", "<f8", (3,))])


class RecordedEvent(NamedTuple):
    """An event of a recorded frame; ``World.events`` has the kinds."""

    kind: str
    """Kind of the event."""
    a: str
    """Name of the body, as in ``Recording.names``, or of the joint."""
    b: str | None
    """Name of the other body; None for sleep and joints."""
    impulse: tuple[float, float, float]
    """Impulse on ``a`` over the step, N·s."""
    point: tuple[float, float, float]
    """Point with the largest impulse, m."""


@dataclass(frozen=True, repr=False)
class Recording:
    """A recording as arrays: n frames of m bodies and links, world axes."""

    world: str
    """Origin of the world: the path of its scene, or its name."""
    times: NDArray[np.float64]
    """Simulated time of each frame, shape (n,), s."""
    frames: NDArray[np.int64]
    """Number of each frame, shape (n,)."""
    names: list[str]
    """Names of the m bodies; a link is ``name/part``."""
    positions: NDArray[np.float64]
    """Shape (n, m, 3), m; NaN while a body did not exist."""
    orientations: NDArray[np.float64]
    """Unit quaternions (x, y, z, w), shape (n, m, 4); NaN while a body did not exist."""
    states: list[bytes]
    """Snapshot of each frame for ``World.restore``."""
    contacts: list[NDArray[np.void]]
    """Contacts of each frame whose surfaces touch, at most 4096, those with the largest forces: a structured array with ``bodies`` (2,),
    indices in ``names``; ``point`` (3,), m; ``normal`` (3,), from the second body to the first; ``depth``, m; ``force`` (3,) on the first, N."""
    sensors: dict[str, NDArray[np.float64]]
    """Readings of each measuring sensor by its name, shape (n, k); NaN while it did not exist."""
    events: list[list[RecordedEvent]]
    """Events of the step before each frame, at most 4096."""
    note: str | None
    """Where the file was cut; None for a complete one."""

    def __len__(self) -> int:
        return len(self.times)

    def index(self, name: str) -> int:
        """Returns the index of the body of that name."""
        if name not in self.names:
            raise UnknownNameError(f"the recording has no '{name}'; it has {', '.join(self.names[:8])}")
        return self.names.index(name)

    def position(self, name: str) -> NDArray[np.float64]:
        """Returns the positions of a body, shape (n, 3), m."""
        return self.positions[:, self.index(name)]

    def orientation(self, name: str) -> NDArray[np.float64]:
        """Returns the orientations of a body, (x, y, z, w), shape (n, 4)."""
        return self.orientations[:, self.index(name)]

    def __repr__(self) -> str:
        until = f"{self.times[-1]:g} s" if len(self) else "0 s"
        return f"<tumble.Recording of {self.world}: {len(self)} frames, {len(self.names)} bodies, until {until}>"


def read(path: str | PathLike[str]) -> Recording:
    """Reads a recording of ``Recorder`` or ``tumble run --record``.

    A truncated file gives its complete frames and a ``note``. A damaged or different file raises ``RecordingError`` with the place.
    """
    arrays = read_recording(path)
    arrays["contacts"] = [np.frombuffer(contacts, _CONTACT) for contacts in arrays["contacts"]]
    arrays["events"] = [
        [RecordedEvent(kind, a, b, tuple(impulse), tuple(point)) for kind, a, b, impulse, point in events] for events in arrays["events"]
    ]
    return Recording(**arrays)


def replay(path: str | PathLike[str], world: World | None = None) -> Iterator[World]:
    """Sets a world to each frame of a recording in turn and yields it, the same object each time: ``for world in tumble.replay(path): ...``.

    world: a world with the same bodies; by default that of the scene which the recording names, loaded again. Its contacts are those of the recording. It can be read,
    rendered, and stepped from any frame. Different bodies raise ``SnapshotError``.
    """
    recording = read(path)
    if world is None:
        if recording.world == "World":
            raise InvalidValueError(f"{path}: the world was made by a program and not from a scene; pass a world with the same bodies as `world`")
        world = World.load(_scene_of(recording))
    return _frames(world, recording)


def _scene_of(recording: Recording) -> str:
    """Returns the argument for `World.load`. A shipped scene is recorded with its path in the sources."""
    match PurePath(recording.world).parts:
        case ("scenes", name, "scene.toml") if not Path(recording.world).exists():
            return name
    return recording.world


def _frames(world: World, recording: Recording) -> Iterator[World]:
    for state, contacts in zip(recording.states, recording.contacts):
        world.restore(state)
        show_contacts(world, recording.names, contacts.tobytes())
        yield world
