"""One conversion of values: whatever holds numbers, texts and lists becomes what JSON and CSV files have."""

from __future__ import annotations

import datetime
import json
import math
import numbers as kinds
import os
import sys
import unicodedata
from collections.abc import Callable, Iterable, Iterator, KeysView, Mapping, Sequence, Set, ValuesView
from decimal import Decimal
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import wrong

Floats = npt.NDArray[np.float64]

class _No(Exception):
    """Why a value will not do, and where it is: the keys and indices from the innermost one outwards."""

    def __init__(self, problem: str, remedy: str) -> None:
        super().__init__(problem)
        self.problem, self.remedy = problem, remedy
        self.keys: list[str] = []


def plain(value: Any, place: str) -> Any:
    """Returns a value as the lists, dictionaries, numbers and texts that JSON has.

    Takes what Python, numpy, pandas, polars, arrow and xarray have for these, and paths and dates. Errors, at ``place``
    with the keys and indices of the value: it has no such form, is not finite, or is missing or masked in an array.
    """
    try:
        return _plain(value)
    except _No as no:
        keys = [key.replace("~", "~0").replace("/", "~1") for key in reversed(no.keys)]
        raise wrong("/".join([place, *keys]), no.problem, no.remedy) from None
    except RecursionError:
        raise wrong(place, "holds itself, or is nested too deeply", "give lists and dictionaries of plain values") from None


def _plain(value: Any) -> Any:
    kind = type(value)
    if kind is bool or value is None or kind is float and math.isfinite(value):
        return value
    if kind is int:
        return _whole(value)
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, Mapping):
        return _keyed(value)
    if isinstance(value, (list, tuple)):
        return _each(value, _plain)
    if isinstance(value, np.floating):
        return _finite(value)
    if isinstance(value, np.generic) or any(hasattr(value, name) for name in (*_LISTS, "__array__")):
        return _listed(value)
    if isinstance(value, (Sequence, KeysView, ValuesView)) and not isinstance(value, (bytes, bytearray, memoryview)):
        return _each(value, _plain)
    if isinstance(value, kinds.Integral):
        return _whole(int(value))
    if isinstance(value, (kinds.Real, Decimal)):
        return _finite(value)
    if is_missing(value):
        raise _No(f"has no value ({kind.__name__})", "give one, or leave it out")
    if isinstance(value, os.PathLike):
        return _text(os.fsdecode(value))
    if isinstance(value, datetime.date):
        return value.isoformat()
    raise _formless(value)


def _formless(value: Any) -> _No:
    remedy = "a list of its values" if isinstance(value, Iterable) else "a number, a text or a list"
    return _No(f"is of type {type(value).__name__}, which has no form in a scene", f"give {remedy}")


#: the methods by which arrays, columns and scalars of other packages say their values
_LISTS = ("tolist", "to_list", "to_pylist", "as_py")


def _listed(values: Any) -> Any:
    """Returns what an array, a column or a scalar of another package holds."""
    dtype = getattr(values, "dtype", None)
    if isinstance(dtype, np.dtype) and dtype.kind in "mM":
        raise _No("has times without a time zone", "give texts such as 2025-06-21T11:30+02:00")
    if is_masked(values):
        raise _No("has masked values", "fill them, or leave them out")
    found = _to_list(values)
    if type(found) is type(values):
        # a scalar of which Python has no like
        raise _formless(values)
    return _entry(found)


def _to_list(values: Any) -> Any:
    for name in _LISTS:
        if hasattr(values, name):
            return getattr(values, name)()
    try:
        return np.asarray(values).tolist()
    except (TypeError, ValueError) as error:
        raise _No(f"is no array ({error})", "give a list of its values") from None


def _entry(value: Any) -> Any:
    """Returns an entry of an array or a column, in which None stands for no value."""
    if isinstance(value, list):
        return _each(value, _entry)
    if value is None:
        raise _No("has no value", "give one, or leave it out")
    return _plain(value)


def _each(values: Iterable[Any], convert: Callable[[Any], Any]) -> list[Any]:
    found: list[Any] = []
    try:
        for value in values:
            found.append(convert(value))
    except _No as no:
        no.keys.append(str(len(found)))
        raise
    return found


