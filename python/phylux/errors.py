"""The exceptions and the warning of the package."""

from __future__ import annotations

import sys
import warnings
from typing import Any


class _Explained(Exception):
    """An error whose message has three parts."""

    def __init__(self, message: str = "", place: str = "", problem: str = "", remedy: str | None = None) -> None:
        super().__init__(message)
        self.place = place
        self.problem = problem
        self.remedy = remedy


class InputError(_Explained, ValueError):
    """Wrong input. The message says where the problem is, what is wrong there, and what to do.

    Attributes:
        place: where the problem is, such as ``scene: /materials/leaf`` (a JSON pointer into the scene),
            ``room.obj:12`` (a line of a file) or ``photons`` (an argument of a call).
        problem: what is wrong there.
        remedy: what would mend it, or None.
    """


class RunError(_Explained, RuntimeError):
    """The run failed although its input is right, for example because a disk is full.

    Attributes:
        place: where the problem is, such as the name of a file.
        problem: what is wrong there.
        remedy: what would mend it, or None.
    """


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
    return InputError(f"{place}: {problem}" + (f"; {remedy}" if remedy else ""), place, problem, remedy or None)


def missing(package: str, what: str) -> ImportError:
    """Returns the error for a package that is not installed."""
    return ImportError(f"{what} needs {package}: pip install {package}", name=package)


def pandas(what: str = "a table") -> Any:
    """Returns the package pandas, which `what` needs."""
    try:
        import pandas as pd
    except ImportError:
        raise missing("pandas", what) from None
    return pd
