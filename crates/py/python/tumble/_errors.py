"""The exceptions: one base, and beside it the built-in one that Python programs expect."""


class TumbleError(Exception):
    """Everything that tumble raises of its own. The text is that of the library and the command."""


class InvalidValueError(TumbleError, ValueError):
    """A number, a shape of an array, a name or a setting that cannot be; says what would be right."""


class SceneError(TumbleError, ValueError):
    """A scene, URDF or mesh file with problems; all of them are told at once, with line and column."""


class MissingFileError(TumbleError, FileNotFoundError):
    """A file, or a shipped scene, that is not there."""


class UnreadableFileError(TumbleError, OSError):
    """A file that is there and cannot be read or written."""


class SnapshotError(TumbleError, ValueError):
    """Bytes that :meth:`World.restore`, which then changes nothing, or unpickling refuses."""


class UnknownNameError(TumbleError, KeyError):
    """No body, joint or link of that name."""

    def __str__(self) -> str:
        return Exception.__str__(self)


class RemovedError(TumbleError, ReferenceError):
    """A handle whose body was removed from its world."""


class StepError(TumbleError, RuntimeError):
    """A step that could not be taken. The world is as it was before that frame."""


class BusyError(TumbleError, RuntimeError):
    """A world that is being stepped: by another thread, or by the step that this very call comes from."""


class PictureError(TumbleError, RuntimeError):
    """No graphics adapter, not even a software one, or one that fails; the text says what brings one."""


class RecordingError(TumbleError, ValueError):
    """A file that is no recording, or a damaged one; says where."""


class InternalError(TumbleError, RuntimeError):
    """A fault of tumble itself. The world it happened in refuses further use; please report it."""
