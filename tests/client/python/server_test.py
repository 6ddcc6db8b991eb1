"""The server that a process starts for itself: it is private, shared, and gone when the process is, however it ends."""

import asyncio
import contextlib
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from unittest import mock

from support import PATIENCE, Case, run_python, uniform

import wellspace
from wellspace import Client, CredentialsError, ServerNotInstalledError, UnavailableError, _server, aio

# Starts a server and says where it is: its address, the process of the supervisor, and its folder.
SHOW = """
import sys, wellspace
from wellspace import _server
server = _server.shared_server()
print(server.address, server._process.pid, server._process.args[4], flush=True)
"""


def wait_until(condition, what):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.01)  # other processes give no event


def processes_of(session):
    """The processes of a session, as the kernel has them: those that have ended and wait for their parent left out."""
    found = []
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            found.append(stat.parent.name)
    return found


class LocalServerTest(Case):
    def test_is_private(self):
        with wellspace.LocalServer() as server:
            self.assertTrue(server.address.startswith("127.0.0.1:"))
            with Client(server.address) as stranger, self.fails(CredentialsError, "", reason="UNAUTHENTICATED"):
                stranger.info()
            folder = pathlib.Path(server._process.args[4])
            self.assertEqual(folder.stat().st_mode & 0o777, 0o700)
            for file in folder.iterdir():
                self.assertNotIn(server.credentials.token, file.read_text())
            self.assertNotIn(server.credentials.token, " ".join(map(str, server._process.args)))

    def test_its_end(self):
        server = wellspace.LocalServer()
        wellspace.mesh(uniform(10, 2), server=server)
        folder, session = pathlib.Path(server._process.args[4]), server._process.pid
        self.assertGreater(len(processes_of(session)), 1)
        server.close()
        server.close()
        self.assertFalse(server.is_running or folder.exists())
        wait_until(lambda: not processes_of(session), "processes are left")

    def test_options(self):
        with wellspace.LocalServer("--max-points", "5") as server:
            self.assertEqual(Client(server).info().max_points, 5)
            with self.fails(wellspace.LimitError, "", reason="TOO_MANY_POINTS"):
                wellspace.mesh(uniform(6, 2), server=server)

    def test_one_for_all_calls(self):
        address = _server.shared_server().address
        wellspace.mesh(uniform(10, 2))
        with wellspace.Session(2) as session:
            self.assertEqual(session.client.address, address)
        self.assertEqual(Client().address, address)

    def test_another_one_after_a_crash(self):
        first = _server.shared_server()
        (pid,) = [pid for pid in processes_of(first._process.pid)
                  if pathlib.Path("/proc", pid, "comm").read_text().startswith("wellspaced")]
        os.kill(int(pid), signal.SIGKILL)
        first._process.wait(PATIENCE)
        self.assertFalse(first.is_running)
        wellspace.mesh(uniform(10, 2))
        self.assertNotEqual(_server.shared_server().address, first.address)

    def crash(self):
        """Kills the shared server, and does not wait for anything."""
        server = _server.shared_server()
        (pid,) = [pid for pid in processes_of(server._process.pid)
                  if pathlib.Path("/proc", pid, "comm").read_text().startswith("wellspaced")]
        os.kill(int(pid), signal.SIGKILL)
        return server

    def test_the_first_call_after_a_crash(self):
        """It gets another server, made by a function or by a client from before."""
        client = Client()
        points = uniform(10, 2)
        for call in (lambda: wellspace.mesh(points), lambda: wellspace.estimate(points), lambda: client.mesh(points),
                     client.info, client.sessions, lambda: wellspace.Session(2).delete(),
                     lambda: asyncio.run(aio.mesh(points))):
            wellspace.mesh(points)
            first = self.crash()
            call()
            self.assertNotEqual(_server.shared_server().address, first.address)
        self.assertEqual(client.info().version, wellspace.Client().info().version)

    def test_a_session_ends_with_its_server(self):
        with self.fails(UnavailableError, "has ended, and its sessions with it"):
            with wellspace.Session(2) as session:
                self.crash()._process.wait(PATIENCE)
                session.info()

    def test_a_crash_in_the_work_is_not_tried_again(self):
        """The call may be the cause of the crash."""
        first = []

        def on_progress(progress):
            if progress.phase == "refinement" and not first:
                first.append(self.crash())

        with self.fails(UnavailableError):
            wellspace.mesh(uniform(10, 3), box=([0] * 3, [1] * 3), size=0.004, threads=1, progress=on_progress)
        self.assertEqual(len(first), 1)
        wellspace.mesh(uniform(10, 2))

    def test_calls_do_not_wait_for_one_that_has_crashed(self):
        with wellspace.LocalServer() as server, Client(server) as client:
            client.info()
            os.killpg(server._process.pid, signal.SIGKILL)
            begin = time.monotonic()
            with self.fails(UnavailableError):
                client.info()
            # Eight attempts would take at least ten seconds, as for a server that may come back.
            self.assertLess(time.monotonic() - begin, 8)

    def test_not_installed(self):
        for environment, message in (
            ({"PATH": "/nowhere"}, "no wellspaced on the path"),
            ({"WELLSPACE_SERVER_BINARY": "/no/such"}, "WELLSPACE_SERVER_BINARY=/no/such is no"),
        ):
            clean = {name: value for name, value in os.environ.items() if name != "WELLSPACE_SERVER_BINARY"}
            with self.subTest(message), mock.patch.dict(os.environ, {**clean, **environment}, clear=True):
                with self.fails(ServerNotInstalledError, message):
                    wellspace.LocalServer()
                with self.assertRaises(FileNotFoundError):
                    wellspace.LocalServer()

    def test_the_programs_of_a_wheel_come_before_those_on_the_path(self):
        clean = {name: value for name, value in os.environ.items() if not name.startswith("WELLSPACE_")}
        with tempfile.TemporaryDirectory() as folder:
            for part in ("own", "path", "named"):
                program = pathlib.Path(folder, part, "wellspaced")
                program.parent.mkdir()
                program.write_text("#!/bin/sh\n")
                program.chmod(0o755)
            named = {"WELLSPACE_SERVER_BINARY": f"{folder}/named/wellspaced"}
            own = mock.patch.object(_server, "_OWN_PROGRAMS", pathlib.Path(folder, "own"))
            for environment, own_part, expected in (({}, own, "own"), (named, own, "named"),
                                                    ({}, contextlib.nullcontext(), "path")):
                changes = {**clean, "PATH": f"{folder}/path", **environment}
                with self.subTest(expected), own_part, mock.patch.dict(os.environ, changes, clear=True):
                    self.assertEqual(_server.find_binary(), f"{folder}/{expected}/wellspaced")

    def test_the_commands_of_a_wheel_are_its_programs(self):
        code = ("import pathlib, sys; from wellspace import _commands, _server; "
                "_server._OWN_PROGRAMS = pathlib.Path(sys.argv.pop(1)); _commands.")
        for name in ("wellspace", "wellspaced"):
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                program = pathlib.Path(folder, name)
                program.write_text("#!/bin/sh\necho \"$@\"\nexit 3\n")
                program.chmod(0o755)
                done = run_python(f"{code}{name}()", folder, "--listen", "a b")
                self.assertEqual((done.returncode, done.stdout), (3, "--listen a b\n"))
                done = run_python(f"{code}{name}()", f"{folder}/none")
                message = f"{name}: this package has no such program inside\n"
                self.assertEqual((done.returncode, done.stderr), (1, message))

    def test_does_not_start(self):
        with self.fails(UnavailableError, "--max-points"):
            wellspace.LocalServer("--max-points", "none")
        with self.fails(UnavailableError, "did not start: it said nothing"):
            wellspace.LocalServer(binary="/bin/true")


