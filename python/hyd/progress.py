"""Bars of progress: the notebook's own where tqdm is there, a line on a terminal else, nothing in a pipe."""

from __future__ import annotations

import sys
from typing import Any, Callable, Optional

from .errors import UsageError


class Bar:
    """Shows how far work has come."""

    def __init__(self, unit: str):
        self._unit = unit
        self._bar: Any = None
        self._line = False

    @staticmethod
    def of(progress: Any, unit: str) -> Optional["Bar"]:
        """The bar that is asked for: none, one of our own, or a function of the caller's."""
        if progress is None or progress is False:
            return None
        if progress is not True and not callable(progress):
            raise UsageError(f"progress: {progress!r} is neither True nor a function")
        return Bar(unit) if progress is True else _Told(progress)

    def count(self, done: int, all: int) -> None:
        """So many are done of all."""
        if self._bar is None and not self._line:
            try:
                from tqdm.auto import tqdm

                self._bar = tqdm(total=all or None, unit=f" {self._unit}")
            except ImportError:
                self._line = True
        if self._bar is not None:
            self._bar.total = all
            self._bar.n = done
            self._bar.refresh()
        elif sys.stderr.isatty():
            print(f"\r\x1b[K{done} of {all} {self._unit}", end="", file=sys.stderr, flush=True)

    def say(self, seconds: float, text: str) -> None:
        """What is done now."""
        if "ipykernel" in sys.modules:
            from IPython.display import display

            shown = {"text/plain": f"{seconds:6.1f} s  {text}"}
            if self._bar is None:
                self._bar = display(shown, raw=True, display_id=True)
            else:
                self._bar.update(shown, raw=True)
        else:
            print(f"{seconds:6.1f} s  {text}", file=sys.stderr, flush=True)

    def close(self) -> None:
        """The work is over."""
        if hasattr(self._bar, "close"):
            self._bar.close()
        elif self._line and sys.stderr.isatty():
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


class _Told(Bar):
    """Hands everything to a function of the caller's."""

    def __init__(self, function: Callable):
        super().__init__("")
        self._function = function

    def count(self, done: int, all: int) -> None:
        """So many are done of all."""
        self._function(done, all)

    def say(self, seconds: float, text: str) -> None:
        """What is done now."""
        self._function(seconds, text)

    def close(self) -> None:
        """Nothing is to be wiped."""
