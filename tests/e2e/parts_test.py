"""Parts of meshes, from files and from sessions: they add up to the mesh; Gmsh and VTK read them; a parallel solver
gets the solution of one rank.

Wants gmsh, python3-gmsh and python3-vtk9, and python3-mpi4py and python3-petsc4py, as deploy/install-deps.sh installs
them for interoperability and solvers; what is not installed is skipped.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy

from wellspaced import BIN, ROOT, Wellspaced


def has_module(name):
    return subprocess.run([sys.executable, "-c", f"import {name}"], capture_output=True, timeout=120).returncode == 0


class Parts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.wellspace("mesh", ROOT / "examples" / "spot.csv", "-o", "mesh.npz", "--quiet")
        cls.wellspace("convert", "mesh.npz", "mesh.msh")
        cls.whole = dict(numpy.load(cls.folder / "mesh.npz"))

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def wellspace(cls, *arguments, code=0):
        done = subprocess.run([BIN / "wellspace", *map(str, arguments)], cwd=cls.folder, timeout=120, text=True,
                              capture_output=True)
        assert done.returncode == code, done.stderr
        return done.stdout if code == 0 else done.stderr

    @classmethod
    def session(cls):
        """A server, and a session with the mesh of the cow."""
        server = Wellspaced()
        cls.addClassCleanup(server.kill)
        remote = ("--server", server.address)
        name = cls.wellspace("session", "create", *remote, "--dimension", 3).strip()
        cls.wellspace("upload", name, ROOT / "examples" / "spot.csv", *remote, "--quiet")
        cls.wellspace("refine", name, *remote, "--quiet")
        return remote, name

    def run_python(self, script, *arguments, ranks=0, server=""):
        mpi = ["mpiexec", "--oversubscribe", "-n", str(ranks)] if ranks > 0 else []
        result = subprocess.run([*mpi, sys.executable, *(["-c"] if "\n" in str(script) else []), str(script),
                                 *map(str, arguments)], cwd=self.folder, text=True, timeout=240,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                env=os.environ | {"WELLSPACE_SERVER": server, "OMPI_ALLOW_RUN_AS_ROOT": "1",
                                                  "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1"})
        self.assertEqual(result.returncode, 0, result.stdout)
        return result.stdout

    def test_parts_add_up_to_the_mesh(self):
        whole = self.whole
        figures = json.loads(self.wellspace("partition", "mesh.npz", "-n", 5, "-o", "five.npz", "--ghost-layers", 2,
                                            "--output", "json"))
        self.assertEqual(sum(figures["parts"]), len(whole["simplices"]))
        self.assertLessEqual(figures["imbalance"], 0.03 + 1e-9)
        seen = {name: [] for name in ("vertices", "simplices", "facets")}
        rows = numpy.full(len(whole["points"]), -1)
        for number in range(5):
            part = dict(numpy.load(self.folder / f"five_{number}.npz"))
            _, _, own_vertices, own_simplices = map(int, part["part"])
            ids = part["vertex_ids"]
            numpy.testing.assert_array_equal(part["points"], whole["points"][ids])
            numpy.testing.assert_array_equal(ids[part["simplices"]], whole["simplices"][part["simplex_ids"]])
            numpy.testing.assert_array_equal(ids[part["facets"]], whole["facets"][part["facet_ids"]])
            numpy.testing.assert_array_equal(part["facet_tags"], whole["facet_tags"][part["facet_ids"]])
            numpy.testing.assert_array_equal(part["vertex_tags"], whole["vertex_tags"][ids])
            self.assertTrue((part["vertex_owners"][:own_vertices] == number).all())
            self.assertTrue((part["simplex_owners"][own_simplices:] != number).all())
            self.assertEqual(figures["ghosts"][number], len(part["simplices"]) - own_simplices)
            rows[ids[:own_vertices]] = part["vertex_rows"][:own_vertices]
            seen["vertices"].append(ids[:own_vertices])
            seen["simplices"].append(part["simplex_ids"][:own_simplices])
            seen["facets"].append(part["facet_ids"])
        for name, count in (("vertices", len(whole["points"])), ("simplices", len(whole["simplices"])),
                            ("facets", len(whole["facets"]))):
            numpy.testing.assert_array_equal(numpy.sort(numpy.concatenate(seen[name])), numpy.arange(count))
        numpy.testing.assert_array_equal(numpy.concatenate([rows[ids] for ids in seen["vertices"]]),
                                         numpy.arange(len(rows)))

    def test_what_cannot_be_is_refused(self):
        for options, words in ((("--parts", 2, "-o", "p.su2"), "parts are written to"),
                               (("--parts", 0, "-o", "p.npz"), "--parts"),
                               (("--ghost-layers", 1, "-o", "p.npz"), "--parts"),
                               (("--parts", 2, "-o", "p.npz", "--order", 2), "--order and --parts"),
                               (("--parts", 2, "-o", "p.npz", "--no-boundary"), "--no-boundary and --parts"),
                               (("--parts", 2, "-o", "p.vtu", "--format", "vtu"), "--format and --parts"),
                               (("--parts", 10**6, "-o", "p.npz"), "parts: 1000000 parts of a mesh of")):
            self.assertIn(words, self.wellspace("mesh", ROOT / "examples" / "swarm.csv", *options, code=2))
        for arguments, words in (((0, "p.npz"), "--parts"), ((2, "p.su2"), "--out p.su2: parts are written to"),
                                 ((10**6, "p.npz"), "parts: 1000000 parts of a mesh of"),
                                 ((2, "mesh.msh"), "MESH")):
            error = self.wellspace("partition", "mesh.msh", "-n", arguments[0], "-o", arguments[1], code=2)
            self.assertIn(words, error)

    @unittest.skipUnless(has_module("gmsh"), "python3-gmsh is not installed")
    def test_gmsh_reads_partitions_and_ghosts(self):
        figures = json.loads(self.wellspace("partition", "mesh.msh", "-n", 6, "-o", "six.msh", "--output", "json"))
        counted = json.loads(self.run_python("""
