"""Many runs of a model."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from typing import Any, Dict, Iterator, Mapping, Optional

import numpy as np

from .errors import UsageError, _warn
from .progress import Bar
from .values import checked, counted, engine, names, real, variation, whole


class Sweep(Mapping[str, Any]):
    """The results of many runs: a table with a line for each run.

    Columns are numpy arrays (texts are arrays of objects): ``member`` (the number of the run), the values that vary, ``status`` (``"done"``, ``"terminated"`` or ``"failed"``), ``message`` and ``time``
    reached in s, the last value of each variable, and the measures that were asked for.

    Attributes
    ----------
    rows : dict or None
        All rows of all runs where they were kept: ``member``, ``time``, variables.
    units : dict
        Units by name, as far as they are known.
    failures : list of tuple
        Why runs failed: how many, the number of one of them, the message; the commonest first.
    """

    def __init__(self, table: Dict[str, Any], rows: Optional[Dict[str, Any]], numbers: dict, path: Optional[str]):
        self._table = table
        self.rows = rows
        self.units: dict = json.loads(numbers.get("units") or "{}")
        self.failures: list = numbers["failures"]
        self.failed: int = numbers["failed"]
        self.path = path

    def __getitem__(self, name: str) -> Any:
        return self._table[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._table)

    # Two sweeps are the same if they are one object.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __len__(self) -> int:
        return len(self._table)

    def to_pandas(self, rows: bool = False) -> Any:
        """The table, or all rows, as a ``pandas.DataFrame``."""
        import pandas

        frame = pandas.DataFrame(self._chosen(rows), copy=False)
        frame.attrs["units"] = {name: self.units[name] for name in frame.columns if name in self.units}
        return frame

    def to_polars(self, rows: bool = False) -> Any:
        """The table, or all rows, as a ``polars.DataFrame``."""
        import polars

        return polars.DataFrame(self._chosen(rows))

    def _chosen(self, rows: bool) -> dict:
        if not rows:
            return dict(self._table)
        if self.rows is None:
            raise UsageError("the rows of the runs were not kept; sweep(..., rows=True) keeps them")
        return dict(self.rows)

    def __repr__(self) -> str:
        return f"<hyd.Sweep of {counted(len(self['member']), 'run')}, {self.failed} failed>"

    def _repr_html_(self) -> str:
        try:
            return self.to_pandas()._repr_html_()
        except ImportError:
            return f"<pre>{self!r}</pre>".replace("<hyd", "&lt;hyd").replace("failed>", "failed&gt;")


def sweep(model, own, vary, options, measure, inputs, result, progress, sharing) -> Sweep:
    """Run a sweep of the extension and read its tables."""
    kept = checked(options)
    kept["measure"] = names("measure", measure)
    kept.update(_shared(*sharing, result))
    if not isinstance(vary, Mapping):
        raise UsageError(f"vary: {vary!r} is not a mapping of names to values")
    both = [name for name, _ in own if name in vary]
    if both:
        raise UsageError(f"`{both[0]}` is varied and set; a parameter is one or the other")
    kept["vary"] = [(str(name), variation(values)) for name, values in vary.items()]
    bar = Bar.of(progress, "runs")
    with tempfile.TemporaryDirectory(prefix="hyd-sweep-") as folder:
        kept["result"] = folder if result is None else os.path.abspath(result)
        kept["kept"] = result is not None
        try:
            found = model.sweep(own, kept, *inputs, None if bar is None else bar.count)
        finally:
            if bar is not None:
                bar.close()
    table = {name: _column(values) for name, values in found["table"]}
    rows = {name: _column(values) for name, values in found["rows"]} if "rows" in found else None
    swept = Sweep(table, rows, found, None if result is None else kept["result"])
    _warn(found["warnings"], swept)
    return swept


def _shared(on: Any, shards: Any, resume: Any, settle: Any, result: Any) -> dict:
    """How a sweep is shared out, as the extension takes it."""
    if on is None:
        given = [name for name, value in (("shards", shards), ("resume", resume), ("settle", settle)) if value]
        if given:
            raise UsageError(f"{given[0]}: on= is needed, too")
    elif result is None:
        raise UsageError("on: result= is needed, a folder that all machines see")
    return {
        "on": engine(on),
        "shards": None if shards is None else whole("shards", shards),
        "resume": bool(resume),
        "settle": None if settle is None else real("settle", settle),
        "python": sys.executable,
    }


def _column(values: Any) -> Any:
    is_text = isinstance(values, list) and values and isinstance(values[0], str)
    return np.asarray(values, dtype=object) if is_text else np.asarray(values)
