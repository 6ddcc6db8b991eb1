"""A wellspaced of this process's own: started when it is needed, and gone when this process is, however it ends."""

from __future__ import annotations

import atexit
import hashlib
import os
import pathlib
import secrets
import shutil
import subprocess
import tempfile
import threading
from typing import Any

from ._channel import Credentials
from .errors import ServerNotInstalledError, UnavailableError

_BINARY = "wellspaced"
_VARIABLE = "WELLSPACE_SERVER_BINARY"
_TENANT = "python"
_SECONDS_TO_END = 10.0  # more than the supervisor gives the server

# Runs the server until it ends by itself, or standard input does: a pipe, which the kernel closes when Python is gone,
# even if it was killed. A signal at the death of a parent would not do: Linux sends it when the thread ends that has
# started the child. The server's message about an error comes on standard output after it has ended.
_SUPERVISOR = """
directory=$1
shift
exec 3<&0
"$@" </dev/null 3<&- 2>"$directory/log" &
server=$!
{
  read -r _ <&3
  kill -TERM $server
  for _ in 1 2 3 4 5 6 7 8 9 10; do sleep 0.5; done
  kill -KILL $server
} >/dev/null 2>&1 &
watcher=$!
exec 3<&-
wait $server
code=$?
kill $watcher 2>/dev/null
[ $code -eq 0 ] || cat "$directory/log"
rm -rf "$directory"
exit $code
"""


# The programs that a wheel for one platform has; packages of distributions have them on the path.
_OWN_PROGRAMS = pathlib.Path(__file__).with_name("_programs") / "bin"


def own_program(name: str) -> str | None:
    """The path of a program that this package has; none if it has none."""
    return shutil.which(name, path=os.fspath(_OWN_PROGRAMS))


def find_program(name: str, variable: str) -> str | None:
    """The path of a program: that which a variable of the environment names, this package's own, or one on the path.

    The package's own is of its version; another release may be on the path.
    """
    named = os.environ.get(variable)
    return shutil.which(named) if named else own_program(name) or shutil.which(name)


def find_binary() -> str:
    """The program to start: $WELLSPACE_SERVER_BINARY, the one of the wheel, or `wellspaced` on the path."""
    found = find_program(_BINARY, _VARIABLE)
    if found is None:
        named = os.environ.get(_VARIABLE)
        where = f"{_VARIABLE}={named} is no program" if named else f"there is no {_BINARY} on the path"
        raise ServerNotInstalledError(
            f"{where}; install it, name it in the variable {_VARIABLE}, or say with server='HOST:PORT' where one runs"
        )
    return found


class LocalServer:
    """A wellspaced on a free port of the loopback, which takes nothing but calls with a token that this process has.

    `wellspace.mesh` and others start one by themselves where no server is named. This class is for other options.

    Parameters
    ----------
    *options : str
        Of wellspaced, such as ``"--max-memory", "4GB"``.
    binary : path
        The program. Default: ``$WELLSPACE_SERVER_BINARY``, the one of the wheel, or `wellspaced` on the path.

    Attributes
    ----------
    address : str
        ``"HOST:PORT"`` on the loopback.
    credentials : Credentials
        With the token that it takes.

    Examples
    --------
    >>> with LocalServer("--max-threads", "2") as server:
    ...     mesh = wellspace.mesh(points, server=server)
    """

    address: str
    credentials: Credentials

    def __init__(self, *options: str, binary: str | os.PathLike[str] | None = None) -> None:
        program = os.fspath(binary) if binary is not None else find_binary()
        token = secrets.token_urlsafe(32)
        self.credentials = Credentials(token=token)
        self.client: Any = None  # of this server, once there is one
        directory = pathlib.Path(tempfile.mkdtemp(prefix="wellspace-"))  # of mode 0700
        tokens = directory / "tokens"
        tokens.touch(0o600)
        tokens.write_text(f"{_TENANT} sha256:{hashlib.sha256(token.encode()).hexdigest()}\n", encoding="ascii")
        command = [program, "--listen", "127.0.0.1:0", "--token-file", str(tokens), "--log-level", "warning"]
        command += ["--grace", "0", *options]
        # In a session of its own: Ctrl-C in a terminal is for Python.
        self._process = subprocess.Popen(
            ["/bin/sh", "-c", _SUPERVISOR, "wellspace", str(directory), *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,
        )
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line.startswith("listening on "):
            said = (line + self._process.stdout.read()).strip()
            self.close()
            raise UnavailableError(f"{program} did not start: {said or 'it said nothing'}")
        self.address = line.removeprefix("listening on ").strip()
        _servers.add(self)

    @property
    def is_running(self) -> bool:
        """Whether the server has neither been closed nor ended by itself."""
        return self._process.poll() is None

    def has_ended(self, within: float) -> bool:
        """Whether the server ends within so many seconds: its supervisor needs a moment after it."""
        try:
            self._process.wait(within)
        except subprocess.TimeoutExpired:
            return False
        return True

    def close(self) -> None:
        """Ends the server with all that it is doing."""
        _servers.discard(self)
        if self.client is not None:
            self.client.close()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()
        try:
            self._process.wait(_SECONDS_TO_END)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def __enter__(self) -> LocalServer:
        return self

    def __exit__(self, *exception: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<wellspace.LocalServer at {self.address}: {'running' if self.is_running else 'ended'}>"

    def _forget(self) -> None:
        """In a forked child: the server is the parent's, and must not outlive it on the child's account."""
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                os.close(pipe.fileno())


_servers: set[LocalServer] = set()
_shared: LocalServer | None = None
_lock = threading.Lock()


def shared_server() -> LocalServer:
    """The one server of this process, started the first time, and again if it has ended."""
    global _shared
    with _lock:
        if _shared is None or not _shared.is_running:
            if _shared is not None:
                _shared.client = None  # calls that are under way find out by themselves, and it goes on with the next
                _shared.close()
            _shared = LocalServer()
        return _shared


def is_shared(server: LocalServer) -> bool:
    """Whether it is the one of `shared_server`, in the place of which there is another once it has ended."""
    return server is _shared


def _end_all() -> None:
    for server in list(_servers):
        server.close()


def _forget_all() -> None:
    global _shared, _lock
    _lock = threading.Lock()
    _shared = None
    for server in list(_servers):
        server._forget()
    _servers.clear()


atexit.register(_end_all)
os.register_at_fork(after_in_child=_forget_all)
