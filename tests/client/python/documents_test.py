"""The code in documents, docstrings and examples is run."""

import ast
import asyncio
import contextlib
import doctest
import importlib
import inspect
import io
import os
import pathlib
import pkgutil
import re
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np
from support import PATIENCE, ROOT

import wellspace

EXAMPLES = sorted((ROOT / "examples" / "python").glob("*.py"))


class DocumentsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)

    def run_blocks(self, path, least):
        """Runs the blocks of Python in a document, one after the other, as one program."""
        text = path.read_text(encoding="utf-8")
        found = re.finditer(r"```python\n(.*?)```", text, re.S)
        blocks = [(text.count("\n", 0, block.start()) + 1, block[1]) for block in found]
        self.assertGreaterEqual(len(blocks), least)
        names = {"__name__": "document"}
        with contextlib.redirect_stdout(io.StringIO()):
            for line, block in blocks:
                with self.subTest(f"{path.name}:{line}"):
                    exec(compile("\n" * line + block, str(path), "exec"), names)

    def test_guide(self):
        self.run_blocks(ROOT / "docs" / "python.md", 10)

    def test_tutorial(self):
        self.run_blocks(ROOT / "docs" / "tutorial.md", 8)

    def test_readme_of_the_package(self):
        self.run_blocks(ROOT / "client" / "python" / "README.md", 1)

    def test_readme(self):
        self.run_blocks(ROOT / "README.md", 1)

    def test_readmes_need_no_other_packages(self):
        """The first documents run with the packages that are needed, without those that are only suggested."""
        hidden = {name: None for name in ("meshio", "pyvista", "tqdm", "tqdm.auto", "scipy")}
        with mock.patch.dict(sys.modules, hidden):
            self.run_blocks(ROOT / "client" / "python" / "README.md", 1)
            self.run_blocks(ROOT / "README.md", 1)

    def test_docstrings(self):
        """Their examples run; their output is not compared."""
        found = 0
        for module in pkgutil.iter_modules(wellspace.__path__, "wellspace."):
            imported = importlib.import_module(module.name)
            for test in doctest.DocTestFinder().find(imported, module.name):
                source = "".join(example.source for example in test.examples)
                if not source:
                    continue
                found += 1
                names = {"np": np, "wellspace": wellspace, "points": np.random.default_rng(1).uniform(size=(50, 3)),
                         "LocalServer": wellspace.LocalServer}
                with self.subTest(test.name):
                    self.run_lines(source, names)
        self.run_lines("".join(e.source for e in doctest.DocTestParser().get_examples(wellspace.__doc__)), {})
        self.assertGreaterEqual(found, 3)

    @staticmethod
    def run_lines(source, names):
        result = eval(compile(source, "docstring", "exec", ast.PyCF_ALLOW_TOP_LEVEL_AWAIT), names)
        if inspect.iscoroutine(result):
            asyncio.run(result)

    def test_every_public_name_has_a_docstring(self):
        for name in wellspace.__all__:
            thing = getattr(wellspace, name)
            if callable(thing):
                self.assertTrue(thing.__doc__, name)
                for method, value in vars(thing).items() if inspect.isclass(thing) else ():
                    if not method.startswith("_") and callable(value):
                        self.assertTrue(value.__doc__, f"{name}.{method}")


class ExamplesTest(unittest.TestCase):
    def run_example(self, name):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, "-B", ROOT / "examples" / "python" / name], cwd=folder, text=True,
                                  capture_output=True, timeout=PATIENCE, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            return done.stdout, sorted(path.name for path in pathlib.Path(folder).iterdir())

    def test_all_are_run_here(self):
        self.assertEqual([path.name for path in EXAMPLES],
                         ["many_meshes.py", "plate.py", "quickstart.py", "session.py"])

    def test_quickstart(self):
        output, files = self.run_example("quickstart.py")
        self.assertIn("smallest dihedral angle: 12", output)
        self.assertEqual(files, ["spot.vtu"])

    def test_session(self):
        output, _ = self.run_example("session.py")
        self.assertIn("neighbours", output)

    def test_plate(self):
        output, _ = self.run_example("plate.py")
        self.assertIn("between 0.0 and 100.0 degrees", output)

    def test_many_meshes(self):
        output, _ = self.run_example("many_meshes.py")
        self.assertEqual(output.count("<wellspace.Mesh"), 4)
        self.assertIn("too long", output)


if __name__ == "__main__":
    unittest.main()
