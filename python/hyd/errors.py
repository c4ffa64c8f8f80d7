"""Exceptions and warnings.

Every exception of hyd is an :class:`Error` with the message as the command words it, and with the place in the text where there is one; Ctrl-C is
:class:`Interrupted`, a ``KeyboardInterrupt``.
"""

from __future__ import annotations

import os
import re
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
        first = next((own for own in self.messages if own["severity"] == "error" and message in ("", own["message"])), None)
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
    """Something that is probably not meant.

    Attributes
    ----------
    result : object
        What the work has made nevertheless, such as a :class:`Run`; where a filter makes an exception of the warning it is not lost.
    """

    result: Any = None


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
    messages = [_as_keywords(own) for own in messages]
    sentence = sentence and _keywords(sentence)
    if sentence is None and not any(own["severity"] == "error" for own in messages):
        sentence = "interrupted" if kind == "interrupted" else "the work was given up"
    # The sentence stands behind what was said before it, which is not its place.
    if sentence is not None and messages:
        severity = "note" if kind == "interrupted" else "error"
        messages.append(dict.fromkeys(("code", "file", "line", "column", "excerpt"), None))
        messages[-1].update(severity=severity, message=sentence, notes=[])
    return _KINDS[kind](sentence or "", messages, run)


#: Options of the command that are keywords here, where their names differ.
_OTHER_WORDS = {"input": "inputs", "report": "report"}
_OPTION = re.compile(r"(?<![\w-])--([a-z]+(?:-[a-z]+)*)(?: ([^\s`]+)(?=`))?")


def _keywords(sentence: str) -> str:
    """A sentence with the options of the command as the keywords that they are here."""

    def keyword(found: "re.Match[str]") -> str:
        word = found[1].replace("-", "_")
        word = _OTHER_WORDS.get(word, word)
        return f"{word}={found[2]}" if found[2] else word

    return _OPTION.sub(keyword, sentence)


def _as_keywords(message: dict) -> dict:
    """A message that has no place in a text, in the words of Python."""
    if message["file"] is not None:
        return message
    said = dict(message, message=_keywords(message["message"]), notes=[_keywords(own) for own in message["notes"]])
    if message["excerpt"]:
        said["excerpt"] = _keywords(message["excerpt"])
    return said


def _warn(messages: list, result: Any = None) -> None:
    """Python warnings of messages; they point at the first line outside of this package.

    Where a filter makes exceptions of warnings, all are given before the first is raised, and it has what the work has made as ``result``.
    """
    if not messages:
        return
    raised: Optional[HydWarning] = None
    level = 1
    frame: Optional[FrameType] = sys._getframe(0)
    while frame is not None and os.path.dirname(os.path.abspath(frame.f_code.co_filename)) == _HERE:
        level, frame = level + 1, frame.f_back
    for own in map(_as_keywords, messages):
        category = HydNote if own["severity"] == "note" else HydWarning
        warning = category((own["excerpt"] or own["message"]).strip())
        warning.result = result
        try:
            warnings.warn(warning, stacklevel=max(level, 1))
        except HydNote:
            pass  # A note is no reason to lose work.
        except HydWarning as error:
            raised = raised or error
    if raised is not None:
        raise raised
