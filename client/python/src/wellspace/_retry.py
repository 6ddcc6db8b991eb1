"""Calls that are made again, as client/retry_policy.h and client/grpc/retry.h have it for C++."""

from __future__ import annotations

import dataclasses
import math
import random
import threading
import time
from collections.abc import Callable
from typing import TypeVar

from .errors import CancelledError, Error

T = TypeVar("T")

# Servers that send a client to and fro do not agree yet which of them has the session.
_MOST_REDIRECTS = 4


@dataclasses.dataclass(frozen=True)
class RetryPolicy:
    """The retry policy of a client.

    An attempt that brought something (a chunk, an event, committed points) is not counted: those after it begin anew.

    Attributes
    ----------
    max_attempts : int
        Attempts in a row that may fail, with a server that has answered before; at least 1. The default takes longer
        than the 15 s after which another server takes over what one had that died.
    max_first_attempts : int
        The same with a server that has never answered: its address may be wrong.
    initial_backoff, multiplier, max_backoff : float
        Seconds before the second attempt, how much longer before each further one, and the most seconds. A random half
        is left out. A delay that the server asks for (`Error.retry_after`) is waited for in full.
    """

    max_attempts: int = 9
    max_first_attempts: int = 3
    initial_backoff: float = 0.2
    multiplier: float = 2.0
    max_backoff: float = 10.0

    def delay(
        self, error: Error, *, failures: int, is_server_known: bool, time_left: float, jitter: float
    ) -> float | None:
        """Seconds before the next attempt; None: there is to be none. `jitter` is in [0.5, 1]."""
        if failures >= (self.max_attempts if is_server_known else self.max_first_attempts):
            return None
        backoff = min(self.initial_backoff * self.multiplier ** (failures - 1), self.max_backoff) * jitter
        wait = max(backoff, error.retry_after or 0.0)
        return None if wait >= time_left else wait


def is_worth_repeating(error: Error) -> bool:
    """Whether the same call may succeed later."""
    return error.code == "UNAVAILABLE" or error.retry_after is not None or error.reason == "READER_STALLED"


class CancelToken:
    """Ends calls, from any thread: they raise `CancelledError`.

    One token may be given to several calls; once cancelled it stays so.
    """

    def __init__(self) -> None:
        self._event = threading.Event()
        self._lock = threading.Lock()
        self._callbacks: list[Callable[[], object]] = []

    @property
    def is_cancelled(self) -> bool:
        """Whether `cancel` was called."""
        return self._event.is_set()

    def __repr__(self) -> str:
        return f"<wellspace.CancelToken: {'cancelled' if self.is_cancelled else 'not cancelled'}>"

    def cancel(self) -> None:
        """Ends the calls that were given this token, and those that will be."""
        with self._lock:
            self._event.set()
            callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            callback()

    def _wait(self, seconds: float) -> bool:
        return self._event.wait(min(seconds, threading.TIMEOUT_MAX))

    def _add(self, callback: Callable[[], object]) -> None:
        with self._lock:
            if not self._event.is_set():
                self._callbacks.append(callback)
                return
        callback()

    def _remove(self, callback: Callable[[], object]) -> None:
        with self._lock:
            if callback in self._callbacks:
                self._callbacks.remove(callback)


class Attempt:
    """One attempt at a call, and its state for the Retrier."""

    def __init__(self, deadline: float, cancel: CancelToken) -> None:
        self._deadline = deadline
        self.cancel = cancel
        self.progressed = False  # the server has answered with something that the call keeps
        self.is_final = False  # the outcome is the call's, whatever it is
        self.is_redirected = False  # the next attempt is made at another server, at once
        self.is_worth_repeating = False  # another attempt may help, though the error does not say so

    def time_left(self) -> float | None:
        """Seconds until the deadline of the call; None: it has none."""
        return None if math.isinf(self._deadline) else max(0.0, self._deadline - now())

    def final(self, error: Error) -> Error:
        """`error` is the call's."""
        self.is_final = True
        return error


def now() -> float:
    """Seconds on a clock that does not jump when that on the wall is set, and goes on while the machine sleeps."""
    return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic()


def cancelled_by_caller() -> CancelledError:
    """The error of a call whose token was cancelled."""
    return CancelledError("cancelled by the caller")


class Retrier:
    """Makes calls until they succeed, or another attempt makes no sense. Thread-safe."""

    def __init__(self, policy: RetryPolicy) -> None:
        self._policy = policy
        self._is_server_known = False

    def run(self, deadline: float, cancel: CancelToken, make: Callable[[Attempt], T]) -> T:
        """Calls `make` until it returns; raises the last error. `deadline` is one of `now`'s, or infinite.

        An attempt that was redirected is no failure, but of more than four in a row.
        """
        failures = 0
        redirects = 0  # in a row
        while True:
            if cancel.is_cancelled:
                raise cancelled_by_caller()
            attempt = Attempt(deadline, cancel)
            try:
                result = make(attempt)
                self._is_server_known = True
                return result
            except Error as error:
                failures = 0 if attempt.progressed else failures
                wait = self._wait_after(error, attempt, failures + 1)
                if attempt.is_redirected and not attempt.is_final and redirects < _MOST_REDIRECTS:
                    redirects += 1
                    continue
                if wait is None:
                    raise
            redirects = 0
            failures += 1
            if cancel._wait(wait):
                raise cancelled_by_caller()

    def _wait_after(self, error: Error, attempt: Attempt, failures: int) -> float | None:
        if attempt.progressed or error.code != "UNAVAILABLE" or error.reason:
            self._is_server_known = True
        if attempt.is_final:
            return None
        if error.code == "CANCELLED" and attempt.cancel.is_cancelled:
            raise cancelled_by_caller() from None
        if not (attempt.is_worth_repeating or is_worth_repeating(error)):
            return None
        left = attempt.time_left()
        return self._policy.delay(
            error,
            failures=failures,
            is_server_known=self._is_server_known,
            time_left=math.inf if left is None else left,
            jitter=random.uniform(0.5, 1),
        )
