"""Reading of recordings as arrays or as worlds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path, PurePath
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tumble._animations import Animation, Shot, instants, write_video
from tumble._errors import InvalidValueError, MissingFileError, SnapshotError, UnknownNameError
from tumble._keywords import hinted
from tumble._native import World, read_recording, show_contacts
from tumble._pictures import Camera

_CONTACT = np.dtype(
    [("bodies", "<u4", (2,)), ("shapes", "<u4", (2,)), ("point", "<f8", (3,)), ("normal", "<f8", (3,)), ("depth", "<f8"), ("force", "<f8", (3,))]
)


class RecordedEvent(NamedTuple):
    """An event of a recorded frame; ``World.events`` has the kinds."""

    kind: str
    """Kind of the event."""
    a: str
    """Name of the body or link, as in ``Recording.names``; for sleep that of the body, else of the joint or scripted event."""
    b: str | None
    """Name of the other body or link; None for sleep and joints."""
    impulse: tuple[float, float, float]
    """Impulse on ``a`` over the step, N·s."""
    point: tuple[float, float, float]
    """Point with the largest impulse, m."""
    shapes: tuple[int, int]
    """Numbers of the shapes at the point, as in ``World.contacts``."""
    shape_names: tuple[str | None, str | None]
    """Names of these shapes; None for those without one, and for all but contacts that begin or persist."""
    bodies: tuple[str | None, str | None]
    """Names of the bodies of ``a`` and ``b``, without links; for a joint or scripted event its name."""
    links: tuple[str | None, str | None]
    """Names of the links of articulations, which may be fixed ones; None for other bodies."""


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
    """Names of the m bodies and links; a link is ``body/link``. A body with a link without a name, or with the full name of another
    body or link, has the indices in ``link_names`` instead: ``body/3``."""
    positions: NDArray[np.float64]
    """Shape (n, m, 3), m; NaN while a body did not exist."""
    orientations: NDArray[np.float64]
    """Unit quaternions (x, y, z, w), shape (n, m, 4); NaN while a body did not exist."""
    states: list[bytes]
    """Snapshot of each frame for ``World.restore``."""
    contacts: list[NDArray[np.void]]
    """Contacts of each frame whose surfaces touch, at most 4096, those with the largest forces: a structured array with ``bodies`` (2,),
    indices in ``names``; ``shapes`` (2,), numbers as in ``World.contacts``; ``point`` (3,), m; ``normal`` (3,), from the second body to the first; ``depth``, m; ``force`` (3,) on the first, N."""
    sensors: dict[str, NDArray[np.float64]]
    """Readings of each measuring sensor by its name, shape (n, k); NaN while it did not exist."""
    images: dict[str, NDArray[np.float32] | NDArray[np.uint8] | NDArray[np.int32]]
    """Images of each camera by its name, if the recorder wrote them: depths, shape (n, rows, columns), m, -1 where nothing is; colors, shape
    (n, rows, columns, 3); of a segmentation the indices in ``names``, shape (n, rows, columns), -1 for nothing. NaN, black or -1 for a
    frame without one."""
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

    @hinted
    def video(
        self,
        path: str | PathLike[str],
        world: World | None = None,
        *,
        width: int = 1280,
        height: int = 720,
        fps: float = 30.0,
        speed: float = 1.0,
        camera: Camera | None = None,
    ) -> None:
        """Writes the recording as a video (``.mp4`` and all that ffmpeg knows), or without ffmpeg as an animated PNG (``.png``, ``.apng``).

        world: a world with the same bodies, which a recording of a world made or changed by a program, or read from a text, needs; it stays as it is. width, height: pixels. fps: images per second. speed: times
        real time. camera: by default that of the scene. Without ffmpeg or a graphics adapter: ``PictureError``.
        """
        if Path(path).suffix.lower() in (".png", ".apng"):
            self.animation(world, width=width, height=height, fps=fps, speed=speed, camera=camera).save(path)
        else:
            write_video(path, self._shots(world, (width, height), fps, speed, camera), fps)

    @hinted
    def animation(
        self,
        world: World | None = None,
        *,
        width: int = 480,
        height: int = 320,
        fps: float = 15.0,
        speed: float = 1.0,
        camera: Camera | None = None,
    ) -> Animation:
        """Returns an animation for notebooks, which plays without a kernel and without a network; arguments as for ``video``."""
        return Animation(self._shots(world, (width, height), fps, speed, camera), fps, self.world)

    def _shots(self, world: World | None, size: tuple[int, int], fps: float, speed: float, camera: Camera | None) -> Iterator[Shot]:
        chosen = instants(self.times, fps, speed)
        shown = world.fork() if world is not None else _world_of(self, None)
        for k in chosen:
            _restore(shown, self, k, given=world is not None)
            show_contacts(shown, self.names, self.contacts[k].tobytes())
            yield Shot(float(self.times[k]), shown.render(*size, camera=camera))

    def __repr__(self) -> str:
        until = f"{self.times[-1]:g} s" if len(self) else "0 s"
        return f"<tumble.Recording of {self.world}: {len(self)} frames, {len(self.names)} bodies, until {until}>"


@hinted
def read(path: str | PathLike[str]) -> Recording:
    """Reads a recording of ``Recorder`` or ``tumble run --record``.

    A truncated file gives its complete frames and a ``note``. A damaged or different file raises ``RecordingError`` with the place.
    """
    arrays = read_recording(path)
    arrays["contacts"] = [np.frombuffer(contacts, _CONTACT) for contacts in arrays["contacts"]]
    arrays["events"] = [
        [RecordedEvent(kind, a, b, tuple(impulse), tuple(point), *names) for kind, a, b, impulse, point, *names in events] for events in arrays["events"]
    ]
    return Recording(**arrays)


@hinted
def replay(path: str | PathLike[str], world: World | None = None) -> Iterator[World]:
    """Sets a world to each frame of a recording in turn and yields it, the same object each time: ``for world in tumble.replay(path): ...``.

    world: a world with the same bodies; by default that of the scene which the recording names, loaded again. Its contacts are those of the recording. It can be read,
    rendered, and stepped from any frame. Different bodies raise ``SnapshotError``.
    """
    recording = read(path)
    return _frames(_world_of(recording, world), recording, given=world is not None)


def _world_of(recording: Recording, world: World | None) -> World:
    """Returns the given world, or else that of the scene which the recording names."""
    if world is not None:
        return world
    if recording.world == "World":
        raise InvalidValueError("the recorded world was made by a program and not from a scene; pass a world with the same bodies as `world`")
    try:
        return World.load(_scene_of(recording))
    except MissingFileError as error:
        raise MissingFileError(f"{error}; or pass a world with the same bodies as `world`") from error


def _restore(world: World, recording: Recording, frame: int, *, given: bool) -> None:
    """Sets a world to a frame."""
    try:
        world.restore(recording.states[frame])
    except SnapshotError as error:
        if given:
            raise
        scene = f"the recorded world had other objects than {recording.world}"
        raise SnapshotError(f"{error}; {scene}: pass a world with the same ones as `world`") from error


def _scene_of(recording: Recording) -> str:
    """Returns the argument for `World.load`. A shipped scene is recorded with its path in the sources."""
    match PurePath(recording.world).parts:
        case ("scenes", name, "scene.toml") if not Path(recording.world).exists():
            return name
    return recording.world


def _frames(world: World, recording: Recording, *, given: bool) -> Iterator[World]:
    for frame, contacts in enumerate(recording.contacts):
        _restore(world, recording, frame, given=given)
        show_contacts(world, recording.names, contacts.tobytes())
        yield world
