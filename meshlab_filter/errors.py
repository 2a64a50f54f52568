"""The errors a user can cause, each carrying the exit code the command line ends with.

Every message is one sentence that says what is wrong, what was given and what to do about it.
"""


class MeshlabFilterError(Exception):
    """Base of every error raised on purpose by this package.

    Attributes
    ----------
    exit_code : int
        What the command line exits with when this error ends it.
    """

    exit_code = 1


class InvalidParameterError(MeshlabFilterError, ValueError):
    """A parameter is out of range, of the wrong type or contradicts another (exit code 2)."""

    exit_code = 2


class InvalidCloudError(MeshlabFilterError, ValueError):
    """The points cannot be worked on: too few, not finite, of the wrong shape (exit code 3)."""

    exit_code = 3


class FileFormatError(MeshlabFilterError, ValueError):
    """A file is missing, empty, truncated or not what its name says (exit code 4)."""

    exit_code = 4


class PresetError(MeshlabFilterError, ValueError):
    """A filter script cannot be run as it stands (exit code 5)."""

    exit_code = 5


class MeshLabError(MeshlabFilterError, RuntimeError):
    """MeshLab refused a filter, crashed or cannot be imported (exit code 6)."""

    exit_code = 6


class SchedulerError(MeshlabFilterError, RuntimeError):
    """The Dask scheduler or its workers cannot be reached or were lost (exit code 8)."""

    exit_code = 8


class OutputError(MeshlabFilterError, OSError):
    """An output cannot be written, or would overwrite what it must not (exit code 7)."""

    exit_code = 7
