"""The exceptions and the warning of the package, and the words of Python for what the command says."""

from __future__ import annotations

import re
import sys
import warnings
from typing import Any


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
        warnings.warn(in_python(sentence), SceneWarning, stacklevel=level)


def wrong(place: str, problem: str, remedy: str = "") -> InputError:
    """Returns the error for wrong input at a place."""
    return InputError(f"{place}: {problem}" + (f"; {remedy}" if remedy else ""), place)


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


def of_command(failed: bool, message: str, place: str) -> InputError | RunError:
    """Returns the error that the command, or the native part, has said: a run that failed, or wrong input."""
    if place.startswith("--"):
        # an option of the command is an argument of the same name
        argument = place[2:].replace("-", "_")
        message, place = argument + message.removeprefix(place), argument
    return (RunError if failed else InputError)(in_python(message), place)


#: what the calls of Python are named for commands and options
_CALLS = {"run": "Scene.run", "year": "Scene.year", "mix": "Result.mix", "check": "Scene.check", "view": "Scene.view"}
_CALLS |= {"calibrate": "Scene.calibrate", "chart": "Scene.chart", "render": "Scene.render", "export": "Scene.export"}
_CALLS |= {"trace": "Scene.histories", "plot": "plot", "compare": "Result.compare", "sweep": "px.sweep"}
_ARGUMENTS = {"group": "groups", "power": "factors", "from": "from_"}
_FLAGS = {name: f"{name.replace('-', '_')}=True" for name in ("by-light", "csv", "keep-light", "log", "png", "results")}
_FLAGS["no-trace"] = "trace=False"
#: words that are values where they stand after an option
_VALUES = {
    "estimator": "photons|paths|complete|auto",
    "guiding": "off|aim|full|auto",
    "model": "common|bands|product|lamps|auto",
    "hours": "groups|all|none",
    "show": r"\w+",
    "denoise": r"\w+",
}


def in_python(sentence: str) -> str:
    """Returns a sentence of the command in the words of Python: its options are arguments of calls.

    >>> in_python("no tolerance is asked for; add --tolerance 0.02, or --estimator photons")
    'no tolerance is asked for; add `tolerance=0.02`, or `estimator="photons"`'
    >>> in_python("write it with `phylux year --results`, or join lamps by --group")
    'write it with `Scene.year(results=True)`, or join lamps by `groups`'
    """

    def argument(found: re.Match[str]) -> str:
        name, value = found["name"], found["value"] or ""
        own = _ARGUMENTS.get(name, name.replace("-", "_"))
        if re.fullmatch(r"[\d.]+(e\d+)?", value):
            return f"`{own}={value}`"
        if value and re.fullmatch(_VALUES.get(name, "(?!)"), value):
            return f'`{own}="{value}"`'
        return f"`{_FLAGS.get(name, own)}`" + (f" {value}" if value else "")

    def call(found: re.Match[str]) -> str:
        if found["name"] not in _CALLS:
            return found[0]
        options = [option.split() for option in (found["options"] or "").split("--")[1:]]
        given = [_FLAGS.get(name, f"{name.replace('-', '_')}={' '.join(value) or '...'}") for name, *value in options]
        return f"`{_CALLS[found['name']]}({', '.join(given)})`" if given else f"`{_CALLS[found['name']]}`"

    sentence = re.sub(r"`phylux (?P<name>[a-z]+)(?P<options>( --[a-z][^`]*)?)`", call, sentence)
    # what stands in quotes is what was given
    sentence = re.sub(r"'--([a-z][a-z-]*)[^']*'", lambda found: "'" + found[1].replace("-", "_") + "'", sentence)
    option = r"--(?P<name>[a-z][a-z-]*)(?: (?P<value>[\w.]*\w))?"
    return re.sub(rf"`{option}`", argument, re.sub(rf"(?<![\w/`-]){option}", argument, sentence))
