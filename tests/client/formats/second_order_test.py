"""Other people's programs, and their documented orders of nodes, find in files of second order what they ought to."""
import importlib.util
import itertools
import os
import pathlib
import subprocess
import tempfile
import unittest

import meshio
import numpy

CONVERT_MESH = os.environ["CONVERT_MESH"]
SIDE = 3

# The edges of which nodes are the middles, in the order of VTK and Abaqus, of Gmsh, and of TetGen and Triangle.
VTK_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
GMSH_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (2, 3), (1, 3)]
TETGEN_EDGES = [(2, 3), (0, 3), (0, 1), (1, 2), (1, 3), (0, 2)]
TRIANGLE_EDGES = [(1, 2), (2, 0), (0, 1)]
# The determinants are constant where edges are straight: two points along each axis are exact for their weights.
GAUSS = (0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5)


def grid(dimension):
    """A box of cubes, each cut into simplices along its diagonal (Kuhn), as points, cells and the volume.

    Points are moved at random, the boundary in itself.
    """
    axes = [numpy.linspace(0, 1 + axis / 4, SIDE + 1) for axis in range(dimension)]
    points = numpy.stack(numpy.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dimension)
    volume = numpy.prod([axis[-1] for axis in axes])
    index = numpy.arange(len(points)).reshape((SIDE + 1,) * dimension)
    cells = []
    for corner in numpy.ndindex((SIDE,) * dimension):
        for order in itertools.permutations(range(dimension)):
            walk = [numpy.array(corner)]
            for axis in order:
                walk.append(walk[-1] + numpy.eye(dimension, dtype=int)[axis])
            cells.append([index[tuple(place)] for place in walk])
    random = numpy.random.default_rng(11)
    high = points.max(axis=0)
    points += random.uniform(-0.05, 0.05, points.shape) * ((points > 0) & (points < high))
    cells = numpy.array(cells)
    turned = numpy.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]]) < 0
    cells[turned, -2:] = cells[turned, -1:-3:-1]
    return points, cells, volume


def boundary(cells, points):
    """The facets on the faces x = 0 and x = 1, looking outward, and their tags."""
    facets, tags = [], []
    for cell in cells:
        for left_out in range(len(cell)):
            facet = [v for i, v in enumerate(cell) if i != left_out]
            for tag, x in ((1, 0.0), (2, 1.0)):
                if (points[facet, 0] == x).all():
                    looks_out = numpy.linalg.det(points[facet] - points[cell[left_out]]) > 0
                    facets.append(facet if looks_out else facet[::-1])
                    tags.append(tag)
    order = numpy.argsort(tags, kind="stable")
    return numpy.array(facets)[order], numpy.array(tags)[order]


def jacobians(points, cells, edges):
    """The determinants of the Jacobian of each cell of second order at points of Gauss, and the weights of these.

    `edges` are those of which nodes behind the corners are the middles.
    """
    d = points.shape[1]
    found, weights = [], []
    for cube in itertools.product(GAUSS, repeat=d):
        # Barycentric coordinates by the map that folds a cube into a simplex, whose Jacobian is the weight.
        rest, local, weight = 1.0, [], 2.0**-d
        for x in cube:
            weight *= rest
            local.append(rest * x)
            rest *= 1 - x
        barycentric = numpy.array([1 - sum(local), *local])
        gradients = numpy.vstack([-numpy.ones(d), numpy.eye(d)])
        slopes = [(4 * barycentric[i] - 1) * gradients[i] for i in range(d + 1)]
        slopes += [4 * (barycentric[i] * gradients[j] + barycentric[j] * gradients[i]) for i, j in edges]
        found.append(numpy.linalg.det(numpy.einsum("cni,nj->cij", points[cells], numpy.array(slopes))))
        weights.append(weight)
    return numpy.array(found), numpy.array(weights)


