"""The adaptive solver of the examples: its error falls as fast as that of any mesh with as many vertices can."""

import math
import os
import re
import subprocess
import sys
import unittest

from support import PATIENCE, ROOT, Case


class PoissonTest(Case):
    def rate(self, dimension, rounds):
        """The order of the error in the number of vertices, over the last two steps."""
        program = ROOT / "examples" / "poisson" / "poisson.py"
        done = subprocess.run([sys.executable, "-B", program, str(dimension), str(rounds)], capture_output=True,
                              text=True, timeout=PATIENCE, check=False, env=os.environ)
        self.assertEqual(done.returncode, 0, done.stderr)
        steps = [(int(n), float(e)) for n, e in re.findall(r"(\d+) vertices, error (\S+)", done.stdout)]
        self.assertEqual(len(steps), rounds)
        (before, coarse), (after, fine) = steps[-3], steps[-1]
        self.assertGreater(after, 2 * before)
        return math.log(coarse / fine) / math.log(after / before)

    def test_in_the_plane(self):
        self.assertGreater(self.rate(2, 8), 0.9 / 2)

    def test_in_space(self):
        self.assertGreater(self.rate(3, 4), 0.9 / 3)

    def test_it_is_short(self):
        text = (ROOT / "examples" / "poisson" / "poisson.py").read_text()
        lines = [line for line in text.splitlines() if line]
        self.assertLessEqual(len(lines), 45)
        self.assertLessEqual(len([line for line in lines if "session" in line or "wellspace" in line]), 8)


if __name__ == "__main__":
    unittest.main()
