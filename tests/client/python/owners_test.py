"""Several servers that share their sessions: calls go to the one that has the session, and nowhere else."""

import asyncio
import socket
import unittest

import numpy as np
from support import Break, Breaker, Case, uniform, unit_box

import wellspace
import wellspace.aio
from wellspace import Credentials, DamagedAnswerError, Error, InvalidArgumentError, UnavailableError, WrongStateError
from wellspace import _api
from wellspace._calls import session_id
from wellspace._channel import _target_of, host_of_named
from wellspace._owners import Owners

QUICK = wellspace.RetryPolicy(max_attempts=4, initial_backoff=0.001, max_backoff=0.01)


def elsewhere(address):
    """The end of a call at a server that has not the session; `address` is empty where it does not know who has."""
    info = _api.message("google.rpc.ErrorInfo")(reason="ERROR_REASON_SESSION_ELSEWHERE")
    if address:
        info.metadata["address"] = address
    status = _api.message("google.rpc.Status")()
    status.details.add(type_url="type.googleapis.com/google.rpc.ErrorInfo", value=info.SerializeToString())
    return Break(message="the session is elsewhere", details=status.SerializeToString())


def is_on_a_session(method):
    return method not in ("CreateSession", "ListSessions", "MeshPoints", "EstimateMesh", "GetServerInfo", "Check")


class OwnersTest(Case):
    """A session of a server that is reached by `second`; the client knows `first`."""

    @classmethod
    def setUpClass(cls):
        cls.server = wellspace.LocalServer()

    @classmethod
    def tearDownClass(cls):
        cls.server.close()

    def setUp(self):
        self.first, self.second = Breaker(self.server), Breaker(self.server)
        self.addCleanup(self.first.close)
        self.addCleanup(self.second.close)
        self.client = self.client_of()
        self.says(self.first, self.second.address)

    def client_of(self, **options):
        client = wellspace.Client(self.first.address, **{"retry": QUICK, **options})
        self.addCleanup(client.close)
        return client

    @staticmethod
    def says(breaker, address, times=None, after=0):
        """Calls on sessions at `breaker` end so, `times` of them, after so many answers."""
        left = [times]

        def on_answer(method, call, message, data):
            if is_on_a_session(method) and message == after and left[0] != 0:
                left[0] = None if left[0] is None else left[0] - 1
                raise elsewhere(address)
            return data

        breaker.on_answer = on_answer

    @staticmethod
    def knows(breaker):
        breaker.on_answer = lambda method, call, message, data: data

    def session(self, client=None):
        session = wellspace.Session(2, server=client or self.client, box=unit_box(2), size=0.1)
        self.first.calls.clear()
        return session

    def test_every_call_goes_where_the_session_is(self):
        session = self.session()
        points = uniform(300, 2)
        self.assertEqual(session.upload(points), 300)
        session.refine()
        mesh = session.download()
        np.testing.assert_array_equal(mesh.points[mesh.input_vertices], points)
        session.add([[0.501, 0.502]])
        session.sizes([0.05], [[0.5, 0.5]])
        session.refine()
        session.download(since=mesh)
        session.nearest([0, 1])
        session.cells([0], beta=2)
        session.locate(points[:5])
        session.update(labels={"a": "b"})
        session.remove([0])
        self.assertEqual(len(session.operations()), 2)
        session.cancel_operation()
        session.delete()
        self.assertEqual(self.first.calls, ["GetSession"], "only the first call had to ask")
        name = session.name.removeprefix("sessions/")
        heard = [seen.get("wellspace-session") for seen in self.second.metadata]
        self.assertEqual(heard, [name] * len(heard), "a proxy learns the session")
        self.assertEqual(self.first.metadata[-1]["wellspace-session"], name)
        self.assertNotIn("wellspace-session", self.first.metadata[0], "creating one is about none")

    def test_asyncio(self):
        async def work():
            session = await wellspace.aio.Session.create(2, server=self.client, box=unit_box(2))
            await session.upload(uniform(100, 2))
            await session.refine()
            mesh = await session.download()
            await session.delete()
            return mesh

        self.assertGreaterEqual(len(asyncio.run(work()).points), 100)
        self.assertEqual(self.first.calls, ["CreateSession", "GetSession"])

    def test_a_watch_goes_on_there(self):
        session = self.session()
        session.upload(uniform(300, 2))
        operation = session.start_refinement()
        found = wellspace.Session.attach(session.name, server=self.client)
        found._calls = self.client._calls.of_session(session.name)  # knows nothing of the second
        self.first.calls.clear()
        self.assertEqual(found.watch(operation.name).state, "succeeded")
        self.assertEqual(self.first.calls, ["WatchOperation"])

    def test_a_download_goes_on_there(self):
        session = self.session()
        session.upload(uniform(300, 2))
        session.refine()
        whole = session.download()
        self.says(self.first, self.second.address, after=1)
        found = wellspace.Session.attach(session.name, server=self.client)
        mesh = found.download()
        np.testing.assert_array_equal(mesh.simplices, whole.simplices)
        self.assertEqual((self.first.calls[-1], self.second.calls[-1]), ("DownloadMesh", "DownloadMesh"))

    def test_a_loop_of_redirects_ends(self):
        self.says(self.second, self.first.address)
        session = self.session()
        self.second.calls.clear()
        with self.fails(UnavailableError, "elsewhere", reason="SESSION_ELSEWHERE"):
            session.info()
        self.assertEqual(len(self.first.calls) + len(self.second.calls), 4 * 5)

    def test_the_deadline_holds(self):
        self.says(self.second, self.first.address)
        patient = wellspace.RetryPolicy(10**6, initial_backoff=0.001, max_backoff=0.01)
        session = self.session(self.client_of(retry=patient))
        with self.fails(Error):
            session.info(timeout=0.2)

    def test_a_server_that_is_gone_is_given_up(self):
        session = self.session()
        session.info()
        self.second.close()
        self.says(self.first, self.second.address, times=2)
        session.info()
        self.assertEqual(self.first.count("GetSession"), 4, "once at first, then twice sent away, and taken in")
        session.info()
        self.assertEqual(self.first.count("GetSession"), 5, "it has the session now")

    def test_a_server_that_stays_away_is_named(self):
        with socket.socket() as bound:  # it does not listen
            bound.bind(("127.0.0.1", 0))
            address = f"127.0.0.1:{bound.getsockname()[1]}"
            session = self.session()
            self.says(self.first, address)
            with self.fails(UnavailableError, f"so it was at {address}"):
                session.info()
            self.assertEqual(self.first.count("GetSession"), 4)

    def test_who_does_not_know_where_is_asked_again(self):
        session = self.session()
        self.says(self.first, "", times=2)
        session.info()
        self.assertEqual(self.first.count("GetSession"), 3)
        self.assertEqual(self.second.calls, [])

    def test_the_first_is_asked_where_the_other_has_lost_it(self):
        session = self.session()
        session.info()
        self.knows(self.first)
        self.says(self.second, "")
        session.info()
        self.assertEqual(self.first.count("GetSession"), 2)

    def test_what_is_expected_of_the_session_goes_along(self):
        session = self.session()
        seen = []

        def on_request(method, call, message, data):
            if method == "UploadPoints" and message == 0:
                seen.append(_api.message("UploadPointsRequest").FromString(data).expected_revision)
            return data

        self.second.on_request = on_request
        # The session moves between the look at it and the upload.
        self.knows(self.first)

        def refuse(method, call, message, data):
            if method == "UploadPoints":
                raise elsewhere(self.second.address)
            return data

        self.first.on_request = refuse
        session.upload(uniform(10, 2), expected_revision=1)
        self.assertEqual(seen, [1])

    def test_only_addresses_are_followed(self):
        for address in ("unix:/run/other.sock", "unix-abstract:x", "dns:///a.example:1", "http://a.example:1",
                        "a.example", "a.example:0", "::1:7233", "[::1:1", "[a.example]:1", "[fe80::1%eth0]:1", "a b:1",
                        "user@host:1", "\x1b[2J:1", "h\u00f6:1", "a.example:\u0661", "a" * 3000 + ":1"):
            with self.subTest(address):
                session = self.session()
                self.says(self.first, address)
                with self.fails(DamagedAnswerError, "expected the HOST:PORT") as caught:
                    session.info()
                self.assertNotIn("\x1b", str(caught.exception))
                self.assertLess(len(str(caught.exception)), 1000)
                self.assertEqual(self.first.calls, ["GetSession"])
                self.knows(self.first)

    def test_following_may_be_off(self):
        session = self.session(self.client_of(follow=False))
        self.says(self.first, self.second.address, times=2)
        session.info()
        self.assertEqual((self.first.count("GetSession"), self.second.calls), (3, []))
        self.assertTrue(self.first.metadata[-1]["wellspace-session"], "a proxy wants it")
        self.says(self.first, self.second.address)
        with self.fails(UnavailableError, reason="SESSION_ELSEWHERE", address=self.second.address):
            session.info()

    def test_the_token_goes_along(self):
        session = self.session(self.client_of(credentials=Credentials(token="secret")))
        session.info()
        self.assertEqual(self.second.metadata[-1]["authorization"], "Bearer secret")

    def test_the_token_goes_nowhere_in_plain_text(self):
        session = self.session(self.client_of(credentials=Credentials(token="secret")))
        self.says(self.first, "mesh.example:7233")
        with self.fails(WrongStateError, "the session is at another server, mesh.example:7233: would send the token"):
            session.info()


