"""The exceptions of btfkit, one for each kind of error."""


class BtfError(Exception):
    """Any error of btfkit. `advice` says what to do about it, or is None."""

    def __init__(self, message: str, advice: str | None = None):
        super().__init__(message)
        self.advice = advice

    def __str__(self) -> str:
        message = str(self.args[0])
        return f"{message} ({self.advice})" if self.advice else message


class UsageError(BtfError, ValueError):
    """An argument that cannot be."""


class InputError(BtfError, ValueError):
    """An archive or a store that is damaged, or is something else."""


class RecipeError(BtfError, ValueError):
    """A result that was made with other options lies where this one is to be."""


class MissingError(BtfError, LookupError):
    """An input that is not there, or not yet."""


class IoError(BtfError, OSError):
    """The system refuses to read or write."""


class StoppedError(BtfError):
    """Stopped on request; the same call goes on."""


class InternalError(BtfError, RuntimeError):
    """A fault of btfkit, or no memory."""
