"""Values of parameters, and how they are varied, in the words of the command line."""

from __future__ import annotations

import math
import numbers
import operator
import os
from typing import Any, Iterable, Mapping, Optional, Union

import numpy as np

from .errors import UsageError


class Variation(str):
    """Values for :meth:`hyd.Model.sweep`, as ``hyd sweep --vary NAME=VALUES`` has them."""

    __slots__ = ()


def text(value: Any) -> str:
    """A value as ``--set NAME=VALUE`` takes it: numbers with all their digits, lists in braces."""
    if isinstance(value, str):
        return value
    # numpy's truth values are no numbers.
    if isinstance(value, bool) or type(value).__name__ in ("bool_", "bool"):
        return "true" if value else "false"
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        return repr(float(value))
    if hasattr(value, "tolist"):
        return text(value.tolist())
    if isinstance(value, Iterable) and not isinstance(value, (bytes, bytearray, Mapping, set, frozenset)):
        return "{" + ", ".join(text(own) for own in value) + "}"
    raise UsageError(f"{value!r} is not a value of a parameter: a number, a truth value, a name, or a list of them")


def counted(number: int, what: str) -> str:
    """A number of things."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def whole(name: str, value: Any) -> int:
    """A number without a fraction; ``name`` is the keyword."""
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        return operator.index(value)
    except TypeError:
        raise UsageError(f"{name}: {value!r} is not an integer") from None


def real(name: str, value: Any) -> float:
    """A number; ``name`` is the keyword."""
    try:
        if isinstance(value, (str, bytes, bool, np.bool_)):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise UsageError(f"{name}: {value!r} is not a number") from None


def names(keyword: str, value: Any) -> list:
    """A list of names; one may stand by itself."""
    if isinstance(value, str):
        return [value]
    try:
        found = list(value)
    except TypeError:
        found = [None]
    for own in found:
        if not isinstance(own, str):
            raise UsageError(f"{keyword}: {value!r} is not a list of names")
    return found


def engine(on: Any) -> Optional[str]:
    """What shares work out, in the words of the command."""
    if on is None or isinstance(on, str):
        return on
    address = getattr(getattr(on, "scheduler", None), "address", None)
    if not isinstance(address, str):
        raise UsageError(f"on: {on!r} is neither a client of Dask nor one of hq, slurm, dask=ADDRESS, here")
    if address.startswith("inproc:"):
        raise UsageError("on: the scheduler of this client lives in this process, and nobody else can reach it; LocalCluster(processes=True) makes one that others can")
    return f"dask={address}"


def paths(keyword: str, value: Any) -> list:
    """A list of paths; one may stand by itself."""
    try:
        return [os.fsdecode(value)] if isinstance(value, (str, bytes, os.PathLike)) else [os.fsdecode(own) for own in value]
    except TypeError:
        raise UsageError(f"{keyword}: {value!r} is not a list of paths") from None


#: What keywords of runs are.
_WHOLE = ("intervals", "max_steps", "samples", "seed", "threads", "calibrate", "shots", "shards", "like")
_COUNTS = {"threads": "threads", "calibrate": "sets", "shots": "shots", "shards": "processes"}
_REAL = ("start", "stop", "tolerance")
_WORDS = ("solver", "variables", "backend", "method")


def checked(options: Mapping[str, Any]) -> dict:
    """Options in the types that the extension takes."""
    known = {}
    for name, value in options.items():
        if value is not None:
            if name in _WHOLE:
                value = whole(name, value)
                if value < 0:
                    raise UsageError(f"{name}: {value} is negative")
                if name in _COUNTS and value == 0:
                    raise UsageError(f"{name}: 0 is not a number of {_COUNTS[name]}")
                if value >= 1 << 63:
                    raise UsageError(f"{name}: {value} is too large")
            elif name in _REAL:
                value = real(name, value)
            elif name in _WORDS and not isinstance(value, str):
                raise UsageError(f"{name}: {value!r} is not a word")
            elif name in ("every_step", "rows") and not isinstance(value, (bool, np.bool_)):
                raise UsageError(f"{name}: {value!r} is neither True nor False")
            elif name in ("every_step", "rows"):
                value = bool(value)
        known[name] = value
    return known


def _number(value: float) -> str:
    value = real("a value", value)
    if not math.isfinite(value):
        raise UsageError(f"{value} is not a value that a parameter can be varied to")
    return repr(value)


def grid(start: float, stop: float, count: int) -> Variation:
    """Numbers at equal distances, both ends among them.

    Examples
    --------
    >>> hyd.grid(8e6, 20e6, 50)
    '8000000.0:20000000.0:50'
    """
    return Variation(f"{_number(start)}:{_number(stop)}:{whole('count', count)}")


def log_grid(start: float, stop: float, count: int) -> Variation:
    """Numbers at equal ratios, both ends among them."""
    return Variation(f"log:{_number(start)}:{_number(stop)}:{whole('count', count)}")


def listed(values: Iterable[Union[float, bool, str]]) -> Variation:
    """These values: numbers, truth values, or names of an enumeration."""
    return Variation(",".join(text(value) for value in values))


def uniform(low: float, high: float) -> Variation:
    """Draws that are equally likely between two numbers."""
    return Variation(f"uniform({_number(low)}, {_number(high)})")


def loguniform(low: float, high: float) -> Variation:
    """Draws whose logarithms are equally likely."""
    return Variation(f"loguniform({_number(low)}, {_number(high)})")


def normal(mean: float, deviation: float) -> Variation:
    """Draws of a normal distribution."""
    return Variation(f"normal({_number(mean)}, {_number(deviation)})")


def lognormal(median: float, deviation: float) -> Variation:
    """Draws whose logarithms are normal."""
    return Variation(f"lognormal({_number(median)}, {_number(deviation)})")


def triangular(low: float, mode: float, high: float) -> Variation:
    """Draws of a triangular distribution."""
    return Variation(f"triangular({_number(low)}, {_number(mode)}, {_number(high)})")


def variation(values: Any) -> str:
    """What varies a parameter: one of the above, its text, or a list of values."""
    if isinstance(values, str):
        return values
    if isinstance(values, (bytes, bytearray, Mapping, set, frozenset)):
        raise UsageError(f"{values!r} is not what a parameter varies over: a list of values, or hyd.grid and its like")
    is_one = isinstance(values, (numbers.Number, np.generic)) or getattr(values, "ndim", 1) == 0
    return listed([values] if is_one else values)
