"""For tests in Python: the calls of wellspace.v1, and meshes put together of their answers."""
import grpc
import numpy

from wellspaced import PATIENCE, api, crc32c, details


def unit_box(dimension, **others):
    """Parameters of a mesh in the unit box."""
    box = api().Box(low=[0] * dimension, high=[1] * dimension)
    return api().MeshParameters(dimension=dimension, domain=box, **others)


def uniform(count, dimension, seed):
    return numpy.random.default_rng(seed).uniform(0.05, 0.95, (count, dimension))


def pieces(name, points, offset, rows):
    """The requests of an upload of points[offset:], so many rows in each."""
    for first in range(offset, len(points), rows):
        chunk = api().PointChunk(coordinates=points[first:first + rows].ravel())
        yield api().UploadPointsRequest(name=name, point_offset=first, points=chunk)


def place_of(phase):
    """The place of a phase in the order in which they come, which is not that of their numbers."""
    return len(api().Phase.values()) if phase == api().PHASE_DONE else phase


def cloud(request, parameters, points, rows=50_000, **others):
    """The requests of MeshPoints or EstimateMesh, which are of type `request`; `others`: more fields of the first."""
    yield request(parameters=parameters, **others)
    for first in range(0, len(points), rows):
        yield request(points=api().PointChunk(coordinates=points[first:first + rows].ravel()))


def array_of(chunk):
    """The array that a chunk is of, and its values as they are on the wire."""
    for name, kind in (("points", "<f8"), ("weights", "<f8"), ("simplices", "<u4"), ("input_vertices", "<u4"),
                       ("vertex_origins", "<u4"), ("vertex_tags", "<i4"), ("facets", "<u4")):
        values = getattr(chunk, name)
        if values:
            return name, numpy.array(values, kind)
    raise AssertionError("a chunk without content")


class Mesh:
    """The arrays of a mesh, put together of its chunks, each of which is checked."""

    def __init__(self, metadata, chunks):
        assert [chunk.index for chunk in chunks] == list(range(metadata.chunk_count))
        parts = {"points": [], "weights": [], "simplices": [], "input_vertices": [], "vertex_origins": [],
                 "vertex_tags": [], "facets": []}
        for chunk in chunks:
            name, values = array_of(chunk)
            assert crc32c(values.tobytes()) == chunk.crc32c, chunk.index
            parts[name].append(values)
        d = metadata.dimension
        self.points = numpy.concatenate(parts["points"]).reshape(metadata.vertex_count, d)
        self.weights = numpy.concatenate([numpy.zeros(0), *parts["weights"]])
        self.simplices = numpy.concatenate(parts["simplices"]).reshape(metadata.simplex_count, d + 1)
        self.input_vertices = numpy.concatenate([numpy.zeros(0, "<u4"), *parts["input_vertices"]])
        self.vertex_origins = numpy.concatenate([numpy.zeros(0, "<u4"), *parts["vertex_origins"]])
        self.vertex_tags = numpy.concatenate([numpy.zeros(0, "<i4"), *parts["vertex_tags"]])
        self.facets = numpy.concatenate([numpy.zeros(0, "<u4"), *parts["facets"]]).reshape(metadata.facet_count, d)
        self.facet_tags = numpy.repeat(numpy.array([part.tag for part in metadata.boundary], "<i4"),
                                       [part.facet_count for part in metadata.boundary])

    def volume(self):
        """Of all simplices; each must be positively oriented."""
        corners = self.points[self.simplices]
        volumes = numpy.linalg.det(corners[:, 1:] - corners[:, :1]) / (2 if corners.shape[2] == 2 else 6)
        assert volumes.min() > 0
        return volumes.sum()


def smallest_dihedral_angle(mesh):
    """Of a mesh of tetrahedra, in degrees."""
    corners = mesh.points[mesh.simplices]
    # Of barycentric coordinates: normals of facets, in columns.
    gradients = numpy.linalg.inv(corners[:, 1:] - corners[:, :1])
    normals = numpy.concatenate([-gradients.sum(axis=2, keepdims=True), gradients], axis=2)
    normals /= numpy.linalg.norm(normals, axis=1, keepdims=True)
    cosines = -numpy.einsum("tki,tkj->tij", normals, normals)[:, *numpy.triu_indices(4, 1)]
    return numpy.degrees(numpy.arccos(cosines.max()))


