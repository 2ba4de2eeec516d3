"""The exceptions and the warning of the package."""

from __future__ import annotations

import sys
import warnings


class InputError(ValueError):
    """Wrong input. The message says where the problem is, what is wrong there, and what to do.

    Attributes:
        place: where the problem is, such as ``scene: /materials/leaf`` (a JSON pointer into the scene),
            ``room.obj:12`` (a line of a file) or ``photons`` (an option of a run).
    """

    def __init__(self, message: str = "", place: str = "") -> None:
        super().__init__(message)
        self.place = place


class RunError(RuntimeError):
    """The run failed although its input is right, for example because a disk is full.

    Attributes:
        place: where the problem is, such as the name of a file.
    """

    def __init__(self, message: str = "", place: str = "") -> None:
        super().__init__(message)
        self.place = place


class SceneWarning(UserWarning):
    """Something to know before you trust a result; the command ``phylux`` prints the same sentences."""


def say(*sentences: str) -> None:
    """Issues warnings at the line of the user's code that has called the package."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith(f"{__package__}."):
        level, frame = level + 1, frame.f_back
    for sentence in sentences:
        warnings.warn(sentence, SceneWarning, stacklevel=level)


def wrong(place: str, problem: str, remedy: str = "") -> InputError:
    """Returns the error for wrong input at a place."""
    return InputError(f"{place}: {problem}" + (f"; {remedy}" if remedy else ""), place)


def missing(package: str, what: str) -> ImportError:
    """Returns the error for a package that is not installed."""
    return ImportError(f"{what} needs {package}: pip install {package}", name=package)