class AddressTest(Case):
    def test_hosts_that_are_named(self):
        for address, host in (("a.example:7233", "a.example"), ("10.0.0.1:80", "10.0.0.1"), ("[fd00::7]:1", "fd00::7")):
            self.assertEqual(host_of_named(address), host)
        with self.fails(InvalidArgumentError):
            host_of_named("a" * 254 + ":1")

    def test_targets_are_no_files(self):
        self.assertEqual(_target_of("unix:7233"), "dns:///unix:7233")
        self.assertEqual(_target_of("[::1]:1"), "[::1]:1")

    def test_the_loopback_of_another_machine(self):
        with self.fails(WrongStateError, "loopback"):
            Owners("a.example:7233", Credentials()).link_to("127.0.0.1:1")

    def test_owners_are_bounded(self):
        owners = Owners("127.0.0.1:1", Credentials())
        links = [owners.link_to(f"127.0.0.1:{n + 1}") for n in range(70)]
        self.assertIs(owners.link_to("127.0.0.1:70"), links[-1])
        self.assertLessEqual(len(owners._links), 64)
        owners.close()

    def test_ids(self):
        self.assertEqual(session_id("sessions/0a"), "0a")
        for name in ("sessions/a b", "sessions/", "x", "sessions/a\n", "sessions/\u00f6"):
            self.assertEqual(session_id(name), "")


if __name__ == "__main__":
    unittest.main()
