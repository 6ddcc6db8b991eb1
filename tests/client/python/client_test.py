"""Clients: addresses, credentials, information about servers, errors and their details, bars."""

import io
import os
import pathlib
import pickle
import sys
import tempfile
import types
import unittest
from unittest import mock

from support import Break, Breaker, Case, grpc, uniform

import wellspace
from wellspace import (
    Credentials,
    CredentialsError,
    Error,
    InvalidArgumentError,
    LimitError,
    NotFoundError,
    UnavailableError,
    WrongStateError,
    _api,
    _calls,
    _progress,
    errors,
)
from wellspace._channel import host_of, is_loopback, open_channel


def status(code, message, *details):
    packed = _api.message("google.rpc.Status")(code=code, message=message)
    for detail in details:
        url = f"type.googleapis.com/{detail.DESCRIPTOR.full_name}"
        packed.details.add(type_url=url, value=detail.SerializeToString())
    return packed


class AddressTest(Case):
    def test_hosts(self):
        for address, host in (("localhost:7233", "localhost"), ("[::1]:1", "::1"), ("a.example:65535", "a.example")):
            self.assertEqual(host_of(address), host)
        for address, message in (("localhost", "expected HOST:PORT"), ("localhost:0", "from 1 to 65535"),
                                 ("localhost:99999", "from 1 to 65535"), (":7233", "expected HOST:PORT"),
                                 ("https://a.example:1/x", "such as 'a.example:1'"), ("a:b", "expected HOST:PORT")):
            with self.subTest(address), self.fails(InvalidArgumentError, message, field="server"):
                host_of(address)
        self.assertEqual([is_loopback(h) for h in ("127.8.0.1", "::1", "Localhost", "10.0.0.1", "a.example")],
                         [True, True, True, False, False])

    def test_servers_that_are_none(self):
        with self.fails(InvalidArgumentError, "server is 7233; expected 'HOST:PORT'", field="server"):
            wellspace.mesh([[0, 0]], server=7233)

    def test_the_environment_names_a_server(self):
        with wellspace.LocalServer() as server:
            named = {"WELLSPACE_SERVER": server.address, "WELLSPACE_TOKEN": server.credentials.token}
            with mock.patch.dict(os.environ, named):
                self.assertEqual(wellspace.Client().address, server.address)
                wellspace.mesh(uniform(10, 2))
            with mock.patch.dict(os.environ, {**named, "WELLSPACE_TOKEN": "wrong"}):
                with self.fails(CredentialsError, "", reason="UNAUTHENTICATED"):
                    wellspace.Client().info()


class CredentialsTest(Case):
    def test_tokens_go_nowhere_in_plain_text(self):
        with self.fails(WrongStateError, "in plain text"):
            open_channel("a.example:7233", Credentials(token="secret"))
        open_channel("a.example:7233", Credentials(token="secret", insecure_remote=True)).close()
        open_channel("a.example:7233", Credentials(token="secret", tls=True)).close()
        open_channel("127.0.0.1:7233", Credentials(token="secret")).close()

    def test_tokens_are_not_shown(self):
        self.assertNotIn("secret", repr(Credentials(token="secret")))

    def test_wrong_credentials(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "file")
            file.write_text("two words\n")
            for given, kind, message in (
                ({"token": "a", "token_file": file}, InvalidArgumentError, "expected one of them"),
                ({"token_file": file}, InvalidArgumentError, "expected one token of visible characters"),
                ({"token_file": file.with_name("none")}, NotFoundError, "cannot read"),
                ({"tls_ca": file}, InvalidArgumentError, "expected PEM"),
                ({"tls_certificate": file}, InvalidArgumentError, "wants its key"),
            ):
                with self.subTest(given), self.fails(kind, message):
                    open_channel("127.0.0.1:7233", Credentials(**given))

    def test_a_token_file_is_read_for_each_call(self):
        with wellspace.LocalServer() as server, tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "token")
            file.write_text("wrong\n")
            with wellspace.Client(server.address, credentials=Credentials(token_file=file)) as client:
                with self.fails(CredentialsError):
                    client.info()
                file.write_text(server.credentials.token + "\n")
                client.info()

    def test_a_server_without_tls(self):
        with wellspace.LocalServer() as server:
            client = wellspace.Client(server.address, credentials=Credentials(tls=True))
            with client, self.fails(Error) as caught:
                client.info(timeout=20)
            self.assertIn(type(caught.exception), (CredentialsError, UnavailableError))


