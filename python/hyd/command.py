"""Verbs of the command that have no function of their own."""

from __future__ import annotations

import os
import subprocess
import sys

from .errors import Error, ModelError, RunError, UsageError, _warn

#: Nothing of the folder in which the process stands is taken for a module.
_MAIN = "import sys; sys.path[:0] = [sys.argv.pop(1)]; from hyd.__main__ import main; sys.exit(main())"

_KINDS = {1: ModelError, 2: UsageError, 3: RunError}


def command(*arguments: str | os.PathLike[str], check: bool = True) -> str:
    """Run ``hyd VERB ...`` in a process of its own and give what it prints.

    Parameters
    ----------
    *arguments
        What stands on the command line, each argument by itself.
    check
        Raise where the command does not end with exit code 0.

    Returns
    -------
    str
        Its standard output.

    Raises
    ------
    ModelError, UsageError, RunError
        For exit codes 1, 2 and 3; the message is what the command says on standard error. What it says there and ends well is a :class:`HydWarning`.

    Examples
    --------
    >>> print(hyd.command("explain", "E0402").splitlines()[0])  # doctest: +ELLIPSIS
    E0402...
    """
    parent = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    line = [sys.executable, "-c", _MAIN, parent, *(os.fspath(own) for own in arguments)]
    done = subprocess.run(line, capture_output=True, text=True, encoding="utf-8")
    if check and done.returncode != 0:
        kind = _KINDS.get(done.returncode, Error)
        raise kind(done.stderr.strip() or done.stdout.strip() or f"exit code {done.returncode}")
    said = done.stderr.strip()
    if said and done.returncode == 0:
        severity = "warning" if "warning" in said else "note"
        _warn([{"severity": severity, "message": said, "excerpt": said, "notes": [], "file": "", "code": None}], done.stdout)
    return done.stdout
