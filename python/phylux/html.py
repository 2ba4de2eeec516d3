"""How notebooks and terminals show objects of the package."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Sequence
from html import escape

#: the most rows of a table that a notebook shows
MOST = 10


def width() -> int:
    """Returns how many characters a line of a text has room for."""
    return shutil.get_terminal_size((80, 24)).columns


def text(words: str, warnings: Sequence[str] = ()) -> str:
    """Returns a text of the command, with its warnings."""
    return f"<pre>{escape(words)}</pre>{_warned(warnings)}"


def table(title: str, heads: Sequence[str], rows: Iterable[Sequence[object]], of: int, warnings: Sequence[str] = ()) -> str:
    """Returns a table of the first of ``of`` rows, with warnings below it."""
    line = "<tr><th>" + "</th><th>".join(map(escape, heads)) + "</th></tr>"
    body = "".join("<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows)
    more = f"<p>and {of - MOST} more</p>" if of > MOST else ""
    whole = f"<table><thead>{line}</thead><tbody>{body}</tbody></table>" if of else ""
    return f"<p><b>{escape(title)}</b></p>{whole}{more}{_warned(warnings)}"


def _warned(warnings: Sequence[str]) -> str:
    return "".join(f"<p>warning: {escape(sentence)}</p>" for sentence in warnings)
