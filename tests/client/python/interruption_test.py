"""Calls that are given up: by Ctrl-C, a token or a timeout. The server stops working for them."""

import _thread
import math
import threading
import time
import unittest

from support import PATIENCE, Case, uniform, unit_box

import wellspace
from wellspace import CancelledError, CancelToken, DeadlineError

# Minutes of work.
LONG = {"box": unit_box(3), "size": 0.004, "threads": 1}


class InterruptionTest(Case):
    @classmethod
    def setUpClass(cls):
        cls.server = wellspace.LocalServer()
        cls.client = wellspace.Client(cls.server)

    @classmethod
    def tearDownClass(cls):
        cls.client.close()
        cls.server.close()

    def tearDown(self):
        deadline = time.monotonic() + PATIENCE
        while self.client.info().running_jobs:
            self.assertLess(time.monotonic(), deadline, "the server works on")

    @staticmethod
    def once(action):
        """Progress that does `action` when the work has begun."""
        done = []

        def on_progress(progress):
            if progress.phase == "refinement" and not done:
                done.append(True)
                action()

        return on_progress

    def test_ctrl_c(self):
        with self.assertRaises(KeyboardInterrupt):
            self.client.mesh(uniform(10, 3), progress=self.once(_thread.interrupt_main), **LONG)

    def test_ctrl_c_while_nothing_comes(self):
        with self.assertRaises(KeyboardInterrupt):
            timer = threading.Timer(0.5, _thread.interrupt_main)
            timer.start()
            self.client.mesh(uniform(10, 3), **LONG)

    def test_a_token(self):
        token = CancelToken()
        with self.fails(CancelledError, "by the caller", code="CANCELLED"):
            self.client.mesh(uniform(10, 3), progress=self.once(token.cancel), cancel=token, **LONG)
        with self.fails(CancelledError, "by the caller"):
            self.client.mesh(uniform(10, 3), cancel=token)

    def test_a_token_from_another_thread(self):
        token = CancelToken()
        thread = threading.Thread(target=token.cancel)
        with self.fails(CancelledError):
            self.client.mesh(uniform(10, 3), progress=self.once(thread.start), cancel=token, **LONG)
        thread.join()

    def test_timeout(self):
        with self.fails(DeadlineError, "took longer than its timeout of 0.5 s", code="DEADLINE_EXCEEDED"):
            self.client.mesh(uniform(10, 3), timeout=0.5, **LONG)
        with self.assertRaises(TimeoutError):
            self.client.estimate(uniform(1000, 3), timeout=0.0)

    def test_sessions_stay_as_they_were(self):
        with wellspace.Session(3, server=self.client, box=unit_box(3)) as session:
            session.upload(uniform(10, 3))
            session.refine()
            before = session.info()
            with self.assertRaises(KeyboardInterrupt):
                session.refine(size=0.004, progress=self.once(_thread.interrupt_main))
            self.assertEqual(session.watch().state, "cancelled")
            token = CancelToken()
            with self.fails(CancelledError):
                session.refine(size=0.004, progress=self.once(token.cancel), cancel=token)
            operation = session.watch()
            self.assertEqual((operation.state, operation.error.code), ("cancelled", "CANCELLED"))
            after = session.info()
            self.assertEqual((after.state, after.revision), ("ready", before.revision))
            self.assertEqual(after.parameters, before.parameters)

    def test_the_next_call_after_ctrl_c(self):
        """The work of an interrupted call has ended when the call has: the session is not busy."""
        with wellspace.Session(3, server=self.client, box=unit_box(3)) as session:
            session.upload(uniform(10, 3))
            session.refine()
            for _ in range(4):
                with self.assertRaises(KeyboardInterrupt):
                    session.refine(size=0.004, progress=self.once(_thread.interrupt_main))
                session.refine(size=math.inf)
                token = CancelToken()
                with self.fails(CancelledError):
                    session.refine(size=0.004, progress=self.once(token.cancel), cancel=token)
                session.upload(uniform(1, 3), offset=0)
            self.assertEqual(session.info().state, "ready")

    def test_ctrl_c_before_the_start_is_answered(self):
        """The work that the lost call has started is found, and ended."""
        with wellspace.Session(3, server=self.client, box=unit_box(3)) as session:
            session.upload(uniform(10, 3))
            start = session._start

            def interrupted(request, options):
                session._start = start
                start(request, options)
                raise KeyboardInterrupt

            session._start = interrupted
            with self.assertRaises(KeyboardInterrupt):
                session.refine(size=0.004)
            self.assertEqual(session.watch().state, "cancelled")
            session.refine()

    def test_a_timeout_leaves_the_work_alone(self):
        with wellspace.Session(3, server=self.client, box=unit_box(3)) as session:
            session.upload(uniform(10, 3))
            with self.fails(DeadlineError):
                session.refine(size=0.004, timeout=0.5)
            self.assertEqual(session.info().state, "refining")
            with self.fails(wellspace.WrongStateError, "", reason="SESSION_BUSY"):
                session.refine()
            session.cancel_operation()
            self.assertEqual(session.watch().state, "cancelled")

    def test_an_operation_that_another_cancels(self):
        with wellspace.Session(3, server=self.client, box=unit_box(3)) as session:
            session.upload(uniform(10, 3))
            with self.fails(CancelledError):
                session.refine(size=0.004, progress=self.once(session.cancel_operation))


if __name__ == "__main__":
    unittest.main()
