"""Runs commands of ``phylux`` in a process of their own, which Ctrl-C ends too."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from .errors import InputError, RunError, missing

#: the command, run in a way that does not need its installed script to be on the PATH
_COMMAND = [sys.executable, "-c", "import sys; from phylux import _cli; sys.exit(_cli())"]


def command(name: str, files: list[Path], options: list[str]) -> list[str]:
    """Runs ``phylux NAME FILES OPTIONS`` and returns its warnings.

    In messages, the files in the folder of the first one are called by their names without endings.
    """
    line = [*_COMMAND, name, *map(os.fspath, files), *options]
    done = subprocess.run(line, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    lines = re.sub(re.escape(os.fspath(files[0].parent)) + r"[/\\](\w+)\.(json|csv)", r"\1", done.stderr).splitlines()
    said = {kind: [line.removeprefix(kind) for line in lines if line.startswith(kind)] for kind in ("error: ", "warning: ")}
    if done.returncode != 0:
        sentence = (said["error: "] or [done.stderr.strip() or f"phylux {name} ended with {done.returncode}"])[-1]
        # the place is a file with a JSON pointer or a line in it, or an option
        found = re.match(r"[^:]+: /[^:]*(?=: )|[^:]+:\d+(?=: )", sentence)
        option = re.search(r"'--([\w-]+)", sentence)
        if option is not None and found is None:
            place = option[1].replace("-", "_")
            known = re.search(r"\[possible values: (.*)\]", done.stderr)
            sentence = f"{place}: {sentence}" + (f"; there are {known[1]}" if known is not None else "")
        else:
            place = found[0] if found is not None else sentence.split(": ")[0]
        raise (InputError if done.returncode == 2 else RunError)(sentence, place)
    return said["warning: "]


def pandas(what: str = "a table") -> Any:
    """Returns the package pandas, which `what` needs."""
    try:
        import pandas as pd
    except ImportError:
        raise missing("pandas", what) from None
    return pd
