"""The installed files for development: programs of others find them, build and run; headers stand alone.

    consumers_test.py [--subproject]

With --subproject a program is built that has the core as a subproject, which compiles the core.
"""
import concurrent.futures
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BIN = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"])
PATIENCE = 600
# Of Debian's, which are found by CMake, but are not needed by the core.
NOT_OF_THE_CORE = ["gRPC", "Protobuf", "OpenSSL", "SQLite3", "spdlog", "CLI11", "nlohmann_json", "prometheus-cpp",
                   "ZLIB", "PkgConfig", "Hdf5Static", "GTest", "CGAL"]


def run(*command, exit_code=0, **environment):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=PATIENCE, check=False,
                          env=os.environ | environment)
    assert done.returncode == exit_code, f"{command}\n{done.stdout[-8000:]}\n{done.stderr[-8000:]}"
    return done.stdout + done.stderr


def in_folder(test):
    """A folder that is gone after the test."""
    folder = tempfile.TemporaryDirectory()
    test.addCleanup(folder.cleanup)
    return pathlib.Path(folder.name)


@unittest.skipIf(os.environ.get("WELLSPACE_SANITIZE"), "programs of others are built without sanitizers")
class Consumers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        installed = pathlib.Path(folder.name) / "first"
        run("cmake", "--install", BIN.parent, "--component", "development", "--prefix", installed)
        # No installed file knows where it was installed to.
        cls.prefix = installed.rename(pathlib.Path(folder.name) / "moved")
        cls.library_dir = next(cls.prefix.glob("lib/**/libwellspace_core.a")).parent

    def configure(self, text, exit_code=0):
        folder = in_folder(self)
        (folder / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.25)\nproject(any LANGUAGES CXX)\n"
                                               + text)
        return run("cmake", "-G", "Ninja", "-S", folder, "-B", folder / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}",
                   exit_code=exit_code)

    def build(self, source, program="consumer"):
        folder = in_folder(self)
        run("cmake", "-G", "Ninja", "-S", source, "-B", folder, f"-DCMAKE_PREFIX_PATH={self.prefix}",
            "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror")
        run("cmake", "--build", folder)
        return folder / program

    def build_by_pkg_config(self, name, *modules):
        program = in_folder(self) / "consumer"
        path = {"PKG_CONFIG_PATH": str(self.library_dir / "pkgconfig")}
        flags = run("pkg-config", "--cflags", "--libs", *modules, **path).split()
        run("g++", "-std=c++20", "-O1", HERE / name / "main.cc", "-o", program, *flags)
        return program

    def mesh_by_core(self, program):
        self.assertRegex(run(program), r"^\d+ vertices, \d+ simplices: OK\n$")

    def run_with_server(self, program, *arguments):
        """Runs a program, which gets the address of a server of its own."""
        server = subprocess.Popen([BIN / "wellspaced", "--listen", "127.0.0.1:0"], stdout=subprocess.PIPE, text=True,
                                  stderr=subprocess.DEVNULL)
        try:
            address = server.stdout.readline().removeprefix("listening on ").strip()
            return run(program, address, *arguments)
        finally:
            server.kill()
            server.wait()
            server.stdout.close()

    def mesh_by_server(self, program):
        mesh = in_folder(self) / "spot.npz"
        output = self.run_with_server(program, ROOT / "examples" / "spot.csv", mesh)
        vertices = re.fullmatch(r"(\d+) vertices\n", output)[1]
        self.assertRegex(run(BIN / "wellspace", "check", mesh), f"^vertices +{int(vertices):,}\n")

    def test_every_header_compiles_alone(self):
        headers = sorted((self.prefix / "include").rglob("*.h"))
        names = {header.relative_to(self.prefix / "include").as_posix() for header in headers}
        self.assertLessEqual({"wellspace/core/meshers/mesher.h", "wellspace/client/client.h",
                              "wellspace/client/formats/read_cloud.h",
                              "wellspace/client/formats/domain/read_planar_domain.h"}, names)
        folder = in_folder(self)

        def compile_alone(name):
            source = folder / (name.replace("/", "_") + ".cc")
            source.write_text(f"#include <{name}>\n#include <{name}>\n")
            run("g++", "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-I", self.prefix / "include",
                source)

        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(compile_alone, names))

    def test_no_header_sees_what_is_not_installed(self):
        for header in (self.prefix / "include").rglob("*.h"):
            for included in re.findall(r'#\s*include "([^"]+)"', header.read_text()):
                known = included.startswith("absl/") or (self.prefix / "include" / included).is_file()
                self.assertTrue(known, f"{header}: {included}")

    def test_nothing_names_the_machine_that_built_it(self):
        for folder in (self.library_dir / "cmake", self.library_dir / "pkgconfig", self.prefix / "include"):
            for file in filter(pathlib.Path.is_file, folder.rglob("*")):
                for path in (ROOT, BIN.parent):
                    self.assertNotIn(str(path), file.read_text(), file)

    def test_core_by_find_package(self):
        self.mesh_by_core(self.build(HERE / "core"))

    def test_core_by_pkg_config(self):
        self.mesh_by_core(self.build_by_pkg_config("core", "wellspace-core"))

    def test_client_and_formats_by_find_package(self):
        self.mesh_by_server(self.build(HERE / "client"))

    def test_example_of_a_solver(self):
        output = self.run_with_server(self.build(ROOT / "examples" / "poisson", "poisson"), 2, 2)
        self.assertRegex(output, r"^(\d+ vertices, error \S+\n){2}$")

    def test_client_and_formats_by_pkg_config(self):
        self.mesh_by_server(self.build_by_pkg_config("client", "wellspace-client-files"))

    def test_core_wants_neither_grpc_nor_files(self):
        disabled = "".join(f"set(CMAKE_DISABLE_FIND_PACKAGE_{name} ON)\n" for name in NOT_OF_THE_CORE)
        self.configure(disabled + "find_package(wellspace REQUIRED COMPONENTS core)\n"
                       "if(NOT TARGET wellspace::core OR TARGET wellspace::client)\nmessage(FATAL_ERROR no)\nendif()\n")

    def test_all_without_components(self):
        targets = "core client formats formats_domain formats_surface client_files"
        self.configure(f"find_package(wellspace REQUIRED)\nforeach(name {targets})\n"
                       "if(NOT TARGET wellspace::${name})\n"
                       "message(FATAL_ERROR ${name})\nendif()\nendforeach()\n")

    def test_versions(self):
        self.configure("find_package(wellspace 0.2 REQUIRED COMPONENTS core)\n")
        for other in ("0.1", "0.3", "1.0", "0.2.99"):
            output = self.configure(f"find_package(wellspace {other} REQUIRED COMPONENTS core)\n", exit_code=1)
            self.assertIn("compatible with requested version", re.sub(r"\s+", " ", output))

    def test_unknown_component(self):
        output = self.configure("find_package(wellspace REQUIRED COMPONENTS core solver)\n", exit_code=1)
        self.assertIn("has no component 'solver'. The components are core, formats, client and client_files",
                      re.sub(r"\s+", " ", output))
        self.configure("find_package(wellspace REQUIRED COMPONENTS core OPTIONAL_COMPONENTS solver)\n"
                       "if(wellspace_solver_FOUND OR NOT wellspace_core_FOUND)\nmessage(FATAL_ERROR no)\nendif()\n")


