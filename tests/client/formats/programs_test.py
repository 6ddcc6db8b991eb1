"""Gmsh, FreeFEM and VTK read files of Wellspace: the same counts, the same volume; it reads those of VTK.

Wants python3-vtk9, gmsh and freefem++ (deploy/install-deps.sh interoperability).
"""
import itertools
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

import numpy

CONVERT_MESH = os.environ["CONVERT_MESH"]
SIDE = 4  # of which all coordinates are few digits: Gmsh writes 16 of them


def grid(dimension):
    """A box of SIDE + 1 points along each axis, each cube cut into simplices along its diagonal (Kuhn); its volume."""
    axes = [numpy.linspace(0, 1 + axis / 4, SIDE + 1) for axis in range(dimension)]
    points = numpy.stack(numpy.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dimension)
    index = numpy.arange(len(points)).reshape((SIDE + 1,) * dimension)
    cells = []
    orders = ([0, 1], [1, 0]) if dimension == 2 else ([0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0])
    for corner in numpy.ndindex((SIDE,) * dimension):
        for order in orders:
            walk = [numpy.array(corner)]
            for axis in order:
                walk.append(walk[-1] + numpy.eye(dimension, dtype=int)[axis])
            cell = [index[tuple(place)] for place in walk]
            if numpy.linalg.det(points[cell[1:]] - points[cell[0]]) < 0:
                cell[-2:] = cell[:-3:-1]
            cells.append(cell)
    return points, numpy.array(cells), numpy.prod([axis[-1] for axis in axes])


