"""Values of parameters, and how they are varied, in the words of the command line."""

from __future__ import annotations

import math
import numbers
from typing import Any, Iterable, Union


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
    if isinstance(value, Iterable):
        return "{" + ", ".join(text(own) for own in value) + "}"
    raise TypeError(f"{value!r} is not a value of a parameter: a number, a truth value, a name, or a list of them")


def _number(value: float) -> str:
    value = float(value)
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a value that a parameter can be varied to")
    return repr(value)


def grid(start: float, stop: float, count: int) -> Variation:
    """Numbers at equal distances, both ends among them.

    Examples
    --------
    >>> hyd.grid(8e6, 20e6, 50)
    '8000000.0:20000000.0:50'
    """
    return Variation(f"{_number(start)}:{_number(stop)}:{int(count)}")


def log_grid(start: float, stop: float, count: int) -> Variation:
    """Numbers at equal ratios, both ends among them."""
    return Variation(f"log:{_number(start)}:{_number(stop)}:{int(count)}")


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
    return values if isinstance(values, str) else listed(values)
