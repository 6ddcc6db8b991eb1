"""Meshes the vertices of a cow, looks at the mesh, and writes it for ParaView.

    python3 quickstart.py [OUT]        OUT: spot.vtu
"""

import pathlib
import sys

import numpy as np

import wellspace

CLOUDS = pathlib.Path(__file__).resolve().parent.parent


def main(out="spot.vtu"):
    points = np.loadtxt(CLOUDS / "spot.csv", delimiter=",", skiprows=1)
    expected = wellspace.estimate(points, size=0.2)
    print(f"about {expected.vertices} vertices, {expected.memory_bytes / 1e6:.0f} MB")

    mesh = wellspace.mesh(points, size=0.2, progress=True)
    print(mesh)
    print(f"smallest dihedral angle: {mesh.statistics.min_angle_deg:.1f} degrees")
    print(f"{len(mesh.boundary('zmin'))} triangles on the floor")
    assert (mesh.points[mesh.input_vertices] == points).all()  # to the bit

    mesh.save(out)  # by the tool, or meshio; .npz needs neither
    print(f"wrote {out}")


if __name__ == "__main__":
    main(*sys.argv[1:])