class ServerTest(Case):
    def test_what_a_server_says(self):
        with wellspace.Client() as client:
            info = client.info()
            self.assertEqual(info.dimensions, (2, 3, 4, 5, 6))
            self.assertRegex(info.version, r"^\d+\.\d+\.\d+$")
            self.assertEqual((info.default_ttl, info.stall_limit), (3600, 60))
            self.assertTrue(client.is_serving())

    def test_no_server_listens(self):
        message = "no server listens at 127.0.0.1:1: the connection was refused; is wellspaced running there"
        with self.fails(UnavailableError, message, code="UNAVAILABLE"):
            wellspace.Client("127.0.0.1:1", retry=wellspace.RetryPolicy(initial_backoff=0.01)).info()
        with self.assertRaises(ConnectionError):
            wellspace.Client("127.0.0.1:1", retry=wellspace.RetryPolicy(max_first_attempts=1)).info()

    def test_other_servers_that_cannot_be_reached(self):
        for message, expected in (
            ("DNS resolution failed for a.example:1: not found", "the host of a.example:1 was not found: DNS"),
            ("failed to connect to all addresses; last error: UNKNOWN: ipv4:10.0.0.1:1: No route to host",
             "cannot connect to a.example:1: UNKNOWN: ipv4:10.0.0.1:1: No route to host"),
            ("Socket closed", "Socket closed"),
        ):
            self.assertTrue(_calls._in_plain_words(message, "a.example:1").startswith(expected), message)

    def test_what_clients_and_servers_say_of_themselves(self):
        with wellspace.LocalServer() as server, wellspace.Client(server) as client:
            self.assertEqual(repr(server), f"<wellspace.LocalServer at {server.address}: running>")
            self.assertEqual(repr(client), f"<wellspace.Client of its own server at {server.address}>")
            self.assertNotIn(server.credentials.token, repr(server) + repr(client))
        self.assertEqual(repr(server), f"<wellspace.LocalServer at {server.address}: ended>")
        self.assertEqual(repr(wellspace.Client("127.0.0.1:1")), "<wellspace.Client of the server at 127.0.0.1:1>")
        token = wellspace.CancelToken()
        self.assertEqual(repr(token), "<wellspace.CancelToken: not cancelled>")
        token.cancel()
        self.assertEqual(repr(token), "<wellspace.CancelToken: cancelled>")


class ErrorsTest(Case):
    def test_details(self):
        violation = _api.message("google.rpc.BadRequest")()
        violation.field_violations.add(field="parameters.size_boxes[3].low", description="")
        retry = _api.message("google.rpc.RetryInfo")()
        retry.retry_delay.seconds, retry.retry_delay.nanos = 2, 500_000_000
        info = _api.message("google.rpc.ErrorInfo")(reason="ERROR_REASON_QUEUE_FULL", domain="wellspace.v1")
        error = errors.from_message(status(8, "full", violation, retry, info))
        self.assertIsInstance(error, LimitError)
        self.assertEqual((error.code, error.reason, error.retry_after), ("RESOURCE_EXHAUSTED", "QUEUE_FULL", 2.5))
        self.assertEqual((error.field, error.argument), ("parameters.size_boxes[3].low", "size_boxes"))
        self.assertEqual((error.message, str(error)), ("full", "full (argument size_boxes)"))
        again = pickle.loads(pickle.dumps(error))
        self.assertEqual((type(again), vars(again)), (type(error), vars(error)))

    def test_errors_without_details(self):
        error = errors.from_status("DEADLINE_EXCEEDED", "READER_STALLED: too slow", b"no protobuf")
        self.assertEqual((error.reason, error.field, error.retry_after), ("READER_STALLED", "", None))
        self.assertIsInstance(error, TimeoutError)
        error = errors.from_status("INTERNAL", "a bug", b"")
        self.assertEqual((type(error), error.code), (Error, "INTERNAL"))

    def test_every_code_of_the_service_has_a_class(self):
        for code, builtin in (
            ("INVALID_ARGUMENT", ValueError),
            ("NOT_FOUND", LookupError),
            ("OUT_OF_RANGE", IndexError),
            ("UNAVAILABLE", ConnectionError),
            ("UNAUTHENTICATED", PermissionError),
            ("DEADLINE_EXCEEDED", TimeoutError),
        ):
            self.assertIsInstance(errors.from_status(code, "", b""), builtin)

    def test_they_come_by_the_wire(self):
        retry = _api.message("google.rpc.RetryInfo")()
        retry.retry_delay.seconds = 3600
        breaker = Breaker(wellspace.LocalServer())
        self.addCleanup(breaker.close)

        def refuse(*message):
            raise Break(grpc.StatusCode.RESOURCE_EXHAUSTED, "full", status(8, "full", retry).SerializeToString())

        breaker.on_request = refuse
        with self.fails(LimitError, "full", retry_after=3600.0):
            wellspace.Client(breaker.address).info(timeout=60)
        self.assertEqual(breaker.count("GetServerInfo"), 1, "the deadline comes before it")


