"""For the tests of the Python package: clouds, errors that are expected, and a server that breaks connections."""

import contextlib
import os
import pathlib
import subprocess
import sys
import unittest
from concurrent import futures

import grpc
import numpy as np

import wellspace

ROOT = pathlib.Path(os.environ["WELLSPACE_ROOT"])
TOOL = pathlib.Path(os.environ["WELLSPACE_SERVER_BINARY"]).with_name("wellspace")
# Seconds after which something hangs, also on a busy machine.
PATIENCE = 400 if os.environ.get("WELLSPACE_SANITIZE") else 100


def uniform(count, dimension, seed=1):
    """Points in the unit box, away from its faces."""
    return np.random.default_rng(seed).uniform(0.05, 0.95, (count, dimension))


def unit_box(dimension):
    return [0] * dimension, [1] * dimension


def spot():
    return np.loadtxt(ROOT / "examples" / "spot.csv", delimiter=",", skiprows=1)


def volume(mesh):
    """Of all simplices, times d!; negative ones would be found by `least_volume`."""
    return volumes(mesh).sum()


def volumes(mesh):
    corners = mesh.points[mesh.simplices]
    return np.linalg.det(corners[:, 1:] - corners[:, :1])


def run_python(code, *arguments, **options):
    """Runs a program in another interpreter; returns it as it has ended."""
    command = [sys.executable, "-B", "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False, **options)


class Case(unittest.TestCase):
    """Tests with the server of this process."""

    @contextlib.contextmanager
    def fails(self, kind, message="", **attributes):
        """The block raises `kind`, with `message` in its text, and with these attributes."""
        with self.assertRaises(kind) as caught:
            yield caught
        self.assertIn(message, str(caught.exception))
        for name, value in attributes.items():
            self.assertEqual(getattr(caught.exception, name), value, name)


class Break(Exception):
    """Ends a call of the Breaker with this status."""

    def __init__(self, code=grpc.StatusCode.UNAVAILABLE, message="broken by the test", details=b""):
        super().__init__(message)
        self.status = code, message, details


class Breaker(grpc.GenericRpcHandler):
    """A server that hands all calls on to another one, and breaks those that a test wants broken.

    `on_request` and `on_answer` get the name of the method, the number of the call of this method, the number of the
    message in it, and the message; they return it, perhaps changed, or raise Break.
    """

    def __init__(self, server):
        client = wellspace.Client(server)
        self._channel, self._metadata = client._channel, client._calls._context(_NoDeadline())["metadata"]
        self.on_request = self.on_answer = lambda method, call, message, data: data
        self.calls = []  # the names of methods
        self.metadata = []  # of each call, a dict
        self._server = grpc.server(futures.ThreadPoolExecutor(16), handlers=[self])
        self.address = f"127.0.0.1:{self._server.add_insecure_port('127.0.0.1:0')}"
        self._server.start()

    def close(self):
        self._server.stop(None).wait()

    def count(self, method):
        return self.calls.count(method)

    def service(self, details):
        method = details.method.rpartition("/")[2]

        def handle(requests, context):
            number = self.count(method)
            self.calls.append(method)
            self.metadata.append(dict(details.invocation_metadata))
            broken = []

            def sent():
                try:
                    for message, request in enumerate(requests):
                        yield self.on_request(method, number, message, request)
                except Break as error:
                    broken.append(error)
                    raise

            call = self._channel.stream_stream(details.method)(sent(), metadata=self._metadata)
            context.add_callback(call.cancel)
            try:
                for message, answer in enumerate(call):
                    yield self.on_answer(method, number, message, answer)
            except grpc.RpcError as error:
                if broken:
                    self._abort(context, *broken[0].status)
                trailers = dict(error.trailing_metadata() or ())
                self._abort(context, error.code(), error.details(), trailers.get("grpc-status-details-bin", b""))
            except Break as error:
                call.cancel()
                self._abort(context, *error.status)

        return grpc.stream_stream_rpc_method_handler(handle)

    @staticmethod
    def _abort(context, code, message, details):
        if details:
            context.set_trailing_metadata([("grpc-status-details-bin", details)])
        context.abort(code, message)


class _NoDeadline:
    @staticmethod
    def time_left():
        return None


class BreakerCase(Case):
    """Tests with a server of their own, behind a Breaker, and a client that does not wait before it tries again."""

    @classmethod
    def setUpClass(cls):
        cls.server = wellspace.LocalServer()

    @classmethod
    def tearDownClass(cls):
        cls.server.close()

    def setUp(self):
        self.breaker = Breaker(self.server)
        self.addCleanup(self.breaker.close)
        retry = wellspace.RetryPolicy(initial_backoff=0.001, max_backoff=0.01)
        self.client = wellspace.Client(self.breaker.address, retry=retry)
        self.addCleanup(self.client.close)
