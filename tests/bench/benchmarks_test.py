"""The benchmarks run on tiny clouds, and compare notices a mesh that is not as it should be."""

import copy
import csv
import importlib.machinery
import importlib.util
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

BENCH = pathlib.Path(__file__).resolve().parents[2] / "bench"
BIN = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"])

sys.dont_write_bytecode = True
sys.path.insert(0, str(BENCH))
import rows  # noqa: E402 (found in BENCH)

loader = importlib.machinery.SourceFileLoader("compare", str(BENCH / "compare"))
compare = importlib.util.module_from_spec(importlib.util.spec_from_loader("compare", loader))
loader.exec_module(compare)


def run(*command):
    """Runs a benchmark; returns the finished process."""
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)


class CompareTest(unittest.TestCase):
    def test_measures_every_quick_row(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "compare.json"
            result = run(BENCH / "compare", "--quick", "--at-most", 500, "--repeat", 1, "--bin", BIN, "--json", out)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            document = json.loads(out.read_text(encoding="utf-8"))
        self.assertEqual(document["wrong"], [])
        self.assertEqual({row["name"] for row in document["rows"]}, {row.name for row in rows.ROWS if row.quick})
        for row in document["rows"]:
            self.assertIn(f"\n{row['name']} ", result.stdout)
            for by_threads in row["by_threads"].values():
                self.assertTrue(math.isfinite(by_threads["median"]) and by_threads["median"] > 0, row["name"])
                self.assertIsNone(by_threads["target"], "a target is for a cloud of full size")
                for report in by_threads["runs"]:
                    self.assertGreater(report["memory_bytes"], 0, row["name"])
                    self.assertTrue("vertices" not in report or report["validated"], row["name"])
            for peer in row["peers"]:
                self.assertGreater(peer["runs"][0]["memory_bytes"], 0, row["name"])

    def test_every_target_has_a_row(self):
        targets = {row.name: row.targets for row in rows.ROWS if row.targets}
        self.assertEqual(targets, {
            "delaunay/uniform-2-1000000": (3.3, 1.9), "mesh_2/uniform-2-100000": (2.5, 4),
            "mesh_2/uniform-2-1000000": (5, 9), "tetgen/uniform-3-10000": (1.5, 2.5), "tetgen/uniform-3-100000": (3, 5),
            "tetgen/clusters-3-100000": (2, 3.5), "tetgen/sphere-3-100000": (4, 7), "tetgen/grid-3-64000": (2, 3),
            "tetgen/skew-3-20000": (100, 170), "memory/skew-3-20000": (150,), "growth/uniform-2-1000000": (1.5,),
            "growth/uniform-3-1000000": (1.5,), "memory/uniform-2-1000000": (170,), "memory/uniform-3-1000000": (450,),
            "domain/segments-2-200000": (2, 3.2), "domain/land-110m": (2, 3.2), "memory/segments-2-200000": (1.3,),
            "cell/uniform-3-1000000": (3,), "initialize/uniform-2-1000000": (4,), "initialize/uniform-3-1000000": (8,)})

    def test_a_target_is_met_on_its_side(self):
        faster = rows.tetgen("uniform-3-10000", (1.5, 2.5))
        self.assertEqual([rows.passes(faster, 1, 1.5), rows.passes(faster, 1, 1.4), rows.passes(faster, 2, 2.4)],
                         [True, False, False])
        slower = rows.delaunay("uniform-2-1000000", (3.3, 1.9))
        self.assertEqual([rows.passes(slower, 1, 3.2), rows.passes(slower, 2, 2.0)], [True, False])
        self.assertIsNone(rows.passes(rows.tetgen("spot"), 1, 1.0))

    def test_refuses_unknown_rows(self):
        result = run(BENCH / "compare", "--rows", "tetgne/", "--bin", BIN)
        self.assertEqual(result.returncode, 1)
        self.assertIn("no row begins with 'tetgne/'", result.stderr)

    def test_says_which_program_is_missing(self):
        with tempfile.TemporaryDirectory() as folder:
            result = run(BENCH / "compare", "--rows", "tetgen/spot", "--bin", folder)
        self.assertEqual(result.returncode, 1)
        self.assertIn("bench_tetgen_mesh", result.stderr)

    def test_notices_wrong_meshes(self):
        row = rows.tetgen("uniform-3-10000")
        mesh = {"fingerprint": "1", "vertices": 25_071}
        reports = {run: [dict(mesh), dict(mesh)] for run in row.ours.values()}
        reports[row.peers[0]] = [{"vertices": 27_992}]
        self.assertEqual(compare.check(reports), [])

        other = copy.deepcopy(reports)
        other[row.ours[2]][1]["fingerprint"] = "2"
        self.assertIn("not the same mesh", "".join(compare.check(other)))
        large = copy.deepcopy(reports)
        large[row.ours[1]][0]["vertices"] = 26_000
        self.assertIn("26000 vertices, 25071 in the design", "".join(compare.check(large)))
        lost = copy.deepcopy(reports)
        lost[row.peers[0]][0]["vertices"] = 9_000
        self.assertIn("has lost", "".join(compare.check(lost)))

    def test_notices_wrong_cells(self):
        row = rows.whole_cells("uniform-3-100000")
        reports = {row.ours[1]: [{"cells": 100_000, "facets": 1_550_000}],
                   row.peers[0]: [{"cells": 100_000, "facets": 1_550_500}]}
        self.assertEqual(compare.check(reports), [])
        reports[row.ours[1]][0]["facets"] = 1_500_000
        self.assertIn("facets", "".join(compare.check(reports)))


class ScalingTest(unittest.TestCase):
    def test_measures_and_draws(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder)
            result = run(BENCH / "scaling", "--largest", 2000, "--repeat", 1, "--peers", "--bin", BIN, "--out", out)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            with open(out / "scaling.csv", newline="", encoding="utf-8") as file:
                figures = list(csv.DictReader(file))
            self.assertTrue((out / "scaling.png").read_bytes().startswith(b"\x89PNG"))
            document = json.loads((out / "scaling.json").read_text(encoding="utf-8"))
        self.assertEqual(len(document["figures"]), len(figures))
        measured = {(figure["dimension"], figure["program"], figure["points"]) for figure in figures}
        programs = [("2", "Wellspace"), ("2", "CGAL Mesh_2"), ("2", "CGAL Delaunay_2"), ("3", "Wellspace"),
                    ("3", "TetGen"), ("3", "CGAL Delaunay_3")]
        self.assertEqual(measured, {(dimension, program, points) for points in ("1000", "2000")
                                    for dimension, program in programs})
        for figure in figures:
            self.assertGreater(float(figure["us_per_vertex"]), 0)
            self.assertGreater(float(figure["bytes_per_vertex"]), 0)

    def test_refuses_no_sizes(self):
        result = run(BENCH / "scaling", "--largest", 10, "--bin", BIN)
        self.assertEqual(result.returncode, 2)
        self.assertIn("--largest: 10 is not allowed", result.stderr)


class MicroTest(unittest.TestCase):
    def test_measures_every_part(self):
        result = run(BIN / "bench_micro", "--benchmark_filter=DecideCut|points:10000$", "--benchmark_min_time=0.001",
                     "--benchmark_format=json")
        self.assertEqual(result.returncode, 0, result.stderr)
        measured = json.loads(result.stdout)["benchmarks"]
        self.assertEqual([part["name"] for part in measured if part.get("error_occurred")], [])
        parts = {part["name"].partition("-D")[0] for part in measured}
        self.assertEqual(parts, {f"{part}/{dimension}" for dimension in (2, 3) for part in [
            "RadixSort", "Initialize", "SortCloud", "Tree", "NearestNeighbor", "ClippedCell", "ClippedCellOfInput",
            "Star", "Cut", "DecideCut/Word", "DecideCut/Integer", "DecideCut/WideInteger", "DecideCut/BigInteger"]})


class EditsTest(unittest.TestCase):
    def test_measures_every_kind_of_mesh(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "edits.json"
            result = run(BENCH / "edits", "--quick", "--at-most", 200, "--repeat", 1, "--bin", BIN, "--json", out)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            document = json.loads(out.read_text(encoding="utf-8"))
        self.assertEqual({row["mesh"] for row in document["rows"]},
                         {"3-D", "3-D, slivers left", "2-D", "domain in the plane"})
        for row in document["rows"]:
            self.assertIn(row["points"], (1, 100))
            for report in row["reports"]:
                self.assertGreater(report["edit_seconds"], 0, row["mesh"])
                self.assertGreater(report["vertices"], 0, row["mesh"])


class ServiceTest(unittest.TestCase):
    def test_measures_small_meshes_and_edits(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "service.json"
            result = run(BENCH / "service", "--quick", "--at-most", 100, "--seconds", 0.5, "--bin", BIN, "--json", out)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            document = json.loads(out.read_text(encoding="utf-8"))
        jobs = [row["report"] for row in document["rows"] if "jobs" in row["report"]]
        edits = [row["report"] for row in document["rows"] if "edit_seconds" in row["report"]]
        self.assertGreaterEqual(len(jobs), 5)
        self.assertGreaterEqual(len(edits), 3)
        for report in jobs:
            self.assertGreater(report["jobs"], 0)
            self.assertGreater(report["server_seconds"], 0)
            self.assertLessEqual(report["median_seconds"], report["p99_seconds"])
        for report in edits:
            self.assertGreater(report["vertices"], 100)
            self.assertGreaterEqual(report["edit_seconds"], report["update_seconds"])


if __name__ == "__main__":
    unittest.main()
