"""Compile equation-based models, run them, hold them against a bench.

A model is a text; :func:`load` translates it to machine code, :meth:`Model.simulate` runs it, and what comes out are numpy arrays.

Examples
--------
>>> import hyd
>>> model = hyd.load(text="model Fall Real h(start = 10, unit = \\"m\\"); Real v(unit = \\"m/s\\"); "
...                  "parameter Real g(unit = \\"m/s2\\") = 9.81; equation der(h) = v; der(v) = -g; end Fall;")
>>> run = model.simulate(stop=1, tolerance=1e-8)
>>> round(float(run["h"][-1]), 3)
5.095
>>> run.units["v"]
'm/s'
"""

import os as _os

from . import _hyd
from ._hyd import __version__
from .command import command
from .errors import Error, HydNote, HydWarning, Interrupted, ModelError, RunError, UsageError
from .function import Function
from .linear import LinearModel
from .model import Model, Parameter, Variable, load
from .picture import Picture, plot
from .run import Run
from .study import Finding, Fit, Proposal, Study, study
from .sweep import Sweep
from .values import grid, listed, log_grid, lognormal, loguniform, normal, triangular, uniform

__all__ = [
    "Error",
    "Finding",
    "Fit",
    "Function",
    "HydNote",
    "HydWarning",
    "Interrupted",
    "LinearModel",
    "Model",
    "ModelError",
    "Parameter",
    "Picture",
    "Proposal",
    "Run",
    "RunError",
    "Study",
    "Sweep",
    "UsageError",
    "Variable",
    "__version__",
    "command",
    "grid",
    "listed",
    "load",
    "log_grid",
    "lognormal",
    "loguniform",
    "normal",
    "plot",
    "study",
    "triangular",
    "uniform",
]

# What executables and units are made of comes with the package.
_hyd.prebuilt_in(_os.path.join(_os.path.dirname(_os.path.abspath(__file__)), "bin"))
