"""The errors of the package, as exceptions.

Every exception of the package is an `Error`. Its class says what kind of failure it is, as the status codes of gRPC
do; `Error.reason` says which one.
"""

from __future__ import annotations

import re
from typing import Any

from . import _api

# The names of the fields of the service's messages among the arguments of this package.
_ARGUMENTS = {
    "dimension": "dimension",
    "rho": "rho",
    "domain": "box",
    "margin": "margin",
    "max_vertices": "max_vertices",
    "threads": "threads",
    "criterion": "criterion",
    "max_circumradius": "size",
    "size_boxes": "size_boxes",
    "edge_length": "edge_length",
    "gradation": "gradation",
    "min_dihedral": "min_dihedral",
    "pump_weights": "pump_weights",
    "merge_distance": "merge_distance",
    "periodic_axes": "periodic",
    "keep_vertices": "keep_vertices",
}


class Error(Exception):
    """A call that has failed.

    Attributes
    ----------
    message : str
        The description of the error, in English.
    reason : str
        The service's name for it, such as ``"INVALID_POINTS"``; see `ErrorReason` of the API. Empty where the service
        gives none: errors that this package finds, lost connections, deadlines.
    field : str
        The path of the field to blame, such as ``"parameters.rho"`` in the request, or ``"points[17]"`` for a row of
        an argument. Empty if nothing is.
    argument : str
        The argument of this package that `field` stands for, such as ``"size"``; empty if none does.
    retry_after : float or None
        Seconds after which the same call may succeed. None: trying again does not help, or nothing is known.
    address : str
        Of an error SESSION_ELSEWHERE: ``"HOST:PORT"`` of the server that has the session, as the one that was asked
        has named it. Empty: it is not known, or another error.
    code : str
        The status code of gRPC, such as ``"INVALID_ARGUMENT"``.
    """

    code = "UNKNOWN"

    def __init__(
        self,
        message: str,
        *,
        reason: str = "",
        field: str = "",
        retry_after: float | None = None,
        address: str = "",
        code: str = "",
    ) -> None:
        super().__init__(message)
        self.message = message
        self.reason = reason
        self.field = field
        self.retry_after = retry_after
        self.address = address
        if code:
            self.code = code

    @property
    def argument(self) -> str:
        name = self.field.removeprefix("parameters.").split("[")[0].split(".")[0]
        return _ARGUMENTS.get(name, "") if self.field.startswith("parameters.") else name

    def __str__(self) -> str:
        argument = self.argument if self.field.startswith("parameters.") else ""
        return f"{self.message} (argument {argument})" if argument else self.message

    def with_message(self, message: str) -> Error:
        """The same error with another message."""
        return _rebuild(type(self), message, self._details())

    def _details(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("reason", "field", "retry_after", "address", "code")}

    def __reduce__(self) -> Any:
        return _rebuild, (type(self), self.message, self._details())


def _rebuild(kind: type[Error], message: str, details: dict[str, Any]) -> Error:
    return kind(message, **details)


class InvalidArgumentError(Error, ValueError):
    """An argument, a point or a segment that is not valid."""

    code = "INVALID_ARGUMENT"


class NotFoundError(Error, LookupError):
    """No such session or operation, or one of another tenant."""

    code = "NOT_FOUND"


class OutOfRangeError(Error, IndexError):
    """A vertex or an offset that is not there."""

    code = "OUT_OF_RANGE"


class WrongStateError(Error):
    """The session is in another state than the call needs: busy, without a mesh, with a fixed domain."""

    code = "FAILED_PRECONDITION"


class ConflictError(Error):
    """The session is at another revision than the one expected."""

    code = "ABORTED"


class LimitError(Error):
    """A limit was reached: vertices, points, memory, jobs, sessions."""

    code = "RESOURCE_EXHAUSTED"


class UnavailableError(Error, ConnectionError):
    """The server cannot be reached, or stops."""

    code = "UNAVAILABLE"


class DeadlineError(Error, TimeoutError):
    """`timeout` has passed, or one side of a stream has stalled."""

    code = "DEADLINE_EXCEEDED"


class CancelledError(Error):
    """The call, or the operation, was cancelled."""

    code = "CANCELLED"


class CredentialsError(Error, PermissionError):
    """The server wants other credentials, or its certificate is not trusted."""

    code = "UNAUTHENTICATED"


class DamagedAnswerError(Error):
    """The server's answer contradicts itself: a checksum that is wrong, a vertex that is not there."""

    code = "DATA_LOSS"


class ServerNotInstalledError(Error, FileNotFoundError):
    """No server was named, and there is none on this machine to be started."""

    code = "NOT_FOUND"


class MissingPackageError(Error, ImportError):
    """An optional package is not installed."""

    code = "UNIMPLEMENTED"


_KINDS: dict[str, type[Error]] = {
    kind.code: kind
    for kind in (
        InvalidArgumentError,
        NotFoundError,
        OutOfRangeError,
        WrongStateError,
        ConflictError,
        LimitError,
        UnavailableError,
        DeadlineError,
        CancelledError,
        CredentialsError,
        DamagedAnswerError,
    )
}

_CODES = (
    "OK CANCELLED UNKNOWN INVALID_ARGUMENT DEADLINE_EXCEEDED NOT_FOUND ALREADY_EXISTS PERMISSION_DENIED "
    "RESOURCE_EXHAUSTED FAILED_PRECONDITION ABORTED OUT_OF_RANGE UNIMPLEMENTED INTERNAL UNAVAILABLE DATA_LOSS "
    "UNAUTHENTICATED"
).split()


# The characters that a terminal may obey: control characters of ASCII and of Latin-1; and halves of pairs, which cannot
# be encoded.
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\ud800-\udfff]")


def printable(text: str) -> str:
    """`text` of a server, without characters that a terminal may obey: \\x1b stands for an escape character."""
    return _CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


def from_status(code: str, message: str, details: bytes) -> Error:
    """The exception for a status of gRPC. `details` is a serialized google.rpc.Status, or empty."""
    found = _read_details(details)
    if not found.get("reason") and message.startswith("READER_STALLED"):
        found["reason"] = "READER_STALLED"
    kind = _KINDS.get(code, CredentialsError if code == "PERMISSION_DENIED" else Error)
    return kind(printable(message), code=code, **found)


def from_message(status: Any) -> Error:
    """The exception for a google.rpc.Status, which operations have."""
    code = _CODES[status.code] if 0 < status.code < len(_CODES) else "UNKNOWN"
    return from_status(code, status.message, status.SerializeToString())


def _read_details(serialized: bytes) -> dict[str, Any]:
    """The arguments of an Error that a serialized google.rpc.Status has."""
    found: dict[str, Any] = {}
    try:
        details = _api.message("google.rpc.Status").FromString(serialized).details
        for detail in details:
            name = detail.type_url.rpartition("/")[2]
            if name == "google.rpc.ErrorInfo":
                info = _api.message(name).FromString(detail.value)
                found["reason"] = info.reason.removeprefix("ERROR_REASON_")
                if found["reason"] == "SESSION_ELSEWHERE" and "address" in info.metadata:
                    found["address"] = info.metadata["address"]
            elif name == "google.rpc.BadRequest":
                violations = _api.message(name).FromString(detail.value).field_violations
                found["field"] = violations[0].field if violations else ""
            elif name == "google.rpc.RetryInfo":
                delay = _api.message(name).FromString(detail.value).retry_delay
                found["retry_after"] = max(0.0, delay.seconds + delay.nanos * 1e-9)
    except Exception:  # of protobuf, which has several: other bytes say nothing
        pass
    return found
