"""The two ways a run may end without a result, and their exit codes."""

from __future__ import annotations


class PolycubeError(Exception):
    """An error that a person can act on.

    Parameters
    ----------
    what : what is wrong, as one sentence without a full stop
    where : the file, option or place in the part
    remedy : what would be right, or what to try
    """

    def __init__(self, what: str, where: str = "", remedy: str = "") -> None:
        self.what, self.where, self.remedy = what, where, remedy
        super().__init__(what, where, remedy)

    def __str__(self) -> str:
        located = f"{self.where}: {self.what}" if self.where else self.what
        return f"{located}; {self.remedy}" if self.remedy else located


class InputError(PolycubeError, ValueError):
    """The input must be refused; exit code 2."""


class MeshingError(PolycubeError, RuntimeError):
    """No valid result could be made; exit code 3.

    `result` holds what was made until then, where the error comes from `polycube.mesh`.
    """

    result: object = None


class UnknownPlugin(InputError, LookupError):
    """A config names a plugin that is not there; the message lists those that are."""


class MissingPackage(InputError, ImportError):
    """An option needs a package that does not load."""


class BadOption(InputError, TypeError):
    """A plugin was given an option it does not take, or a value it refuses."""


def brief(error: Exception | str) -> str:
    """What another program's error says, on one line of at most 100 characters."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 100 else f"{text[:97]}..."
