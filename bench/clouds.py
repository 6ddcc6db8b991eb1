"""The reference clouds of all benchmarks, and the figures of their meshes.

Synthetic clouds come from make_clouds.py; real ones and real domains from examples/, scaled uniformly to a longest side
of 0.8 and centred in the unit box. The domain of all of them is the unit box.
"""
import array
import collections
import csv
import gzip
import json
import math
import pathlib

import make_clouds

ROOT = pathlib.Path(__file__).resolve().parent.parent
SQRT2 = math.sqrt(2)

Size = collections.namedtuple("Size", "cloud rho peer peer_vertices design")

# Peers: Triangle -q20.705 (-q30 for rho = 1) and TetGen -zpq<rho>/0O0/0NEF on the same points in the same box. Design:
# a prototype of the algorithm, one vertex after the other, buckets of sqrt(2) (1.2 for rho = 1).
SIZES = [
    Size("uniform-2-10000", SQRT2, "Triangle", 16601, 16659),
    Size("inner-2-10000", SQRT2, "Triangle", 16211, 16150),
    Size("clusters-2-100000", SQRT2, "Triangle", 159968, 158824),
    Size("lines-2-100000", SQRT2, "Triangle", 386285, 375533),
    Size("annuli-2-100000", SQRT2, "Triangle", 405761, 390542),
    Size("grid-2-90000", SQRT2, "Triangle", 91114, 91216),
    Size("coast-110m", SQRT2, "Triangle", 9499, 9612),
    Size("coast-50m", SQRT2, "Triangle", 125524, 126221),
    Size("inner-2-10000", 1.0, "Triangle", 28151, 27996),
    Size("uniform-3-10000", 2.0, "TetGen", 27992, 25071),
    Size("uniform-3-100000", 2.0, "TetGen", 220097, 196256),
    Size("inner-3-10000", 2.0, "TetGen", 17088, 15229),
    Size("sphere-3-10000", 2.0, "TetGen", 38641, 27519),
    Size("clusters-3-100000", 2.0, "TetGen", 154537, 143962),
    Size("annuli-3-100000", 2.0, "TetGen", 384862, 272953),
    Size("skew-3-2000", 2.0, "TetGen", 13081, 10721),
    Size("moment-3-2000", 2.0, "TetGen", 12981, 11421),
    Size("grid-3-64000", 2.0, "TetGen", 66943, 67453),
    Size("inner-3-3000", 1.2, "TetGen", 18206, 14888),
    Size("spot", 2.0, "TetGen", 5151, 4741),
]

# The largest accepted ratio of a mesh's vertices to the design's.
SIZE_LIMIT = 1.02


def synthetic(name):
    """The points of KIND-D-N, or None if `name` is none."""
    parts = name.split("-")
    if len(parts) != 3:
        return None
    kind, dimension, count = parts
    return make_clouds.cloud(kind, int(dimension), int(count))


def example_file(name):
    """The file of an example: points, or polygons."""
    polygons = ROOT / "examples" / f"{name}.geojson.gz"
    return polygons if polygons.exists() else ROOT / "examples" / f"{name}.csv"


def segments_of(path):
    """The ends of the sides of a GeoJSON file's MultiPolygon, those of each side in a row."""
    with gzip.open(path, "rt", encoding="utf-8") as file:
        polygons = json.load(file)["geometry"]["coordinates"]
    return [end[:2] for polygon in polygons for ring in polygon for side in zip(ring, ring[1:]) for end in side]


def example(name):
    """The points of an example, brought into the unit box; of polygons, the ends of their sides, in pairs."""
    path = example_file(name)
    if path.suffix == ".gz":
        points = segments_of(path)
    else:
        with open(path, newline="", encoding="utf-8") as file:
            rows = csv.reader(file)
            next(rows)  # the header
            points = [[float(x) for x in row] for row in rows]
    low = [min(column) for column in zip(*points)]
    high = [max(column) for column in zip(*points)]
    factor = 0.8 / max(h - l for l, h in zip(low, high))
    return [[0.5 + factor * (x - (l + h) / 2) for x, l, h in zip(p, low, high)] for p in points]


def points_of(name):
    """The points of a reference cloud, synthetic or real."""
    return synthetic(name) or example(name)


Stored = collections.namedtuple("Stored", "path dimension count")


def store(name, folder):
    """Writes the cloud as doubles to a file of `folder`, unless it is there already, and returns where."""
    folder.mkdir(parents=True, exist_ok=True)
    found = list(folder.glob(f"{name}.[2-6]d"))
    source = ROOT / "bench" / "make_clouds.py" if len(name.split("-")) == 3 else example_file(name)
    if not found or found[0].stat().st_mtime < source.stat().st_mtime:
        points = points_of(name)
        found = [folder / f"{name}.{len(points[0])}d"]
        whole = found[0].with_suffix(".part")
        with open(whole, "wb") as file:
            array.array("d", (x for p in points for x in p)).tofile(file)
        whole.rename(found[0])
    dimension = int(found[0].suffix[1])
    return Stored(found[0], dimension, found[0].stat().st_size // (8 * dimension))
