"""The two ways a run may end without a result, and their exit codes."""


class InputError(ValueError):
    """The input must be refused: one sentence for a person; exit code 2."""


class MeshingError(RuntimeError):
    """No valid result could be made: names the stage; exit code 3."""


class UnknownPlugin(InputError, LookupError):
    """A config names a plugin that is not there; the message lists those that are."""


class BadOption(InputError, TypeError):
    """A plugin was given an option it does not take, or a value it refuses."""
