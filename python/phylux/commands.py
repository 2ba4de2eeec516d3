"""Runs commands of ``phylux`` in a process of their own, which Ctrl-C ends too."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from . import _native
from .errors import InputError, RunError, in_python, missing, of_command
from .values import plain

#: what the process runs. Only the native part is loaded, by its path, so that nothing that stands in folders or in the
#: environment can take the place of a package.
_CODE = """
import sys
try:
    from importlib.machinery import ExtensionFileLoader
    from importlib.util import module_from_spec, spec_from_loader
    loader = ExtensionFileLoader("phylux._native", sys.argv[1])
    native = module_from_spec(spec_from_loader(loader.name, loader))
    loader.exec_module(native)
except ImportError:
    sys.exit(97)
sys.exit(native.main(["phylux"] + sys.argv[2:]))
"""
#: the exit code of a Python that cannot load the native part
_OTHER_PYTHON = 97


def command(name: str, files: Sequence[Path], options: Sequence[str | bytes]) -> list[str]:
    """Runs ``phylux NAME FILES OPTIONS`` and returns its warnings.

    In messages, the files in the folder of the first one are called by their names without endings.
    """
    # the command reads texts as UTF-8, and names of files as the system has them
    texts = [name.encode(), *map(os.fsencode, files), *(_bytes(option) for option in options)]
    done = _run([os.fsencode(_native.__file__), *texts])
    folder = re.escape(os.fspath(files[0].parent))
    said = re.sub(folder + r"[/\\](\w+)\.(json|csv)", r"\1", done.stderr)
    lines = said.splitlines()
    warned, failed = ([line.removeprefix(kind) for line in lines if line.startswith(kind)] for kind in ("warning: ", "error: "))
    if done.returncode == 0:
        return [in_python(sentence) for sentence in warned]
    sentence = (failed or [said.strip() or f"phylux {name} ended with {done.returncode}"])[-1]
    raise _error(done.returncode != 2, sentence, said)


def _error(failed: bool, sentence: str, said: str) -> InputError | RunError:
    """Returns the error with its place: a file with a JSON pointer or a line in it, an option, or another beginning."""
    found = re.match(r"[^:]+: /[^:]*(?=: )|[^:]+:\d+(?=: )", sentence)
    option = re.search(r"'--([\w-]+)", sentence)
    if option is None or found is not None:
        return of_command(failed, sentence, found[0] if found is not None else sentence.split(": ")[0])
    place = option[1].replace("-", "_")
    known = re.search(r"\[possible values: (.*)\]", said)
    return of_command(failed, f"{place}: {sentence}" + (f"; there are {known[1]}" if known is not None else ""), place)


def _run(arguments: list[bytes]) -> subprocess.CompletedProcess[str]:
    """Runs the command by the first Python that can."""
    for python in _pythons():
        # isolated from the folder, the environment and other packages; its texts are UTF-8 whatever the system's are
        line = [os.fsencode(python), b"-I", b"-S", b"-X", b"utf8", b"-c", _CODE.encode(), *arguments]
        try:
            done = subprocess.run(
                line, stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8", errors="replace"
            )
        except OSError:
            continue
        if done.returncode != _OTHER_PYTHON:
            return done
    raise RunError("phylux: found no Python to run the command with; put the folder of one into PATH", "phylux")


def _pythons() -> Iterator[str]:
    """Yields what may be a Python of this kind: that of this process first. Programs in which Python is embedded are left
    out, as running one would start it once more."""
    own = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    known = [sys.executable, getattr(sys, "_base_executable", None)]
    for prefix in (sys.exec_prefix, sys.base_exec_prefix):
        known += [os.path.join(prefix, *parts) for parts in (("bin", own), ("bin", "python3"), ("python.exe",))]
    known += [shutil.which(name) for name in (own, "python3", "python")]
    for path in dict.fromkeys(known):
        if path and re.match(r"py(thon|py)", os.path.basename(path).lower()) and os.path.isfile(path):
            yield path


def _bytes(option: str | bytes) -> bytes:
    return option if isinstance(option, bytes) else option.encode()


def options(given: Mapping[str, Any]) -> list[str | bytes]:
    """Returns options as the command line has them; an option with a list of values is repeated for each value. Those that
    name files are bytes."""
    found: list[str | bytes] = []
    for name, values in given.items():
        option = "--" + name.replace("_", "-")
        if isinstance(values, os.PathLike):
            found.append(option.encode() + b"=" + os.fsencode(values))
            continue
        values = plain(values, name)
        for value in values if isinstance(values, list) else [values]:
            if value is True:
                found.append(option)
            elif value is not None and value is not False:
                if isinstance(value, float):
                    value = int(value) if value.is_integer() else repr(value)
                found.append(f"{option}={value}")
    return found


def pandas(what: str = "a table") -> Any:
    """Returns the package pandas, which `what` needs."""
    try:
        import pandas as pd
    except ImportError:
        raise missing("pandas", what) from None
    return pd
