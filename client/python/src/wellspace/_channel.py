"""The channel to a server: its address, and the client's credentials."""

from __future__ import annotations

import dataclasses
import ipaddress
import os
import pathlib
import re

import grpc

from .errors import InvalidArgumentError, NotFoundError, WrongStateError

_MAX_RESPONSE_BYTES = 4 << 20  # above the largest message of a server
_OPTIONS = [
    ("grpc.max_receive_message_length", _MAX_RESPONSE_BYTES),
    # A server whose machine has vanished is noticed by pings.
    ("grpc.keepalive_time_ms", 20_000),
    ("grpc.keepalive_timeout_ms", 10_000),
    # The delay of the first attempt after a lost connection, and the largest delay of a later one.
    ("grpc.initial_reconnect_backoff_ms", 200),
    ("grpc.max_reconnect_backoff_ms", 5_000),
]


@dataclasses.dataclass(frozen=True)
class Credentials:
    """Credentials that a client shows a server, and those that it wants to be shown.

    Attributes
    ----------
    tls : bool
        Reach the server by TLS; also where one of the next three is given. Otherwise plain text.
    tls_ca : path
        PEM file: authorities of the server's certificate. None: those that gRPC trusts.
    tls_certificate, tls_key : path
        PEM files: this client's certificate, and its key.
    token : str
        For the metadata ``authorization: Bearer TOKEN``.
    token_file : path
        A file that has the token instead; it is read anew for each call.
    insecure_remote : bool
        Let the token go to other machines in plain text.
    """

    tls: bool = False
    tls_ca: str | os.PathLike[str] | None = None
    tls_certificate: str | os.PathLike[str] | None = None
    tls_key: str | os.PathLike[str] | None = None
    token: str | None = dataclasses.field(default=None, repr=False)
    token_file: str | os.PathLike[str] | None = None
    insecure_remote: bool = False

    @property
    def uses_tls(self) -> bool:
        """Whether the channel is encrypted."""
        return self.tls or any((self.tls_ca, self.tls_certificate, self.tls_key))

    def read_token(self) -> str | None:
        """The token of a call. Raises `InvalidArgumentError` or `NotFoundError`."""
        if self.token is not None and self.token_file is not None:
            raise InvalidArgumentError("both a token and a file with a token; expected one of them", field="token")
        if self.token is None and self.token_file is None:
            return None
        token = self.token if self.token is not None else _read(self.token_file, "token_file").decode(errors="replace")
        token = token.strip()
        if not re.fullmatch(r"[!-~]+", token):
            name = "the token" if self.token_file is None else str(self.token_file)
            raise InvalidArgumentError(f"{name}: expected one token of visible characters of ASCII", field="token")
        return token


def _read(path: str | os.PathLike[str] | None, field: str) -> bytes:
    try:
        return pathlib.Path(path or "").read_bytes()
    except OSError as error:
        raise NotFoundError(f"cannot read {path}: {error.strerror}", field=field) from error


def _read_pem(path: str | os.PathLike[str] | None, field: str) -> bytes | None:
    if path is None:
        return None
    content = _read(path, field)
    if b"-----BEGIN " not in content:
        raise InvalidArgumentError(f"{path}: expected PEM, which begins with -----BEGIN", field=field)
    return content


def host_of(address: str) -> str:
    """The host of HOST:PORT, without the brackets of IPv6."""
    if "://" in address:
        rest = address.split("://", 1)[1].split("/")[0]
        raise InvalidArgumentError(
            f"{address!r} is no address of a server, but a URL; expected HOST:PORT, such as {rest!r}, and tls=True "
            "for TLS",
            field="server",
        )
    matched = re.fullmatch(r"(\[[^\]/]+\]|[^/]+):([0-9]{1,5})", address)
    if matched is None or not 0 < int(matched[2]) < 65536:
        raise InvalidArgumentError(
            f"{address!r} is no address of a server; expected HOST:PORT with a port from 1 to 65535", field="server"
        )
    return matched[1].strip("[]")


def host_of_named(address: str) -> str:
    """The same of an address that a server has named: a name of DNS or a number, IPv6 in brackets, and a port."""
    host = host_of(address)
    try:
        if address.startswith("["):
            if "]:" not in address or ipaddress.IPv6Address(host).scope_id is not None:
                raise ValueError
        elif not _is_name_or_number(host) or len(host) > 253:
            raise ValueError
    except ValueError:
        raise InvalidArgumentError(
            "expected HOST:PORT, with the name of a host, its IPv4 address, or its IPv6 address in brackets"
        ) from None
    return host


def _is_name_or_number(host: str) -> bool:
    return re.fullmatch(r"[A-Za-z0-9._-]+", host) is not None


def _target_of(address: str) -> str:
    """HOST:PORT as gRPC takes it for that and nothing else: unix:7233 would be a file."""
    return f"dns:///{address}" if _is_name_or_number(address.rpartition(":")[0]) else address


def is_loopback(host: str) -> bool:
    """Whether `host` is this machine's loopback by its name or number alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def open_channel(address: str, credentials: Credentials) -> grpc.Channel:
    """A channel to HOST:PORT. It connects with the first call."""
    host = host_of(address)
    options = list(_OPTIONS)
    if is_loopback(host):  # a proxy's loopback is not this machine's
        options.append(("grpc.enable_http_proxy", 0))
    has_token = credentials.read_token() is not None
    if credentials.uses_tls:
        if (credentials.tls_certificate is None) != (credentials.tls_key is None):
            raise InvalidArgumentError("a client certificate wants its key, and a key its certificate", field="tls_key")
        tls = grpc.ssl_channel_credentials(
            _read_pem(credentials.tls_ca, "tls_ca"),
            _read_pem(credentials.tls_key, "tls_key"),
            _read_pem(credentials.tls_certificate, "tls_certificate"),
        )
        return grpc.secure_channel(_target_of(address), tls, options)
    if has_token and not credentials.insecure_remote and not is_loopback(host):
        raise WrongStateError(
            f"would send the token to {address} in plain text; use TLS, or allow it with insecure_remote=True"
        )
    return grpc.insecure_channel(_target_of(address), options)
