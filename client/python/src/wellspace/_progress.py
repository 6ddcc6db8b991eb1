"""The progress of a call, told to a function or shown as a bar."""

from __future__ import annotations

import contextlib
import dataclasses
import html
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any, Union

from . import _api

_STEPS = 1000  # of a bar


@dataclasses.dataclass(frozen=True)
class Progress:
    """The progress of meshing.

    Attributes
    ----------
    phase : str
        ``"waiting"``, ``"tree"``, ``"refinement"``, ``"simplices"``, ``"slivers"``, ``"done"``.
    vertices, simplices : int
        So far.
    estimated_vertices : int
        Of the finished mesh; 0 while unknown.
    fraction : float
        Of the whole work, in [0, 1]; never lower than before.
    """

    phase: str
    vertices: int
    estimated_vertices: int
    simplices: int
    fraction: float
    sequence: int = 0


OnProgress = Callable[[Progress], object]
# None or False: nothing; True: a bar; else a function.
ProgressOption = Union[OnProgress, bool, None]


def progress_of(message: Any) -> Progress:
    """Of a ProgressEvent."""
    return Progress(
        phase=_api.enum_names("Phase").get(message.phase, "unknown"),
        vertices=message.vertices,
        estimated_vertices=message.estimated_vertices,
        simplices=message.simplices,
        fraction=min(message.fraction, 1.0) if message.fraction > 0 else 0.0,  # also for NaN
        sequence=message.sequence,
    )


@contextlib.contextmanager
def told(option: ProgressOption) -> Iterator[OnProgress]:
    """The function that is told of progress within the block."""
    if callable(option):
        yield option
    elif option:
        bar = _make_bar()
        try:
            yield bar.update
        finally:
            bar.close()
    else:
        yield lambda progress: None


def _make_bar() -> _NotebookBar | _TqdmBar | _TextBar:
    display = _notebook_display()
    if display is not None:
        return _NotebookBar(display)
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return _TextBar()
    return _TqdmBar(tqdm(total=_STEPS, bar_format="{l_bar}{bar}| [{elapsed}<{remaining}]{postfix}"))


class _TqdmBar:
    def __init__(self, bar: Any) -> None:
        self._bar = bar

    def update(self, progress: Progress) -> None:
        self._bar.set_description(progress.phase, refresh=False)
        self._bar.set_postfix_str(f"{progress.vertices} vertices", refresh=False)
        self._bar.update(round(progress.fraction * _STEPS) - self._bar.n)
        self._bar.refresh()

    def close(self) -> None:
        self._bar.close()


class _TextBar:
    """Without tqdm: a line on standard error, written over and over."""

    def __init__(self) -> None:
        self._width = 0

    def update(self, progress: Progress) -> None:
        line = f"{progress.phase}: {progress.fraction:4.0%}, {progress.vertices} vertices"
        print("\r" + line.ljust(self._width), end="", file=sys.stderr, flush=True)
        self._width = len(line)

    def close(self) -> None:
        if self._width:
            print(file=sys.stderr)


def _notebook_display() -> Callable[..., Any] | None:
    """IPython's `display` where this code runs in the kernel of a notebook; an unloaded module is not imported."""
    if "IPython" not in sys.modules:
        return None
    try:
        from IPython import get_ipython
        from IPython.display import display
    except ImportError:
        return None
    shell = get_ipython()
    found: Callable[..., Any] = display
    return found if getattr(shell, "kernel", None) is not None else None


class _NotebookBar:
    """A bar below the cell, by IPython's protocol of display alone: Jupyter, VS Code and Colab show it."""

    def __init__(self, display: Callable[..., Any]) -> None:
        self._display = display
        self._handle: Any = None
        self._first: tuple[float, float] | None = None  # fraction and time of the first work
        self._html = ""

    def update(self, progress: Progress) -> None:
        left = self._time_left(progress.fraction, time.monotonic())
        text = f"{progress.phase}: {progress.fraction:.0%}, {progress.vertices:,} vertices"
        text += "" if left is None else f", {left:.0f} s left"
        self._show(
            f'<progress max="1" value="{progress.fraction:.4f}" style="width:20em;vertical-align:middle"></progress> '
            f"{html.escape(text)}"
        )

    def close(self) -> None:
        """Leaves the last line there, without a bar."""
        if self._handle is not None:
            self._show(self._html.rpartition("</progress> ")[2])

    def _repr_html_(self) -> str:
        return self._html

    def __repr__(self) -> str:
        return "progress"

    def _show(self, text: str) -> None:
        self._html = text
        if self._handle is None:
            self._handle = self._display(self, display_id=True)
        else:
            self._handle.update(self)

    def _time_left(self, fraction: float, now: float) -> float | None:
        """Seconds, at the mean speed since the first work; nothing before two seconds and two percent of it."""
        if not 0 < fraction < 1:
            return None
        if self._first is None:
            self._first = fraction, now
        done, taken = fraction - self._first[0], now - self._first[1]
        return None if done < 0.02 or taken < 2 else taken * (1 - fraction) / done