def _keyed(values: Mapping[Any, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in values.items():
        if is_missing(key):
            raise _No(f"a key without a value ({key!r})", "give it a name, or leave it out")
        name = _text(str(key))
        if name in found:
            raise _No(f"two keys that are {name!r} as text", "give each its own")
        try:
            found[name] = _plain(value)
        except _No as no:
            no.keys.append(name)
            raise
    return found


def _text(value: str) -> str:
    found = str.__str__(value)
    try:
        found.encode()
    except UnicodeEncodeError:
        raise _No(f"{found!r} is no text of Unicode", "write it anew") from None
    return found


def _whole(value: int) -> int:
    if abs(value) > sys.float_info.max:
        raise _too_large()
    return value


def _too_large() -> _No:
    return _No(f"is beyond {sys.float_info.max:.2g}, the largest number", "give a smaller one")


def _finite(value: Any) -> float:
    try:
        number = float(value.item() if hasattr(value, "item") else value)
    except OverflowError:
        raise _too_large() from None
    except (TypeError, ValueError):
        raise _No(f"{value!r} is no number", "give a number") from None
    if not math.isfinite(number):
        raise _No(f"{number} is no finite number", "give a finite one")
    return number


def finite(value: Any, place: str) -> float:
    """Returns a value as a finite number. Errors: it is none, or has no value."""
    if is_missing(value):
        raise wrong(place, "has no value", "give a number")
    if isinstance(value, (bool, np.bool_)):
        raise wrong(place, f"{value} is no number", "give a number")
    try:
        return _finite(value)
    except _No as no:
        raise wrong(place, no.problem, no.remedy) from None


def count(value: Any, place: str) -> int:
    """Returns a value as a whole number. Errors: it is none, or negative."""
    found = finite(value, place)
    if not 0 <= found <= 9e15 or found != int(found):
        raise wrong(place, f"{value} is no whole number from 0 to 9e15", "give one")
    return int(found)


def text(value: Any, place: str) -> str:
    """Returns a value as a text. Error: it is none."""
    found = plain(value, place)
    if not isinstance(found, str):
        raise wrong(place, f"{found!r} is no text", "give one text")
    return found


def texts(values: Any, place: str) -> list[str]:
    """Returns one text, or several, as a list. Error: they are no texts."""
    found = plain(list(values) if isinstance(values, (Iterator, Set)) else values, place)
    if not isinstance(found, (str, list)):
        raise wrong(place, f"{found!r} is no text", "give one text, or a list of texts")
    return [found] if isinstance(found, str) else [text(one, f"{place}/{i}") for i, one in enumerate(found)]


def span(ends: Any, place: str) -> tuple[float, float]:
    """Returns the two ends of a range of numbers. Errors: they are not two, or no numbers."""
    found = plain(ends, place)
    if not isinstance(found, list) or len(found) != 2:
        raise wrong(place, f"{found!r} is no range", "give its ends: (low, high)")
    return finite(found[0], place), finite(found[1], place)


def is_missing(value: Any) -> bool:
    """Returns whether a cell is empty: None, NaN, NaT, pandas' NA, masked."""
    if value is None or value is np.ma.masked:
        return True
    try:
        return bool(value != value)
    except (TypeError, ArithmeticError):
        # pandas' NA is neither true nor false
        return True
    except ValueError:
        return False


def is_masked(values: Any) -> bool:
    """Returns whether an array has masked entries, also one in a list of arrays."""
    if isinstance(values, (list, tuple)):
        return any(map(is_masked, values))
    return values is np.ma.masked or isinstance(values, np.ma.MaskedArray) and bool(np.ma.is_masked(values))


def numbers(values: Any, place: str, what: str) -> Floats:
    """Returns an array of numbers, in which NaN stands for no value. Errors: they are no real numbers, or are masked."""
    if is_masked(values):
        raise wrong(place, f"{what} of which some are masked", "leave these out, or fill them")
    try:
        found = np.asarray(values)
        if found.dtype.kind in "bcmM":
            raise TypeError(f"of type {found.dtype}")
        return found.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError) as error:
        raise wrong(place, f"{what} that are no numbers ({error})") from None


def columns(table: Any, place: str) -> dict[str, Any] | None:
    """Returns the columns of a table of pandas, polars or arrow, or of an array with named fields; None for what is no
    table."""
    if hasattr(table, "collect"):
        raise wrong(place, f"a {type(table).__name__}, whose values are not there yet", "collect it first")
    names = getattr(getattr(table, "dtype", None), "names", None) or getattr(table, "column_names", None)
    if names is None and not isinstance(table, type):
        names = getattr(table, "columns", None)
    if names is None or isinstance(names, (str, bytes)) or callable(names):
        return None
    named = [str(name) for name in names]
    twice = first_twice(named)
    if twice is not None:
        raise wrong(place, f"two columns {twice}", "leave one out")
    return {own: table[name] for own, name in zip(named, names, strict=True)}


def cells(column: Any, place: str) -> list[Any]:
    """Returns the values of a column, with None for those that are missing or masked."""
    try:
        return [None if is_missing(value) else value for value in (column if isinstance(column, list) else _to_list(column))]
    except (_No, TypeError) as error:
        raise wrong(place, f"no column of values ({error})", "give one value for each row") from None


def csv_table(columns: Mapping[str, Iterable[Any]]) -> bytes:
    """Returns columns as the bytes of a CSV file: texts in quotes, numbers with all their digits, nothing for None."""

    def cell(value: Any) -> str:
        if value is None:
            return ""
        return '"' + value.replace('"', '""') + '"' if isinstance(value, str) else repr(value)

    rows = zip(*(map(cell, column) for column in columns.values()), strict=True)
    heads = (name if name.isidentifier() else cell(name) for name in columns)
    return "\n".join([",".join(heads), *map(",".join, rows), ""]).encode()


def first_twice(names: Iterable[str]) -> str | None:
    """Returns the first name that comes again."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None


def name(value: Any, place: str, what: str) -> str:
    """Returns the name of what is an object, a group or the like. Errors: it is no text, or one that files cannot hold."""
    if not isinstance(value, str):
        raise wrong(place, f"{what} named {value!r}", "give it a text as its name")
    found = plain(value, place)
    control = any(unicodedata.category(letter) in ("Cc", "Zl", "Zp") for letter in found)
    if control or found != found.strip() or not found or found.endswith("\\"):
        remedy = "give it a name on one line, without spaces around it or a backslash at its end"
        raise wrong(place, f"{what} named {found!r}", remedy)
    return str(found)


def arguments(given: Mapping[str, Any]) -> str:
    """Returns the arguments of a call that are given, as JSON. Error: one of them has no form there."""
    return json.dumps({name: plain(value, name) for name, value in given.items() if value is not None}, allow_nan=False)
