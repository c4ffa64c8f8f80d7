"""A run: times, variables, units, and the ways to other libraries."""

from __future__ import annotations

import html
import json
from collections.abc import ItemsView, KeysView, ValuesView
from typing import Any, Iterator, List, Optional

import numpy as np

from . import _hyd
from .errors import UsageError
from .picture import Picture, plot
from .values import counted

#: Variables that are shown when nobody says which.
_FEW = 12


class Run:
    """The results of one run.

    A run maps full names of variables to numpy arrays as a dictionary does (``run[name]``, ``in``, ``keys``, ``values``, ``items``, ``get``). The arrays
    are views of the memory that the solver wrote to: nothing is copied, and nothing can be written. What does not change during a run (a parameter) is an array of one value repeated.

    Attributes
    ----------
    time : numpy.ndarray
        Times of the rows in s. An event is two rows of equal time.
    units : dict
        Units by name, ``""`` where none is known.
    summary : dict
        What ``hyd simulate --json`` prints: status, counters of the solver, warnings, last values.

    Examples
    --------
    >>> run = model.simulate(p0=15e6, stop=0.02)
    >>> bool(run["y"].max() > 0.004), run.units["y"], len(run.time) == len(run["y"])
    (True, 'm', True)
    """

    def __init__(self, run: _hyd.Run):
        self._run = run
        self._listed: Optional[list] = None
        self._summary: Optional[dict] = None

    @property
    def time(self) -> np.ndarray:
        """Times of the rows in s."""
        return np.asarray(self._run.time)

    @property
    def _variables(self) -> list:
        if self._listed is None:
            self._listed = self._run.variables()
        return self._listed

    @property
    def names(self) -> List[str]:
        """Full names of the variables that were recorded."""
        return [name for name, _, _ in self._variables]

    @property
    def units(self) -> dict:
        """Units by name; ``""`` where none is known."""
        return {"time": "s", **{name: unit for name, unit, _ in self._variables}}

    @property
    def descriptions(self) -> dict:
        """What the model says of its variables, by name."""
        return {name: text for name, _, text in self._variables}

    @property
    def parameters(self) -> dict:
        """Parameters and constants with their values in this run."""
        return self._run.parameters()

    @property
    def summary(self) -> dict:
        """What ``hyd simulate --json`` prints."""
        if self._summary is None:
            self._summary = json.loads(self._run.summary)
        return self._summary

    @property
    def status(self) -> str:
        """``"done"``, or ``"terminated"`` by the model, ``"interrupted"``, ``"failed"``."""
        return self.summary["status"]

    def __getitem__(self, name: str) -> np.ndarray:
        if name == "time" and name not in self._run:
            return self.time
        values = self._run.values(name)
        if isinstance(values, float):
            return np.broadcast_to(values, (len(self._run),))
        return np.asarray(values)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self._run

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    # Not a `Mapping`: polars would read it as one, without its times, instead of asking for its Arrow stream.
    def keys(self) -> KeysView:
        """Full names of the variables that were recorded."""
        return KeysView(self)  # type: ignore[arg-type]

    def values(self) -> ValuesView:
        """Arrays of the variables that were recorded."""
        return ValuesView(self)  # type: ignore[arg-type]

    def items(self) -> ItemsView:
        """Names and arrays."""
        return ItemsView(self)  # type: ignore[arg-type]

    def get(self, name: str, default: Any = None) -> Any:
        """The values of a variable, or ``default`` where there is none of this name."""
        try:
            return self[name]
        except KeyError:
            return default

    def __len__(self) -> int:
        return len(self._variables)

    def derivative(self, of: str, by: str) -> np.ndarray:
        """Derivative of a variable by a parameter, where :meth:`hyd.Model.sensitivity` computed it."""
        return self[f"d({of})/d({by})"]

    def at(self, time: float) -> dict:
        """All variables at a time in s, interpolated linearly between rows; at an event, the values after it."""
        times = self.time
        if not len(times):
            raise UsageError("the run has no rows")
        if not times[0] <= time <= times[-1]:
            raise UsageError(f"the run goes from {times[0]} to {times[-1]} s, and has nothing at {time} s")
        after = int(np.searchsorted(times, time, side="right"))
        if after == len(times) or times[after - 1] == time:
            return {name: float(self[name][after - 1]) for name in self}
        share = (time - times[after - 1]) / (times[after] - times[after - 1])
        own = self._run.values
        result = {}
        for name in self:
            values = own(name)
            if isinstance(values, float):
                result[name] = values
            else:
                values = np.asarray(values)
                result[name] = float(values[after - 1] + share * (values[after] - values[after - 1]))
        return result

    def to_pandas(self) -> Any:
        """A ``pandas.DataFrame`` with the time as index; ``frame.attrs["units"]`` has the units."""
        import pandas

        columns = {name: self[name] for name in self}
        frame = pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"), copy=False)
        frame.attrs["units"] = self.units
        return frame

    def to_polars(self) -> Any:
        """A ``polars.DataFrame`` with a column ``time``; its columns are the memory of the run."""
        import polars

        return polars.DataFrame(self)

    def to_arrow(self) -> Any:
        """A ``pyarrow.Table`` with a column ``time``; its columns are the memory of the run, units stand in the fields' metadata."""
        import pyarrow

        return pyarrow.table(self)

    def to_xarray(self) -> Any:
        """An ``xarray.Dataset`` over ``time``, with units and descriptions as attributes."""
        import xarray

        variables = {}
        for name, unit, description in self._variables:
            attributes = {key: text for key, text in (("units", unit), ("long_name", description)) if text}
            variables[name] = ("time", self[name], attributes)
        return xarray.Dataset(variables, {"time": ("time", self.time, {"units": "s"})}, {"model": self.summary["model"]})

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self._run.arrow()

    def plot(self, *names: str, title: Optional[str] = None) -> Picture:
        """Draw variables over time, one panel for each unit; without names a few of the top level.

        Examples
        --------
        >>> model.simulate(stop=0.02).plot("x", "y", "p_R")
        <hyd.Picture of x, y, p_R>
        """
        chosen = list(names) or self._shown()
        return plot(self, names=chosen, title=title if title is not None else self.summary["model"])

    def _shown(self) -> list:
        return [name for name in self.summary["final"] if name in self][:_FEW] or self.names[:_FEW]

    def __repr__(self) -> str:
        own = self.summary
        return (
            f"<hyd.Run of {own['model']}: {own['start']:g} to {own['time']:g} s, {own['status']}, "
            f"{counted(len(self), 'variable')}, {counted(len(self._run), 'row')}>"
        )

    def _repr_html_(self) -> str:
        own = self.summary
        head = f"{own['model']}: {own['start']:g} to {own['time']:g} s, {own['status']}"
        counts = f"{counted(len(self), 'variable')}, {counted(len(self._run), 'row')}, {counted(own['counters']['steps'], 'step')}"
        picture = self.plot(title="").svg if len(self) and len(self._run) > 1 else ""
        said = "".join(f"<p>warning: {html.escape(text)}</p>" for text in own["warnings"])
        return f'<div class="hyd-run"><p><b>{html.escape(head)}</b><br>{counts}</p>{said}{picture}</div>'

    def __reduce__(self):
        summary, variables, times, matrix, parameters = self._run.state()
        columns = np.ascontiguousarray(np.asarray(matrix)).ravel()
        return (_restored, (summary, variables, np.asarray(times).copy(), columns, list(parameters.items())))


def _restored(summary, variables, times, columns, parameters) -> Run:
    return Run(_hyd.Run.of_state(summary, variables, times, columns, parameters))