class BarTest(Case):
    def test_by_tqdm(self):
        output = io.StringIO()
        with mock.patch.object(sys, "stderr", output):
            wellspace.mesh(uniform(1000, 2), progress=True)
        self.assertIn("done: 100%", output.getvalue())
        self.assertIn("vertices", output.getvalue())

    def test_without_tqdm(self):
        output = io.StringIO()
        with mock.patch.object(sys, "stderr", output), mock.patch.dict(sys.modules, {"tqdm": None, "tqdm.auto": None}):
            wellspace.mesh(uniform(1000, 2), progress=True)
        self.assertRegex(output.getvalue(), r"\rdone: 100%, \d+ vertices\n$")

    def test_in_a_notebook(self):
        """By IPython's protocol alone; here is a kernel's part of it."""
        shown = []

        class Handle:
            def update(self, bar):
                shown.append(bar._repr_html_())

        def display(bar, display_id):
            shown.append(bar._repr_html_())
            return Handle() if display_id else None

        shell = types.SimpleNamespace(kernel=object())
        ipython = types.SimpleNamespace(get_ipython=lambda: shell)
        modules = {"IPython": ipython, "IPython.display": types.SimpleNamespace(display=display)}
        with mock.patch.dict(sys.modules, modules):
            wellspace.mesh(uniform(1000, 2), progress=True)
            self.assertIn("<progress ", shown[0])
            self.assertRegex(shown[-1], r"^done: 100%, [\d,]+ vertices$")
            before = len(shown)
            shell.kernel = None  # IPython in a terminal
            output = io.StringIO()
            with mock.patch.object(sys, "stderr", output):
                wellspace.mesh(uniform(1000, 2), progress=True)
            self.assertEqual(len(shown), before)
            self.assertIn("100%", output.getvalue())

    def test_a_notebook_is_told_the_time_left_and_no_markup(self):
        shown = []
        bar = _progress._NotebookBar(lambda one, display_id: shown.append(one._repr_html_()) or bar_handle)
        bar_handle = types.SimpleNamespace(update=lambda one: shown.append(one._repr_html_()))
        with mock.patch.object(_progress.time, "monotonic", side_effect=[100.0, 110.0, 110.0]):
            for fraction in (0.1, 0.3, 1.0):
                bar.update(_progress.Progress("<b>", 1234, 0, 0, fraction))
        bar.close()
        self.assertIn("&lt;b&gt;: 30%, 1,234 vertices, 35 s left", shown[1])
        self.assertNotIn("left", shown[0] + shown[2])
        self.assertNotIn("<b>", "".join(shown))
        self.assertEqual(shown[3], "&lt;b&gt;: 100%, 1,234 vertices")

    def test_none(self):
        output = io.StringIO()
        with mock.patch.object(sys, "stderr", output):
            wellspace.mesh(uniform(1000, 2), progress=False)
        self.assertEqual(output.getvalue(), "")

    def test_an_error_of_the_function_ends_the_call(self):
        def fail(progress):
            raise RuntimeError("of the test")

        with self.assertRaisesRegex(RuntimeError, "of the test"):
            wellspace.mesh(uniform(1000, 2), progress=fail)
        self.assertEqual(_progress.Progress("done", 1, 2, 3, 1.0).sequence, 0)


if __name__ == "__main__":
    unittest.main()
