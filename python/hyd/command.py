"""Verbs of the command that have no function of their own."""

from __future__ import annotations

import os
import subprocess
import sys

from .errors import Error, ModelError, RunError, UsageError

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
        For exit codes 1, 2 and 3; the message is what the command says on standard error.

    Examples
    --------
    >>> print(hyd.command("explain", "E0402").splitlines()[0])  # doctest: +ELLIPSIS
    E0402...
    """
    line = [sys.executable, "-m", "hyd", *(os.fspath(own) for own in arguments)]
    done = subprocess.run(line, capture_output=True, text=True, encoding="utf-8")
    if check and done.returncode != 0:
        kind = _KINDS.get(done.returncode, Error)
        raise kind(done.stderr.strip() or done.stdout.strip() or f"exit code {done.returncode}")
    return done.stdout
