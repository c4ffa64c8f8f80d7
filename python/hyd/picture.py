"""Pictures, drawn as ``hyd plot`` draws them: one panel for each unit."""

from __future__ import annotations

import os
from typing import Optional, Sequence

import numpy as np

from . import _hyd
from .errors import UsageError
from .values import counted
from .values import names as listed


class Picture:
    """A picture of curves; a notebook shows it.

    Attributes
    ----------
    svg : str
        The text of an SVG file.
    """

    def __init__(self, curves: list, title: Optional[str], runs: Sequence[str]):
        self._drawn = (curves, title, list(runs))
        self.svg: str = bytes(_hyd.picture(*self._drawn, False)).decode()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the picture to a file that ends in ``.svg`` or ``.png``."""
        name = os.fspath(path)
        ending = os.path.splitext(name)[1].lower()
        if ending not in (".svg", ".png"):
            raise UsageError(f"`{name}`: a picture ends in .svg or .png")
        content = self.svg.encode() if ending == ".svg" else bytes(_hyd.picture(*self._drawn, True))
        with open(name, "wb") as file:
            file.write(content)

    def _repr_svg_(self) -> str:
        return self.svg

    def __repr__(self) -> str:
        names = list(dict.fromkeys(curve[0] for curve in self._drawn[0]))
        return f"<hyd.Picture of {', '.join(names)}>"


def plot(*runs, names: Sequence[str], labels: Optional[Sequence[str]] = None, title: Optional[str] = None) -> Picture:
    """Draw variables of several runs over each other.

    Parameters
    ----------
    *runs : Run
        The runs.
    names
        Full names of variables.
    labels
        What the runs are called [default: their numbers].
    title
        A line above the picture.
    """
    names = listed("names", names)
    if not runs:
        raise UsageError("plot: no run is given")
    if labels is not None:
        labels = listed("labels", labels)
        if len(labels) != len(runs):
            raise UsageError(f"labels: {counted(len(labels), 'label')} for {counted(len(runs), 'run')}")
    curves = []
    for number, run in enumerate(runs):
        times = np.asarray(run.time)
        for name in names:
            curves.append((name, run.units.get(name, ""), number, times, np.asarray(run[name])))
    # Runs of a variable stand together.
    curves.sort(key=lambda curve: names.index(curve[0]))
    labels = labels or ([f"run {k + 1}" for k in range(len(runs))] if len(runs) > 1 else [""])
    return Picture(curves, title, labels)
