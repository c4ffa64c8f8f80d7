"""Exceptions and warnings.

Every exception of hyd is an :class:`Error` with the message as the command words it, and with the place in the text where there is one; Ctrl-C is
:class:`Interrupted`, a ``KeyboardInterrupt``.
"""

from __future__ import annotations

import os
import sys
import warnings
from types import FrameType
from typing import Any, Optional


class _Said(BaseException):
    """A message with its place.

    Attributes
    ----------
    message : str
        One sentence.
    code : str or None
        Error code such as ``"E0201"``, explained by ``hyd explain``.
    file, line, column : str, int, int or None
        The place in the text; lines and columns count from 1.
    excerpt : str
        The messages as the command prints them, with the marked lines of the text.
    messages : list of dict
        All messages: ``severity``, ``code``, ``message``, ``notes``, ``file``, ``line``, ``column``, ``excerpt``.
    run : Run or None
        For a run that failed or was stopped: what it computed up to there.
    """

    def __init__(self, message: str = "", messages: Optional[list] = None, run: Any = None):
        self.messages: list = list(messages or [])
        first = next((own for own in self.messages if own["severity"] == "error"), None)
        if not message and first is not None:
            message = first["message"]
        self.message: str = message
        place = first or {}
        self.code: Optional[str] = place.get("code")
        self.file: Optional[str] = place.get("file")
        self.line: Optional[int] = place.get("line")
        self.column: Optional[int] = place.get("column")
        self.run = run
        super().__init__(message)

    @property
    def excerpt(self) -> str:
        """The messages as the command prints them."""
        if not self.messages:
            return f"error: {self.message}\n"
        return "".join(own["excerpt"] or f"{own['severity']}: {own['message']}\n" for own in self.messages)

    def __str__(self) -> str:
        return self.excerpt.strip() if self.messages else self.message

    def __reduce__(self):
        return (type(self), (self.message, self.messages, self.run))


class Error(_Said, Exception):
    __doc__ = "What hyd has to say against a call." + (_Said.__doc__ or "").partition("place.")[2]


class ModelError(Error):
    """The model or the data is at fault; the command ends with exit code 1."""


class UsageError(Error, ValueError):
    """A call that makes no sense; the command ends with exit code 2."""


class RunError(Error):
    """The solver gave up; the command ends with exit code 3."""


class Interrupted(_Said, KeyboardInterrupt):
    """Ctrl-C stopped the work; ``run`` has what a run computed up to there. Attributes as for :class:`Error`."""


class HydWarning(UserWarning):
    """Something that is probably not meant."""


class HydNote(HydWarning):
    """Something worth knowing; not shown unless a filter asks for it."""


# Notes are for those who ask: the filter stands behind all others.
warnings.filterwarnings("ignore", category=HydNote, append=True)

_KINDS = {"model": ModelError, "usage": UsageError, "run": RunError, "interrupted": Interrupted}
_HERE = os.path.dirname(os.path.abspath(__file__))


def _exception(kind: str, sentence: Optional[str], messages: list, run: Any) -> BaseException:
    """The exception of a failure, called by the extension."""
    if run is not None:
        from .run import Run

        run = Run(run)
    if sentence is None and not any(own["severity"] == "error" for own in messages):
        sentence = "interrupted" if kind == "interrupted" else "the work was given up"
    # What was said before a sentence is not its place.
    if sentence is not None:
        messages = [own for own in messages if own["severity"] == "error"]
    return _KINDS[kind](sentence or "", messages, run)


def _warn(messages: list) -> None:
    """Python warnings of messages, called by the extension; they point at the first line outside of this package."""
    level = 1
    frame: Optional[FrameType] = sys._getframe(0)
    while frame is not None and os.path.dirname(os.path.abspath(frame.f_code.co_filename)) == _HERE:
        level, frame = level + 1, frame.f_back
    for own in messages:
        category = HydNote if own["severity"] == "note" else HydWarning
        warnings.warn((own["excerpt"] or own["message"]).strip(), category, stacklevel=max(level, 1))
