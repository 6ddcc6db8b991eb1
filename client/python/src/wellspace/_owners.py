"""The servers that others have named as owners of sessions."""

from __future__ import annotations

import threading

from ._calls import Link
from ._channel import Credentials, host_of, host_of_named, is_loopback, open_channel
from .errors import DamagedAnswerError, Error, InvalidArgumentError, WrongStateError, printable

# Beyond these all are forgotten, whatever addresses a server names; sessions keep the one that they are at.
_MOST = 64
_LONGEST_SHOWN = 300


class Owners:
    """The ways to them, with the credentials of a client; one for each address. Thread-safe."""

    def __init__(self, first: str, credentials: Credentials) -> None:
        """`first` is the address of the server that the client was made for."""
        self._is_local = is_loopback(host_of(first))
        self._credentials = credentials
        self._lock = threading.Lock()
        self._links: dict[str, Link] = {}

    def link_to(self, address: str) -> Link:
        """The way to the server at `address`, which another server has named.

        Raises `DamagedAnswerError` for what is no HOST:PORT, `WrongStateError` for one that must not be asked.
        """
        try:
            host = host_of_named(address)
        except InvalidArgumentError:
            raise DamagedAnswerError(
                f"the server says that the session is at '{printable(address[:_LONGEST_SHOWN])}'; expected the "
                "HOST:PORT of a server, as its --advertise has it"
            ) from None
        with self._lock:
            if address not in self._links:
                link = self._open(address, host)
                if len(self._links) >= _MOST:
                    self._links.clear()
                self._links[address] = link
            return self._links[address]

    def _open(self, address: str, host: str) -> Link:
        try:
            if is_loopback(host) and not self._is_local:
                raise WrongStateError(
                    "that is the loopback, which is another one on this machine; its --advertise wants an address by "
                    "which clients reach it"
                )
            return Link(open_channel(address, self._credentials), self._credentials, lambda within: False, address)
        except Error as error:
            raise error.with_message(f"the session is at another server, {address}: {error.message}") from None

    def close(self) -> None:
        """Closes the connections."""
        with self._lock:
            for link in self._links.values():
                link.channel.close()
            self._links.clear()
