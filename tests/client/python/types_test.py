"""The type hints: of the package, strictly; of programs that use it, as mypy has them without options; the stubs."""

import ast
import importlib
import importlib.util
import inspect
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from support import PATIENCE, ROOT

import wellspace
import wellspace.aio

PACKAGE = pathlib.Path(wellspace.__file__).parent
STUBS = ("__init__", "_client", "_sessions", "aio")

# A program without a fault.
GOOD = """
from typing import Any
import numpy as np
import wellspace
import wellspace.aio

points = np.zeros((3, 2))
mesh: wellspace.Mesh = wellspace.mesh(points, size=0.1, segments=[[0, 1]], box=([0.0, 0.0], [1.0, 1.0]), rho=None)
wellspace.mesh(points, size=0.1 * np.ptp(points), max_vertices=np.int64(1000), box=mesh.box)
wellspace.mesh([[0, 0]], box=[[0, 0], [1, 1]], size_boxes=[(points[0], points[1], np.float32(0.2))])
wellspace.mesh(points, box=(points.min(axis=0), points.max(axis=0)), server="127.0.0.1:7233", timeout=10)
arguments: dict[str, Any] = {"size": 1}
wellspace.mesh(points, **arguments)
angle: float = mesh.statistics.min_angle_deg if mesh.statistics is not None else 0.0
with wellspace.LocalServer("--max-threads", "2") as server, wellspace.Client(server) as client:
    address: str = client.address
    client.mesh(points, pump_weights=True)
with wellspace.Session(3, rho=2.0, ttl=60, labels={"a": "b"}) as session:
    operation: wellspace.Operation = session.refine(progress=lambda event: print(event.fraction), size=0.1)
    session.add_triangles(triangles=[[0, 1, 2]], solids="holes", weld=0.1)
    name: str = session.name
    part: wellspace.MeshPart = session.download(part=0, parts=2)
    whole: wellspace.Mesh = session.download(since=mesh)
    session.close()

async def later() -> wellspace.Mesh:
    async with await wellspace.aio.Session.create(3, size=1.0) as session:
        count: int = await session.upload([[0, 0, 0]], offset=0)
        await session.add([[0, 0, 0]], near=[0])
        await session.refine(rho=2.0, restart=True)
        part: wellspace.MeshPart = await session.download(part=0, parts=2)
    return await wellspace.aio.mesh([[0, 0]], progress=True)
"""
# Lines with one fault each, and what mypy says of it.
BAD = (
    ('wellspace.mesh([[0, 0]], mesh_size=1)', 'keyword argument "mesh_size" for "mesh"'),
    ('wellspace.mesh([[0, 0]], sise=1)', 'keyword argument "sise" for "mesh"'),
    ('wellspace.mesh([[0, 0]], size="small")', 'has incompatible type "str"'),
    ('wellspace.mesh([[0, 0]], 0.1)', 'Too many positional arguments for "mesh"'),
    ('wellspace.mesh([[0, 0]], max_vertices=1.5)', 'has incompatible type "float"'),
    ('wellspace.estimate([[0, 0]], progress=True)', 'keyword argument "progress" for "estimate"'),
    ('wellspace.Client().mesh([[0, 0]], mesh_size=3)', 'keyword argument "mesh_size" for "mesh" of "Client"'),
    ('wellspace.Client().adress', '"Client" has no attribute "adress"'),
    ('wellspace.Session("3")', 'has incompatible type "str"; expected "int"'),
    ('wellspace.Session(3, mesh_size=1)', 'keyword argument "mesh_size" for "Session"'),
    ('wellspace.Session(3).refine(progress=3)', '"progress" to "refine"'),
    ('wellspace.Session(3).refine(mesh_size=3)', 'keyword argument "mesh_size" for "refine"'),
    ('wellspace.Session(3).start_refinement(progress=True)', 'keyword argument "progress"'),
    ('wellspace.Session(2).add_segments(segment=[[0, 1]])', 'keyword argument "segment"'),
    ('wellspace.Session(3).add_triangles(segments=[[0, 1]])', 'keyword argument "segments"'),
    ('await wellspace.aio.mesh([[0, 0]], mesh_size=1)', 'keyword argument "mesh_size" for "mesh"'),
    ('await wellspace.aio.Session.create(3, mesh_size=1)', 'keyword argument "mesh_size" for "create"'),
    ('await session.refine(mesh_size=1)', 'keyword argument "mesh_size" for "refine" of "Session"'),
    ('await session.locate([[0, 0, 0]], alow_outside=True)', 'did you mean "allow_outside"'),
    ('await session.download(prat=0, parts=2)', 'No overload variant of "download"'),
    ('number: int = wellspace.mesh([[0, 0]])', 'expression has type "Mesh"'),
    ('wellspace.mesh([[0, 0]]).simplexes', '"Mesh" has no attribute "simplexes"'),
    ('wellspace.meesh([[0, 0]])', 'Module has no attribute "meesh"'),
)
START = "import wellspace\nimport wellspace.aio\n\nasync def work(session: wellspace.aio.Session) -> None:\n"