import collections, gmsh, json
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open("six.msh")
parts, ghosts, facets = collections.Counter(), collections.Counter(), 0
for dimension, tag in gmsh.model.getEntities():
    owners = gmsh.model.getPartitions(dimension, tag)
    if gmsh.model.getType(dimension, tag).startswith("Ghost"):
        ghosts[int(owners[0])] += len(gmsh.model.mesh.getGhostElements(dimension, tag)[0])
        continue
    count = sum(map(len, gmsh.model.mesh.getElements(dimension, tag)[1]))
    facets += count if dimension == 2 else 0
    if dimension == 3 and count:
        parts[int(owners[0])] += count
print(json.dumps([[parts[i] for i in range(1, 7)], [ghosts[i] for i in range(1, 7)], facets]))
gmsh.finalize()
"""))
        self.assertEqual(counted, [figures["parts"], figures["ghosts"], len(self.whole["facets"])])

    @unittest.skipUnless(has_module("vtkmodules"), "python3-vtk9 is not installed")
    def test_vtk_reads_pieces_and_ghosts(self):
        figures = json.loads(self.wellspace("partition", "mesh.npz", "-n", 4, "-o", "four.pvtu", "--output", "json"))
        cells, ghosts, ids = json.loads(self.run_python("""
import json
from vtkmodules.vtkIOXML import vtkXMLPUnstructuredGridReader
from vtkmodules.util.numpy_support import vtk_to_numpy
import vtkmodules.vtkCommonDataModel
reader = vtkXMLPUnstructuredGridReader()
reader.SetFileName("four.pvtu")
reader.Update()
data = reader.GetOutput().GetCellData()
ghosts = vtk_to_numpy(data.GetArray("vtkGhostType"))
ids = vtk_to_numpy(data.GetArray("GlobalCellIds"))[ghosts == 0]
print(json.dumps([reader.GetOutput().GetNumberOfCells(), int((ghosts != 0).sum()), sorted(map(int, ids))]))
"""))
        own = len(self.whole["simplices"]) + len(self.whole["facets"])
        self.assertEqual(ghosts, sum(figures["ghosts"]))
        self.assertEqual(cells, own + ghosts)
        self.assertEqual(ids, list(range(own)))

    def test_a_mesh_in_parts_is_that_of_its_file(self):
        """To the byte: `mesh --parts` writes what `partition` writes of the mesh."""
        for output in ("direct.npz", "direct.msh", "direct.pvtu"):
            self.wellspace("mesh", ROOT / "examples" / "spot.csv", "-o", output, "--parts", 3, "--quiet")
            self.wellspace("partition", "mesh.npz", "-n", 3, "-o", f"of_{output}")
            written = [path.name for path in self.folder.iterdir() if path.name.startswith("direct")
                       and path.suffix in (pathlib.Path(output).suffix, ".vtu")]
            self.assertGreaterEqual(len(written), 1)
            for name in written:
                direct, other = ((self.folder / path).read_bytes() for path in (name, f"of_{name}"))
                self.assertEqual(direct.replace(b"direct_", b"of_direct_"), other, name)
            for path in self.folder.glob("*direct*"):
                path.unlink()

    def test_the_tool_downloads_parts(self):
        remote, name = self.session()
        self.wellspace("download", name, "-o", "whole.npz", *remote, "--quiet")
        self.wellspace("partition", "whole.npz", "-n", 3, "--ghost-layers", 2, "-o", "cut.npz")
        for number in range(3):
            figures = json.loads(self.wellspace("download", name, "--parts", 3, "--part", number, "--ghost-layers", 2,
                                                "-o", "got.npz", *remote, "--output", "json"))
            got, cut = numpy.load(self.folder / "got.npz"), numpy.load(self.folder / f"cut_{number}.npz")
            self.assertEqual(set(got.files), set(cut.files))
            for array in cut.files:
                numpy.testing.assert_array_equal(got[array], cut[array])
            self.assertEqual(figures["own_vertices"], int(cut["part"][2]))
        self.assertIn("part 2 of 3", self.run_tool_for_notes("download", name, "--parts", 3, "--part", 2,
                                                             "-o", "got.vtu", *remote))
        for options, words in ((("--parts", 2, "-o", "p.npz"), "--part"), (("--part", 2, "-o", "p.npz"), "--parts"),
                               (("--parts", 2, "--part", 2, "-o", "p.npz"), "the last is 1"),
                               (("--parts", 2, "--part", 1, "-o", "p.msh"), "a part is written to .vtu or .npz"),
                               (("--parts", 2, "--part", 1, "-o", "p.npz", "--ghost-layers", 17), "0 to 16"),
                               (("--parts", 2, "--part", 1, "-o", "p.npz", "--no-boundary"), "--no-boundary"),
                               (("--parts", 10**6, "--part", 1, "-o", "p.npz"), "each part has at least one")):
            self.assertIn(words, self.wellspace("download", name, *options, *remote, code=2))

    def run_tool_for_notes(self, *arguments):
        done = subprocess.run([BIN / "wellspace", *map(str, arguments)], cwd=self.folder, timeout=120, text=True,
                              capture_output=True, check=True)
        return done.stderr

    @unittest.skipUnless(has_module("petsc4py") and has_module("mpi4py") and shutil.which("mpiexec"),
                         "python3-petsc4py or python3-mpi4py is not installed")
    def test_ranks_solve_what_one_solves(self):
        (_, server), session = self.session()
        solutions = []
        for ranks in (1, 2, 4):
            self.wellspace("partition", "mesh.npz", "-n", ranks, "-o", f"ranks{ranks}.npz")
            for mesh in (session, f"ranks{ranks}"):
                self.run_python(ROOT / "examples" / "poisson" / "parallel_poisson.py", mesh, f"u{ranks}.npy",
                                ranks=ranks, server=server)
                solutions.append(numpy.load(self.folder / f"u{ranks}.npy"))
        self.assertGreater(solutions[0].max(), 0)
        for solution in solutions[1:]:
            self.assertLessEqual(abs(solution - solutions[0]).max(), 1e-10 * solutions[0].max())


if __name__ == "__main__":
    unittest.main()
