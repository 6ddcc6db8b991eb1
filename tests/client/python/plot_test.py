"""Pages of meshes: the same as the tool's, in notebooks and files, whatever names say."""

import base64
import html
import json
import pathlib
import re
import subprocess
import tempfile
import unittest
from unittest import mock

import numpy as np
from support import PATIENCE, TOOL, Case, spot, uniform

import wellspace
from wellspace import InvalidArgumentError, LimitError

HOSTILE = "</script><script>alert(1)</script><!-- \udc80 é \x7f\n\"'&"


def header_of(page):
    return json.loads(re.search(r'id="mesh">(.*?)</script>', page)[1])


def array_of(page, element):
    return np.frombuffer(base64.b64decode(re.search(rf'id="mesh-{element}">(.*?)</script>', page)[1]))


class PlotTest(Case):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def page_of_tool(self, path, *options):
        command = [TOOL, "view", path, "-o", "-", *options]
        done = subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_page_is_that_of_the_tool(self):
        square = [[0, 0], [2, 0], [2, 1], [0, 1], [1, 0], [1, 1]]
        ring = [[0, 4], [4, 1], [1, 2], [2, 5], [5, 3], [3, 0], [4, 5]]
        regions = [(0.5, 0.5, 4), (1.5, 0.5, 3)]
        meshes = {
            "spot": wellspace.mesh(spot()),
            "regions": wellspace.mesh(square, segments=ring, markers=[7, 7, -2, 0, 0, 5, 0], regions=regions),
            "weights": wellspace.mesh(uniform(60, 3), pump_weights=True, min_dihedral=0),
            "bare": wellspace.mesh(uniform(60, 2), boundary=False),
        }
        for name, mesh in meshes.items():
            with self.subTest(name):
                path = self.folder / f"{name}.npz"
                mesh.save(path)
                page = mesh.plot(name=path.name, up="y").html
                self.assertEqual(page.encode(), self.page_of_tool(path, "--up", "y"))
        header = header_of(meshes["regions"].plot().html)
        self.assertEqual([region["id"] for region in header["regions"]], [3, 4])
        self.assertEqual(sum(part["facets"] for part in header["boundary"]), len(meshes["regions"].facets))

    def test_notebooks_get_a_frame(self):
        mesh = wellspace.mesh(uniform(30, 3))
        plot = mesh.plot(name=HOSTILE, height=321)
        frame = plot._repr_html_()
        self.assertRegex(frame, r'^<iframe title="[^"<>]*" width="100%" height="321" ')
        self.assertIn('sandbox="allow-scripts allow-downloads"', frame)
        self.assertEqual(frame.count("<"), 2)
        self.assertEqual(html.unescape(re.search(r'srcdoc="([^"]*)"', frame)[1]), plot.html)
        self.assertEqual(header_of(plot.html)["name"], HOSTILE)
        self.assertNotIn("alert(1)</script>", plot.html)

    def test_tables_are_light(self):
        mesh = wellspace.mesh(uniform(30, 3))
        mesh.facet_names[1] = HOSTILE
        table = mesh._repr_html_()
        self.assertLess(len(table), 2000)
        self.assertIn("<td>%s</td>" % f"{len(mesh.simplices):,}", table)
        self.assertNotIn("<script>", table)
        self.assertIn("Mesh in 4-D", wellspace.mesh(uniform(9, 4))._repr_html_())

    def test_files_and_data(self):
        mesh = wellspace.mesh(uniform(30, 2))
        areas = np.arange(len(mesh.simplices)) / 7
        plot = mesh.plot(data={"x": mesh.points[:, 0], "area": areas, HOSTILE: np.arange(len(mesh.points))})
        plot.save(self.folder / "page.html")
        text = (self.folder / "page.html").read_text(encoding="utf-8")
        self.assertEqual(text, plot.html)
        self.assertEqual(header_of(text)["fields"], ["x", HOSTILE])
        self.assertEqual(header_of(text)["simplex_fields"], ["area"])
        np.testing.assert_array_equal(array_of(text, "simplex-field0"), areas)
        self.assertEqual([path.name for path in self.folder.iterdir()], ["page.html"])
        with self.assertRaises(FileNotFoundError):
            plot.save(self.folder / "absent" / "page.html")

    def test_errors_name_the_argument(self):
        mesh = wellspace.mesh(uniform(30, 2))
        for options, field, text in (
            ({"up": "w"}, "up", "expected 'x', 'y' or 'z'"),
            ({"data": {"a": [1, 2]}}, "data", r"data\['a'\] has the shape \(2,\)"),
        ):
            with self.assertRaisesRegex(InvalidArgumentError, text) as caught:
                mesh.plot(**options)
            self.assertEqual(caught.exception.field, field)
        with self.assertRaisesRegex(InvalidArgumentError, "4-D"):
            wellspace.mesh(uniform(9, 4)).plot()
        with mock.patch("wellspace._view._MOST_BYTES", 500), self.assertRaisesRegex(LimitError, "the points take"):
            mesh.plot()


if __name__ == "__main__":
    unittest.main()
