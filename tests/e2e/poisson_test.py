"""The adaptive solvers of the examples, in C++ and in Python: their errors fall as fast as those of any mesh can."""
import math
import os
import re
import subprocess
import sys
import unittest

from wellspaced import BIN, PATIENCE, ROOT, Wellspaced

FOLDER = ROOT / "examples" / "poisson"
PROGRAM = BIN / "poisson_example"


class Poisson(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Wellspaced()
        cls.addClassCleanup(cls.server.kill)
        cls.commands = {"C++": [PROGRAM, cls.server.address],
                        "Python": [sys.executable, "-B", FOLDER / "poisson.py"]}

    def run_command(self, *command):
        environment = os.environ | {"WELLSPACE_SERVER": self.server.address}
        return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=PATIENCE, check=False,
                              env=environment)

    def solve(self, language, dimension, rounds):
        """The vertices and the error of each round."""
        done = self.run_command(*self.commands[language], dimension, rounds)
        self.assertEqual(done.returncode, 0, done.stderr)
        steps = [(int(n), float(e)) for n, e in re.findall(r"(\d+) vertices, error (\S+)", done.stdout)]
        self.assertEqual(len(steps), rounds, done.stdout)
        return steps

    def check_rates(self, dimension, rounds):
        """The order of the error in the number of vertices, over the last two steps; and that both programs agree."""
        both = [self.solve(language, dimension, rounds) for language in self.commands]
        for steps in both:
            (before, coarse), (after, fine) = steps[-3], steps[-1]
            self.assertGreater(after, 2 * before)
            self.assertGreater(math.log(coarse / fine) / math.log(after / before), 0.9 / dimension, steps)
        # Of the same mesh they say the same. Their sizes differ by rounding, and other sizes give other meshes.
        for step, ((n, error), (m, other)) in enumerate(zip(*both)):
            self.assertLessEqual(abs(n / m - 1), 0.15 if step > 0 else 0, both)
            self.assertLessEqual(abs(error / other - 1), 0.15 if step > 0 else 0.005, both)

    def test_in_the_plane(self):
        self.check_rates(2, 8)

    def test_in_space(self):
        self.check_rates(3, 4)

    def test_what_fails_is_said(self):
        done = self.run_command(PROGRAM, "nowhere")
        self.assertEqual(done.returncode, 1)
        self.assertIn("INVALID_ARGUMENT", done.stderr)
        self.assertEqual(self.run_command(PROGRAM, self.server.address, 4).returncode, 2)

    def test_they_are_short(self):
        for name, most, of_the_service in (("poisson.py", 45, 8), ("poisson.cc", 170, 14)):
            lines = [line for line in (FOLDER / name).read_text().splitlines() if line]
            self.assertLessEqual(len(lines), most)
            about = [line for line in lines if re.search(r"session|wellspace|client[:.]", line)]
            self.assertLessEqual(len(about), of_the_service, about)


if __name__ == "__main__":
    unittest.main()
