"""Servers that answer with numbers and text that cannot be: an error, or no harm."""

import contextlib
import io
import sys
import unittest
from concurrent import futures
from unittest import mock

import grpc
import numpy as np
from support import Case

import wellspace
from wellspace import CancelToken, DamagedAnswerError, NotFoundError, _api

NAN, INFINITY = float("nan"), float("inf")


class FakeServer(grpc.GenericRpcHandler):
    """A server whose `answers` has a list of messages, or a function that makes it, for each method."""

    def __init__(self):
        self.answers = {}
        self.requests = []  # (method, bytes)
        self.end = {}  # the status of a method, if it is not OK
        self._server = grpc.server(futures.ThreadPoolExecutor(4), handlers=[self])
        self.address = f"127.0.0.1:{self._server.add_insecure_port('127.0.0.1:0')}"
        self._server.start()

    def close(self):
        self._server.stop(None).wait()

    def service(self, details):
        method = details.method.rpartition("/")[2]

        def handle(requests, context):
            for request in requests:
                self.requests.append((method, request))
            for answer in self.answers.get(method, []):
                yield answer if isinstance(answer, bytes) else answer.SerializeToString()
            if method in self.end:
                context.abort(*self.end[method])

        return grpc.stream_stream_rpc_method_handler(handle)


class HostileCase(Case):
    def setUp(self):
        self.server = FakeServer()
        self.addCleanup(self.server.close)
        retry = wellspace.RetryPolicy(initial_backoff=0.001, max_backoff=0.01)
        self.client = wellspace.Client(self.server.address, retry=retry)
        self.addCleanup(self.client.close)
        self.session_says(dimension=2)

    def session_says(self, dimension, **fields):
        session = _api.message("Session")(name="sessions/one", last_operation="sessions/one/operations/two", **fields)
        session.parameters.dimension = dimension
        self.server.answers["GetSession"] = [_api.message("GetSessionResponse")(session=session)]

    def session(self):
        return wellspace.Session.attach("sessions/one", server=self.client)

    @contextlib.contextmanager
    def damaged(self, message):
        with self.fails(DamagedAnswerError, message, code="DATA_LOSS"):
            yield


class ProgressTest(HostileCase):
    def setUp(self):
        super().setUp()
        response = _api.message("WatchOperationResponse")
        sent = [NAN, -INFINITY, -1, 0.25, 1e300, INFINITY]
        self.server.answers["WatchOperation"] = [response(progress={"fraction": one}) for one in sent]
        self.server.answers["WatchOperation"].append(response(operation={"state": 3, "progress": {"fraction": NAN}}))

    def test_fractions_are_from_zero_to_one(self):
        told = []
        ended = self.session().watch(progress=lambda progress: told.append(progress.fraction))
        self.assertEqual(told, [0, 0, 0, 0.25, 1, 1])
        self.assertEqual(ended.progress.fraction, 0)

    def test_bars(self):
        for hidden in ({}, {"tqdm": None, "tqdm.auto": None}):
            with mock.patch.dict(sys.modules, hidden), contextlib.redirect_stderr(io.StringIO()):
                self.assertEqual(self.session().watch(progress=True).state, "succeeded")


class LocateTest(HostileCase):
    def says(self, **changes):
        fields = {"simplices": [3], "vertices": [4, 5, 6], "coordinates": [0.5, 0.5, 0], "revision": 9,
                  "vertex_count": 7} | changes
        self.server.answers["Locate"] = [_api.message("LocateResponse")(**fields)]

    def test_what_is_right(self):
        self.says()
        located = self.session().locate([[0.5, 0.5]], revision=9)
        self.assertEqual((located.vertex_count, located.revision, located.vertices.tolist()), (7, 9, [[4, 5, 6]]))

    def test_what_cannot_be(self):
        for changes, message in (
            ({"vertices": [4, 7, 6]}, "at vertex 7 of 7"),
            ({"vertices": [4, 2**32 - 1, 6]}, "at vertex 4294967295 of 7"),
            ({"vertex_count": 0}, "of 0"),
            ({"coordinates": [0.5, NAN, 0]}, "barycentric"),
            ({"coordinates": [0.5, -0.5, 1]}, "barycentric"),
            ({"coordinates": [0, 1.5, 0]}, "barycentric"),
            ({"coordinates": [0.5, 0.5]}, "2 numbers in field 3"),
            ({"simplices": []}, "0 numbers in field 1"),
            ({"simplices": [2**32 - 1], "coordinates": [0, 0, 0]}, "not allowed"),
            ({"revision": 8}, "revision 8, not 9"),
            ({"revision": 0}, "revision 0"),
        ):
            self.says(**changes)
            with self.subTest(message), self.damaged(message):
                self.session().locate([[0.5, 0.5]], revision=9)

    def test_a_point_in_no_simplex(self):
        self.says(simplices=[2**32 - 1], vertices=[8, 8, 8], coordinates=[0, 0, 0])
        located = self.session().locate([[0.5, 0.5]], allow_outside=True)
        self.assertTrue(np.isnan(located.interpolate(np.ones(7))).all())
        self.says(simplices=[2**32 - 1])
        with self.damaged("barycentric"):
            self.session().locate([[0.5, 0.5]], allow_outside=True)


