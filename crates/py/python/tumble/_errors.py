"""Exceptions. Each derives from ``TumbleError`` and from the built-in exception that fits."""


class TumbleError(Exception):
    """Base of all exceptions of tumble. The text is that of the library and the command."""


class InvalidValueError(TumbleError, ValueError):
    """An invalid number, array shape, name or setting. The text states the expected value."""


class SceneError(TumbleError, ValueError):
    """A scene, URDF, MJCF or mesh file with problems; all of them are listed with line and column."""


class MissingFileError(TumbleError, FileNotFoundError):
    """A file or a shipped scene does not exist."""


class UnreadableFileError(TumbleError, OSError):
    """A file exists but cannot be read or written."""


class SnapshotError(TumbleError, ValueError):
    """Bytes are not a snapshot, or not one of this world. :meth:`World.restore` then changes nothing."""


class UnknownNameError(TumbleError, KeyError):
    """No body, joint or link of that name."""

    def __str__(self) -> str:
        return Exception.__str__(self)


class RemovedError(TumbleError, ReferenceError):
    """A handle whose body was removed from its world."""


class StepError(TumbleError, RuntimeError):
    """A step failed. The world has the state before that step."""


class BusyError(TumbleError, RuntimeError):
    """The world is being stepped, by another thread or by the step that made this call."""


class PictureError(TumbleError, RuntimeError):
    """There is no graphics adapter, not even a software one, or it fails. The text says how to install one."""


class RecordingError(TumbleError, ValueError):
    """A file is not a recording, or is damaged. The text has the place."""


class InternalError(TumbleError, RuntimeError):
    """A bug in tumble. The world can no longer be used; please report the error."""
