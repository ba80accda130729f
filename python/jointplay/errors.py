"""Exceptions and warnings of the package. Messages are for people, attributes for programs."""

from __future__ import annotations

from typing import Any


class JointplayError(Exception):
    """Base of all exceptions of this package. Instances can be pickled with their attributes."""

    def __init__(self, message: str, **details: Any) -> None:
        super().__init__(message)
        self.__dict__.update(details)

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickle, (type(self), self.args[0], self.__dict__)


def _unpickle(kind: type[JointplayError], message: str, details: dict[str, Any]) -> JointplayError:
    return kind(message, **details)


class SceneError(JointplayError, ValueError):
    """A scene or parameter that is invalid, or a scene that cannot start.

    Attributes: `file` as it was named, `line` and `column` counted from 1, the invalid `key` and `value`, and `allowed`, the
    range and units of a parameter in words. Each is None if unknown.
    """

    file: str | None
    line: int | None
    column: int | None
    key: str | None
    value: str | None
    allowed: str | None


class OptionError(JointplayError, ValueError):
    """An argument that is invalid; the message names it, its value and what is allowed."""


class ChannelError(JointplayError, KeyError):
    """A channel that the scene does not have, or that a run did not record."""

    def __str__(self) -> str:
        # KeyError would show the message in quotes.
        return str(self.args[0])


class Stopped(JointplayError, RuntimeError):
    """A run that the divergence guard stopped.

    Attributes: `time` of the last good state, s; `advice` about what to try, or None; `run`, the `Run` with the rows so far if
    `Scene.run` raised it.
    """

    time: float
    advice: str | None
    run: Any = None


class InUseError(JointplayError, RuntimeError):
    """A simulation that another thread is using."""


class InternalError(JointplayError, RuntimeError):
    """A bug in jointplay."""


class DoubtWarning(UserWarning):
    """A reason to doubt the results of a run."""


class OmissionWarning(UserWarning):
    """Parts of a robot description that the scene made of it does not have."""
