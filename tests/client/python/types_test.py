"""The type hints: of the package, strictly, and of programs that use it."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

from support import PATIENCE, ROOT

import wellspace

GOOD = """
import numpy as np
import wellspace
import wellspace.aio

mesh: wellspace.Mesh = wellspace.mesh(np.zeros((3, 2)), size=0.1, segments=[[0, 1]], box=([0.0, 0.0], [1.0, 1.0]))
angle: float = mesh.statistics.min_angle_deg if mesh.statistics is not None else 0.0
with wellspace.Session(3, rho=2.0) as session:
    operation: wellspace.Operation = session.refine(progress=lambda event: print(event.fraction), size=0.1)

async def later() -> wellspace.Mesh:
    return await wellspace.aio.mesh([[0, 0]], progress=True)
"""
BAD = """
import wellspace

wellspace.mesh([[0, 0]], size="small")
wellspace.mesh([[0, 0]], sise=1)
wellspace.Session(3).refine(progress=3)
"""


class TypesTest(unittest.TestCase):
    def mypy(self, *arguments):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "mypy", "--config-file", ROOT / "client/python/pyproject.toml",
                       "--cache-dir", folder, *arguments]
            environment = {**os.environ, "MYPYPATH": str(pathlib.Path(wellspace.__file__).parent.parent)}
            done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=3 * PATIENCE,
                                  env=environment, cwd=folder, check=False)
            return done.stdout + done.stderr

    def test_the_package(self):
        self.assertIn("no issues found", self.mypy("-p", "wellspace"))
        self.assertTrue(pathlib.Path(wellspace.__file__).with_name("py.typed").exists())

    def test_programs(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, code in (("good", GOOD), ("bad", BAD)):
                pathlib.Path(folder, f"{name}.py").write_text(code)
            self.assertIn("no issues found", self.mypy(f"{folder}/good.py"))
            found = self.mypy(f"{folder}/bad.py")
        for line, message in ((4, '"str"; expected "float"'), (5, 'argument "sise"'), (6, '"progress"')):
            self.assertRegex(found, rf"bad.py:{line}: error: .*{message}")
        self.assertIn("Found 3 errors", found)


if __name__ == "__main__":
    unittest.main()
