"""Calls of gRPC, with bytes in and out, errors as exceptions, and an end when the caller wants one."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import re
import uuid
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

import grpc

from . import _api
from ._channel import Credentials
from ._retry import Attempt, CancelToken, Retrier, now
from .errors import (
    CredentialsError,
    DamagedAnswerError,
    DeadlineError,
    Error,
    UnavailableError,
    WrongStateError,
    from_status,
)

T = TypeVar("T")


@dataclasses.dataclass(frozen=True)
class CallOptions:
    """The options that every call takes besides its arguments."""

    timeout: float | None = None  # seconds for all attempts together
    cancel: CancelToken | None = None
    request_id: str = ""

    def id_or_new(self) -> str:
        """One for a call that changes something, so that a call repeated after a lost connection is done once."""
        return self.request_id or uuid.uuid4().hex


@dataclasses.dataclass(frozen=True)
class Link:
    """The way to a server."""

    channel: grpc.Channel
    credentials: Credentials
    is_gone: Callable[[float], bool]  # whether the server will never answer again, as is known within so many seconds
    address: str = ""  # of one that another server has named
    asked: str = ""  # the address of one that the caller has named

    @property
    def place(self) -> str:
        """The address, for messages."""
        return self.address or self.asked or "the server"


# A connection that broke off may be the first sign of the end of a server of this process; its exit code is the next.
_SECONDS_TO_KNOW = 1.0


class Calls:
    """Makes calls to a server. Thread-safe."""

    def __init__(
        self,
        link: Link,
        retrier: Retrier,
        renew: Callable[[Link], Link] | None = None,
        link_to: Callable[[str], Link] | None = None,
        session: str = "",
    ) -> None:
        """`renew` gets another server in the place of that of a link which is gone.

        `link_to` is the way to a server that another one has named as the owner of a session; None: it is not gone.
        `session` is the id of the session that all calls are about, if they are about one.
        """
        self._first = self._link = link
        self._renew = renew
        self._link_to = link_to
        self._session = session
        self._retrier = retrier
        self._end = ""  # what is said of calls after `close`

    @property
    def are_closed(self) -> bool:
        """Whether `close` was called."""
        return bool(self._end)

    def close(self, message: str) -> None:
        """Has further calls raise WrongStateError with this message."""
        self._end = message

    def of_session(self, name: str) -> Calls:
        """The same for calls on a session, which go to the server that has it, and end with that of this process."""
        return Calls(self._link, self._retrier, None, self._link_to, session_id(name))

    def run(self, options: CallOptions, make: Callable[[Attempt], T]) -> T:
        """Runs attempts until one succeeds.

        Where the server is gone, and another can be had, that one is asked, unless the work has begun: once, as it may
        be the call that ends servers.
        """
        if self._end:
            raise WrongStateError(self._end)
        deadline = math.inf if options.timeout is None else now() + options.timeout
        link = self._link
        if link.is_gone(0.0):
            if self._renew is None:
                raise UnavailableError("the server that this process started has ended, and its sessions with it")
            self._link = self._renew(link)
        has_renewed = False

        def make_unless_gone(attempt: Attempt) -> T:
            nonlocal has_renewed
            used = self._link
            try:
                return self._make_where_it_is(make, attempt)
            except UnavailableError:
                if attempt.is_final or not used.is_gone(_SECONDS_TO_KNOW):
                    raise
                attempt.is_final = self._renew is None or has_renewed
                if self._renew is not None and not has_renewed:
                    has_renewed = True
                    self._link = self._renew(used)
                raise

        try:
            return self._retrier.run(deadline, options.cancel or CancelToken(), make_unless_gone)
        except DeadlineError as error:
            if options.timeout is None or error.reason:
                raise
            message = f"the call to {self._link.place} took longer than its timeout of {options.timeout:g} s"
            raise error.with_message(message) from None

    def _make_where_it_is(self, make: Callable[[Attempt], T], attempt: Attempt) -> T:
        """One attempt; where it says that another server has the session, or leaves that open, the next goes there."""
        used = self._link
        try:
            return make(attempt)
        except Error as error:
            if self._link_to is None or not self._session:
                raise
            if _leaves_owner_open(error) and self._link is used:
                self._link = self._first
            if error.address:
                try:
                    self._link = self._link_to(error.address)
                except Error as refused:
                    raise attempt.final(refused) from error
                attempt.is_redirected = True
            elif used.address and not error.reason and error.code in ("UNAVAILABLE", "UNAUTHENTICATED"):
                where = f"so it was at {used.address}, where the session is, as another server has said"
                raise error.with_message(f"{error.message}; {where}") from None
            raise

    def unary(self, method: str, request: Any, response: str, options: CallOptions) -> Any:
        """A call with one request and one answer, of the type `response`."""
        answer: Any = self.run(options, lambda attempt: self.attempt_unary(method, request, response, attempt))
        return answer

    def unary_bytes(self, method: str, request: bytes, options: CallOptions) -> bytes:
        """The same with serialized messages."""

        def attempt_once(attempt: Attempt) -> bytes:
            call = self._link.channel.unary_unary(_path(method)).future(request, **self._context(attempt))
            return self._result(call, attempt)

        return self.run(options, attempt_once)

    def attempt_unary(self, method: str, request: Any, response: str, attempt: Attempt) -> Any:
        """One attempt at such a call."""
        unary = self._link.channel.unary_unary(_path(method))
        call = unary.future(request.SerializeToString(), **self._context(attempt))
        return parse(response, self._result(call, attempt))

    def attempt_upload(self, method: str, requests: Iterable[bytes], response: str, attempt: Attempt) -> Any:
        """One attempt at a call with a stream of requests and one answer."""
        call = self._link.channel.stream_unary(_path(method)).future(iter(requests), **self._context(attempt))
        return parse(response, self._result(call, attempt))

    @contextlib.contextmanager
    def stream(self, method: str, requests: bytes | Iterable[bytes], attempt: Attempt) -> Iterator[Iterator[bytes]]:
        """One attempt at a call with a stream of answers, which ends with the block."""
        if isinstance(requests, bytes):
            call = self._link.channel.unary_stream(_path(method))(requests, **self._context(attempt))
        else:
            call = self._link.channel.stream_stream(_path(method))(iter(requests), **self._context(attempt))
        with _cancelled_by(call, attempt):
            yield self._answers(call)
            call.cancel()

    def _answers(self, call: Any) -> Iterator[bytes]:
        try:
            yield from call
        except grpc.RpcError as error:
            raise self._error(error) from None

    def _result(self, call: Any, attempt: Attempt) -> bytes:
        with _cancelled_by(call, attempt):
            try:
                result: bytes = call.result()
                return result
            except grpc.RpcError as error:
                raise self._error(error) from None
            except grpc.FutureCancelledError:
                raise from_status("CANCELLED", "the call was cancelled", b"") from None

    def _context(self, attempt: Attempt) -> dict[str, Any]:
        token = self._link.credentials.read_token()
        metadata = [] if token is None else [("authorization", f"Bearer {token}")]
        if self._session:  # by which proxies send all calls on it to one server
            metadata.append(("wellspace-session", self._session))
        return {"timeout": attempt.time_left(), "metadata": metadata}

    def _error(self, error: Any) -> Error:
        code, message = error.code().name, error.details() or ""
        details = b""
        for key, value in error.trailing_metadata() or ():
            if key == "grpc-status-details-bin":
                details = value
        if code == "UNAVAILABLE" and not details and "handshake failed" in message.lower():
            return CredentialsError(f"the server's certificate is not trusted, or it speaks no TLS: {message}")
        if code == "UNKNOWN" and not details and message == "Stream removed":  # a proxy broke off between two messages
            code, message = "UNAVAILABLE", f"the connection broke off: {message}"
        if code == "UNAVAILABLE" and not details:
            message = _in_plain_words(message, self._link.place)
        return from_status(code, message, details)


def _in_plain_words(message: str, place: str) -> str:
    """What gRPC says of a server that it cannot reach, for those who do not know gRPC; its own words come last."""
    if "connection refused" in message.lower():
        return f"no server listens at {place}: the connection was refused; is wellspaced running there, on this port?"
    if "DNS resolution failed" in message:
        return f"the host of {place} was not found: {message}"
    if "failed to connect" in message:
        return f"cannot connect to {place}: {message.rpartition('last error: ')[2]}"
    return message


def session_id(name: str) -> str:
    """The part of a session's name behind "sessions/"; empty for what is no such name."""
    matched = re.fullmatch(r"sessions/([A-Za-z0-9._-]{1,128})", name)
    return matched[1] if matched else ""


