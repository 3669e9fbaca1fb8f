"""The errors of the program and their exit codes."""


class PolycubeError(Exception):
    """An error that the user can correct.

    Parameters
    ----------
    what : description of the problem, one sentence without a full stop
    where : file, option or place in the part
    remedy : what is correct, or what to try
    """

    def __init__(self, what: str, where: str = "", remedy: str = "") -> None:
        self.what, self.where, self.remedy = what, where, remedy
        super().__init__(what, where, remedy)

    def __str__(self) -> str:
        located = f"{self.where}: {self.what}" if self.where else self.what
        return f"{located}; {self.remedy}" if self.remedy else located


class InputError(PolycubeError, ValueError):
    """Invalid input or option; exit code 2."""


class MeshingError(PolycubeError, RuntimeError):
    """There is no valid result; exit code 3.

    If the error is raised by `polycube.mesh`, `result` contains the completed stages.
    """

    result: object = None


class UnknownPlugin(InputError, LookupError):
    """A configuration refers to an unknown plugin; the message lists the known ones."""


class MissingPackage(InputError, ImportError):
    """An option needs a package that does not load."""


class BadOption(InputError, TypeError):
    """A plugin was given an option it does not take, or a value it refuses."""


def printable(text: str) -> str:
    """Text for a terminal or a table: control characters and bytes of file names as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def brief(error: Exception | str) -> str:
    """The message of an error of another library, on one line of at most 100 characters."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 100 else f"{text[:97]}..."
