"""A mesh that grows: points in pieces, a refinement where it is needed, and vertices that are added.

    python3 session.py
"""

import pathlib

import numpy as np

import wellspace

CLOUDS = pathlib.Path(__file__).resolve().parent.parent


def main():
    points = np.loadtxt(CLOUDS / "coast-110m.csv", delimiter=",", skiprows=1)
    with wellspace.Session(2, labels={"example": "coast"}) as session:
        for piece in np.array_split(points, 4):
            session.upload(piece)
        session.refine(progress=True)
        mesh = session.download()
        print(f"the coast: {mesh}")

        # Only the mesh around the new points is refined again; vertices keep their numbers.
        session.add([[-0.12, 51.51], [12.48, 41.89]])
        session.refine(size_boxes=[([5, 40], [15, 45], 0.5)])
        finer = session.download()
        print(f"with two towns, and finer in Italy: {finer}")
        assert (finer.points[: len(mesh.points)] == mesh.points).all()

        # As an adaptive solver does: a size for each vertex, and a mesh of these sizes, coarser where they have grown.
        distance = np.hypot(*(finer.points - points.mean(axis=0)).T)
        session.sizes(1 + distance / 10, mesh_revision=finer.revision)
        session.refine(restart=True)
        print(f"finer towards the middle: {session.download()}")

        rome = session.add([[12.48, 41.89]])[0]
        session.refine()
        cell = session.cells([rome])[0]
        print(f"the cell of Rome has {len(cell.nodes)} corners and {len(cell.neighbours)} neighbours")
        print(f"nearest vertex of Rome: {session.nearest([rome])[0]:.2f} degrees")


if __name__ == "__main__":
    main()
