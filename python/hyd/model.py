"""A model: a text that was translated to machine code."""

from __future__ import annotations

import html
import inspect
import os
from dataclasses import dataclass
from typing import Any, Iterable, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _hyd
from .errors import UsageError, _warn
from .function import Function, made
from .inputs import samples
from .linear import LinearModel
from .run import Run
from .sweep import Sweep, sweep
from .values import checked, names, paths, real, text

_Path = Union[str, "os.PathLike[str]"]

#: Rows of a table in a notebook.
_MOST_ROWS = 200


@dataclass(frozen=True)
class Parameter:
    """A parameter or constant of a model, as it is before anything is set for a run.

    Attributes
    ----------
    name, unit, description : str
        Full name; SI unit, ``""`` if unknown, ``"1"`` without dimension; what the text says of it.
    value : float, bool, int or str
        Its value; of an enumeration the name. NaN where it follows from the start of a run.
    min, max : float or None
        Its limits.
    kind : str
        ``"Real"``, ``"Integer"``, ``"Boolean"`` or ``"enumeration"``.
    literals : tuple of str
        The names of an enumeration.
    settable : str
        ``"yes"``; ``"structural"`` if every value is a translation of its own; ``"no"``.
    """

    name: str
    unit: str
    description: str
    value: Any
    min: Optional[float]
    max: Optional[float]
    kind: str
    literals: tuple
    settable: str


@dataclass(frozen=True)
class Variable:
    """A variable of a model: full name, SI unit (``""`` if unknown) and what the text says of it."""

    name: str
    unit: str
    description: str
    kind: str


def load(
    source: Optional[_Path] = None,
    model: Optional[str] = None,
    *,
    text: Optional[str] = None,
    parameters: Union[None, _Path, Mapping[str, Any]] = None,
    library: Union[_Path, Iterable[_Path]] = (),
    allow_outside: bool = False,
    strict_units: bool = False,
    name: str = "<text>",
) -> "Model":
    """Translate a model.

    Parameters
    ----------
    source
        The model's file (``.hyd`` or ``.mo``).
    model
        The class to take [default: the last complete model of the file].
    text
        The text of a model, instead of a file.
    parameters
        Values that hold for all runs unless they are set again: by full name, or a file of lines ``NAME = VALUE`` in TOML.
    library
        Folders with libraries, or one library.
    allow_outside
        Lets the model name data files outside of its own folder and those of the libraries.
    strict_units
        Units that do not fit are errors in the texts of libraries, too, not only in those of the model.
    name
        What messages call ``text``.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        With code, file, line and excerpt, if the text has an error.

    Examples
    --------
    >>> hyd.load("models/single_acting_drive/drive.hyd").name
    'SingleActingDrive.Drive'
    """
    if (source is None) == (text is None):
        raise UsageError("load takes a file or a text: one of them")
    folders = paths("library", library)
    given: list
    if parameters is None:
        given = []
    elif isinstance(parameters, Mapping):
        given = _assignments(parameters)
    else:
        given = _hyd.Model.parameter_file(os.fsdecode(parameters))
    if source is not None:
        return _loaded(_hyd.Model.load(os.fsdecode(source), model, given, (folders, allow_outside), strict_units))
    return _loaded(_hyd.Model.of_text(text or "", name, model, given, (folders, allow_outside), strict_units))


def _loaded(own: _hyd.Model) -> "Model":
    loaded = Model(own)
    _warn(own.warnings(), loaded)
    return loaded


def _assignments(values: Mapping[str, Any]) -> list:
    return [(str(name), text(value)) for name, value in values.items()]


def _keyword_names(method: Any) -> List[str]:
    """The names of a method that are given as keywords alone."""
    return [own.name for own in inspect.signature(method).parameters.values() if own.kind is own.KEYWORD_ONLY]


