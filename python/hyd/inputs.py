"""Recorded inputs: tables of other libraries as times and columns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, List, Sequence, Tuple

import numpy as np

from .errors import UsageError
from .run import Run
from .values import counted

_TIME = "time"


def samples(inputs: Any, known: Sequence[str]) -> Tuple[List[float], List[Tuple[str, List[float]]]]:
    """Times in s and named columns of a table; ``known`` are the inputs of the model."""
    columns = _columns(inputs, known)
    if _TIME not in columns:
        raise UsageError("inputs need a column `time` in s")
    times = _numbers(_TIME, columns.pop(_TIME))
    if times.ndim != 1:
        raise UsageError("inputs: `time` is a list of numbers")
    if isinstance(inputs, Run) and len(times):
        # Of the two rows of an event the one after it.
        kept = np.append(np.diff(times) > 0, True)
        times, columns = times[kept], {name: values[kept] for name, values in columns.items()}
    found = []
    for name, values in columns.items():
        numbers = _numbers(name, values)
        if numbers.ndim == 0:
            numbers = np.full(times.shape, float(numbers))
        if numbers.ndim != 1:
            raise UsageError(f"inputs: `{name}` has {numbers.ndim} dimensions; an array is a column for each element, such as `{name}[1]`")
        if len(numbers) != len(times):
            raise UsageError(f"inputs: `{name}` has {counted(len(numbers), 'value')}, and there are {counted(len(times), 'time')}")
        found.append((name, numbers.tolist()))
    return times.tolist(), found


def _columns(inputs: Any, known: Sequence[str]) -> dict:
    if isinstance(inputs, Run):
        return {_TIME: inputs.time, **{name: inputs[name] for name in known if name in inputs}}
    if isinstance(inputs, Mapping) and not hasattr(inputs, "data_vars"):
        return {str(name): values for name, values in inputs.items()}
    if hasattr(inputs, "data_vars"):
        # An `xarray.Dataset`.
        found = {str(name): own.values for name, own in inputs.data_vars.items()}
        return {_TIME: inputs[_TIME].values, **found} if _TIME in inputs else found
    if hasattr(inputs, "column_names") and hasattr(inputs, "column"):
        # A `pyarrow.Table`.
        return {name: inputs.column(name).to_numpy() for name in inputs.column_names}
    if hasattr(inputs, "columns"):
        found = {str(name): inputs[name] for name in inputs.columns}
        index = getattr(inputs, "index", None)
        if _TIME not in found and index is not None and (index.name == _TIME or np.asarray(index).dtype.kind in "mM"):
            found[_TIME] = index
        return found
    raise UsageError(f"inputs: {type(inputs).__name__} is neither a file nor a table with `time` and a column for each input")


def _numbers(name: str, values: Any) -> np.ndarray:
    found = np.asarray(values)
    if found.dtype.kind == "m":
        return found / np.timedelta64(1, "s")
    if found.dtype.kind == "M":
        raise UsageError(f"inputs: `{name}` holds dates; times are in s, such as `(t - t[0]).total_seconds()`")
    try:
        return found.astype(float)
    except (TypeError, ValueError):
        raise UsageError(f"inputs: `{name}` holds something that is not a number") from None
