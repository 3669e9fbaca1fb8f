"""The two ways a run may end without a result, and their exit codes."""


class InputError(ValueError):
    """The input must be refused: one sentence for a person; exit code 2."""


class MeshingError(RuntimeError):
    """No valid result could be made: names the stage; exit code 3."""