class SecondOrder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, dimension, name, format=None):
        points, cells, volume = grid(dimension)
        facets, tags = boundary(cells, points)
        numpy.savez(self.folder / "first.npz", points=points, simplices=cells, facets=facets, facet_tags=tags,
                    facet_names=["inlet", "outlet"], facet_name_tags=[1, 2], regions=numpy.arange(len(cells)) % 2 + 7,
                    region_ids=[7, 8], region_names=["land", "sea"])
        subprocess.run([CONVERT_MESH, "--second-order", self.folder / "first.npz", self.folder / name,
                        *([format] if format else [])], check=True, timeout=60)
        return points, cells, facets, tags, volume

    def assert_second_order(self, nodes, cells, first, edges=None, by_regions=False):
        """`cells` are those of `first` and the middles of their edges, each edge having one node, and of its volume."""
        points, corners, _, _, volume = first
        d = points.shape[1]
        edges = (edges or VTK_EDGES)[: d * (d + 1) // 2]
        order = numpy.argsort(numpy.arange(len(corners)) % 2, kind="stable") if by_regions else slice(None)
        nodes = nodes[:, :d]
        numpy.testing.assert_array_equal(nodes[: len(points)], points)
        numpy.testing.assert_array_equal(cells[:, : d + 1], corners[order])
        of_edges = {}
        for cell in cells:
            for node, (i, j) in zip(cell[d + 1 :], edges):
                numpy.testing.assert_array_equal(nodes[node], (points[cell[i]] + points[cell[j]]) / 2)
                ends = tuple(sorted((int(cell[i]), int(cell[j]))))
                self.assertEqual(of_edges.setdefault(ends, int(node)), int(node))
        # By the ends of their edges, behind the vertices, and there is no other node.
        self.assertEqual([of_edges[ends] for ends in sorted(of_edges)], list(range(len(points), len(nodes))))
        found, weights = jacobians(nodes, cells, edges)
        self.assertGreater(found.min(), 0)
        self.assertAlmostEqual(found.sum(axis=1) @ weights, volume, places=12)
        self.assert_quadratic_is_exact(nodes, cells, edges)

    def assert_quadratic_is_exact(self, nodes, cells, edges):
        """A quadratic function by its values at nodes is itself anywhere: in the middles of cells."""
        d = nodes.shape[1]
        form = numpy.random.default_rng(3).random((d + 1, d + 1))

        def value(at):
            with_one = numpy.column_stack([at, numpy.ones(len(at))])
            return numpy.einsum("ni,ij,nj->n", with_one, form, with_one)

        b = 1 / (d + 1)
        shape = numpy.array([b * (2 * b - 1)] * (d + 1) + [4 * b * b] * len(edges))
        middles = nodes[cells[:, : d + 1]].mean(axis=1)
        numpy.testing.assert_allclose(value(nodes)[cells] @ shape, value(middles), rtol=1e-12)

    def assert_facets(self, cells_of_facets, first, nodes, edges=None):
        _, _, facets, _, _ = first
        d = facets.shape[1]
        numpy.testing.assert_array_equal(cells_of_facets[:, :d], facets)
        for node, (i, j) in zip(cells_of_facets[:, d:].T, edges or VTK_EDGES):
            numpy.testing.assert_array_equal(nodes[node], (nodes[facets[:, i]] + nodes[facets[:, j]]) / 2)

    def kinds(self, dimension):
        return ("triangle6", "line3") if dimension == 2 else ("tetra10", "triangle6")

    def test_meshio_reads_our_vtu_vtk_and_msh(self):
        formats = ((".vtu", None, "vtu"), (".vtk", None, "vtk"), (".msh", "msh41", "gmsh"), (".msh", "msh22", "gmsh"))
        for dimension, (suffix, format, theirs) in itertools.product((2, 3), formats):
            with self.subTest(dimension=dimension, format=format or theirs):
                first = self.write(dimension, "mesh" + suffix, format)
                mesh = meshio.read(self.folder / ("mesh" + suffix), file_format=theirs)
                cells = mesh.cells_dict  # of one kind all blocks, one after the other
                self.assertEqual(tuple(cells), self.kinds(dimension))
                simplex, facet = self.kinds(dimension)
                self.assert_second_order(mesh.points, cells[simplex], first, by_regions=format == "msh41")
                self.assert_facets(cells[facet], first, mesh.points)
                data = mesh.cell_data_dict["gmsh:physical" if theirs == "gmsh" else "boundary"][facet]
                numpy.testing.assert_array_equal(data, first[3])

    def test_the_order_of_gmsh_is_that_of_its_manual(self):
        """Ours by the edges that Gmsh's manual draws, without meshio's idea of it."""
        first = self.write(3, "mesh.msh", "msh22")
        lines = (self.folder / "mesh.msh").read_text().splitlines()
        begin = lines.index("$Elements") + 2
        rows = [list(map(int, line.split())) for line in lines[begin : lines.index("$EndElements")]]
        cells = numpy.array([row[5:] for row in rows if row[1] == 11]) - 1
        start = lines.index("$Nodes") + 2
        nodes = numpy.array([list(map(float, line.split()[1:])) for line in lines[start : lines.index("$EndNodes")]])
        self.assert_second_order(nodes, cells, first, GMSH_EDGES)

    def test_meshio_reads_our_inp(self):
        first = self.write(3, "mesh.inp")
        mesh = meshio.read(self.folder / "mesh.inp")
        self.assert_second_order(mesh.points, mesh.cells_dict["tetra10"], first)
        on_faces = {"inlet": 0.0, "outlet": 1.0}
        for name, x in on_faces.items():
            numpy.testing.assert_array_equal(mesh.point_sets[name], numpy.flatnonzero(mesh.points[:, 0] == x))

    def test_our_inp_in_the_plane(self):
        """meshio does not know CPS6."""
        first = self.write(2, "mesh.inp")
        sections = (self.folder / "mesh.inp").read_text().split("*")
        numbers = {part.split("\n", 1)[0]: part.splitlines()[1:] for part in sections}
        nodes = numpy.array([list(map(float, line.split(",")[1:])) for line in numbers["NODE"]])
        cells = numpy.array([list(map(int, line.split(",")[1:])) for line in numbers["ELEMENT, TYPE=CPS6"]]) - 1
        self.assert_second_order(nodes, cells, first)

    def test_numpy_reads_our_npz(self):
        for dimension in (2, 3):
            with self.subTest(dimension=dimension):
                first = self.write(dimension, "mesh.npz")
                with numpy.load(self.folder / "mesh.npz", allow_pickle=False) as mesh:
                    self.assert_second_order(mesh["points"], mesh["simplices"], first)
                    self.assert_facets(mesh["facets"], first, mesh["points"])
                    ends = mesh["middle_ends"]
                    numpy.testing.assert_array_equal(mesh["points"][len(first[0]) :], first[0][ends].mean(axis=1))
                    numpy.testing.assert_array_equal(mesh["facet_tags"], first[3])

    def test_tetgen_and_triangle(self):
        for dimension, edges, facets in ((2, TRIANGLE_EDGES, ".edge"), (3, TETGEN_EDGES, ".face")):
            with self.subTest(dimension=dimension):
                first = self.write(dimension, "mesh.node")
                read = {}
                for suffix in (".node", ".ele", facets):
                    lines = (self.folder / ("mesh" + suffix)).read_text().splitlines()
                    rows = [line.split() for line in lines if not line.startswith("#")][1:]
                    read[suffix] = numpy.array([list(map(float, row[1:])) for row in rows])
                nodes = read[".node"][:, :dimension]
                width = (dimension + 1) * (dimension + 2) // 2
                self.assert_second_order(nodes, read[".ele"][:, :width].astype(int), first, edges)
                self.assertEqual(read[".ele"].shape[1], width + 1)  # the region
                self.assert_facets(read[facets][:, :-1].astype(int), first, nodes, TRIANGLE_EDGES)
                numpy.testing.assert_array_equal(read[facets][:, -1], first[3])

    @unittest.skipUnless(importlib.util.find_spec("h5py"), "python3-h5py is not installed")
    def test_h5py_and_meshio_read_our_vtkhdf_and_xdmf(self):
        import h5py
        for dimension in (2, 3):
            with self.subTest(dimension=dimension):
                simplex, facet = self.kinds(dimension)
                first = self.write(dimension, "mesh.xdmf")
                mesh = meshio.read(self.folder / "mesh.xdmf")
                self.assert_second_order(mesh.points, mesh.cells_dict[simplex], first)
                of_boundary = meshio.read(self.folder / "mesh_boundary.xdmf")
                self.assert_facets(of_boundary.cells_dict[facet], first, of_boundary.points)
                self.write(dimension, "mesh.vtkhdf")
                with h5py.File(self.folder / "mesh.vtkhdf") as file:
                    root = file["VTKHDF"]
                    m, f, k = len(first[1]), len(first[2]), (dimension + 1) * (dimension + 2) // 2
                    numbers = root["Connectivity"][:]
                    self.assert_second_order(root["Points"][:], numbers[: m * k].reshape(m, k), first)
                    self.assert_facets(numbers[m * k :].reshape(f, -1), first, root["Points"][:, :dimension])
                    types = [22, 21] if dimension == 2 else [24, 22]
                    numpy.testing.assert_array_equal(root["Types"], numpy.repeat(types, [m, f]))
                    of_facet = dimension * (dimension + 1) // 2
                    numpy.testing.assert_array_equal(numpy.diff(root["Offsets"]), numpy.repeat([k, of_facet], [m, f]))


if __name__ == "__main__":
    unittest.main()
