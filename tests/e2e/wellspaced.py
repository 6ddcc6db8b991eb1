"""For tests in Python: a wellspaced process on a free port, and the stubs of its API, made of the protos alone."""
import atexit
import functools
import importlib
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import types

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"])
# Seconds after which something hangs, also on a busy machine.
PATIENCE = 960 if os.environ.get("WELLSPACE_SANITIZE") else 240


class Wellspaced:
    """A wellspaced on a free port of the loopback. Its log goes to `log`, or nowhere."""

    def __init__(self, *arguments, log=subprocess.DEVNULL, environment=None):
        self.process = subprocess.Popen([BIN / "wellspaced", "--listen", "127.0.0.1:0", *map(str, arguments)],
                                        stdout=subprocess.PIPE, stderr=log, text=True,
                                        env={**os.environ, **(environment or {})})
        self.address = self.read_address("listening on ")

    def read_address(self, prefix):
        line = self.process.stdout.readline()
        assert line.startswith(prefix), line
        return line.removeprefix(prefix).strip()

    def is_running(self):
        return self.process.poll() is None

    def stop(self):
        """Asks it to end, and returns its exit code."""
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(timeout=PATIENCE)
        self.process.stdout.close()
        return code

    def kill(self):
        if self.is_running():
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()


@functools.cache
def api():
    """All messages and stubs of wellspace.v1 and google.rpc in one namespace, generated now."""
    folder = tempfile.mkdtemp()
    atexit.register(shutil.rmtree, folder)
    protos = ROOT / "proto"
    files = [path.relative_to(protos) for name in ("wellspace", "google")
             for path in sorted((protos / name).rglob("*.proto"))]
    subprocess.run(["protoc", "--proto_path", protos, "--python_out", folder, "--grpc_python_out", folder,
                    "--plugin", "protoc-gen-grpc_python=" + shutil.which("grpc_python_plugin"), *files], check=True)
    sys.path.insert(0, folder)
    names = {}
    for file in files:
        module = ".".join(file.with_suffix("").parts)
        for suffix in ("_pb2", "_pb2_grpc"):
            names |= vars(importlib.import_module(module + suffix))
    return types.SimpleNamespace(**{name: value for name, value in names.items() if not name.startswith("_")})


def crc32c(data):
    """The checksum of chunks, bit by bit as RFC 3720 has it, by a table of bytes."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc = crc_table()[(crc ^ byte) & 0xFF] ^ (crc >> 8)
    return crc ^ 0xFFFFFFFF


@functools.cache
def crc_table():
    table = []
    for value in range(256):
        for _ in range(8):
            value = (value >> 1) ^ (0x82F63B78 if value & 1 else 0)
        table.append(value)
    return table


def details(error):
    """The details of an RpcError, google.rpc.Status.details: {message name: message}."""
    trailers = dict(error.trailing_metadata())
    status = api().Status.FromString(trailers.get("grpc-status-details-bin", b""))
    found = {}
    for packed in status.details:
        message = getattr(api(), packed.TypeName().rpartition(".")[2])()
        assert packed.Unpack(message)
        found[packed.TypeName()] = message
    return found