class Programs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, dimension, name, format, *options):
        points, cells, volume = grid(dimension)
        numpy.savez(self.folder / "mesh.npz", points=points, simplices=cells)
        subprocess.run([CONVERT_MESH, *options, self.folder / "mesh.npz", self.folder / name, format], check=True,
                       timeout=60)
        return points, cells, volume

    def run_program(self, *command):
        result = subprocess.run(command, cwd=self.folder, text=True, timeout=120, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT)
        self.assertEqual(result.returncode, 0, result.stdout)
        return result.stdout

    def test_gmsh_reads_our_msh_and_we_read_its(self):
        for dimension in (2, 3):
            for format in ("msh41", "msh22"):
                with self.subTest(dimension=dimension, format=format):
                    points, cells, _ = self.write(dimension, "mesh.msh", format)
                    self.run_program("gmsh", "-check", "mesh.msh")
                    for version, binary in (("2.2", []), ("4.1", []), ("4.1", ["-bin"])):
                        text = self.run_program("gmsh", "mesh.msh", "-save", "-save_all",
                                                "-format", "msh" + version[0] + version[2],
                                                *binary, "-o", "theirs.msh")
                        self.assertRegex(text, rf"{len(points)} nodes")
                        self.assertNotRegex(text, r"Error|Warning")
                        self.run_program(CONVERT_MESH, "theirs.msh", "back.npz")
                        with numpy.load(self.folder / "back.npz") as back:
                            numpy.testing.assert_array_equal(back["points"], points)
                            numpy.testing.assert_array_equal(back["simplices"], cells)

    def test_freefem_reads_our_mesh(self):
        for dimension in (2, 3):
            with self.subTest(dimension=dimension):
                points, cells, volume = self.write(dimension, "mesh.mesh", "medit")
                script = ('mesh3 Th = readmesh3("mesh.mesh");\nreal v = int3d(Th)(1.);\n' if dimension == 3 else
                          'mesh Th = readmesh("mesh.mesh");\nreal v = int2d(Th)(1.);\n')
                (self.folder / "volume.edp").write_text(
                    script + 'cout.precision(15);\ncout << "figures " << Th.nv << " " << Th.nt << " " << v << endl;\n')
                text = self.run_program("FreeFem++", "-nw", "-ne", "volume.edp")
                figures = re.search(r"^figures (\d+) (\d+) (\S+)$", text, re.MULTILINE)
                self.assertIsNotNone(figures, text)
                self.assertEqual((int(figures[1]), int(figures[2])), (len(points), len(cells)))
                self.assertAlmostEqual(float(figures[3]), volume, places=12)

    def read_by_vtk(self, dimension, format):
        """What VTK reads of mesh.FORMAT, and its area or volume."""
        import vtk
        readers = {"vtu": vtk.vtkXMLUnstructuredGridReader, "vtkhdf": vtk.vtkHDFReader,
                   "vtk": vtk.vtkUnstructuredGridReader}
        reader = readers[format]()
        reader.SetFileName(str(self.folder / f"mesh.{format}"))
        sizes = vtk.vtkCellSizeFilter()
        sizes.SetInputConnection(reader.GetOutputPort())
        sizes.ComputeSumOn()
        sizes.Update()
        total = sizes.GetOutput().GetFieldData().GetArray("Area" if dimension == 2 else "Volume").GetValue(0)
        return reader.GetOutput(), total

    def test_vtk_reads_our_vtu_vtkhdf_and_vtk(self):
        for dimension, format in itertools.product((2, 3), ("vtu", "vtkhdf", "vtk")):
            with self.subTest(dimension=dimension, format=format):
                points, cells, volume = self.write(dimension, f"mesh.{format}", format)
                found, total = self.read_by_vtk(dimension, format)
                self.assertEqual((found.GetNumberOfPoints(), found.GetNumberOfCells()), (len(points), len(cells)))
                self.assertAlmostEqual(total, volume, places=12)

    def test_gmsh_measures_our_elements_of_second_order(self):
        """Nodes in another order than Gmsh's make Jacobians that change their signs."""
        for dimension, format in itertools.product((2, 3), ("msh41", "msh22")):
            with self.subTest(dimension=dimension, format=format):
                self.write(dimension, "mesh.msh", format, "--second-order")
                (self.folder / "quality.geo").write_text(
                    'Merge "mesh.msh";\nPlugin(AnalyseMeshQuality).JacobianDeterminant = 1;\n'
                    "Plugin(AnalyseMeshQuality).Run;\n")
                text = self.run_program("gmsh", "quality.geo", "-")
                self.assertNotRegex(text, r"Error|Warning")
                found = re.search(rf"Jacobian for {dimension}D elements[\s\S]*minJ/maxJ\s*=\s*([-\d.e]+),", text)
                self.assertIsNotNone(found, text)
                self.assertAlmostEqual(float(found[1]), 1, places=3)

    def test_vtk_reads_our_elements_of_second_order(self):
        """VTK maps places in a cell as its corners alone do: edges are straight, and nodes in VTK's order."""
        import vtk
        for dimension, format in itertools.product((2, 3), ("vtu", "vtkhdf", "vtk")):
            with self.subTest(dimension=dimension, format=format):
                points, cells, volume = self.write(dimension, f"mesh.{format}", format, "--second-order")
                found, total = self.read_by_vtk(dimension, format)
                self.assertAlmostEqual(total, volume, places=12)
                self.assertEqual(found.GetNumberOfCells(), len(cells))
                kind = vtk.VTK_QUADRATIC_TRIANGLE if dimension == 2 else vtk.VTK_QUADRATIC_TETRA
                for number, corners in enumerate(cells):
                    cell = found.GetCell(number)
                    self.assertEqual(cell.GetCellType(), kind)
                    for local in ((0.1, 0.2, 0.3), (0.7, 0.05, 0.15)):
                        local = numpy.array(local[:dimension])
                        place, weights = [0.0] * 3, [0.0] * cell.GetNumberOfPoints()
                        cell.EvaluateLocation(vtk.reference(0), [*local, *[0] * (3 - dimension)], place, weights)
                        expected = numpy.array([1 - local.sum(), *local]) @ points[corners]
                        numpy.testing.assert_allclose(place[:dimension], expected, atol=1e-14)

    def vtk_grid(self, dimension):
        import vtk
        from vtk.util.numpy_support import numpy_to_vtk
        points, cells, _ = grid(dimension)
        points = points + numpy.random.default_rng(7).random(points.shape) / 64  # of all bits
        padded = numpy.hstack([points, numpy.zeros((len(points), 3 - dimension))])
        coordinates = vtk.vtkPoints()
        coordinates.SetDataTypeToDouble()
        coordinates.SetData(numpy_to_vtk(padded, deep=True))
        mesh = vtk.vtkUnstructuredGrid()
        mesh.SetPoints(coordinates)
        for cell in cells:
            mesh.InsertNextCell(vtk.VTK_TRIANGLE if dimension == 2 else vtk.VTK_TETRA, len(cell), list(map(int, cell)))
        heat = numpy_to_vtk(points[:, 0] * 3, deep=True)
        heat.SetName("heat")
        mesh.GetPointData().AddArray(heat)
        return mesh, points, cells

    def assert_mesh(self, name, points, cells):
        self.run_program(CONVERT_MESH, name, "back.npz")
        with numpy.load(self.folder / "back.npz") as back:
            numpy.testing.assert_array_equal(back["points"], points)
            numpy.testing.assert_array_equal(back["simplices"], cells)

    def test_we_read_meshes_of_vtk_however_they_are_encoded(self):
        import vtk
        modes = ("Ascii", "Binary", "raw", "base64")
        compressors = (None, vtk.vtkZLibDataCompressor, vtk.vtkLZ4DataCompressor, vtk.vtkLZMADataCompressor)
        for dimension in (2, 3):
            mesh, points, cells = self.vtk_grid(dimension)
            for mode, compressor, is_wide, is_big in itertools.product(modes, compressors, (False, True),
                                                                       (False, True)):
                with self.subTest(dimension=dimension, mode=mode, compressor=compressor, wide=is_wide, big=is_big):
                    writer = vtk.vtkXMLUnstructuredGridWriter()
                    writer.SetCompressor(compressor() if compressor else None)
                    getattr(writer, "SetHeaderTypeToUInt64" if is_wide else "SetHeaderTypeToUInt32")()
                    getattr(writer, "SetByteOrderToBigEndian" if is_big else "SetByteOrderToLittleEndian")()
                    getattr(writer, f"SetDataModeTo{mode if mode in modes[:2] else 'Appended'}")()
                    writer.SetEncodeAppendedData(mode == "base64")
                    writer.SetBlockSize(1024)  # of several blocks
                    writer.SetFileName(str(self.folder / "theirs.vtu"))
                    writer.SetInputData(mesh)
                    writer.Write()
                    self.assert_mesh("theirs.vtu", points, cells)
            for version, is_binary in itertools.product((42, 51), (False, True)):
                with self.subTest(dimension=dimension, version=version, binary=is_binary):
                    writer = vtk.vtkUnstructuredGridWriter()
                    writer.SetFileVersion(version)
                    writer.SetFileType(2 if is_binary else 1)
                    writer.SetFileName(str(self.folder / "theirs.vtk"))
                    writer.SetInputData(mesh)
                    writer.Write()
                    rounded = [[float(f"{x:.11g}") for x in point] for point in points]
                    self.assert_mesh("theirs.vtk", points if is_binary else rounded, cells)

    def test_we_read_pieces_of_vtk(self):
        import vtk
        for dimension, compressor in itertools.product((2, 3), (None, vtk.vtkLZ4DataCompressor)):
            with self.subTest(dimension=dimension, compressor=compressor):
                mesh, points, cells = self.vtk_grid(dimension)
                writer = vtk.vtkXMLUnstructuredGridWriter()
                writer.SetCompressor(compressor() if compressor else None)
                writer.SetNumberOfPieces(3)
                writer.SetFileName(str(self.folder / "pieces.vtu"))
                writer.SetInputData(mesh)
                writer.Write()
                self.assertEqual((self.folder / "pieces.vtu").read_bytes().count(b"<Piece"), 3)
                # The writer asks for each piece, and gets the whole each time.
                shifts = numpy.repeat(numpy.arange(3), len(cells))[:, None] * len(points)
                self.assert_mesh("pieces.vtu", numpy.tile(points, (3, 1)), numpy.tile(cells, (3, 1)) + shifts)

    def test_we_read_points_of_vtk_with_arrays_of_any_type(self):
        import vtk
        grid_of_vtk = vtk.vtkStructuredGrid()
        grid_of_vtk.SetDimensions(3, 4, 5)
        points = vtk.vtkPoints()
        for i in range(60):
            points.InsertNextPoint(i % 3, i // 3 % 4, i // 12 + i / 8)
        grid_of_vtk.SetPoints(points)
        for name in ("Bit", "String", "Char", "UnsignedChar", "TypeUInt64", "IdType", "Double"):
            array = getattr(vtk, f"vtk{name}Array")()
            array.SetName(name)
            for i in range(60):
                array.InsertNextValue({"String": f"{i} <&\"", "Char": chr(65 + i % 2)}.get(name, i % 2))
            grid_of_vtk.GetPointData().AddArray(array)
        vectors = vtk.vtkDoubleArray()
        vectors.SetName("v")
        vectors.SetNumberOfComponents(3)
        vectors.SetComponentName(1, "north")  # the others are blank
        for i in range(60):
            vectors.InsertNextTuple3(i, -i, i / 3)
        grid_of_vtk.GetPointData().SetVectors(vectors)
        mixed = vtk.vtkAppendFilter()
        mixed.AddInputData(grid_of_vtk)
        mixed.Update()
        expected = numpy.array([points.GetPoint(i) for i in range(60)])
        for data, writer, name in ((grid_of_vtk, vtk.vtkXMLStructuredGridWriter, "theirs.vts"),
                                   (mixed.GetOutput(), vtk.vtkXMLUnstructuredGridWriter, "theirs.vtu")):
            for mode in ("Ascii", "Binary", "Appended"):
                with self.subTest(name=name, mode=mode):
                    writer_of_vtk = writer()
                    getattr(writer_of_vtk, f"SetDataModeTo{mode}")()
                    self.write_by_vtk(writer_of_vtk, data, name)
                    self.assert_cloud(name, expected)
        for data, writer in ((grid_of_vtk, vtk.vtkStructuredGridWriter),
                             (mixed.GetOutput(), vtk.vtkUnstructuredGridWriter)):
            for version, file_type in itertools.product((42, 51), (1, 2)):
                with self.subTest(writer=writer, version=version, file_type=file_type):
                    writer_of_vtk = writer()
                    writer_of_vtk.SetFileVersion(version)
                    writer_of_vtk.SetFileType(file_type)
                    self.write_by_vtk(writer_of_vtk, data, "theirs.vtk")
                    self.assert_cloud("theirs.vtk", expected)

    def test_we_read_grids_of_vtk_that_are_told_by_their_axes(self):
        import vtk
        image = vtk.vtkImageData()
        image.SetExtent(-1, 2, 3, 6, 0, 2)
        image.SetOrigin(0.1, -7.3, 1e6)
        image.SetSpacing(0.1, 1 / 3, 7.7)
        image.SetDirectionMatrix(0.6, -0.8, 0, 0.8, 0.6, 0, 0, 0, 1)
        grid = vtk.vtkRectilinearGrid()
        grid.SetExtent(-1, 2, 3, 6, 0, 2)
        for axis, count in (("X", 4), ("Y", 4), ("Z", 3)):
            numbers = vtk.vtkDoubleArray()
            for i in range(count):
                numbers.InsertNextValue(i * i / 3 - count)
            getattr(grid, f"Set{axis}Coordinates")(numbers)
        for data, kind in ((image, "ImageData"), (grid, "RectilinearGrid")):
            suffix = {"ImageData": "vti", "RectilinearGrid": "vtr"}[kind]
            expected = numpy.array([data.GetPoint(i) for i in range(data.GetNumberOfPoints())])
            values = vtk.vtkFloatArray()
            values.SetName("h")
            for i in range(len(expected)):
                values.InsertNextValue(i)
            data.GetPointData().AddArray(values)
            for mode in ("Ascii", "Binary", "Appended"):
                with self.subTest(kind=kind, mode=mode):
                    writer = getattr(vtk, f"vtkXML{kind}Writer")()
                    getattr(writer, f"SetDataModeTo{mode}")()
                    self.write_by_vtk(writer, data, f"theirs.{suffix}")
                    if mode == "Ascii" and kind == "RectilinearGrid":
                        self.assert_cloud(f"theirs.{suffix}", expected, "float32")
                    else:
                        self.assert_cloud(f"theirs.{suffix}", expected)
            with self.subTest(kind=kind, pieces=4):
                writer = getattr(vtk, f"vtkXMLP{kind}Writer")()
                writer.SetNumberOfPieces(4)
                writer.SetStartPiece(0)
                writer.SetEndPiece(3)
                self.write_by_vtk(writer, data, f"theirs.p{suffix}")
                self.run_program(CONVERT_MESH, "--cloud", f"theirs.p{suffix}", "cloud.npz")
                with numpy.load(self.folder / "cloud.npz") as cloud:
                    self.assertEqual({tuple(point) for point in cloud["points"]},
                                     {tuple(point) for point in expected})
            for file_type in (1, 2):
                with self.subTest(kind=kind, file_type=file_type):
                    plain = data.NewInstance()
                    plain.DeepCopy(data)
                    if kind == "ImageData":  # the legacy format knows no direction, and 6 digits of an origin
                        plain.SetDirectionMatrix(1, 0, 0, 0, 1, 0, 0, 0, 1)
                        plain.SetOrigin(0.5, -7.25, 1000)
                        plain.SetSpacing(0.125, 0.25, 7.5)
                    writer = {"ImageData": vtk.vtkStructuredPointsWriter,
                              "RectilinearGrid": vtk.vtkRectilinearGridWriter}[kind]()
                    writer.SetFileType(file_type)
                    self.write_by_vtk(writer, plain, "theirs.vtk")
                    wanted = [plain.GetPoint(i) for i in range(plain.GetNumberOfPoints())]
                    self.assert_cloud("theirs.vtk", wanted, "float32" if kind == "RectilinearGrid" else "float64")

    def write_by_vtk(self, writer, data, name):
        writer.SetFileName(str(self.folder / name))
        writer.SetInputData(data)
        writer.Write()

    def assert_cloud(self, name, points, type="float64"):
        self.run_program(CONVERT_MESH, "--cloud", name, "cloud.npz")
        with numpy.load(self.folder / "cloud.npz") as cloud:
            numpy.testing.assert_array_equal(cloud["points"].astype(type), numpy.asarray(points, type))

    def test_we_read_the_points_of_vtk(self):
        import vtk
        sphere = vtk.vtkSphereSource()
        sphere.Update()
        surface = sphere.GetOutput()
        points = numpy.array([surface.GetPoint(i) for i in range(surface.GetNumberOfPoints())])  # floats
        for version, binary in itertools.product((42, 51), (False, True)):
            with self.subTest(format="vtk", version=version, binary=binary):
                writer = vtk.vtkPolyDataWriter()
                writer.SetFileVersion(version)
                writer.SetFileType(2 if binary else 1)
                writer.SetFileName(str(self.folder / "sphere.vtk"))
                writer.SetInputData(surface)
                writer.Write()
                expected = points if binary else [[float(f"{x:g}") for x in point] for point in points]
                self.assert_cloud("sphere.vtk", expected)
        for mode in ("Ascii", "Binary"):
            with self.subTest(format="vtp", mode=mode):
                writer = vtk.vtkXMLPolyDataWriter()
                getattr(writer, f"SetDataModeTo{mode}")()
                writer.SetFileName(str(self.folder / "sphere.vtp"))
                writer.SetInputData(surface)
                writer.Write()
                with open(self.folder / "sphere.vtp") as file:
                    self.assertIn(mode.lower(), file.read())
                self.assert_cloud("sphere.vtp", points, "float64" if mode == "Binary" else "float32")
        for binary in (False, True):
            with self.subTest(format="stl", binary=binary):
                writer = vtk.vtkSTLWriter()
                writer.SetFileType(2 if binary else 1)
                writer.SetFileName(str(self.folder / "sphere.stl"))
                writer.SetInputData(surface)
                writer.Write()
                self.run_program(CONVERT_MESH, "--cloud", "sphere.stl", "cloud.npz")
                with numpy.load(self.folder / "cloud.npz") as cloud:
                    self.assertEqual(cloud["points"].shape, points.shape)  # each once, in another order
                    found = sorted(map(tuple, cloud["points"].round(4) + 0.0))
                    self.assertEqual(found, sorted(map(tuple, points.round(4) + 0.0)))


if __name__ == "__main__":
    unittest.main()
