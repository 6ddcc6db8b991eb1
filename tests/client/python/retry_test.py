"""When calls are made again, and when not: the policy, and the loop around attempts."""

import math
import unittest
from unittest import mock

from wellspace import (
    CancelledError,
    CancelToken,
    InvalidArgumentError,
    LimitError,
    RetryPolicy,
    UnavailableError,
    _retry,
)

POLICY = RetryPolicy(max_attempts=4, max_first_attempts=2, initial_backoff=1, multiplier=2, max_backoff=3)


class PolicyTest(unittest.TestCase):
    def delay(self, error=UnavailableError("gone"), **others):
        given = {"failures": 1, "is_server_known": True, "time_left": math.inf, "jitter": 1.0, **others}
        return POLICY.delay(error, **given)

    def test_grows_up_to_a_limit(self):
        self.assertEqual([self.delay(failures=n) for n in (1, 2, 3)], [1, 2, 3])
        self.assertEqual(self.delay(failures=2, jitter=0.5), 1)

    def test_ends(self):
        self.assertIsNone(self.delay(failures=4))
        self.assertIsNone(self.delay(failures=2, is_server_known=False))
        self.assertEqual(self.delay(failures=1, is_server_known=False), 1)
        self.assertIsNone(self.delay(time_left=1.0), "the deadline comes first")

    def test_waits_as_the_server_asks(self):
        self.assertEqual(self.delay(LimitError("full", retry_after=7.5)), 7.5)

    def test_what_is_worth_repeating(self):
        for error, expected in (
            (UnavailableError("gone"), True),
            (LimitError("full"), False),
            (LimitError("full", retry_after=0.0), True),
            (InvalidArgumentError("wrong"), False),
            (LimitError("slow", reason="READER_STALLED"), True),
        ):
            self.assertEqual(_retry.is_worth_repeating(error), expected, repr(error))


class RetrierTest(unittest.TestCase):
    def setUp(self):
        self.waited = []

        def wait(token, seconds):
            self.waited.append(seconds)
            return token.is_cancelled

        patches = [
            mock.patch.object(CancelToken, "_wait", wait),
            mock.patch("random.uniform", lambda low, high: high),
        ]
        for patch in patches:
            patch.start()
            self.addCleanup(patch.stop)
        self.token = CancelToken()

    def run_with(self, *outcomes, deadline=math.inf):
        """Attempts end with these, one after the other: an exception, or (exception, attributes set of the attempt)."""
        left = list(outcomes)

        def attempt_once(attempt):
            outcome = left.pop(0)
            error, changes = outcome if isinstance(outcome, tuple) else (outcome, {})
            for name, value in changes.items():
                setattr(attempt, name, value)
            if isinstance(error, Exception):
                raise error
            return error

        return _retry.Retrier(POLICY).run(deadline, self.token, attempt_once), len(left)

    def test_repeats_until_it_succeeds(self):
        first = (UnavailableError("1"), {"progressed": True})
        self.assertEqual(self.run_with(first, UnavailableError("2"), "done"), ("done", 0))
        self.assertEqual(self.waited, [1, 2])

    def test_an_attempt_with_progress_begins_anew(self):
        progress = {"progressed": True}
        outcomes = [(UnavailableError(str(n)), progress) for n in range(10)]
        self.assertEqual(self.run_with(*outcomes, "done"), ("done", 0))
        self.assertEqual(self.waited, [1] * 10)

    def test_gives_up_early_with_a_server_that_never_answered(self):
        with self.assertRaisesRegex(UnavailableError, "2"):
            self.run_with(UnavailableError("1"), UnavailableError("2"), "never")

    def test_what_is_final_is_not_repeated(self):
        for outcome in (InvalidArgumentError("wrong"), (UnavailableError("wrong"), {"is_final": True})):
            with self.assertRaisesRegex(Exception, "wrong"):
                self.run_with(outcome, "never")
        self.assertEqual(self.waited, [])

    def test_an_attempt_may_know_better(self):
        busy = (LimitError("busy"), {"is_worth_repeating": True})
        self.assertEqual(self.run_with(busy, "done"), ("done", 0))

    def test_redirects_are_no_failures(self):
        redirected = {"is_redirected": True}
        outcomes = [(UnavailableError(str(n), reason="SESSION_ELSEWHERE"), redirected) for n in range(10)]
        self.assertEqual(self.run_with(*outcomes[:4], "done"), ("done", 0))
        self.assertEqual(self.waited, [])
        self.assertEqual(self.run_with(*outcomes, "done"), ("done", 0))
        self.assertEqual(self.waited, [1, 2], "after four in a row, each fifth")

    def test_what_is_final_is_not_redirected(self):
        with self.assertRaisesRegex(UnavailableError, "here"):
            self.run_with((UnavailableError("here"), {"is_redirected": True, "is_final": True}), "never")

    def test_ends_when_the_token_is_cancelled(self):
        self.token.cancel()
        with self.assertRaisesRegex(CancelledError, "by the caller"):
            self.run_with("never")


class CancelTokenTest(unittest.TestCase):
    def test_calls_back_once(self):
        token, calls = CancelToken(), []
        first, second = (lambda: calls.append(1)), (lambda: calls.append(2))
        token._add(first)
        token._add(second)
        token._remove(first)
        token.cancel()
        token.cancel()
        self.assertEqual(calls, [2])
        token._add(first)
        self.assertEqual(calls, [2, 1], "a late one is called at once")


if __name__ == "__main__":
    unittest.main()
