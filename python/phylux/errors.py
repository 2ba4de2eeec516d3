"""What can go wrong, and what to be warned of."""

from __future__ import annotations


class InputError(ValueError):
    """Wrong input: a sentence that says where, what is wrong there, and what to do.

    Attributes:
        place: where it is, such as ``scene: /materials/leaf`` (a JSON pointer into the scene),
            ``room.obj:12`` (a line of a file) or ``photons`` (an option of a run).
    """

    def __init__(self, message: str = "", place: str = "") -> None:
        super().__init__(message)
        self.place = place


class RunError(RuntimeError):
    """The run itself failed, through no fault of the input: a full disk, say.

    Attributes:
        place: where, such as the name of a file.
    """

    def __init__(self, message: str = "", place: str = "") -> None:
        super().__init__(message)
        self.place = place


class SceneWarning(UserWarning):
    """What you should know before you trust a result; the command prints the same sentences."""


def wrong(place: str, problem: str, remedy: str = "") -> InputError:
    """The error of wrong input at a place."""
    return InputError(f"{place}: {problem}" + (f"; {remedy}" if remedy else ""), place)


def missing(package: str, what: str) -> ImportError:
    """The error of a package that is not installed."""
    return ImportError(f"{what} needs {package}: pip install {package}", name=package)
