"""A model held against a bench: fits, and the search for what is missing."""

from __future__ import annotations

import json
import os
import tempfile
from typing import Any, Iterable, List, Optional, Sequence, Union

from . import _hyd
from .model import Model, load
from .progress import Bar

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
    folders = [os.fspath(library)] if isinstance(library, (str, os.PathLike)) else [os.fspath(own) for own in library]
    return Study(_hyd.Study(os.fspath(file), os.fspath(bench), folders, allow_outside, threads), folders, allow_outside)


class Study:
    """A study and a set of shots; made by :func:`study`."""

    def __init__(self, own: _hyd.Study, folders: List[str], allow_outside: bool):
        self._study = own
        self._folders = folders
        self._allow_outside = allow_outside

    def fit(self, *, profile: Sequence[str] = (), seed: int = 1, write_parameters: Optional[_Path] = None) -> "Fit":
        """Fit what may be off to the shots.

        Parameters
        ----------
        profile
            Names of what may be off whose 95 % interval is wanted, from its profile likelihood.
        seed
            Seed of random starts.
        write_parameters
            A file for the parameters as fitted, with the conditions of the first fitted shot.

        Returns
        -------
        Fit
        """
        path = None if write_parameters is None else os.fspath(write_parameters)
        return Fit(*self._study.fit(list(profile), seed, path))

    def discover(
        self,
        *,
        report: Optional[_Path] = None,
        resume: bool = False,
        calibrate: Optional[int] = None,
        seed: int = 1,
        progress: Any = False,
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

        Returns
        -------
        Finding
        """
        keeper = None
        if report is None:
            keeper = tempfile.TemporaryDirectory(prefix="hyd-report-")
            folder = keeper.name
        else:
            folder = os.fspath(report)
        bar = Bar.of(progress, "")
        try:
            text, found, model = self._study.discover(
                folder, resume, calibrate, seed, None if bar is None else bar.say
            )
        finally:
            if bar is not None:
                bar.close()
        libraries = (self._folders, self._allow_outside)
        return Finding(text, json.loads(found), folder, model, libraries, keeper)


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
    """

    def __init__(self, text: str, found: str, parameters: str, converged: bool):
        self.text = text
        self.report: dict = json.loads(found)
        self.parameters = parameters
        self.converged = converged

    def __repr__(self) -> str:
        return f"<hyd.Fit of {self.report['set']}: misfit {self.report['misfit']:.3f}>"


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

    def __init__(self, text: str, report: dict, folder: str, model: Optional[Any], libraries: tuple, keeper: Any):
        self.text = text
        self.report = report
        self.folder = folder
        self._file = model
        self._libraries = libraries
        self._keeper = keeper
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
