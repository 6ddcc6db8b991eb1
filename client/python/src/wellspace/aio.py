"""The package for asyncio: the same calls, to be awaited.

Each call runs in a thread of its own, since a mesh is decoded by numpy, for which an event loop would have to wait.
A task that is cancelled cancels its call, and waits until it has ended. Progress is told in the event loop.

>>> mesh = await wellspace.aio.mesh(points, size=0.2)
>>> async with await wellspace.aio.Session.create(3) as session:
...     await session.upload(points)
...     await session.refine()
...     mesh = await session.download()
"""

from __future__ import annotations

import asyncio
import functools
import inspect
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, TypeVar

import wellspace

from . import _client, _mesh, _operations, _session_info, _sessions
from ._cells import Cells
from ._domain import DomainArguments
from ._located import Located
from ._parameters import Parameters, takes
from ._plane import PlaneArguments
from ._progress import Progress, ProgressOption
from ._retry import CancelToken
from ._sizes import SizeArguments
from ._surface import TriangleArguments
from .statistics import Estimate, ServerInfo

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    from typing_extensions import Unpack

T = TypeVar("T")

_THREADS = 64  # calls at a time; further ones wait


@functools.cache
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(_THREADS, "wellspace")


async def _run(call: Callable[..., T], /, *positional: Any, **options: Any) -> T:
    """Awaits `call`, which takes `cancel` and perhaps `progress`."""
    loop = asyncio.get_running_loop()
    token = CancelToken()
    given = options.get("cancel")
    if given is not None:
        given._add(token.cancel)
    options["cancel"] = token
    progress = options.get("progress")
    if callable(progress):
        tell: Callable[[Progress], object] = progress
        options["progress"] = lambda event: loop.call_soon_threadsafe(tell, event)
    work = loop.run_in_executor(_threads(), functools.partial(call, *positional, **options))
    try:
        return await asyncio.shield(work)
    except asyncio.CancelledError:
        token.cancel()
        await asyncio.wait([work])
        if not work.cancelled():
            work.exception()  # has been seen
        raise
    finally:
        if given is not None:
            given._remove(token.cancel)


@takes(DomainArguments, PlaneArguments, TriangleArguments, SizeArguments, Parameters)
async def mesh(
    points: Any,
    *,
    server: _client.Server = None,
    boundary: bool = True,
    progress: ProgressOption = None,
    timeout: float | None = None,
    cancel: CancelToken | None = None,
    **arguments: Unpack[_client.MeshArguments],
) -> _mesh.Mesh:
    """As `wellspace.mesh`."""
    return await _run(
        wellspace.mesh,
        points,
        server=server,
        boundary=boundary,
        progress=progress,
        timeout=timeout,
        cancel=cancel,
        **arguments,
    )


@takes(DomainArguments, PlaneArguments, TriangleArguments, SizeArguments, Parameters)
async def estimate(
    points: Any,
    *,
    server: _client.Server = None,
    timeout: float | None = None,
    cancel: CancelToken | None = None,
    **arguments: Unpack[_client.MeshArguments],
) -> Estimate:
    """As `wellspace.estimate`."""
    return await _run(wellspace.estimate, points, server=server, timeout=timeout, cancel=cancel, **arguments)


async def info(*, server: _client.Server = None, timeout: float | None = None) -> ServerInfo:
    """As `wellspace.Client.info`."""
    def call(cancel: CancelToken) -> ServerInfo:
        return _client.client_of(server).info(timeout=timeout)

    return await _run(call)