@unittest.skipIf(os.environ.get("WELLSPACE_SANITIZE"), "configures alone")
class Parts(unittest.TestCase):
    def test_core_alone_looks_for_nothing_else(self):
        folder = in_folder(self)
        disabled = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in NOT_OF_THE_CORE]
        run("cmake", "-G", "Ninja", "-S", ROOT, "-B", folder, "-DWELLSPACE_COMPONENTS=core", *disabled)
        targets = run("ninja", "-C", folder, "-t", "targets", "all")
        self.assertIn("libwellspace_core.a", targets)
        for other in ("libwellspace_client.a", "libwellspace_proto.a", "libwellspace_formats.a", "bin/wellspaced"):
            self.assertNotIn(other, targets)

    @unittest.skipUnless((BIN.parent / "build.ninja").exists(), "wants a build by Ninja")
    def test_core_is_made_of_abseil_onetbb_and_boost(self):
        """The headers that went into the objects of the core, by their packages."""
        inputs = run("ninja", "-C", BIN.parent, "-t", "inputs", "core/libwellspace_core.a",
                     "core/libwellspace_core_sliver.a",
                     "core/libwellspace_core_refine.a", "core/libwellspace_core_geometry.a").split()
        objects = [name for name in inputs if name.endswith(".o")]
        self.assertGreater(len(objects), 40)
        headers = set(re.findall(r"^    (/usr/\S+)$", run("ninja", "-C", BIN.parent, "-t", "deps", *objects),
                                 re.MULTILINE))
        owners = run("dpkg-query", "--search", *sorted({str(pathlib.Path(header).resolve()) for header in headers}))
        packages = {owner.split(":")[0] for line in owners.splitlines()
                    for owner in line.rsplit(": ", 1)[0].split(", ")}
        compiler = {"libc6-dev", "libgcc-12-dev", "libstdc++-12-dev", "linux-libc-dev"}
        self.assertEqual(packages - compiler, {"libabsl-dev", "libtbb-dev", "libboost1.74-dev"})

    def test_unknown_part(self):
        output = run("cmake", "-G", "Ninja", "-S", ROOT, "-B", in_folder(self), "-DWELLSPACE_COMPONENTS=core;solver",
                     exit_code=1)
        self.assertIn("WELLSPACE_COMPONENTS has 'solver'; there are: core;formats;client;server;tool;python",
                      re.sub(r"\s+", " ", output))

    def test_subproject_keeps_to_itself(self):
        folder = in_folder(self)
        (folder / "CMakeLists.txt").write_text(f"""
cmake_minimum_required(VERSION 3.25)
project(any LANGUAGES CXX)
get_cmake_property(before VARIABLES)
set(WELLSPACE_COMPONENTS core)
add_subdirectory({ROOT} wellspace)
foreach(name CMAKE_CXX_STANDARD CMAKE_BUILD_TYPE CMAKE_MODULE_PATH CMAKE_RUNTIME_OUTPUT_DIRECTORY BUILD_TESTING)
  if(NOT "${{${{name}}}}" STREQUAL "")
    message(FATAL_ERROR "${{name}} is now '${{${{name}}}}'")
  endif()
endforeach()
file(WRITE ${{CMAKE_BINARY_DIR}}/main.cc "int main() {{}}")
add_executable(mine ${{CMAKE_BINARY_DIR}}/main.cc)
""")
        build = folder / "build"
        run("cmake", "-G", "Ninja", "-S", folder, "-B", build, "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON")
        commands = {entry["file"]: entry["command"]
                    for entry in json.loads((build / "compile_commands.json").read_text())}
        for file, command in commands.items():
            self.assertNotIn("-Werror", command, file)
        self.assertNotIn("-std=", commands[str(build / "main.cc")])
        names = set(re.findall(r"^(\w+)(?:-ADVANCED)?:", (build / "CMakeCache.txt").read_text(), re.MULTILINE))
        ours = {name for name in names if name.startswith(
            ("CTEST", "BUILD_TESTING", "GTest", "gRPC", "CMAKE_INSTALL_LIBDIR"))}
        self.assertEqual(ours, set())
        self.assertFalse((build / "wellspace" / "tests").exists())
        run("cmake", "--install", build, "--prefix", folder / "prefix")
        self.assertEqual([path for path in (folder / "prefix").rglob("*") if path.is_file()], [])


class Subproject(unittest.TestCase):
    def test_core_as_a_subproject(self):
        folder = in_folder(self)
        run("cmake", "-G", "Ninja", "-S", HERE / "subproject", "-B", folder, f"-DWELLSPACE_SOURCE_DIR={ROOT}",
            "-DCMAKE_BUILD_TYPE=Release")
        run("cmake", "--build", folder)
        self.assertRegex(run(folder / "consumer"), r"^\d+ vertices, \d+ simplices: OK\n$")


if __name__ == "__main__":
    if shutil.which("ninja") is None:
        sys.exit("consumers_test: wants Ninja: deploy/install-deps.sh build")
    if "--subproject" in sys.argv:
        sys.argv.remove("--subproject")
        unittest.main(defaultTest="Subproject")
    unittest.main(defaultTest=["Consumers", "Parts"])
