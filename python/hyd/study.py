"""A model compared with a bench: fits, and the search for what is missing."""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
import weakref
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple, Union

from . import _hyd
from .errors import UsageError, _warn
from .model import Model, load
from .progress import Bar
from .values import checked, engine, names, paths, real

_Path = Union[str, "os.PathLike[str]"]


def study(
    file: _Path,
    bench: _Path,
    *,
    library: Union[_Path, Iterable[_Path]] = (),
    allow_outside: bool = False,
    threads: Optional[int] = None,
) -> "Study":
    """Open a study and a set of shots.

    Parameters
    ----------
    file
        The study: which model, which channel is which variable, what may be off.
    bench
        The set of shots: what the lab knows of its bench, and its tables.
    library
        Folders with libraries, or one library.
    allow_outside
        Lets study and set name files outside of their own folders and those of the libraries.
    threads
        Number of threads [default: all cores].

    Returns
    -------
    Study
    """
    folders = paths("library", library)
    threads = checked({"threads": threads})["threads"]
    # Found again wherever the process goes.
    files = (os.path.abspath(file), os.path.abspath(bench))
    return Study(_hyd.Study(*files, folders, allow_outside, threads), [os.path.abspath(own) for own in folders], allow_outside, files, threads)


class Study:
    """A study and a set of shots; made by :func:`study`."""

    def __init__(self, own: _hyd.Study, folders: List[str], allow_outside: bool, files: Tuple[str, str], threads: Optional[int]):
        self._files, self._threads = files, threads
        self._study = own
        self._folders = folders
        self._allow_outside = allow_outside

    def fit(
        self,
        *,
        profile: Sequence[str] = (),
        seed: int = 1,
        write_parameters: Optional[_Path] = None,
        report: Optional[_Path] = None,
        progress: Any = False,
    ) -> "Fit":
        """Fit what may be off to the shots.

        Parameters
        ----------
        profile
            Names of what may be off whose 95 % interval is wanted, from its profile likelihood.
        seed
            Seed of random starts.
        write_parameters
            A file for the parameters as fitted, with the conditions of the first fitted shot.
        report
            Folder of a report: page, picture, curves, values, parameters [default: none is written].
        progress
            True to be told what is done, or a function that gets seconds and a sentence.

        Returns
        -------
        Fit
        """
        files = tuple(None if own is None else os.path.abspath(own) for own in (write_parameters, report))
        wanted, seed = names("profile", profile), checked({"seed": seed})["seed"]
        bar = Bar.of(progress, "")
        try:
            text, found, parameters, converged, warnings = self._study.fit(wanted, seed, files, None if bar is None else bar.say)
        finally:
            if bar is not None:
                bar.close()
        fit = Fit(text, found, parameters, converged, None if report is None else files[1])
        _warn(warnings, fit)
        return fit

    def discover(
        self,
        *,
        report: Optional[_Path] = None,
        resume: bool = False,
        calibrate: Optional[int] = None,
        seed: int = 1,
        progress: Any = False,
        on: Any = None,
        shards: Optional[int] = None,
        settle: Optional[float] = None,
    ) -> "Finding":
        """Find where model and bench disagree, name what is missing, write the model that has it.

        Parameters
        ----------
        report
            Folder of the report [default: a temporary one, which lives as long as the finding].
        resume
            Go on where an earlier search for the same report was ended.
        calibrate
            First search so many sets made from the fitted model; a name then needs more than 95 of 100 of them show by chance.
        seed
            Seed of random starts.
        progress
            True to be told what is done, or a function that gets seconds and a sentence.
        on
            What shares the search (and the sets of ``calibrate``) out to other machines, as for :meth:`hyd.Model.sweep`. They have to see this interpreter with the
            package, study, set and ``report``, which is needed, at the same places.
        shards
            Processes that search together [default: 4]; the answer does not depend on how many there are.
        settle
            Seconds that a file may take to become visible on a file system that machines share [default: 30].

        Returns
        -------
        Finding
        """
        if on is not None and report is None:
            raise UsageError("on: report= is needed, too, a folder that all machines see")
        given = [name for name, value in (("shards", shards), ("settle", settle)) if value is not None]
        if on is None and given:
            raise UsageError(f"{given[0]}: on= is needed, too")
        options = checked({"calibrate": calibrate, "seed": seed, "shards": shards})
        sharing = (engine(on), options["shards"], None if settle is None else real("settle", settle), sys.executable)
        if report is None:
            folder = tempfile.mkdtemp(prefix="hyd-report-")
        else:
            folder = os.path.abspath(report)
        bar = Bar.of(progress, "")
        try:
            text, found, model, warnings = self._study.discover(
                folder, (bool(resume), options["calibrate"], options["seed"]), sharing, None if bar is None else bar.say
            )
        except BaseException:
            if report is None:
                shutil.rmtree(folder, ignore_errors=True)
            raise
        finally:
            if bar is not None:
                bar.close()
        libraries = (self._folders, self._allow_outside)
        finding = Finding(text, json.loads(found), folder, model, libraries)
        if report is None:
            weakref.finalize(finding, shutil.rmtree, folder, ignore_errors=True)
        _warn(warnings, finding)
        return finding

    def next(
        self,
        vary: Optional[Mapping[str, Tuple[float, float]]] = None,
        *,
        shots: int = 1,
        like: Optional[int] = None,
        report: Optional[_Path] = None,
        seed: int = 1,
        progress: Any = False,
    ) -> "Proposal":
        """Propose the shots that settle what a search leaves open.

        Parameters
        ----------
        vary
            Conditions of the shots that can be set, with their ends [default: what differs among the shots, as far as it does].
        shots
            How many shots to propose.
        like
            Number of the shot that the new ones are like in all that does not vary [default: the longest].
        report
            Folder for ``next.html`` and ``next.json`` [default: none is written].
        seed
            Seed of random starts of the search.
        progress
            True to be told what is done, or a function that gets seconds and a sentence.

        Returns
        -------
        Proposal
        """
        ranges = []
        for name, ends in (vary or {}).items():
            try:
                low, high = ends
            except (TypeError, ValueError):
                raise UsageError(f"vary: `{name}` needs two ends, such as (5e6, 20e6)") from None
            ranges.append(f"{name}={real(name, low)!r}:{real(name, high)!r}")
        options = checked({"shots": shots, "seed": seed, "like": like})
        folder = None if report is None else os.path.abspath(report)
        bar = Bar.of(progress, "")
        try:
            text, found, warnings = self._study.next(
                (ranges, options["shots"], options.get("like")), folder, options["seed"], None if bar is None else bar.say
            )
        finally:
            if bar is not None:
                bar.close()
        proposal = Proposal(text, json.loads(found))
        _warn(warnings, proposal)
        return proposal

    def __repr__(self) -> str:
        file, bench = map(os.path.basename, self._files)
        return f"<hyd.Study of {file} and {bench}>"

    def __reduce__(self):
        return (_restored, (*self._files, self._folders, self._allow_outside, self._threads))


