"""Makes `wellspace/_api.binpb`, the descriptors of the API, of the protos, and stubs; copies `wellspace/viewer.html`.

From the repository the protos are compiled by protoc, or by grpcio-tools where there is no protoc. A source
distribution has both files, since it is built away from the repository.
"""

import pathlib
import shutil
import subprocess
import sys

import setuptools
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))  # where a tool builds the package, it is not there

from make_stubs import make_stubs  # noqa: E402

PROTOS = HERE.parent.parent / "proto"
VIEWER = HERE.parent / "viewer" / "page.html"
DESCRIPTORS = pathlib.Path("wellspace", "_api.binpb")
PAGE = pathlib.Path("wellspace", "viewer.html")
FILES = ("wellspace/v1/*.proto", "google/rpc/*.proto", "grpc/health/v1/*.proto")


def compile_protos(target):
    """Writes the descriptors to `target`; a source distribution has them already."""
    target.parent.mkdir(parents=True, exist_ok=True)
    compiled = HERE / "src" / DESCRIPTORS
    if not (PROTOS / "wellspace" / "v1").is_dir():
        if not compiled.is_file():
            sys.exit(f"setup.py: neither {PROTOS} nor {compiled} is there")
        if compiled != target:
            shutil.copyfile(compiled, target)
        return
    names = [str(path.relative_to(PROTOS)) for pattern in FILES for path in sorted(PROTOS.glob(pattern))]
    compiler = ["protoc"] if shutil.which("protoc") else [sys.executable, "-m", "grpc_tools.protoc"]
    arguments = [f"--proto_path={PROTOS}", "--include_imports", f"--descriptor_set_out={target}", *names]
    subprocess.run([*compiler, *arguments], check=True)


def copy_page(target):
    """Copies the page of the viewer to `target`; a source distribution has it already."""
    copied = HERE / "src" / PAGE
    source = VIEWER if VIEWER.is_file() else copied
    if not source.is_file():
        sys.exit(f"setup.py: neither {VIEWER} nor {copied} is there")
    if source != target:
        shutil.copyfile(source, target)


class BuildWithMadeFiles(build_py):
    """Adds the descriptors and the page to what is built."""

    def run(self):
        super().run()
        folder = pathlib.Path(self.build_lib).resolve()
        compile_protos(folder / DESCRIPTORS)
        copy_page(folder / PAGE)
        make_stubs(HERE / "src" / "wellspace", folder / "wellspace")


class SdistWithMadeFiles(sdist):
    """Adds the descriptors and the page to the sources."""

    def make_release_tree(self, base_dir, files):
        super().make_release_tree(base_dir, files)
        folder = pathlib.Path(base_dir).resolve() / "src"
        for file, make in ((DESCRIPTORS, compile_protos), (PAGE, copy_page)):
            (folder / file).unlink(missing_ok=True)  # may be a link into the tree
            make(folder / file)


setuptools.setup(cmdclass={"build_py": BuildWithMadeFiles, "sdist": SdistWithMadeFiles})
