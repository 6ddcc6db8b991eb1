"""Solvers and other programs use the boundary that meshes have: FreeFEM, Gmsh, dolfinx, OpenFOAM, meshio, CalculiX.

Wants freefem++, gmsh, python3-gmsh, python3-meshio, python3-dolfinx, openfoam and calculix-ccx, as
deploy/install-deps.sh installs them for interoperability and solvers; what is not installed is skipped.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy

from wellspaced import BIN, ROOT

# The clouds; and the maximum of u on each, −Δu = 1 with u = 0 on the boundary of the box.
CLOUDS = {2: ("coast-110m.csv", 12365), 3: ("spot.csv", 0.252)}
NAMES = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"]


def has_module(name):
    return subprocess.run([sys.executable, "-c", f"import {name}"], capture_output=True, timeout=120).returncode == 0


class Solvers(unittest.TestCase):
    """Meshes of both clouds, in every format."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.counts = {}
        for dimension, (cloud, _) in CLOUDS.items():
            for name, format in ((".mesh", "medit"), (".msh", "msh41"), ("-22.msh", "msh22"), (".npz", "npz"),
                                 (".xdmf", "xdmf")):
                cls.wellspace("mesh", ROOT / "examples" / cloud, "--dimension", dimension, "-o", f"{dimension}{name}",
                              "--format", format, "--quiet")
            with numpy.load(cls.folder / f"{dimension}.npz") as mesh:
                cls.counts[dimension] = numpy.bincount(mesh["facet_tags"], minlength=2 * dimension + 1)[1:]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def wellspace(cls, *arguments):
        subprocess.run([BIN / "wellspace", *map(str, arguments)], cwd=cls.folder, check=True, timeout=120)

    def run_program(self, *command, **environment):
        result = subprocess.run(list(map(str, command)), cwd=self.folder, text=True, timeout=240,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=os.environ | environment)
        self.assertEqual(result.returncode, 0, result.stdout)
        return result.stdout

    @unittest.skipUnless(shutil.which("FreeFem++"), "freefem++ is not installed")
    def test_freefem_solves_with_conditions_on_labels(self):
        scripts = {2: 'mesh Th = readmesh("2.mesh");\nfespace Vh(Th, P1);\nVh u, v;\n'
                      'solve Poisson(u, v) = int2d(Th)(dx(u)*dx(v) + dy(u)*dy(v)) - int2d(Th)(v)'
                      ' + on(1, 2, 3, 4, u = 0);\n'
                      'real area = int1d(Th, 2)(1.), outward = int1d(Th, 2)(N.x);\n',
                   3: 'mesh3 Th = readmesh3("3.mesh");\nfespace Vh(Th, P1);\nVh u, v;\n'
                      'solve Poisson(u, v) = int3d(Th)(dx(u)*dx(v) + dy(u)*dy(v) + dz(u)*dz(v)) - int3d(Th)(v)'
                      ' + on(1, 2, 3, 4, 5, 6, u = 0);\n'
                      'real area = int2d(Th, 2)(1.), outward = int2d(Th, 2)(N.x);\n'}
        for dimension, (_, expected) in CLOUDS.items():
            with self.subTest(dimension=dimension):
                (self.folder / "poisson.edp").write_text(
                    scripts[dimension] +
                    'cout << "figures " << u[].max << " " << Th.nbe << " " << area << " " << outward << endl;\n'
                    'int[int] found = labels(Th);\ncout << "labels " << found.n << endl;\n')
                text = self.run_program("FreeFem++", "-nw", "-ne", "poisson.edp")
                figures = re.search(r"^figures (\S+) (\d+) (\S+) (\S+)$", text, re.MULTILINE)
                self.assertIsNotNone(figures, text)
                self.assertAlmostEqual(float(figures[1]), expected, delta=0.01 * expected)
                self.assertEqual(int(figures[2]), self.counts[dimension].sum())
                self.assertAlmostEqual(float(figures[4]) / float(figures[3]), 1, places=9,
                                       msg="the normal of xmax is that of x")
                self.assertRegex(text, rf"(?m)^labels {2 * dimension}$")

    @unittest.skipUnless(shutil.which("gmsh") and has_module("gmsh"), "gmsh or python3-gmsh is not installed")
    def test_gmsh_lists_named_groups(self):
        script = """
import sys, gmsh
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open(sys.argv[1])
for dimension, tag in gmsh.model.getPhysicalGroups():
    count = 0
    for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
        count += sum(map(len, gmsh.model.mesh.getElements(dimension, entity)[1]))
    print("group", dimension, tag, gmsh.model.getPhysicalName(dimension, tag), count)
gmsh.finalize()
"""
        for dimension in CLOUDS:
            for name in (f"{dimension}.msh", f"{dimension}-22.msh"):
                with self.subTest(name=name):
                    text = self.run_program(sys.executable, "-c", script, name)
                    groups = re.findall(r"^group (\d) (\d+) (\w+) (\d+)$", text, re.MULTILINE)
                    boundary = [group for group in groups if int(group[0]) == dimension - 1]
                    self.assertEqual([(int(tag), part, int(count)) for _, tag, part, count in boundary],
                                     list(zip(range(1, 2 * dimension + 1), NAMES, self.counts[dimension])))
                    regions = [group for group in groups if int(group[0]) == dimension]
                    self.assertEqual([part for _, _, part, _ in regions], ["domain"])
                    self.assertNotRegex(self.run_program("gmsh", "-check", name), "Error|Warning")

    @unittest.skipUnless(has_module("meshio"), "python3-meshio is not installed")
    def test_meshio_makes_markers_of_su2(self):
        import meshio
        # The writer of Debian's 7.0.0 unpacks blocks of cells, which have ceased to be tuples.
        if not hasattr(meshio.CellBlock, "__iter__"):
            meshio.CellBlock.__iter__ = lambda block: iter((block.type, block.data))
        for dimension in CLOUDS:
            with self.subTest(dimension=dimension):
                mesh = meshio.read(self.folder / f"{dimension}-22.msh")
                mesh.points = mesh.points[:, :dimension]  # as its command with --prune-z-0
                mesh.write(self.folder / "mesh.su2")
                text = (self.folder / "mesh.su2").read_text()
                self.assertEqual(re.findall(r"(?m)^NMARK= ?(\d+)$", text), [str(2 * dimension)])
                counts = [int(count) for count in re.findall(r"(?m)^MARKER_ELEMS= ?(\d+)$", text)]
                self.assertEqual(sorted(counts), sorted(self.counts[dimension]))

    @unittest.skipUnless(has_module("dolfinx.io"), "python3-dolfinx is not installed")
    def test_dolfinx_reads_xdmf_with_facet_tags(self):
        script = """
import sys, numpy
from mpi4py import MPI
from dolfinx.io import XDMFFile
with XDMFFile(MPI.COMM_WORLD, sys.argv[1] + ".xdmf", "r") as file:
    mesh = file.read_mesh(name="mesh")
    regions = file.read_meshtags(mesh, name="mesh")
mesh.topology.create_connectivity(mesh.topology.dim - 1, mesh.topology.dim)
with XDMFFile(MPI.COMM_WORLD, sys.argv[1] + "_boundary.xdmf", "r") as file:
    facets = file.read_meshtags(mesh, name="boundary")
print("tags", *numpy.bincount(facets.values)[1:])
print("cells", len(regions.values), *set(regions.values))
"""
        for dimension in CLOUDS:
            with self.subTest(dimension=dimension):
                text = self.run_program(sys.executable, "-c", script, dimension)
                with numpy.load(self.folder / f"{dimension}.npz") as mesh:
                    self.assertIn(f"cells {len(mesh['simplices'])} 1\n", text)
                self.assertIn("tags " + " ".join(map(str, self.counts[dimension])), text)

    @unittest.skipUnless(has_module("dolfinx.io.gmshio") and has_module("gmsh"), "python3-dolfinx is not installed")
    def test_dolfinx_gets_facet_tags(self):
        script = """
import sys, gmsh, numpy
from mpi4py import MPI
from dolfinx.io import gmshio
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open(sys.argv[1])
mesh, cells, facets = gmshio.model_to_mesh(gmsh.model, MPI.COMM_WORLD, 0, gdim=int(sys.argv[2]))
gmsh.finalize()
print("tags", *numpy.bincount(facets.values)[1:])
print("cells", len(cells.values), len(set(cells.values)))
"""
        for dimension in CLOUDS:
            with self.subTest(dimension=dimension):
                text = self.run_program(sys.executable, "-c", script, f"{dimension}.msh", dimension)
                self.assertIn("tags " + " ".join(map(str, self.counts[dimension])), text)
                self.assertRegex(text, r"(?m)^cells \d+ 1$")

    @unittest.skipUnless(shutil.which("gmshToFoam"), "openfoam is not installed")
    def test_openfoam_finds_six_patches(self):
        system = self.folder / "system"
        system.mkdir(exist_ok=True)
        header = "FoamFile {{ version 2.0; format ascii; class dictionary; object {}; }}\n"
        control = ("application none; startFrom startTime; startTime 0;\n"
                   "stopAt endTime; endTime 1; deltaT 1; writeControl timeStep; writeInterval 1;\n")
        (system / "controlDict").write_text(header.format("controlDict") + control)
        (system / "fvSchemes").write_text(header.format("fvSchemes"))
        (system / "fvSolution").write_text(header.format("fvSolution"))
        self.run_program("gmshToFoam", "3-22.msh", WM_PROJECT_DIR="/usr/share/openfoam")
        boundary = (self.folder / "constant/polyMesh/boundary").read_text()
        patches = dict(re.findall(r"(?m)^    (\w+)\s*\{[^}]*?nFaces\s+(\d+);", boundary))
        self.assertEqual({name: int(count) for name, count in patches.items()}, dict(zip(NAMES, self.counts[3])))

    @unittest.skipUnless(shutil.which("ccx"), "calculix-ccx is not installed")
    def test_calculix_puts_vertices_where_they_are(self):
        """A displacement that is linear on the boundary is linear everywhere, at the places that CalculiX has read.

        It reads 20 characters of a number: coordinates are such that need up to 24.
        """
        for dimension in (2, 3):
            with self.subTest(dimension=dimension):
                random = numpy.random.default_rng(52)
                points = random.uniform(-1, 1, (60, dimension)) * 1e-4
                points[0] = -8.708810636114117e-05
                name = f"tiny{dimension}"
                numpy.savetxt(self.folder / f"{name}.csv", points, fmt="%.17g", delimiter=",")
                for extension in ("inp", "npz"):
                    self.wellspace("mesh", f"{name}.csv", "--dimension", dimension, "-o", f"{name}.{extension}",
                                   "--quiet")
                with numpy.load(self.folder / f"{name}.npz") as mesh:
                    vertices, tags = mesh["points"], mesh["vertex_tags"]
                written = (self.folder / f"{name}.inp").read_text().split("*ELEMENT")[0].split("*NODE\n")[1]
                widths = [len(field.strip()) for line in written.splitlines() for field in line.split(",")]
                self.assertEqual(max(widths), 20, "there are numbers of more than 20 characters")
                gradient = random.uniform(-1, 1, (dimension, dimension)) * 1e-3
                expected = vertices @ gradient.T
                conditions = [f"{vertex + 1}, {axis + 1}, {axis + 1}, {float(expected[vertex, axis])!r}"
                              for vertex in numpy.flatnonzero(tags) for axis in range(dimension)]
                (self.folder / f"deck{dimension}.inp").write_text("\n".join(
                    [f"*INCLUDE, INPUT={name}.inp", "*NSET, NSET=all, GENERATE", f"1, {len(vertices)}, 1",
                     "*MATERIAL, NAME=steel", "*ELASTIC", "210000., 0.3",
                     "*SOLID SECTION, ELSET=domain, MATERIAL=steel",
                     *(["1e-5"] if dimension == 2 else []), "*BOUNDARY", *(line for line in self.in_width(conditions)),
                     "*STEP", "*STATIC", "*NODE PRINT, NSET=all", "U", "*END STEP", ""]))
                self.run_program("ccx", "-i", f"deck{dimension}")
                text = (self.folder / f"deck{dimension}.dat").read_text()
                rows = re.findall(r"(?m)^ +(\d+) +(\S+E\S+) +(\S+E\S+) +(\S+E\S+)$", text)
                self.assertEqual(len(rows), len(vertices))
                found = numpy.array([[float(x) for x in row[1:dimension + 1]] for row in rows])
                numpy.testing.assert_allclose(found, expected, atol=1e-5 * numpy.abs(expected).max())

    @unittest.skipUnless(shutil.which("ccx"), "calculix-ccx is not installed")
    def test_calculix_bends_a_bar_of_second_order(self):
        """The force that bends a clamped bar, 10 long, by 0.01: 3 E I u / L^3. Tetrahedra of 4 nodes are too stiff."""
        corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 10)]
        sides = ["0 2 3 1", "4 5 7 6", "0 1 5 4", "2 6 7 3", "0 4 6 2", "1 3 7 5"]
        (self.folder / "bar.smesh").write_text("\n".join(
            ["8 3 0 0", *(f"{i} {x} {y} {z}" for i, (x, y, z) in enumerate(corners)),
             "6 1", *(f"4 {side} {tag}" for tag, side in enumerate(sides, 1)), "0", "0", ""]))
        forces = {}
        for order, kind in ((1, "C3D4"), (2, "C3D10")):
            self.wellspace("mesh", "bar.smesh", "-o", f"bar{order}.inp", "--edge-length", 1.2, "--order", order,
                           "--quiet")
            self.assertIn(f"TYPE={kind}, ELSET=domain", (self.folder / f"bar{order}.inp").read_text())
            (self.folder / f"bend{order}.inp").write_text("\n".join(
                [f"*INCLUDE, INPUT=bar{order}.inp", "*MATERIAL, NAME=steel", "*ELASTIC", "210000., 0.3",
                 "*SOLID SECTION, ELSET=domain, MATERIAL=steel", "*BOUNDARY", "marker_5, 1, 3", "marker_6, 3, 3, 0.01",
                 "*STEP", "*STATIC", "*NODE PRINT, NSET=marker_5, TOTALS=ONLY", "RF", "*END STEP", ""]))
            self.run_program("ccx", "-i", f"bend{order}")
            forces[order] = -float((self.folder / f"bend{order}.dat").read_text().split()[-1])
        self.assertAlmostEqual(forces[2], 0.525, delta=0.02 * 0.525)
        self.assertGreater(forces[1], 2 * 0.525)

    @staticmethod
    def in_width(conditions):
        """Values of conditions in the 20 characters that CalculiX reads of them."""
        for condition in conditions:
            start, value = condition.rsplit(", ", 1)
            yield f"{start}, {float(value):.12e}"


if __name__ == "__main__":
    unittest.main()