@unittest.skipUnless(importlib.util.find_spec("mypy"), "wants mypy")
class MypyTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())

    def mypy(self, path, *arguments):
        """What mypy prints; `path` is where it finds the package."""
        command = [sys.executable, "-m", "mypy", "--cache-dir", f"{self.folder}/cache", *arguments]
        environment = {**os.environ, "MYPYPATH": str(path)}
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=3 * PATIENCE,
                              env=environment, cwd=self.folder, check=False)
        return done.stdout + done.stderr

    def test_the_package(self):
        """The code itself, for which mypy would take the stubs where they are beside it; and the stubs."""
        configuration = ("--config-file", ROOT / "client/python/pyproject.toml")
        for path in (ROOT / "client/python/src", PACKAGE.parent):
            self.assertIn("no issues found", self.mypy(path, *configuration, "-p", "wellspace"))
        self.assertTrue((PACKAGE / "py.typed").exists())

    def test_programs(self):
        """Without any option; as in site-packages, mypy is silent of what is imported."""
        good, bad = pathlib.Path(self.folder, "good.py"), pathlib.Path(self.folder, "bad.py")
        good.write_text(GOOD)
        bad.write_text(START + "".join(f"    {line}\n" for line, _ in BAD))
        found = self.mypy(PACKAGE.parent, "--config-file", os.devnull, "--follow-imports", "silent", good, bad)
        self.assertNotIn("good.py", found)
        wrong = {int(number) for number in re.findall(r"bad\.py:(\d+): error: ", found)}
        first = START.count("\n") + 1
        self.assertEqual(wrong, set(range(first, first + len(BAD))), found)
        for number, (line, message) in enumerate(BAD, first):
            with self.subTest(line):
                self.assertRegex(found, rf"bad\.py:{number}: error: .*{message}")


class StubsTest(unittest.TestCase):
    """The stubs say what the functions say of themselves."""

    def functions(self):
        """Pairs of a function in a stub, one node or one for each overload, and the same as it runs."""
        for name in STUBS:
            module = importlib.import_module(f"wellspace.{name}" if name != "__init__" else "wellspace")
            tree = ast.parse((PACKAGE / f"{name}.pyi").read_text(encoding="utf-8"))
            for node in tree.body:
                thing = getattr(module, node.name, None) if hasattr(node, "name") else None
                if inspect.isfunction(thing):
                    yield [node], thing
                elif inspect.isclass(thing):
                    methods = [one for one in node.body if isinstance(one, (ast.FunctionDef, ast.AsyncFunctionDef))]
                    named = {one.name: [other for other in methods if other.name == one.name] for one in methods}
                    public = {key for key, value in vars(thing).items() if not key.startswith("_") and callable(value)}
                    self.assertLessEqual(public, named.keys(), f"{name}.{node.name}")
                    for key, one in named.items():
                        value = vars(thing)[key]
                        if not isinstance(value, property):
                            yield one, getattr(value, "__func__", value)

    def test_signatures_are_the_same(self):
        count = 0
        for nodes, function in self.functions():
            if (function.__module__, function.__name__) == ("wellspace.aio", "create"):
                function = wellspace.Session.__init__
            with self.subTest(f"{function.__module__}.{function.__qualname__}"):
                count += 1
                expected = [p for p in inspect.signature(function).parameters.values() if p.name not in ("self", "cls")]
                arguments = [one for node in nodes
                             for one in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
                found = {one.arg for one in arguments} - {"self", "cls"}
                self.assertEqual(found, {one.name for one in expected if not one.kind.name.startswith("VAR_")})
                self.assertFalse(any(node.args.kwarg for node in nodes), "one without a name hides misspelt ones")
                node = nodes[0]
                if not node.name.startswith("__") or node.name == "__init__":
                    self.assertTrue(all(one.annotation is not None or one.arg in ("self", "cls") for one in arguments))
        self.assertGreater(count, 60)

    def test_docstrings_are_whole(self):
        documents = {}
        for (node, *_), function in self.functions():
            documents[f"{function.__module__}.{function.__qualname__}"] = ast.get_docstring(node) or ""
            self.assertNotIn("**arguments", ast.get_docstring(node) or "")
        for name in ("wellspace.mesh", "wellspace._sessions.Session.refine", "wellspace.aio.Session.refine"):
            self.assertIn("\nsize_boxes : sequence of (low, high, size)\n    Boxes with", documents[name])
            self.assertEqual(documents[name].count("\nsize : "), 1)

    def test_an_attribute_without_a_type_is_an_error(self):
        with tempfile.TemporaryDirectory() as folder:
            sources = pathlib.Path(folder, "sources")
            sources.mkdir()
            for name in STUBS:
                code = "class A:\n    def f(self) -> None:\n        self.x = 1\n" if name == "aio" else "__all__ = []\n"
                (sources / f"{name}.py").write_text(code)
            done = subprocess.run([sys.executable, "-B", ROOT / "client/python/make_stubs.py", sources, folder],
                                  capture_output=True, text=True, timeout=PATIENCE, check=False)
            self.assertEqual(done.returncode, 1)
            self.assertIn("aio.A.x has no type in the class", done.stderr)


if __name__ == "__main__":
    unittest.main()
