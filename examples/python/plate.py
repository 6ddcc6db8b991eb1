"""The temperature of a plate with a hole: segments with markers, and finite elements by scipy on the mesh.

The outer sides are at 0 degrees, the hole is at 100.

    python3 plate.py
"""

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

import wellspace

OUTER, HOLE = 1, 2


def plate(around=64):
    """Points, segments between them and their markers: a square, and a circle about its middle."""
    angles = np.linspace(0, 2 * np.pi, around, endpoint=False)
    points = np.vstack([[[-1, -1], [1, -1], [1, 1], [-1, 1]], 0.3 * np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    square, circle = np.arange(4), 4 + np.arange(around)
    segments = np.vstack([np.stack([ring, np.roll(ring, -1)], axis=1) for ring in (square, circle)])
    return points, segments, np.repeat([OUTER, HOLE], [4, around])


def stiffness(mesh):
    """Of linear elements for the Laplacian."""
    corners = mesh.points[mesh.simplices]
    edges = np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)  # opposite to each corner
    areas = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 2
    local = np.einsum("tik,tjk->tij", edges, edges) / (4 * areas)[:, None, None]
    rows = np.repeat(mesh.simplices, 3, axis=1).ravel()
    columns = np.tile(mesh.simplices, 3).ravel()
    return scipy.sparse.csr_matrix((local.ravel(), (rows, columns)))


def main():
    points, segments, markers = plate()
    mesh = wellspace.mesh(points, segments=segments, markers=markers, holes=[[0, 0]], size=0.05, min_angle=25)
    print(mesh)

    temperature = np.zeros(len(mesh.points))
    temperature[mesh.boundary_vertices("marker_2")] = 100
    fixed = mesh.boundary_vertices()
    free = np.setdiff1d(np.arange(len(mesh.points)), fixed)
    matrix = stiffness(mesh)
    load = -matrix[free] @ temperature
    temperature[free] = scipy.sparse.linalg.spsolve(matrix[free][:, free].tocsc(), load)
    print(f"between {temperature.min():.1f} and {temperature.max():.1f} degrees")

    # Half way between hole and side.
    middle = np.argmin(((mesh.points - [0.65, 0]) ** 2).sum(axis=1))
    print(f"at {mesh.points[middle].round(2)}: {temperature[middle]:.1f} degrees")
    assert 25 < temperature[middle] < 45


if __name__ == "__main__":
    main()
