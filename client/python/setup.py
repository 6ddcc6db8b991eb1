"""Makes `wellspace/_api.binpb`, the descriptors of the API, of the protos.

From the repository they are compiled by protoc, or by grpcio-tools where there is no protoc. A source distribution has
them compiled, since it is built away from the protos.
"""

import pathlib
import shutil
import subprocess
import sys

import setuptools
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = pathlib.Path(__file__).resolve().parent
PROTOS = HERE.parent.parent / "proto"
DESCRIPTORS = pathlib.Path("wellspace", "_api.binpb")
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


class BuildWithDescriptors(build_py):
    """Adds the descriptors to what is built."""

    def run(self):
        super().run()
        compile_protos(pathlib.Path(self.build_lib).resolve() / DESCRIPTORS)


class SdistWithDescriptors(sdist):
    """Adds the descriptors to the sources."""

    def make_release_tree(self, base_dir, files):
        super().make_release_tree(base_dir, files)
        target = pathlib.Path(base_dir).resolve() / "src" / DESCRIPTORS
        target.unlink(missing_ok=True)  # may be a link into the tree
        compile_protos(target)


setuptools.setup(cmdclass={"build_py": BuildWithDescriptors, "sdist": SdistWithDescriptors})
