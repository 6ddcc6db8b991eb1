"""How far a call is, told to a function or shown as a bar."""

from __future__ import annotations

import contextlib
import dataclasses
import sys
from collections.abc import Callable, Iterator
from typing import Any, Union

from . import _api

_STEPS = 1000  # of a bar


@dataclasses.dataclass(frozen=True)
class Progress:
    """How far meshing is.

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


def _make_bar() -> _TqdmBar | _TextBar:
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