class Remote:
    """The calls on a server."""

    def __init__(self, address, credentials=None):
        self.address = address
        self.channel = grpc.secure_channel(address, credentials) if credentials else grpc.insecure_channel(address)
        self.meshing = api().MeshingServiceStub(self.channel)
        self.sessions = api().SessionServiceStub(self.channel)
        self.operations = api().OperationServiceStub(self.channel)
        self.queries = api().QueryServiceStub(self.channel)

    def close(self):
        self.channel.close()

    def info(self):
        return self.meshing.GetServerInfo(api().GetServerInfoRequest(), timeout=PATIENCE)

    def create(self, parameters, **others):
        request = api().CreateSessionRequest(parameters=parameters, **others)
        return self.sessions.CreateSession(request, timeout=PATIENCE).session

    def get(self, name):
        return self.sessions.GetSession(api().GetSessionRequest(name=name), timeout=PATIENCE).session

    def list(self, **others):
        return self.sessions.ListSessions(api().ListSessionsRequest(**others), timeout=PATIENCE)

    def delete(self, name):
        self.sessions.DeleteSession(api().DeleteSessionRequest(name=name), timeout=PATIENCE)

    def upload(self, name, points, offset=0, rows=50_000):
        return self.sessions.UploadPoints(pieces(name, points, offset, rows), timeout=PATIENCE)

    def start(self, name, parameters=None):
        request = api().StartRefinementRequest(name=name, parameters=parameters)
        return self.operations.StartRefinement(request, timeout=PATIENCE).operation

    def cancel(self, operation):
        return self.operations.CancelOperation(api().CancelOperationRequest(name=operation), timeout=PATIENCE).operation

    def responses(self, operation, timeout=PATIENCE, **after):
        """The stream of a watch."""
        return self.operations.WatchOperation(api().WatchOperationRequest(name=operation, **after), timeout=timeout)

    def watch(self, operation, **after):
        """Watches an operation to its end: the operation, and the events."""
        *events, last = self.responses(operation, **after)
        assert last.WhichOneof("response") == "operation"
        return last.operation, [response.progress for response in events]

    def refine(self, name, parameters=None):
        return self.watch(self.start(name, parameters).name)

    def download(self, name, **others):
        """Metadata and chunks."""
        request = api().DownloadMeshRequest(name=name, **others)
        first, *rest = self.sessions.DownloadMesh(request, timeout=PATIENCE)
        return first.metadata, [response.chunk for response in rest]

    def mesh(self, parameters, points, **others):
        """All in one call: metadata and chunks."""
        requests = cloud(api().MeshPointsRequest, parameters, points, **others)
        responses = self.meshing.MeshPoints(requests, timeout=PATIENCE)
        found = {"progress": [], "metadata": [], "chunk": []}
        for response in responses:
            kind = response.WhichOneof("response")
            found[kind].append(getattr(response, kind))
        (metadata,) = found["metadata"]
        return metadata, found["chunk"]


def content(chunks):
    """Chunks as bytes, to be compared."""
    return [chunk.SerializeToString(deterministic=True) for chunk in chunks]


class Fails:
    """`with Fails(test, code) as error:` and an RpcError of that code, whose google.rpc details error.details has."""

    def __init__(self, test, code, reason=None):
        self.test, self.code, self.reason, self.details, self.message = test, code, reason, None, None

    def __enter__(self):
        return self

    def __exit__(self, kind, error, _):
        self.test.assertIsNotNone(error, f"expected {self.code}, but the call succeeded")
        if not isinstance(error, grpc.RpcError):
            return False
        self.test.assertEqual(error.code(), self.code, error.details())
        self.details, self.message = details(error), error.details()
        if self.reason is not None:
            info = self.details["google.rpc.ErrorInfo"]
            self.test.assertEqual((info.domain, info.reason), ("wellspace.v1", "ERROR_REASON_" + self.reason),
                                  self.message)
        return True

    @property
    def field(self):
        """The field of the request that is to blame."""
        (violation,) = self.details["google.rpc.BadRequest"].field_violations
        return violation.field
