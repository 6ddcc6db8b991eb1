"""Meshes as pages: for notebooks, and as files that a browser shows without any network."""

from __future__ import annotations

import base64
import html
import importlib.resources
import json
import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _files
from ._mesh_arrays import MeshArrays
from .errors import InvalidArgumentError, LimitError

_MARK = "<!--wellspace:mesh-->"
# Of each array: browsers have no longer texts than twice that.
_MOST_BYTES = 2**28


class Plot:
    """A page that shows a mesh: the boundary by name, cuts, quality, regions and data, with histograms.

    Jupyter and its like show it below the cell that makes it. The page has the mesh and all else that it needs inside,
    and asks no network for anything.
    """

    def __init__(self, pieces: list[str], name: str, height: int) -> None:
        self._pieces = pieces
        self._name = name
        self._height = height

    @property
    def html(self) -> str:
        """The whole page."""
        return "".join(self._pieces)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the page to a file, which appears complete or not at all."""
        with _files.replacing(path) as file:
            for piece in self._pieces:
                file.write(piece.encode())

    def _repr_html_(self) -> str:
        # Of another origin than the notebook, whatever the page does.
        return (
            f'<iframe title="{html.escape(self._name)}" width="100%" height="{self._height}" style="border: 0" '
            f'sandbox="allow-scripts allow-downloads" srcdoc="{html.escape(self.html)}"></iframe>'
        )

    def __repr__(self) -> str:
        return f"<wellspace.Plot of {self._name}: {sum(map(len, self._pieces)) / 1e6:.1f} MB>"


def plot(mesh: MeshArrays, name: str, up: str, data: Mapping[str, Any] | None, height: int) -> Plot:
    """See Mesh.plot."""
    if mesh.dimension not in (2, 3):
        raise InvalidArgumentError(f"a mesh in {mesh.dimension}-D; plot shows 2-D and 3-D", field="mesh")
    if up not in ("x", "y", "z"):
        raise InvalidArgumentError(f"up is {up!r}; expected 'x', 'y' or 'z'", field="up")
    if not len(mesh.simplices):
        raise InvalidArgumentError("a mesh without simplices; plot wants one at least", field="mesh")
    page = importlib.resources.files(__package__).joinpath("viewer.html").read_text(encoding="utf-8")
    before, after = page.split(_MARK)
    return Plot([before, *_elements(mesh, name, up, *_fields(mesh, data or {})), after], name, height)


_Fields = dict[str, npt.NDArray[np.float64]]


def _fields(mesh: MeshArrays, data: Mapping[str, Any]) -> tuple[_Fields, _Fields]:
    """The numbers of the vertices, and those of the simplices."""
    of_vertices: _Fields = {}
    of_simplices: _Fields = {}
    for name, values in data.items():
        array = np.asarray(values, np.float64)
        if array.shape == (len(mesh.points),):
            of_vertices[str(name)] = array
        elif array.shape == (len(mesh.simplices),):
            of_simplices[str(name)] = array
        else:
            expected = f"({len(mesh.points)},) or ({len(mesh.simplices)},), one number for each vertex or simplex"
            raise InvalidArgumentError(f"data[{name!r}] has the shape {array.shape}; expected {expected}", field="data")
    if mesh.weights is not None:
        of_vertices.setdefault("weights", mesh.weights)
    return of_vertices, of_simplices


def _facet_counts(mesh: MeshArrays) -> dict[int, int]:
    """How many facets each tag has, by ascending tags: those with a name, and those of facets."""
    tags, counts = np.unique(mesh.facet_tags, return_counts=True)
    found = {**dict.fromkeys(mesh.facet_names, 0), **dict(zip(tags.tolist(), counts.tolist()))}
    return dict(sorted(found.items()))


def _elements(
    mesh: MeshArrays, name: str, up: str, of_vertices: _Fields, of_simplices: _Fields
) -> Iterator[str]:
    """The elements of the page that hold the mesh; docs/view.md defines them."""
    counts = _facet_counts(mesh)
    order = np.argsort(mesh.facet_tags, kind="stable")
    ids = sorted({*mesh.region_names, *np.unique(mesh.regions).tolist()})
    header = {
        "format": 1,
        "name": name,
        "dimension": mesh.dimension,
        "up": "xyz".index(up),
        "vertices": len(mesh.points),
        "simplices": len(mesh.simplices),
        "boundary": [{"tag": tag, "name": mesh.facet_names.get(tag, ""), "facets": counts[tag]} for tag in counts],
        "regions": [{"id": number, "name": mesh.region_names.get(number, "")} for number in ids],
        "has_simplex_regions": len(ids) > 1,
        "fields": list(of_vertices),
        "simplex_fields": list(of_simplices),
    }
    text = json.dumps(header, sort_keys=True, separators=(",", ":")).replace("<", "\\u003c")
    yield f'<script type="application/json" id="mesh">{text}</script>\n'
    arrays: dict[str, npt.NDArray[Any]] = {
        "points": mesh.points.astype("<f8", copy=False),
        "simplices": mesh.simplices.astype("<u4", copy=False),
        "facets": mesh.facets[order].astype("<u4", copy=False),
    }
    if len(ids) > 1:
        arrays["regions"] = np.searchsorted(ids, mesh.regions).astype("<u4")
    for kind, fields in (("field", of_vertices), ("simplex-field", of_simplices)):
        for number, values in enumerate(fields.values()):
            arrays[f"{kind}{number}"] = values.astype("<f8", copy=False)
    for key, array in arrays.items():
        if array.nbytes > _MOST_BYTES:
            raise LimitError(f"the {key} take {array.nbytes} bytes; a page has room for {_MOST_BYTES} of an array")
        encoded = base64.b64encode(np.ascontiguousarray(array).data).decode()
        yield f'<script type="application/octet-stream" id="mesh-{key}">{encoded}</script>\n'


def table(mesh: MeshArrays) -> str:
    """The display of a mesh in notebooks: a few rows of numbers."""
    kind = {2: "triangles", 3: "tetrahedra"}.get(mesh.dimension, "simplices")
    rows = [("vertices", f"{len(mesh.points):,}"), (kind, f"{len(mesh.simplices):,}")]
    if mesh.facet_names:
        counts = _facet_counts(mesh)
        named = ((name, counts[tag]) for tag, name in mesh.facet_names.items())
        rows.append(("boundary", ", ".join(f"{name or 'no name'} ({count:,})" for name, count in named)))
    if len(mesh.region_names) > 1:
        rows.append(("regions", ", ".join(name or f"{number}" for number, name in mesh.region_names.items())))
    low, high = ("(" + ", ".join(f"{x:.6g}" for x in corner) + ")" for corner in mesh.box)
    rows.append(("box", f"{low} to {high}"))
    cells = "".join(f"<tr><th>{html.escape(key)}</th><td>{html.escape(text)}</td></tr>" for key, text in rows)
    return f"<table><caption>Mesh in {mesh.dimension}-D</caption>{cells}</table>"
