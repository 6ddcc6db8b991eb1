"""The pages of docs/solvers: their commands and programs run, and give the results that are said there.

A block ```LANGUAGE NAME is a file; blocks ```sh and ```python are run, in the order of the page. Commands of
`wellspace` run for every page, all others where the page's solver is installed.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from wellspaced import BIN, ROOT

PAGES = ROOT / "docs" / "solvers"
PACKAGE = os.environ["PYTHONPATH"]
BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def has_module(name):
    return subprocess.run([sys.executable, "-c", f"import {name}"], capture_output=True, timeout=120).returncode == 0


class Page:
    """A page in a folder of its own, with the plate and a cloud."""

    def __init__(self, test, name):
        temporary = tempfile.TemporaryDirectory()
        test.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.test = test
        programs = self.folder / "programs"
        programs.mkdir()
        (programs / "python3").symlink_to(sys.executable)
        self.environment = os.environ | {"PATH": f"{programs}:{BIN}:{os.environ['PATH']}", "PYTHONPATH": PACKAGE,
                                         "WM_PROJECT_DIR": "/usr/share/openfoam"}
        shutil.copy(ROOT / "examples" / "spot.csv", self.folder)
        for _, file, text in BLOCK.findall((PAGES / "README.md").read_text(encoding="utf-8")):
            self.write(file, text)
        self.blocks = BLOCK.findall((PAGES / f"{name}.md").read_text(encoding="utf-8"))

    def write(self, file, text):
        path = self.folder / file
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def run_block(self, *command):
        done = subprocess.run(command, cwd=self.folder, env=self.environment, text=True, timeout=240,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        self.test.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout

    def run_ours(self):
        """Runs the commands of wellspace alone."""
        lines = [line for language, _, text in self.blocks if language == "sh" for line in text.splitlines()]
        ours = [line for line in lines if line.startswith("wellspace ")]
        self.test.assertTrue(ours)
        self.run_block("bash", "-euc", "\n".join(ours))

    def run_all(self):
        output = ""
        for language, file, text in self.blocks:
            if file:
                self.write(file, text)
            elif language == "sh":
                output += self.run_block("bash", "-euc", text)
            elif language == "python":
                output += self.run_block(sys.executable, "-c", text)
        return output


class SolverPagesTest(unittest.TestCase):
    def test_commands_of_every_page(self):
        for name in ("freefem", "dolfinx", "openfoam", "calculix", "su2"):
            with self.subTest(page=name):
                Page(self, name).run_ours()

    def check_largest(self, name):
        """The largest value of −Δu = 1 on the plate, which linear elements of this size find."""
        found = re.search(r"^largest (\S+)$", Page(self, name).run_all(), re.MULTILINE)
        self.assertIsNotNone(found)
        self.assertAlmostEqual(float(found[1]), 0.1527, delta=0.002)

    @unittest.skipUnless(shutil.which("FreeFem++"), "freefem++ is not installed")
    def test_freefem(self):
        self.check_largest("freefem")

    @unittest.skipUnless(has_module("dolfinx.fem.petsc"), "python3-dolfinx is not installed")
    def test_dolfinx(self):
        self.check_largest("dolfinx")

    @unittest.skipUnless(has_module("skfem"), "scikit-fem is not installed")
    def test_scikit_fem(self):
        self.check_largest("scikit-fem")

    @unittest.skipUnless(shutil.which("gmshToFoam"), "openfoam is not installed")
    def test_openfoam(self):
        self.assertRegex(Page(self, "openfoam").run_all(), r"(?m)^6$")

    @unittest.skipUnless(shutil.which("ccx"), "calculix-ccx is not installed")
    def test_calculix(self):
        page = Page(self, "calculix")
        page.run_all()
        printed = (page.folder / "pulled.dat").read_text()
        force = re.search(r"^ +(\S+E\S+) +(\S+E\S+) +(\S+E\S+)$", printed, re.MULTILINE)
        # Between a plate without the hole, 630, and the two strips beside it alone, 420.
        self.assertGreater(float(force[1]), 420)
        self.assertLess(float(force[1]), 630)

    @unittest.skipUnless(shutil.which("SU2_CFD"), "SU2 is not installed")
    def test_su2(self):
        self.assertIn("Exit Success", Page(self, "su2").run_all())

    @unittest.skipUnless(has_module("scipy.sparse"), "python3-scipy is not installed")
    def test_time(self):
        output = Page(self, "time").run_all()
        found = re.search(r"^(\d+) vertices, heat (\S+)$", output, re.MULTILINE)
        self.assertIsNotNone(found)
        self.assertAlmostEqual(float(found[2]), 0.00785, delta=0.01 * 0.00785)
        fixed = re.search(r"^(\d+) vertices of the fixed mesh, error (\S+) times that$", output, re.MULTILINE)
        self.assertIsNotNone(fixed)
        self.assertLess(float(fixed[2]), 2)
        self.assertLess(3 * int(found[1]), int(fixed[1]))


if __name__ == "__main__":
    unittest.main()