class Model:
    """A model that can be run; made by :func:`load`.

    Values of parameters are keywords of its methods, or entries of a mapping before them where a name is no Python name (``{"sh.m": 0.02}``). What
    decides sizes or structure is translated for each value once. Models are safe to be used by several threads, which run beside each other,
    and they pickle with all their texts.
    """

    #: Keywords of a run that are no parameters.
    _RUN = (
        "start",
        "stop",
        "tolerance",
        "intervals",
        "every_step",
        "max_steps",
        "solver",
        "variables",
        "inputs",
        "hold",
        "backend",
        "result",
    )

    def __init__(self, model: _hyd.Model):
        self._model = model

    @property
    def name(self) -> str:
        """Full name of the class."""
        return self._model.name

    @property
    def file(self) -> str:
        """The file of the model, as messages name it."""
        return self._model.file

    @property
    def description(self) -> str:
        """What the model says of itself."""
        return self._model.description

    @property
    def experiment(self) -> dict:
        """``start``, ``stop`` and ``interval`` in s and ``tolerance`` by the model's annotation, None where it says nothing."""
        return dict(zip(("start", "stop", "tolerance", "interval"), self._model.experiment))

    @property
    def parameters(self) -> "dict[str, Parameter]":
        """All parameters and constants by full name.

        Examples
        --------
        >>> model.parameters["p0"].value, model.parameters["p0"].unit
        (10000000.0, 'Pa')
        """
        found = {}
        for own in self._model.variables(True):
            if own.pop("protected"):
                continue
            own["literals"] = tuple(own["literals"] or ())
            own["value"] = _value(own)
            found[own["name"]] = Parameter(**own)
        return found

    @property
    def variables(self) -> "dict[str, Variable]":
        """All variables by full name."""
        return {
            own["name"]: Variable(own["name"], own["unit"], own["description"], own["kind"])
            for own in self._model.variables(False)
        }

    @property
    def inputs(self) -> List[str]:
        """The model's own inputs of type Real, which may follow recorded samples."""
        return self._model.ends()[0]

    @property
    def outputs(self) -> List[str]:
        """The model's own outputs."""
        return self._model.ends()[1]

    def simulate(
        self,
        parameters: Optional[Mapping[str, Any]] = None,
        /,
        *,
        start: Optional[float] = None,
        stop: Optional[float] = None,
        tolerance: Optional[float] = None,
        intervals: Optional[int] = None,
        every_step: bool = False,
        max_steps: Optional[int] = None,
        solver: str = "auto",
        variables: Optional[str] = None,
        inputs: Any = None,
        hold: Union[str, Sequence[str]] = (),
        backend: str = "native",
        result: Optional[_Path] = None,
        **values: Any,
    ) -> Run:
        """Run the model once.

        Parameters
        ----------
        parameters, **values
            Values of parameters by full name.
        start, stop
            Times in s [default: the model's experiment annotation, else 0 and 1 s later].
        tolerance
            Relative tolerance [default: the annotation, else 1e-6].
        intervals
            Number of equal output intervals [default: the annotation, else 500].
        every_step
            Rows at every step of the solver.
        max_steps
            Number of steps after which the run is given up.
        solver
            ``"auto"``, ``"bdf"`` or ``"esdirk"``.
        variables
            Variables that are recorded: those whose full name matches this regular expression.
        inputs
            Recorded inputs: a file as ``--input`` takes it, or a mapping, data frame, Arrow table or ``xarray.Dataset`` with ``time`` in s (or time
            differences) and a column for each input; or a run, which has variables of these names.
        hold
            What inputs do between samples: ``"linear"``, ``"zero"`` or ``"smooth"``, for all, or ``"NAME=zero"`` for one.
        backend
            ``"native"``, or ``"vm"``, the interpreter.
        result
            Also writes the rows to a file: ``.csv``, ``.mat`` or ``.parquet``.

        Returns
        -------
        Run

        Raises
        ------
        RunError
            If the solver gave up; ``error.run`` has the rows up to there.
        Interrupted
            If Ctrl-C stopped the run; ``error.run`` has the rows up to there.
        UsageError
            For a keyword that is neither an option nor a parameter.

        Examples
        --------
        >>> run = model.simulate(p0=15e6, U0=28, stop=0.05, tolerance=1e-6)
        >>> run.status
        'done'
        >>> model.simulate(tolerence=1e-6)
        Traceback (most recent call last):
        ...
        hyd.errors.UsageError: the model has no parameter `tolerence`; did you mean `tolerance`?
        """
        options = dict(
            start=start,
            stop=stop,
            tolerance=tolerance,
            intervals=intervals,
            every_step=every_step,
            max_steps=max_steps,
            solver=solver,
            variables=variables,
            backend=backend,
            result=None if result is None else os.fsdecode(result),
        )
        return self._run(self._set("simulate", parameters, values), options, inputs, hold, [])

    def _run(self, given: list, options: Mapping[str, Any], inputs: Any, hold: Any, by: List[str]) -> Run:
        own, warnings = self._model.simulate(given, checked(options), *self._inputs(inputs, hold), by)
        run = Run(own)
        _warn(warnings, run)
        return run

    def sensitivity(
        self, by: Union[str, Sequence[str], None] = None, parameters: Optional[Mapping[str, Any]] = None, /, **options: Any
    ) -> Run:
        """Run the model with the derivatives of all recorded variables.

        Parameters
        ----------
        by
            Parameters, or variables for their start values.
        parameters, **options
            As for :meth:`simulate`.

        Returns
        -------
        Run
            With further variables ``d(x)/d(p)``; see :meth:`Run.derivative`.

        Examples
        --------
        >>> run = model.sensitivity(["p0", "C"], stop=0.02)
        >>> run.derivative("y", "p0").shape == run.time.shape
        True
        """
        by = names("by", self._named("by", by, options))
        values = {name: options.pop(name) for name in list(options) if name not in self._RUN}
        inputs, hold = options.pop("inputs", None), options.pop("hold", ())
        known = dict.fromkeys(own for own in self._RUN if own not in ("inputs", "hold"))
        known.update(every_step=False)
        known.update(options)
        if known["result"] is not None:
            known["result"] = os.fsdecode(known["result"])
        return self._run(self._set("sensitivity", parameters, values), known, inputs, hold, by)

    def sweep(
        self,
        vary: Optional[Mapping[str, Any]] = None,
        parameters: Optional[Mapping[str, Any]] = None,
        /,
        *,
        measure: Sequence[str] = (),
        samples: Optional[int] = None,
        method: str = "lhs",
        seed: int = 0,
        rows: bool = False,
        variables: Optional[str] = None,
        stop: Optional[float] = None,
        tolerance: Optional[float] = None,
        intervals: Optional[int] = None,
        inputs: Any = None,
        hold: Union[str, Sequence[str]] = (),
        threads: Optional[int] = None,
        result: Optional[_Path] = None,
        progress: Any = False,
        on: Any = None,
        shards: Optional[int] = None,
        resume: bool = False,
        settle: Optional[float] = None,
        **values: Any,
    ) -> Sweep:
        """Run the model many times, on all cores, or on other machines.

        Parameters
        ----------
        vary
            What varies, by full name: :func:`hyd.grid` and its like, a list of values, or the text that ``--vary`` takes. The first changes slowest.
        measure
            Numbers taken of each run, as ``--measure`` takes them: ``"max(y)"``, ``"when(y > 4e-3)"`` (a time in s), ``"mean(p)/2"``; each is a column.
        samples, method, seed
            Number of draws from distributions, ``"lhs"`` or ``"random"``, and their seed.
        rows
            Keeps all rows of every run, not only the last.
        variables, stop, tolerance, intervals, inputs, hold
            As for :meth:`simulate`.
        threads
            Number of threads [default: one for each core].
        result
            Folder of the results, in which the same call goes on after an interrupt [default: a temporary one].
        progress
            True for a bar, or a function that gets the numbers of runs done and of all runs.
        on
            What shares the runs out to other machines: ``"hq"``, ``"slurm"``, ``"dask=ADDRESS"`` or a client of Dask. They have to see the folder ``result``, and need nothing else.
        shards
            Number of shares [default: one for each thousand runs, at most 1000].
        resume
            Go on with what was shared out before into the same folder.
        settle
            Seconds that a file may take to become visible on a file system that machines share [default: 30].
        parameters, **values
            Values of parameters that do not vary.

        Returns
        -------
        Sweep

        Examples
        --------
        >>> swept = model.sweep({"p0": hyd.grid(8e6, 20e6, 5)}, measure=["max(y)"], stop=0.02)
        >>> bool(swept["max(y)"][0] < swept["max(y)"][-1])
        True
        """
        options = dict(
            samples=samples,
            method=method,
            seed=seed,
            rows=rows,
            variables=variables,
            stop=stop,
            tolerance=tolerance,
            intervals=intervals,
            threads=threads,
        )
        vary = self._named("vary", vary, values)
        own = self._set("sweep", parameters, values)
        return sweep(self._model, own, vary, options, measure, self._inputs(inputs, hold), result, progress, (on, shards, resume, settle))

    def linearize(
        self,
        parameters: Optional[Mapping[str, Any]] = None,
        /,
        *,
        at: float,
        inputs: Sequence[str] = (),
        outputs: Sequence[str] = (),
        tolerance: Optional[float] = None,
        **values: Any,
    ) -> LinearModel:
        """Give the linear model at a point of a run.

        Parameters
        ----------
        at
            Time of the point in s: the run goes there from its start.
        inputs
            Parameters that are inputs of the linear model [default: the inputs of the model].
        outputs
            Variables that are its outputs [default: the outputs of the model].
        tolerance
            Relative tolerance of the run.
        parameters, **values
            Values of parameters.

        Returns
        -------
        LinearModel

        Examples
        --------
        >>> linear = model.linearize(at=0.01, inputs=["p0"], outputs=["y"])
        >>> linear.A.shape == (len(linear.states), len(linear.states))
        True
        """
        own = self._set("linearize", parameters, values)
        wanted = (real("at", at), names("inputs", inputs), names("outputs", outputs), checked({"tolerance": tolerance})["tolerance"])
        return LinearModel(self._model.linearize(own, *wanted))

    def function(
        self,
        outputs: Union[str, Sequence[str], None] = None,
        parameters: Union[str, Sequence[str], None] = None,
        fixed: Optional[Mapping[str, Any]] = None,
        /,
        *,
        at: Optional[Sequence[float]] = None,
        start: Optional[float] = None,
        stop: Optional[float] = None,
        tolerance: Optional[float] = None,
        solver: str = "auto",
        **values: Any,
    ) -> Function:
        """Give the model as a function of some of its parameters, with exact derivatives.

        Parameters
        ----------
        outputs
            Full names of the variables that are its results.
        parameters
            Full names of the parameters that are its arguments.
        at
            Times of the results in s, ascending [default: the stop time alone].
        start, stop, tolerance, solver
            As for :meth:`simulate`; the last of ``at`` ends the runs.
        fixed, **values
            Values of other parameters.

        Returns
        -------
        Function

        Examples
        --------
        >>> lift = model.function(["y"], ["p0", "C"], at=[0.005, 0.01, 0.02])
        >>> values, jacobian = lift.value_and_jacobian([10e6, 1e-3])
        >>> values.shape, jacobian.shape
        ((3,), (3, 2))
        """
        lists = {
            "outputs": names("outputs", self._named("outputs", outputs, values)),
            "parameters": names("parameters", self._named("parameters", parameters, values)),
        }
        for word, own in lists.items():
            if not own:
                raise UsageError(f"{word}: no name is given")
        fixed = values.pop("fixed") if fixed is None and "fixed" in values and not self._model.is_parameter("fixed") else fixed
        wanted = dict(
            **lists,
            at=None if at is None else [real("at", time) for time in np.atleast_1d(at)],
            **checked(dict(start=start, stop=stop, tolerance=tolerance, solver=solver)),
        )
        if wanted["at"] == []:
            raise UsageError("at: no time is given")
        given = self._set("function", fixed, values)
        both = [name for name, _ in given if name in lists["parameters"]]
        if both:
            raise UsageError(f"`{both[0]}` is an argument of the function and set; a parameter is one or the other")
        return made(self, given, wanted)

    def equations(self, stage: str = "flat") -> str:
        """The text of a stage of the translation: ``flat``, ``system``, ``reduced``, ``sorted``, ``jacobian`` or ``c``."""
        return self._model.equations(stage)

    def explain(self, variable: str) -> str:
        """What a variable equals, what it is solved from, in which block, and where that stands in the text."""
        return self._model.explain(variable)

    def _named(self, word: str, value: Any, values: dict) -> Any:
        """What stands before the keywords, or was given by its name."""
        if word in values and not self._model.is_parameter(word):
            if value is not None:
                raise UsageError(f"{word}: is given twice")
            return values.pop(word)
        if value is None:
            raise UsageError(f"{word}: is missing")
        return value

    def _set(self, method: str, parameters: Optional[Mapping[str, Any]], values: Mapping[str, Any]) -> list:
        """Parameters to set, with their values as text; a name that is none of the model's is refused here."""
        values = dict(values)
        if parameters is None and isinstance(values.get("parameters"), Mapping) and not self._model.is_parameter("parameters"):
            parameters = values.pop("parameters")
        if parameters is not None and not isinstance(parameters, Mapping):
            raise UsageError(f"parameters: {parameters!r} is not a mapping of names to values")
        twice = [name for name in values if name in (parameters or {})]
        if twice:
            raise UsageError(f"`{twice[0]}` is set twice")
        both = {**(parameters or {}), **values}
        for name in values:
            if not self._model.is_parameter(name):
                raise self._unknown(method, name)
        return _assignments(both)

    def _unknown(self, method: str, name: str) -> UsageError:
        """What is said of a keyword that is neither an option of the method nor a parameter."""
        methods = (Model.simulate, Model.sweep, Model.linearize, Model.function)
        if any(name in _keyword_names(own) for own in methods):
            return UsageError(f"{method} has no option `{name}`")
        own = _keyword_names(getattr(Model, method)) + (list(self._RUN) if method == "sensitivity" else [])
        hint = _hyd.did_you_mean(name, [*own, *self._model.settable()])
        return UsageError(f"the model has no parameter `{name}`" + (f"; {hint}" if hint else ""))

    def _inputs(self, inputs: Any, hold: Union[str, Sequence[str]]) -> Tuple[Any, List[str]]:
        """Recorded inputs as the extension takes them."""
        holds = names("hold", hold)
        if inputs is None:
            return None, holds
        if isinstance(inputs, (str, os.PathLike)):
            return os.fspath(inputs), holds
        return samples(inputs, self.inputs), holds

    def __repr__(self) -> str:
        return f"<hyd.Model {self.name} of {self.file}>"

    def _repr_html_(self) -> str:
        settable = [own for own in self.parameters.values() if own.settable != "no"]
        rows = []
        for own in settable[:_MOST_ROWS]:
            limits = "" if own.min is None and own.max is None else f"{_shown(own.min)} to {_shown(own.max)}"
            cells = (own.name, _shown(own.value), own.unit, limits, own.description)
            rows.append("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>")
        more = len(settable) - len(rows)
        end = f"<p>and {more} more parameters</p>" if more > 0 else ""
        head = "".join(f"<th>{word}</th>" for word in ("parameter", "value", "unit", "limits", "description"))
        title = html.escape(f"{self.name}: {self.description}" if self.description else self.name)
        return (
            f'<div class="hyd-model"><p><b>{title}</b></p><table><thead><tr>{head}</tr></thead>'
            f"<tbody>{''.join(rows)}</tbody></table>{end}</div>"
        )

    def __reduce__(self):
        return (_restored, (self._model.state(),))


def _restored(state: str) -> Model:
    return _loaded(_hyd.Model.of_state(state))


def _value(own: Mapping[str, Any]) -> Any:
    """A value in the type of its parameter."""
    value = own["value"]
    if value is None or value != value:
        return float("nan")
    if own["kind"] == "Boolean":
        return bool(value)
    if own["kind"] == "Integer":
        return int(value)
    if own["kind"] == "enumeration" and 1 <= value <= len(own["literals"]):
        return own["literals"][int(value) - 1]
    return value


def _shown(value: Any) -> str:
    if value is None:
        return "..."
    return f"{value:.6g}" if isinstance(value, float) else str(value)
