"""The linear model at a point of a run."""

from __future__ import annotations

import json
from typing import Any, List

import numpy as np

from .errors import _warn
from .values import counted


class LinearModel:
    """``dx/dt = A x + B u``, ``y = C x + D u`` for small deviations from a point of a run.

    Attributes
    ----------
    A, B, C, D : numpy.ndarray
        Matrices, in SI units.
    x, u, y : numpy.ndarray
        States, inputs and outputs at the point.
    states, inputs, outputs : list of str
        Their names.
    eigenvalues : numpy.ndarray
        Complex, in 1/s.
    time : float
        Time of the point in s.
    """

    def __init__(self, found: dict):
        warnings = found.pop("warnings")
        self._json: str = found["json"]
        self.A, self.B, self.C, self.D = (np.asarray(found[name]) for name in "ABCD")
        self.x, self.u, self.y = (np.asarray(found[name]) for name in "xuy")
        self.eigenvalues: np.ndarray = np.asarray(found["real"]) + 1j * np.asarray(found["imaginary"])
        self.states: List[str] = found["states"]
        self.inputs: List[str] = found["inputs"]
        self.outputs: List[str] = found["outputs"]
        self.time: float = found["time"]
        self.model: str = found["model"]
        _warn(warnings, self)

    def to_dict(self) -> dict:
        """What ``hyd linearize --json`` prints."""
        return json.loads(self._json)

    def to_scipy(self) -> Any:
        """A ``scipy.signal.StateSpace``."""
        from scipy.signal import StateSpace

        return StateSpace(self.A, self.B, self.C, self.D)

    def __repr__(self) -> str:
        lists = (("state", self.states), ("input", self.inputs), ("output", self.outputs))
        counts = ", ".join(counted(len(own), what) for what, own in lists)
        return f"<hyd.LinearModel of {self.model} at {self.time:g} s: {counts}>"
