"""bench/distribution counts what it says, against counts by hand, on a tiny cloud."""
import importlib.machinery
import importlib.util
import pathlib
import sys
import unittest

try:
    import numpy
    import scipy  # noqa: F401
except ImportError:
    numpy = None

BENCH = pathlib.Path(__file__).resolve().parents[2] / "bench"


@unittest.skipIf(numpy is None, "numpy and scipy are not installed")
class DistributionTest(unittest.TestCase):
    def setUp(self):
        sys.dont_write_bytecode = True
        sys.path.insert(0, str(BENCH))
        loader = importlib.machinery.SourceFileLoader("distribution", str(BENCH / "distribution"))
        self.bench = importlib.util.module_from_spec(importlib.util.spec_from_loader("distribution", loader))
        loader.exec_module(self.bench)
        self.points = numpy.random.default_rng(7).random((300, 2))

    def test_parts_have_as_many_vertices_and_follow_the_curve(self):
        for parts in (1, 7, 8):
            part = self.bench.parts_of(self.points, parts)
            self.assertLessEqual(numpy.ptp(numpy.bincount(part, minlength=parts)), 1)
        # Of four the quarters of the box, nearly: no part reaches over the whole of it.
        part = self.bench.parts_of(self.points, 4)
        for number in range(4):
            self.assertLess(numpy.ptp(self.points[part == number], axis=0).min(), 0.8)

    def test_radii_are_to_the_nearest_vertex_before(self):
        radii = self.bench.empty_radii(self.points, 20)
        for i in range(20, 300):
            nearest = numpy.linalg.norm(self.points[:i] - self.points[i], axis=1).min()
            self.assertAlmostEqual(radii[i - 20], nearest)

    def test_chains_of_conflicts(self):
        radii = self.bench.empty_radii(self.points, 0 + 1)
        depth, pairs = self.bench.depth_of(self.points[1:], radii)
        longest = [1] * 299
        count = 0
        for j in range(299):
            for i in range(j):
                apart = numpy.linalg.norm(self.points[1 + i] - self.points[1 + j])
                if apart < self.bench.CONFLICT * max(radii[i], radii[j]):
                    longest[j] = max(longest[j], longest[i] + 1)
                    count += 1
        self.assertEqual((depth, len(pairs)), (max(longest), count))

    def test_reach(self):
        part = self.bench.parts_of(self.points, 5)
        reach = numpy.full(300, 0.07)
        reached = self.bench.reach_others(self.points, part, numpy.arange(300), reach, 5)
        for i in range(300):
            near = numpy.linalg.norm(self.points - self.points[i], axis=1) <= 0.07
            expected = {int(p) for p in part[near]} - {int(part[i])}
            self.assertEqual(set(numpy.flatnonzero(reached[:, i]).tolist()), expected)


if __name__ == "__main__":
    unittest.main()