class Session:
    """A `wellspace.Session` whose calls are awaited. Made by `create` or `attach`.

    The methods are those of `wellspace.Session`, with the same arguments.
    """

    def __init__(self, session: _sessions.Session) -> None:
        self._session = session

    @classmethod
    async def create(cls, dimension: int, **options: Any) -> Session:
        """Creates a session; arguments are those of `wellspace.Session`."""
        return cls(await _run(_sessions.Session, dimension, **options))

    @classmethod
    async def attach(
        cls, name: str, *, server: _client.Server = None, timeout: float | None = None
    ) -> Session:
        """The session called `name`, which is there already."""
        def call(cancel: CancelToken) -> _sessions.Session:
            return _sessions.Session.attach(name, server=server, timeout=timeout)

        return cls(await _run(call))

    @property
    def name(self) -> str:
        """``"sessions/…"``"""
        return self._session.name

    @property
    def dimension(self) -> int:
        """Of the space."""
        return self._session.dimension

    async def __aenter__(self) -> Session:
        return self

    def __repr__(self) -> str:
        return repr(self._session).replace("wellspace.", "wellspace.aio.", 1)

    async def __aexit__(self, *exception: Any) -> None:
        def call(cancel: CancelToken) -> None:
            self._session.__exit__(*exception)

        await _run(call)

    async def info(self, **options: Any) -> _session_info.SessionInfo:
        return await _run(self._session.info, **options)

    async def update(self, **options: Any) -> _session_info.SessionInfo:
        return await _run(self._session.update, **options)

    async def delete(self, **options: Any) -> None:
        await _run(self._session.delete, **options)

    def close(self) -> None:
        self._session.close()

    async def upload(self, points: Any, **options: Any) -> int:
        return await _run(self._session.upload, points, **options)

    async def add_segments(self, **options: Any) -> None:
        await _run(self._session.add_segments, **options)

    async def add_triangles(self, **options: Any) -> None:
        await _run(self._session.add_triangles, **options)

    async def locate(self, points: Any, **options: Any) -> Located:
        return await _run(self._session.locate, points, **options)

    async def transfer(self, values: Any, from_mesh: _mesh.Mesh | int, **options: Any) -> npt.NDArray[np.float64]:
        return await _run(self._session.transfer, values, from_mesh, **options)

    async def sizes(self, values: Any, points: Any = None, **options: Any) -> int:
        return await _run(self._session.sizes, values, points, **options)

    async def refine(self, **options: Any) -> _operations.Operation:
        return await _run(self._session.refine, **options)

    async def start_refinement(self, **options: Any) -> _operations.Operation:
        return await _run(self._session.start_refinement, **options)

    async def watch(self, operation: str | None = None, **options: Any) -> _operations.Operation:
        return await _run(self._session.watch, operation, **options)

    async def cancel_operation(
        self, operation: str | None = None, *, timeout: float | None = None
    ) -> _operations.Operation:
        def call(cancel: CancelToken) -> _operations.Operation:
            return self._session.cancel_operation(operation, timeout=timeout)

        return await _run(call)

    async def operations(self, *, timeout: float | None = None) -> list[_operations.Operation]:
        def call(cancel: CancelToken) -> list[_operations.Operation]:
            return self._session.operations(timeout=timeout)

        return await _run(call)

    async def download(self, **options: Any) -> _mesh.Mesh:
        return await _run(self._session.download, **options)

    async def add(self, points: Any, **options: Any) -> npt.NDArray[Any]:
        return await _run(self._session.add, points, **options)

    async def remove(self, points: Any, **options: Any) -> int:
        return await _run(self._session.remove, points, **options)

    async def nearest(self, vertices: Any = None, **options: Any) -> npt.NDArray[np.float64]:
        return await _run(self._session.nearest, vertices, **options)

    async def cells(self, vertices: Any = None, **options: Any) -> Cells:
        return await _run(self._session.cells, vertices, **options)


def _document() -> None:
    """Methods have the docstrings, and the signatures, of those that they await."""
    for name, function in vars(Session).items():
        model = getattr(_sessions.Session, name, None)
        if inspect.isfunction(function) and model is not None and not name.startswith("_") and not function.__doc__:
            function.__doc__ = model.__doc__
            function.__signature__ = inspect.signature(model)  # type: ignore[attr-defined]
    create: Any = vars(Session)["create"].__func__
    create.__signature__ = inspect.signature(_sessions.Session.__init__)


_document()

__all__ = ["Session", "estimate", "info", "mesh"]
