"""Wheel and source distribution: built without a network, installed elsewhere, and used from there."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest
import zipfile

from support import PATIENCE, ROOT

CODE = """
import sys, numpy, wellspace
assert wellspace.__file__.startswith(sys.argv[1]), wellspace.__file__
points = numpy.loadtxt(sys.argv[2], delimiter=",", skiprows=1)
mesh = wellspace.mesh(points)
assert (mesh.points[mesh.input_vertices] == points).all()
print(len(mesh.points), wellspace.__version__)
"""


class PackageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        # A copy: builds leave files behind.
        shutil.copytree(ROOT / "client" / "python", cls.folder / "tree" / "client" / "python", symlinks=True)
        shutil.copytree(ROOT / "proto", cls.folder / "tree" / "proto")
        (cls.folder / "tree" / "client" / "viewer").mkdir()
        shutil.copy(ROOT / "client" / "viewer" / "page.html", cls.folder / "tree" / "client" / "viewer")
        shutil.copy(ROOT / "LICENSE", cls.folder / "tree")
        cls.run_python("-m", "build", "--no-isolation", "--outdir", cls.folder / "dist",
                       cls.folder / "tree" / "client" / "python")
        (cls.wheel,) = (cls.folder / "dist").glob("*.whl")
        (cls.sdist,) = (cls.folder / "dist").glob("*.tar.gz")

    @classmethod
    def run_python(cls, *arguments, python="/usr/bin/python3", **changes):
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        # Whatever would ask the network fails.
        environment |= {"PIP_NO_INDEX": "1", "http_proxy": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9",
                        **changes}
        done = subprocess.run([python, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE,
                              env=environment, cwd=cls.folder, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def test_contents(self):
        folder = ROOT / "client" / "python" / "src" / "wellspace"
        sources = {path.name for path in folder.iterdir() if path.suffix in (".py", ".typed")}
        with zipfile.ZipFile(self.wheel) as wheel:
            names = {name for name in wheel.namelist() if name.startswith("wellspace/")}
            made = {"_api.binpb", "viewer.html", "__init__.pyi", "_client.pyi", "_sessions.pyi", "aio.pyi"}
            self.assertEqual(names, {f"wellspace/{name}" for name in sources | made})
            stub = wheel.read("wellspace/__init__.pyi").decode()
            (metadata,) = [wheel.read(name).decode() for name in wheel.namelist() if name.endswith("METADATA")]
            descriptors = wheel.read("wellspace/_api.binpb")
            page = wheel.read("wellspace/viewer.html")
        for line in ("Name: wellspace", "Requires-Dist: grpcio", "Requires-Dist: numpy", "License: Apache-2.0",
                     "Description-Content-Type: text/markdown"):
            self.assertIn(line, metadata)
        self.assertTrue(self.wheel.name.endswith("-py3-none-any.whl"))
        self.assertIn("size: Number | None", stub)
        with tarfile.open(self.sdist) as sdist:
            names = {name.partition("/")[2] for name in sdist.getnames()}
            prefix = self.sdist.name.removesuffix(".tar.gz")
            self.assertEqual(sdist.extractfile(f"{prefix}/src/wellspace/_api.binpb").read(), descriptors)
            self.assertEqual(sdist.extractfile(f"{prefix}/src/wellspace/viewer.html").read(), page)
        self.assertEqual(page, (ROOT / "client" / "viewer" / "page.html").read_bytes())
        self.assertLessEqual({"LICENSE", "README.md", "setup.py", "make_stubs.py", "pyproject.toml",
                              "src/wellspace/py.typed"}, names)

    def test_debian_package_says_the_same(self):
        """METADATA.in, from which it has its metadata, against those of the wheel."""

        def plain(text):
            return [re.sub(r"[() ]", "", line) for line in text.splitlines() if "Version" not in line.partition(":")[0]]

        with zipfile.ZipFile(self.wheel) as wheel:
            (metadata,) = [wheel.read(name).decode() for name in wheel.namelist() if name.endswith("METADATA")]
        debian = plain((ROOT / "client" / "python" / "METADATA.in").read_text(encoding="utf-8"))
        required = {line for line in plain(metadata) if line.startswith("Requires-") and "extra==" not in line}
        self.assertLessEqual(set(debian), set(plain(metadata)))
        self.assertEqual({line for line in debian if line.startswith("Requires-")}, required)

    def test_version_is_that_of_the_project(self):
        cmake = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
        version = self.wheel.name.split("-")[1]
        self.assertIn(f"project(wellspace VERSION {version} ", cmake)
        released = re.search(r"^## \[(\d.*)\] - ", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
        self.assertEqual(released[1], version, "the last release of CHANGELOG.md")

    def test_installed_by_pip_into_an_environment(self):
        environment = self.folder / "environment"
        self.run_python("-m", "venv", "--system-site-packages", environment)
        python = environment / "bin" / "python3"
        self.run_python("-m", "pip", "install", "--no-index", "--no-deps", self.wheel, python=python)
        output = self.run_python("-c", CODE, environment, ROOT / "examples" / "spot.csv", python=python)
        self.assertRegex(output, r"^\d{4} \d+\.\d+\.\d+$")

    def test_built_from_the_source_distribution_alone(self):
        """Without protoc: it has the descriptors."""
        with tarfile.open(self.sdist) as sdist:
            sdist.extractall(self.folder / "sources")
        (source,) = (self.folder / "sources").iterdir()
        target = self.folder / "target"
        tools = self.folder / "tools"
        tools.mkdir()
        self.run_python("-m", "pip", "install", "--no-index", "--no-deps", "--no-build-isolation", "--target", target,
                        source, PATH=str(tools))
        output = self.run_python("-B", "-c", CODE, target, ROOT / "examples" / "spot.csv", PYTHONPATH=str(target))
        self.assertRegex(output, r"^\d{4} \d+\.\d+\.\d+$")

    def test_the_sources_alone_say_what_they_are(self):
        source = self.folder / "tree" / "client" / "python" / "src"
        code = "import wellspace"
        done = subprocess.run([sys.executable, "-B", "-c", code], env={**os.environ, "PYTHONPATH": str(source)},
                              capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.assertIn("this is the source of wellspace, not a build of it", done.stderr)


if __name__ == "__main__":
    unittest.main()