def _restored(file: str, bench: str, folders: List[str], allow_outside: bool, threads: Optional[int]) -> Study:
    return study(file, bench, library=folders, allow_outside=allow_outside, threads=threads)


class Fit:
    """What a fit has found.

    Attributes
    ----------
    text : str
        What ``hyd fit`` prints.
    report : dict
        What ``hyd fit --json`` prints: misfit, gaps, unknowns with their errors, attempts, profiles.
    parameters : str
        The parameters as fitted, as the text of a file of parameters.
    converged : bool
        Whether the values are a minimum.
    folder : str or None
        The folder of the report, where one was asked for.
    """

    def __init__(self, text: str, found: str, parameters: str, converged: bool, folder: Optional[str] = None):
        self.text = text
        self.report: dict = json.loads(found)
        self.parameters = parameters
        self.converged = converged
        self.folder = folder

    def __repr__(self) -> str:
        return f"<hyd.Fit of {self.report['set']}: misfit {self.report['misfit']:.3f}>"


class Proposal:
    """Shots that settle what a search leaves open.

    Attributes
    ----------
    text : str
        What ``hyd next`` prints.
    report : dict
        ``next.json``: what is open, the shots with what is expected of them, and all points that were run.
    """

    def __init__(self, text: str, report: dict):
        self.text = text
        self.report = report

    @property
    def shots(self) -> List[Dict[str, float]]:
        """The conditions of the shots, in their order; none if no shot would settle anything."""
        return [dict(shot["conditions"]) for shot in self.report["shots"]]

    def __repr__(self) -> str:
        return f"<hyd.Proposal: {self.shots if self.shots else self.text.strip()}>"


class Finding:
    """What a search has found.

    Attributes
    ----------
    text : str
        What ``hyd discover`` prints.
    report : dict
        ``report.json``.
    folder : str
        The folder of the report.
    """

    def __init__(self, text: str, report: dict, folder: str, model: Optional[Any], libraries: tuple):
        self.text = text
        self.report = report
        self.folder = folder
        self._file = model
        self._libraries = libraries
        self._model: Optional[Model] = None

    @property
    def status(self) -> str:
        """How the search ended, such as ``"named"``."""
        return self.report["status"]

    @property
    def model(self) -> Optional[Model]:
        """The model that has what was found, with the parameters as fitted under the conditions of the first fitted shot; None if nothing was named."""
        if self._model is None and self._file is not None:
            parameters = os.path.join(self.folder, "parameters.toml")
            folders, allow_outside = self._libraries
            self._model = load(self._file, parameters=parameters, library=folders, allow_outside=allow_outside)
        return self._model

    @property
    def html(self) -> str:
        """The page of the report, which needs no network."""
        with open(os.path.join(self.folder, "report.html"), encoding="utf-8") as file:
            return file.read()

    def __repr__(self) -> str:
        return f"<hyd.Finding: {self.text.splitlines()[0] if self.text else self.status}>"

    def _repr_html_(self) -> str:
        import html

        return f'<iframe class="hyd-finding" width="100%" height="700" style="border:0" srcdoc="{html.escape(self.html)}"></iframe>'
