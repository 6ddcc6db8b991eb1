"""Other people's programs read files of Wellspace, and Wellspace reads theirs; every bit the same."""
import importlib.util
import os
import pathlib
import subprocess
import tempfile
import unittest
import warnings

import meshio
import numpy

CONVERT_MESH = os.environ["CONVERT_MESH"]


def random_mesh(dimension, vertices=3000, simplices=20000):
    random = numpy.random.default_rng(5)
    points = random.integers(0, 2**64, size=(vertices, dimension), dtype=numpy.uint64).view(numpy.float64)
    points = numpy.where(numpy.isfinite(points), points, 0.1)
    cells = random.integers(0, vertices, size=(simplices, dimension + 1))
    return points, cells


def pad(points):
    return numpy.hstack([points, numpy.zeros((len(points), 3 - points.shape[1]))])


def cell_type(dimension):
    return "triangle" if dimension == 2 else "tetra"


class Interoperability(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def convert(self, source, target, *options, format=None):
        formats = [format] if format else []
        subprocess.run([CONVERT_MESH, *options, self.folder / source, self.folder / target, *formats],
                       check=True, timeout=60)

    def assert_same_bits(self, mesh, points, cells, dimension):
        self.assertEqual(mesh.points.dtype, numpy.float64)
        numpy.testing.assert_array_equal(mesh.points.view(numpy.uint64), points.view(numpy.uint64))
        self.assertEqual([block.type for block in mesh.cells], [cell_type(dimension)])
        numpy.testing.assert_array_equal(mesh.cells[0].data, cells)

    def write_pair(self, name, points, cells):
        with open(self.folder / f"{name}.node", "w") as nodes:
            nodes.write(f"{len(points)} {points.shape[1]} 0 0\n")
            nodes.writelines(f"{i} {' '.join(map(repr, map(float, p)))}\n" for i, p in enumerate(points))
        with open(self.folder / f"{name}.ele", "w") as simplices:
            simplices.write(f"{len(cells)} {cells.shape[1]} 0\n")
            simplices.writelines(f"{i} {' '.join(map(str, c))}\n" for i, c in enumerate(cells))

    def test_meshio_reads_our_vtu(self):
        for dimension in (2, 3):
            with self.subTest(dimension=dimension):
                points, cells = random_mesh(dimension)
                self.write_pair("mesh", points, cells)
                self.convert("mesh.node", "mesh.vtu")
                mesh = meshio.read(self.folder / "mesh.vtu")
                self.assert_same_bits(mesh, pad(points), cells, dimension)
                numpy.testing.assert_array_equal(mesh.point_data["input"], numpy.zeros(len(points)))

    def test_we_read_the_vtu_of_meshio(self):
        for dimension in (2, 3):
            for options in ({"binary": False}, {"binary": True, "compression": None},
                            {"binary": True, "compression": "zlib"}):
                with self.subTest(dimension=dimension, **options):
                    points, cells = random_mesh(dimension)
                    theirs = meshio.Mesh(pad(points), [(cell_type(dimension), cells)])
                    if not options["binary"]:  # meshio writes 11 digits
                        theirs.points = numpy.round(numpy.clip(theirs.points, -1e6, 1e6), 3)
                    theirs.write(self.folder / "theirs.vtu", **options)
                    self.convert("theirs.vtu", "ours.vtu")
                    self.assert_same_bits(meshio.read(self.folder / "ours.vtu"),
                                          meshio.read(self.folder / "theirs.vtu").points, cells, dimension)

    def test_meshio_reads_our_tetgen_pair_and_we_read_its(self):
        points, cells = random_mesh(3)
        meshio.Mesh(points, [("tetra", cells)]).write(self.folder / "theirs.vtu")
        self.convert("theirs.vtu", "ours.node")
        self.assert_same_bits(meshio.read(self.folder / "ours.node"), points, cells, 3)
        meshio.Mesh(points, [("tetra", cells)]).write(self.folder / "theirs.node", float_fmt=".17e")
        self.convert("theirs.ele", "again.vtu")
        self.assert_same_bits(meshio.read(self.folder / "again.vtu"), points, cells, 3)

    def test_numpy_reads_our_npz(self):
        for dimension in (2, 4, 6):
            with self.subTest(dimension=dimension):
                points, cells = random_mesh(dimension)
                self.write_pair("mesh", points, cells)
                self.convert("mesh.node", "mesh.npz")
                with numpy.load(self.folder / "mesh.npz", allow_pickle=False) as mesh:
                    self.assertEqual(sorted(mesh.files), ["points", "simplices"])
                    self.assertEqual((mesh["points"].dtype, mesh["simplices"].dtype), (numpy.float64, numpy.uint32))
                    self.assertTrue(mesh["points"].flags.c_contiguous and mesh["simplices"].flags.c_contiguous)
                    numpy.testing.assert_array_equal(mesh["points"].view(numpy.uint64), points.view(numpy.uint64))
                    numpy.testing.assert_array_equal(mesh["simplices"], cells)

    def test_meshio_reads_our_msh_and_mesh(self):
        for dimension in (2, 3):
            for name, format, theirs in (("a.msh", "msh41", "gmsh"), ("b.msh", "msh22", "gmsh"),
                                         ("c.mesh", "medit", "medit")):
                with self.subTest(dimension=dimension, format=format):
                    points, cells = random_mesh(dimension)
                    self.write_pair("mesh", points, cells)
                    self.convert("mesh.node", name, format=format)
                    mesh = meshio.read(self.folder / name, file_format=theirs)
                    self.assert_same_bits(mesh, points if theirs == "medit" else pad(points), cells, dimension)
                    if theirs == "gmsh":
                        numpy.testing.assert_array_equal(mesh.point_data["input"].ravel(), numpy.zeros(len(points)))

    def write_with_boundary(self, dimension):
        """A mesh of random numbers with two regions, and facets of two parts; as arrays."""
        points, cells = random_mesh(dimension)
        facets = numpy.random.default_rng(9).integers(0, len(points), size=(90, dimension))
        tags = numpy.repeat([2, 5], [30, 60])
        regions = numpy.arange(len(cells)) % 3 // 2 + 7
        numpy.savez(self.folder / "mesh.npz", points=points, simplices=cells, facets=facets, facet_tags=tags,
                    facet_names=["xmax", "ice & snow"], facet_name_tags=[2, 5], regions=regions,
                    region_ids=[7, 8], region_names=["land", "deep sea"],
                    vertex_origins=numpy.arange(len(points)), vertex_tags=numpy.arange(len(points)) % 4)
        return points, cells, facets, tags, regions

    def assert_blocks(self, mesh, *blocks):
        self.assertEqual([block.type for block in mesh.cells], [kind for kind, _ in blocks])
        for block, (_, expected) in zip(mesh.cells, blocks):
            numpy.testing.assert_array_equal(block.data, expected)

    def test_meshio_reads_our_vtk_and_su2_with_boundary(self):
        for dimension in (2, 3):
            points, cells, facets, tags, regions = self.write_with_boundary(dimension)
            blocks = (cell_type(dimension), cells), ("line" if dimension == 2 else "triangle", facets)
            with self.subTest(dimension=dimension, format="vtk"):
                self.convert("mesh.npz", "mesh.vtk")
                mesh = meshio.read(self.folder / "mesh.vtk")
                numpy.testing.assert_array_equal(mesh.points.astype(numpy.float64).view(numpy.uint64),
                                                 pad(points).view(numpy.uint64))
                self.assert_blocks(mesh, *blocks)
                for name, values in (("region", (regions, 0 * tags)), ("boundary", (0 * regions, tags))):
                    for found, expected in zip(mesh.cell_data[name], values):
                        numpy.testing.assert_array_equal(found, expected)
            with self.subTest(dimension=dimension, format="su2"), warnings.catch_warnings():
                self.convert("mesh.npz", "mesh.su2")
                mesh = meshio.read(self.folder / "mesh.su2")  # which makes tags 1, 2, ... of names
                numpy.testing.assert_array_equal(mesh.points.view(numpy.uint64), points.view(numpy.uint64))
                self.assert_blocks(mesh, *blocks)
                numpy.testing.assert_array_equal(mesh.cell_data["su2:tag"][1], numpy.repeat([1, 2], [30, 60]))

    def test_meshio_reads_our_vtu_with_boundary_and_names(self):
        for dimension in (2, 3):
            with self.subTest(dimension=dimension):
                points, cells, facets, tags, regions = self.write_with_boundary(dimension)
                self.convert("mesh.npz", "mesh.vtu")
                mesh = meshio.read(self.folder / "mesh.vtu")
                numpy.testing.assert_array_equal(mesh.points.view(numpy.uint64), pad(points).view(numpy.uint64))
                facet_type = "line" if dimension == 2 else "triangle"
                self.assert_blocks(mesh, (cell_type(dimension), cells), (facet_type, facets))
                numpy.testing.assert_array_equal(mesh.cell_data["boundary"][1], tags)
                numpy.testing.assert_array_equal(mesh.cell_data["region"][0], regions)

    def test_meshio_reads_our_mesh_with_names(self):
        for dimension in (2, 3):
            with self.subTest(dimension=dimension):
                points, cells, facets, tags, regions = self.write_with_boundary(dimension)
                self.convert("mesh.npz", "mesh.mesh")
                mesh = meshio.read(self.folder / "mesh.mesh")
                numpy.testing.assert_array_equal(mesh.points.view(numpy.uint64), points.view(numpy.uint64))
                numpy.testing.assert_array_equal(mesh.cell_data["medit:ref"][0], regions)
                numpy.testing.assert_array_equal(mesh.cell_data["medit:ref"][1], tags)

    def test_we_read_the_binary_msh_22_of_meshio(self):
        for dimension in (2, 3):
            with self.subTest(dimension=dimension):
                points, cells = random_mesh(dimension)
                meshio.Mesh(pad(points), [(cell_type(dimension), cells)]).write(
                    self.folder / "theirs.msh", file_format="gmsh22", binary=True)
                self.convert("theirs.msh", "ours.vtu")
                self.assert_same_bits(meshio.read(self.folder / "ours.vtu"), pad(points), cells, dimension)

    def test_we_read_the_vtk_of_meshio(self):
        for dimension, name in ((2, "vtk42"), (3, "vtk42"), (2, "vtk51"), (3, "vtk51")):
            for binary in (False, True):
                with self.subTest(dimension=dimension, name=name, binary=binary):
                    points, cells = random_mesh(dimension, 300, 900)
                    points = numpy.round(numpy.clip(points, -1e6, 1e6), 3)
                    meshio.Mesh(pad(points), [(cell_type(dimension), cells)]).write(
                        self.folder / "theirs.vtk", file_format=name, binary=binary)
                    self.convert("theirs.vtk", "ours.vtu")
                    self.assert_same_bits(meshio.read(self.folder / "ours.vtu"), pad(points), cells, dimension)

    def test_meshio_reads_our_inp_with_sets(self):
        for dimension in (2, 3):
            with self.subTest(dimension=dimension):
                points, cells, facets, tags, regions = self.write_with_boundary(dimension)
                self.convert("mesh.npz", "mesh.inp")
                mesh = meshio.read(self.folder / "mesh.inp")
                # A number has 20 characters at most, as CalculiX reads them.
                numpy.testing.assert_allclose(mesh.points, points, rtol=1e-13, atol=0)
                usual = (numpy.abs(points) > 0.01) & (numpy.abs(points) < 1e15)
                numpy.testing.assert_array_equal(mesh.points[usual], points[usual])
                self.assert_blocks(mesh, (cell_type(dimension), cells))
                for name, tag in (("xmax", 2), ("ice___snow", 5)):
                    numpy.testing.assert_array_equal(mesh.point_sets[name], numpy.unique(facets[tags == tag]))
                for name, region in (("land", 7), ("deep_sea", 8)):
                    numpy.testing.assert_array_equal(mesh.cell_sets[name][0], numpy.flatnonzero(regions == region))

    @unittest.skipUnless(importlib.util.find_spec("h5py"), "python3-h5py is not installed")
    def test_meshio_reads_our_xdmf_with_boundary(self):
        for dimension in (2, 3):
            with self.subTest(dimension=dimension):
                points, cells, facets, tags, regions = self.write_with_boundary(dimension)
                self.convert("mesh.npz", "mesh.xdmf")
                mesh = meshio.read(self.folder / "mesh.xdmf")
                self.assert_same_bits(mesh, points, cells, dimension)
                numpy.testing.assert_array_equal(mesh.cell_data["region"][0], regions)
                self.assertEqual({name: list(map(int, row)) for name, row in mesh.field_data.items()},
                                 {"xmax": [2, dimension - 1], "ice & snow": [5, dimension - 1],
                                  "land": [7, dimension], "deep sea": [8, dimension]})
                boundary = meshio.read(self.folder / "mesh_boundary.xdmf")
                numpy.testing.assert_array_equal(boundary.points.view(numpy.uint64), points.view(numpy.uint64))
                self.assert_blocks(boundary, ("line" if dimension == 2 else "triangle", facets))
                numpy.testing.assert_array_equal(boundary.cell_data["boundary"][0], tags)

    def test_we_read_the_msh_and_mesh_of_meshio(self):
        for dimension in (2, 3):
            for name, options in (("a.msh", {"file_format": "gmsh", "binary": True}),
                                  ("b.msh", {"file_format": "gmsh", "binary": False, "float_fmt": ".17e"}),
                                  ("c.msh", {"file_format": "gmsh22", "binary": False, "float_fmt": ".17e"}),
                                  ("d.mesh", {"file_format": "medit", "float_fmt": ".17e"})):
                with self.subTest(dimension=dimension, name=name):
                    points, cells = random_mesh(dimension)
                    is_medit = name.endswith(".mesh")
                    theirs = meshio.Mesh(points if is_medit else pad(points), [(cell_type(dimension), cells)])
                    theirs.write(self.folder / name, **options)
                    self.convert(name, "ours.vtu")
                    self.assert_same_bits(meshio.read(self.folder / "ours.vtu"), pad(points), cells, dimension)

    def test_others_read_our_weights(self):
        points, cells = random_mesh(3)
        weights = numpy.random.default_rng(7).random(len(points))
        numpy.savez(self.folder / "theirs.npz", points=points, simplices=cells, weights=weights)
        self.convert("theirs.npz", "ours.vtu")
        mesh = meshio.read(self.folder / "ours.vtu")
        self.assert_same_bits(mesh, points, cells, 3)
        numpy.testing.assert_array_equal(mesh.point_data["weights"], weights)
        numpy.testing.assert_array_equal(mesh.point_data["input"], numpy.zeros(len(points)))
        self.convert("ours.vtu", "ours.node")
        mesh = meshio.read(self.folder / "ours.node")
        self.assert_same_bits(mesh, points, cells, 3)
        self.convert("ours.node", "ours.npz")
        with numpy.load(self.folder / "ours.npz", allow_pickle=False) as arrays:
            self.assertEqual(sorted(arrays.files), ["points", "simplices", "weights"])
            self.assertEqual((arrays["weights"].dtype, arrays["weights"].shape), (numpy.float64, (len(points),)))
            numpy.testing.assert_array_equal(arrays["weights"], weights)

    def test_we_read_the_npz_of_numpy(self):
        for save in (numpy.savez, numpy.savez_compressed):
            for index_type in ("int32", "int64", "uint32", "uint64"):
                for order in "CF":
                    with self.subTest(save=save.__name__, index_type=index_type, order=order):
                        points, cells = random_mesh(5, 300, 2000)
                        save(self.folder / "theirs.npz", simplices=cells.astype(index_type, order=order),
                             comment=numpy.array("ignored"), points=numpy.asarray(points, order=order))
                        self.convert("theirs.npz", "ours.npz")
                        with numpy.load(self.folder / "ours.npz", allow_pickle=False) as mesh:
                            numpy.testing.assert_array_equal(mesh["points"].view(numpy.uint64),
                                                             points.view(numpy.uint64))
                            numpy.testing.assert_array_equal(mesh["simplices"], cells)

    def test_we_read_the_npy_of_numpy(self):
        points = random_mesh(4)[0]
        with numpy.errstate(over="ignore"):
            floats = points.astype(numpy.float32)
        floats = numpy.where(numpy.isfinite(floats), floats, numpy.float32(0.1))
        for cloud in (points, numpy.asfortranarray(points), floats):
            with self.subTest(type=cloud.dtype, fortran=cloud.flags.f_contiguous):
                numpy.save(self.folder / "cloud.npy", cloud)
                self.convert("cloud.npy", "cloud.npz", "--cloud")
                with numpy.load(self.folder / "cloud.npz", allow_pickle=False) as mesh:
                    numpy.testing.assert_array_equal(mesh["points"].view(numpy.uint64),
                                                     cloud.astype(numpy.float64, order="C").view(numpy.uint64))
                    self.assertEqual(mesh["simplices"].shape, (0, 5))


if __name__ == "__main__":
    unittest.main()