class TransferTest(HostileCase):
    def says(self, *values, revision=9, rows=2, more=()):
        response = _api.message("TransferValuesResponse")
        answers = [response(), response()]
        answers[0].start.revision, answers[0].start.row_count = revision, rows
        answers[1].values.values.extend(values)
        self.server.answers["TransferValues"] = [*answers, *more]

    def transfer(self):
        return self.session().transfer([[1, 2], [3, 4], [5, 6]], 8, revision=9)

    def test_what_is_right(self):
        self.says(1.5, 2.5, 3.5, 4.5)
        np.testing.assert_array_equal(self.transfer(), [[1.5, 2.5], [3.5, 4.5]])
        self.says(rows=0)
        self.assertEqual(self.transfer().shape, (0, 2))

    def test_what_cannot_be(self):
        for values, options, message in (
            ([1, 2, 3], {}, "3 of 4 values"),
            ([1, 2, 3, 4, 5], {}, "more than 4 values"),
            ([1, 2, 3, NAN], {}, "not finite"),
            ([1, 2, 3, INFINITY], {}, "not finite"),
            ([1, 2, 3, 4], {"revision": 8}, "revision 8, not 9"),
            ([1, 2, 3, 4], {"revision": 0}, "revision 0"),
            ([1, 2, 3, 4], {"rows": 2**63}, "4 of "),
            ([1, 2, 3, 4], {"more": [b"\x08\x01"]}, "no values"),
        ):
            self.says(*values, **options)
            with self.subTest(message), self.damaged(message):
                self.transfer()
        for answers, message in (([], "without a start"), ([b"\xff"], "no message")):
            self.server.answers["TransferValues"] = answers
            with self.subTest(message), self.damaged(message):
                self.transfer()


class QueriesTest(HostileCase):
    def distances(self, *values):
        answer = _api.message("ApproximateNearestNeighborsResponse")(distances=values)
        self.server.answers["ApproximateNearestNeighbors"] = [answer]

    def test_distances(self):
        for values, message in (
            ([1, NAN], "not a number"),
            ([1, -1], "negative"),
            ([1], "1 of 2 vertices"),
            ([1, 2, 3], "more than 2 vertices"),
        ):
            self.distances(*values)
            with self.subTest(values), self.damaged(message):
                self.session().nearest([7, 8])

    def test_a_break_after_the_last_answer_does_not_ask_about_all(self):
        self.distances(1, 2)
        self.server.end["ApproximateNearestNeighbors"] = grpc.StatusCode.UNAVAILABLE, "Socket closed"
        self.assertEqual(self.session().nearest([7, 8]).tolist(), [1, 2])
        self.assertEqual([method for method, _ in self.server.requests].count("ApproximateNearestNeighbors"), 1)

    def test_cells(self):
        good = {"vertices": [0], "clip_radii": [INFINITY], "is_clipped": [False], "node_counts": [1],
                "nodes": [0.5, 0.5], "neighbour_counts": [0]}
        for changes, message in (
            ({"nodes": [0.5, NAN]}, "not a number"),
            ({"clip_radii": [NAN]}, "not a number"),
            ({"node_counts": [2**32 - 1]}, "do not add up"),
        ):
            batch = _api.message("VoronoiCellBatch")(**{**good, **changes})
            self.server.answers["VoronoiCells"] = [_api.message("VoronoiCellsResponse")(cells=batch)]
            with self.subTest(changes), self.damaged(message):
                self.session().cells([0])
        # A count of 2^64 - 1, alone and so not packed.
        self.server.answers["VoronoiCells"] = [b"\x0a\x0b\x20" + b"\xff" * 9 + b"\x01"]
        with self.damaged("above 2^32"):
            self.session().cells([0])

    def test_added_vertices(self):
        for count in (0, 1, 3):
            self.server.answers["AddVertices"] = [_api.message("AddVerticesResponse")(vertices=range(count))]
            with self.damaged(f"{count} vertices for 2 points"):
                self.session().add([[0.5, 0.5], [0.25, 0.25]])


class SessionsTest(HostileCase):
    def test_dimensions(self):
        for dimension in (-1, 65, 2**31 - 1):
            self.session_says(dimension=dimension)
            with self.damaged(f"a session in {dimension}-D"):
                self.session()

    def test_times(self):
        for seconds in (2**62, -(2**62), 10**15):
            self.session_says(2, create_time={"seconds": seconds})
            with self.damaged("seconds after 1970"):
                self.session()

    def test_pages_end(self):
        self.server.answers["ListSessions"] = [_api.message("ListSessionsResponse")(next_page_token="again")]
        with self.damaged("the same page again"):
            self.client.sessions()
        self.server.answers["ListOperations"] = [_api.message("ListOperationsResponse")(next_page_token="again")]
        with self.damaged("the same page again"):
            self.session().operations()

    def test_messages_do_not_reach_the_terminal_as_commands(self):
        self.server.end["ListSessions"] = grpc.StatusCode.NOT_FOUND, "no \x1b[2Jsession\r\n\x7f\x9b é"
        with self.fails(NotFoundError) as caught:
            self.client.sessions()
        self.assertEqual(str(caught.exception), r"no \x1b[2Jsession\r\n\x7f\x9b é")
        response = _api.message("WatchOperationResponse")
        error = {"code": 13, "message": "\x1b]0;title\x07"}
        self.server.answers["WatchOperation"] = [response(operation={"state": 4, "error": error})]
        self.assertEqual(str(self.session().watch().error), r"\x1b]0;title\x07")

    def test_a_server_may_ask_for_any_patience(self):
        token = CancelToken()
        token.cancel()
        for seconds in (1e18, 2.0**63, INFINITY):
            self.assertTrue(token._wait(seconds))


if __name__ == "__main__":
    unittest.main()