class EndTest(Case):
    def gone(self, line):
        _, session, folder = line.split()
        wait_until(lambda: not processes_of(int(session)), f"processes {processes_of(int(session))} are left")
        self.assertFalse(pathlib.Path(folder).exists())

    def test_at_exit(self):
        for end in ("", "raise RuntimeError", "sys.exit(3)"):
            done = run_python(SHOW + end)
            self.gone(done.stdout)

    def test_with_every_signal(self):
        for number in (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP):
            with self.subTest(number):
                process = subprocess.Popen([sys.executable, "-c", SHOW + "input()"], stdin=subprocess.PIPE,
                                           stdout=subprocess.PIPE, text=True)
                line = process.stdout.readline()
                process.send_signal(number)
                process.wait(PATIENCE)
                self.gone(line)
                process.stdin.close()
                process.stdout.close()

    def test_a_fork_does_not_keep_it(self):
        code = SHOW + """
import os, signal
reader, writer = os.pipe()
child = os.fork()
if child == 0:
    os.write(writer, b"1" if _server._shared is None else b"0")
    signal.pause()
assert os.read(reader, 1) == b"1"
print(child, flush=True)
input()
"""
        command = [sys.executable, "-c", code]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        line, child = process.stdout.readline(), int(process.stdout.readline())
        try:
            os.kill(child, signal.SIGSTOP)  # it lives on, with its copies of the parent's files
            process.kill()
            process.wait(PATIENCE)
            self.gone(line)
        finally:
            os.kill(child, signal.SIGKILL)
            process.stdin.close()
            process.stdout.close()

    def test_ctrl_c_in_a_terminal_is_for_python(self):
        code = SHOW + """
import os, signal
try:
    os.kill(0, signal.SIGINT)  # to the whole group, as a terminal does
    signal.pause()
except KeyboardInterrupt:
    print(server.is_running, len(wellspace.mesh([[0, 0], [1, 1]]).points) > 2)
"""
        done = run_python(code, start_new_session=True)
        self.assertEqual(done.stdout.splitlines()[1], "True True", done.stderr)
        self.gone(done.stdout.splitlines()[0])


if __name__ == "__main__":
    unittest.main()
