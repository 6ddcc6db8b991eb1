"""Operations: the long work on a session."""

from __future__ import annotations

import dataclasses
from typing import Any

from . import _api
from ._calls import Calls, CallOptions, parse
from ._progress import OnProgress, Progress, progress_of
from ._receiver import damaged
from ._retry import Attempt
from .errors import Error, from_message


@dataclasses.dataclass(frozen=True)
class Operation:
    """A refinement of a session.

    Attributes
    ----------
    name : str
        ``"sessions/…/operations/…"``
    state : str
        ``"queued"``, ``"running"``, ``"succeeded"``, ``"failed"`` or ``"cancelled"``.
    progress : Progress
        The last that was told.
    error : Error or None
        Of one that has failed or was cancelled.
    mesh_revision : int
        Of one that has succeeded: the revision of its mesh.
    restart : bool
        It makes the mesh anew, see `Session.refine`.
    """

    name: str
    state: str
    progress: Progress
    error: Error | None
    mesh_revision: int
    restart: bool = False


def operation_of(message: Any) -> Operation:
    """Of an Operation of the API."""
    state = _api.enum_names("Operation.State").get(message.state, "unknown")
    return Operation(
        name=message.name,
        state=state,
        progress=progress_of(message.progress),
        error=from_message(message.error) if state in ("failed", "cancelled") else None,
        mesh_revision=message.mesh_revision,
        restart=message.restart,
    )


def watch(calls: Calls, name: str, on_progress: OnProgress, options: CallOptions) -> Operation:
    """Waits for the end of an operation; a watch that broke off goes on after the last event."""
    request = _api.message("WatchOperationRequest")(name=name)

    def attempt_once(attempt: Attempt) -> Operation:
        with calls.stream("OperationService/WatchOperation", request.SerializeToString(), attempt) as answers:
            for serialized in answers:
                attempt.progressed = True
                answer = parse("WatchOperationResponse", serialized)
                if answer.HasField("operation"):
                    return operation_of(answer.operation)
                if answer.HasField("progress"):
                    request.after_sequence = answer.progress.sequence
                    on_progress(progress_of(answer.progress))
        raise attempt.final(damaged("the watch ended without the operation's end"))

    return calls.run(options, attempt_once)