def _leaves_owner_open(error: Error) -> bool:
    """Whether `error` leaves open if its server still has the session."""
    is_late = error.code == "DEADLINE_EXCEEDED" and not error.reason
    return error.code == "UNAVAILABLE" or is_late or error.reason == "SESSION_NOT_FOUND"


@contextlib.contextmanager
def _cancelled_by(call: Any, attempt: Attempt) -> Iterator[None]:
    """Cancels `call` when the caller wants that, and when the block is left by an exception: Ctrl-C is one."""
    cancel = call.cancel
    attempt.cancel._add(cancel)
    try:
        yield
    except BaseException:
        cancel()
        raise
    finally:
        attempt.cancel._remove(cancel)


def _path(method: str) -> str:
    return method if method.startswith("/") else f"/wellspace.v1.{method}"


def parse(name: str, serialized: bytes) -> Any:
    """The message `name` of its bytes; raises `DamagedAnswerError`."""
    try:
        return _api.message(name).FromString(serialized)
    except Exception as error:  # of protobuf, which has several
        raise DamagedAnswerError("the server's answer is damaged: no message") from error


def next_page(token: str, following: str) -> str:
    """The token of the page after that of `token`; raises `DamagedAnswerError` for the same, which would never end."""
    if following == token:
        raise DamagedAnswerError("the server's answer is damaged: after a page comes the same page again")
    return following
