"""Meshes in files and as objects of other packages, against the tool and meshio."""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import types
import unittest
from unittest import mock

import meshio
import numpy as np
from support import PATIENCE, TOOL, Case, spot, uniform, unit_box

import wellspace
from wellspace import InvalidArgumentError, MissingPackageError
from wellspace._tool import MESH_FORMATS as FORMATS

SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
RING = [[0, 1], [1, 2], [2, 3], [3, 0]]


def square():
    """The arrays of a file with one triangle."""
    return {"points": np.array([[0, 0], [1, 0], [0, 1]], float), "simplices": np.array([[0, 1, 2]])}


class FilesTest(Case):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def tool(self, *arguments):
        command = [TOOL, *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def assert_same(self, one, other):
        for name in ("points", "simplices", "facets", "facet_tags", "regions", "vertex_origins", "vertex_tags"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name)
        self.assertEqual((one.facet_names, one.region_names), (other.facet_names, other.region_names))

    def test_npz_is_what_the_tool_reads(self):
        mesh = wellspace.mesh(spot())
        mesh.save(self.folder / "spot.npz")
        np.savetxt(self.folder / "spot.csv", spot(), "%r", ",")
        report = self.tool("check", self.folder / "spot.npz", "--cloud", self.folder / "spot.csv", "--rho", "2")
        self.assertIn("valid", report)
        self.assertIn("6 tags", report)
        self.assert_same(wellspace.Mesh.load(self.folder / "spot.npz"), mesh)

    def test_npz_of_every_kind(self):
        meshes = [
            wellspace.mesh(uniform(50, 2), boundary=False),
            wellspace.mesh(uniform(20, 4)),
            wellspace.mesh(uniform(300, 3), pump_weights=True, min_dihedral=0),
            wellspace.mesh(SQUARE, segments=RING, markers=[7, 7, 0, 0], regions=[(0.5, 0.5, 4)]),
        ]
        for mesh in meshes:
            mesh.save(self.folder / "mesh.npz")
            loaded = wellspace.Mesh.load(str(self.folder / "mesh.npz"))
            self.assert_same(loaded, mesh)
            self.assertEqual(loaded.simplices.dtype, mesh.simplices.dtype)
            np.testing.assert_array_equal(loaded.weights, mesh.weights)
            self.tool("check", self.folder / "mesh.npz")

    def test_reads_what_the_tool_writes(self):
        np.savetxt(self.folder / "spot.csv", spot(), "%r", ",")
        self.tool("mesh", self.folder / "spot.csv", "-o", self.folder / "spot.npz", "--quiet")
        self.assert_same(wellspace.Mesh.load(self.folder / "spot.npz"), wellspace.mesh(spot()))

    def test_files_that_are_wrong(self):
        path = self.folder / "wrong.npz"
        for content, message in ((b"text", "expected .npz"), (b"", "expected .npz")):
            path.write_bytes(content)
            with self.subTest(content), self.fails(InvalidArgumentError, message, field="path"):
                wellspace.Mesh.load(path)
        points = np.zeros((3, 2))
        for arrays, message in (({"points": points}, "no array 'simplices'"),
                                ({"points": points, "simplices": np.zeros((1, 4), int)}, "4 vertices in 2-D"),
                                ({"points": points, "simplices": [[0, 1, 3]]},
                                 "simplices[0] has 3; expected a vertex from 0, below 3"),
                                ({"points": points, "simplices": [[0, 1, 2], [0, -1, 2]]}, "simplices[1] has -1"),
                                ({"points": points, "simplices": [[0.0, 1.0, 2.5]]}, "simplices is of float64"),
                                ({"points": [[0, 0], [0, np.nan], [1, 1]], "simplices": [[0, 1, 2]]},
                                 "points[1] has nan; expected a finite number"),
                                ({**square(), "weights": [1, np.inf, 1]}, "weights[1] has inf"),
                                ({**square(), "weights": [1, 1]}, "weights has the shape (2,); expected (3,)"),
                                ({**square(), "facets": [[0, 7]], "facet_tags": [1]}, "facets[0] has 7"),
                                ({**square(), "facets": [[0, 1]], "facet_tags": [1, 2]}, "facet_tags has the shape"),
                                ({**square(), "facets": [[0, 1]], "facet_tags": [2], "facet_names": ["a"],
                                  "facet_name_tags": [1]}, "facet_tags[0] has 2; expected a tag that has a name"),
                                ({**square(), "vertex_tags": [0, 9, 0], "facet_names": ["a"], "facet_name_tags": [1]},
                                 "vertex_tags[1] has 9"),
                                ({**square(), "vertex_origins": [0, 1, -4]}, "vertex_origins[2] has -4"),
                                ({**square(), "regions": [3], "region_ids": [1], "region_names": ["a"]},
                                 "regions[0] has 3"),
                                ({**square(), "regions": [1, 1]}, "regions has the shape (2,)"),
                                ({**square(), "region_ids": [1], "region_names": ["a", "b"]}, "region_ids has")):
            np.savez(path, **arrays)
            with self.fails(InvalidArgumentError, message, field="path"):
                wellspace.Mesh.load(path)
        with self.assertRaises(FileNotFoundError):
            wellspace.Mesh.load(self.folder / "none.npz")

    def test_a_file_is_whole_or_not_there(self):
        mesh = wellspace.mesh(uniform(50, 2))
        path = self.folder / "mesh.npz"
        mesh.save(path)
        before = path.read_bytes()
        with mock.patch("numpy.savez", side_effect=OSError("disk full")), self.assertRaises(OSError):
            mesh.save(path)
        self.assertEqual([file.name for file in self.folder.iterdir()], ["mesh.npz"])
        self.assertEqual(path.read_bytes(), before)
        with self.fails(InvalidArgumentError, ".npz takes no options", field="binary"):
            mesh.save(path, binary=True)

    def test_what_the_tool_writes_to_the_byte(self):
        outlet = wellspace.mesh(SQUARE, segments=RING, markers=[7, 7, 0, 0], regions=[(0.5, 0.5, 4)], edge_length=0.3)
        for mesh in (wellspace.mesh(spot(), size=0.4), outlet, wellspace.mesh(uniform(30, 3), pump_weights=True)):
            mesh.save(self.folder / "mesh.npz")
            for suffix in sorted(FORMATS):
                if suffix in (".14", ".grd", ".gr3", ".2dm") and mesh.points.shape[1] == 3:
                    continue
                with self.subTest(suffix, d=mesh.points.shape[1]):
                    (self.folder / "own").mkdir(exist_ok=True)
                    self.tool("convert", self.folder / "mesh.npz", self.folder / f"mesh{suffix}")
                    mesh.save(self.folder / "own" / f"mesh{suffix}")
                    for file in (self.folder / "own").iterdir():
                        self.assertEqual(file.read_bytes(), (self.folder / file.name).read_bytes(), file.name)
                        file.unlink()

    def test_the_formats_are_all_of_the_tool(self):
        manual = self.tool("manual", "--format", "markdown").split("### `wellspace convert")[1].replace("\\|", "|")
        told = re.search(r"--format ([a-z0-9|]+)", manual).group(1).split("|")
        of_names = {"msh41": ".msh", "msh22": ".msh", "medit": ".mesh", "abaqus": ".inp", "adcirc": ".14"}
        others = {".hdf", ".ele", ".grd", ".gr3"}  # further extensions of formats with several
        self.assertEqual({of_names.get(name, "." + name) for name in told}, FORMATS - others | {".npz"})

    def test_the_extensions_are_all_of_the_tool(self):
        wellspace.mesh(uniform(20, 2)).save(self.folder / "mesh.npz")
        command = [TOOL, "convert", self.folder / "mesh.npz", self.folder / "mesh.none"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
        told = re.search(r"expected one of (.*), or the name of a format", done.stderr)
        self.assertIsNotNone(told, done.stderr)
        self.assertEqual(set(told.group(1).split(", ")), FORMATS | {".npz"})

    def test_meshes_of_other_formats_are_read(self):
        mesh = wellspace.mesh(SQUARE, segments=RING, markers=[7, 7, 0, 0], regions=[(0.5, 0.5, 4)], edge_length=0.3)
        for suffix in (".vtu", ".msh", ".mesh", ".vtk"):
            mesh.save(self.folder / f"mesh{suffix}")
            loaded = wellspace.Mesh.load(self.folder / f"mesh{suffix}")
            np.testing.assert_array_equal(loaded.points, mesh.points, suffix)
            np.testing.assert_array_equal(loaded.simplices, mesh.simplices, suffix)
            self.assertEqual(sorted(loaded.facet_names.values()), sorted(mesh.facet_names.values()), suffix)

    def test_errors_of_the_tool(self):
        mesh = wellspace.mesh(uniform(50, 3))
        with self.fails(InvalidArgumentError, "2-D", field="path"):
            mesh.save(self.folder / "mesh.2dm")
        with self.assertRaises(FileNotFoundError):
            mesh.save(self.folder / "none" / "mesh.vtu")
        with self.assertRaises(FileNotFoundError):
            wellspace.Mesh.load(self.folder / "none.vtu")
        (self.folder / "wrong.msh").write_text("$MeshFormat\nno\n")
        with self.fails(InvalidArgumentError, "wrong.msh", field="path"):
            wellspace.Mesh.load(self.folder / "wrong.msh")
        self.assertEqual([file.name for file in self.folder.iterdir()], ["wrong.msh"])
        with mock.patch.dict(os.environ, {"WELLSPACE_TOOL_BINARY": str(self.folder / "no-tool")}):
            with self.fails(MissingPackageError, "WELLSPACE_TOOL_BINARY"):
                wellspace.Mesh.load(self.folder / "wrong.msh")

    @mock.patch.dict(os.environ, {"WELLSPACE_TOOL_BINARY": "/nowhere"})
    def test_meshio(self):
        for mesh, kinds in ((wellspace.mesh(uniform(50, 2), box=unit_box(2)), ("triangle", "line")),
                            (wellspace.mesh(uniform(50, 3), box=unit_box(3)), ("tetra", "triangle"))):
            converted = mesh.to_meshio()
            self.assertEqual(tuple(block.type for block in converted.cells), kinds)
            np.testing.assert_array_equal(converted.cells[0].data, mesh.simplices)
            np.testing.assert_array_equal(converted.cell_data["wellspace:tag"][1], mesh.facet_tags)
            self.assertEqual(list(converted.field_data["xmax"]), [2, mesh.dimension - 1])
            self.assertEqual(list(converted.field_data["domain"]), [1, mesh.dimension])
            np.testing.assert_array_equal(converted.point_data["wellspace:origin"], mesh.vertex_origins)
            for name in ("mesh.vtu", "mesh.msh", "mesh.mesh", "mesh.vtk"):
                mesh.save(self.folder / name)
                read = meshio.read(self.folder / name)
                np.testing.assert_array_equal(read.points[:, : mesh.dimension], mesh.points)
                np.testing.assert_array_equal(read.cells_dict[kinds[0]], mesh.simplices)
            read = meshio.gmsh.read(self.folder / "mesh.msh")
            self.assertEqual(list(read.field_data["ymin"]), [3, mesh.dimension - 1])
            tags = read.cell_data_dict["gmsh:physical"]
            np.testing.assert_array_equal(tags[kinds[1]], mesh.facet_tags)
            read = meshio.read(self.folder / "mesh.vtu")
            np.testing.assert_array_equal(read.cell_data["wellspace:tag"][1], mesh.facet_tags)
            mesh.save(self.folder / "text.vtu", binary=False)
            self.assertIn(b"ascii", (self.folder / "text.vtu").read_bytes())

    def test_meshio_is_in_two_and_three_dimensions(self):
        mesh = wellspace.mesh(uniform(5, 4))
        for convert in (mesh.to_meshio, mesh.to_pyvista if "pyvista" in sys.modules else mesh.to_meshio):
            with self.fails(InvalidArgumentError, "a mesh in 4-D"):
                convert()

    def test_packages_that_are_not_installed(self):
        mesh = wellspace.mesh(uniform(5, 2))
        without = mock.patch.dict(os.environ, {"WELLSPACE_TOOL_BINARY": "/nowhere"})
        with without, mock.patch.dict(sys.modules, {"meshio": None, "pyvista": None}):
            with self.fails(MissingPackageError, "meshio is needed or the tool wellspace on the path, to write .vtu"):
                mesh.save(self.folder / "mesh.vtu")
            with self.fails(MissingPackageError, "meshio is needed for to_meshio"):
                mesh.to_meshio()
            with self.fails(MissingPackageError, "pyvista is needed for to_pyvista"):
                mesh.to_pyvista()
            mesh.save(self.folder / "mesh.npz")
        with self.assertRaises(ImportError), mock.patch.dict(sys.modules, {"pyvista": None}):
            mesh.to_pyvista()

    def test_pyvista(self):
        """Against the documented arguments of pyvista: it is no package of Debian 12."""

        class UnstructuredGrid:
            def __init__(self, cells, celltypes, points):
                self.cells, self.celltypes, self.points = cells, celltypes, points
                self.cell_data, self.point_data = {}, {}

        with mock.patch.dict(sys.modules, {"pyvista": types.SimpleNamespace(UnstructuredGrid=UnstructuredGrid)}):
            for d, kind in ((2, 5), (3, 10)):
                mesh = wellspace.mesh(uniform(20, d))
                grid = mesh.to_pyvista()
                cells = grid.cells.reshape(-1, d + 2)
                self.assertTrue((cells[:, 0] == d + 1).all() and (grid.celltypes == kind).all())
                np.testing.assert_array_equal(cells[:, 1:], mesh.simplices)
                self.assertEqual(grid.points.shape, (len(mesh.points), 3))
                np.testing.assert_array_equal(grid.cell_data["region"], mesh.regions)
                np.testing.assert_array_equal(grid.point_data["tag"], mesh.vertex_tags)

    def test_the_tool_says_the_same_of_it(self):
        mesh = wellspace.mesh(uniform(200, 3))
        mesh.save(self.folder / "mesh.npz")
        figures = json.loads(self.tool("check", self.folder / "mesh.npz", "--output", "json"))
        self.assertIn(str(len(mesh.simplices)), json.dumps(figures))


if __name__ == "__main__":
    unittest.main()
