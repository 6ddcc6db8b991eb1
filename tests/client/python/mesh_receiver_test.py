"""A mesh from its chunks: every way in which an answer can contradict itself is found."""

import unittest

import numpy as np
from support import Case

from wellspace import DamagedAnswerError, LimitError, _api, _mesh
from wellspace._checksum import crc32c
from wellspace._receiver import MeshReceiver

ARRAYS = {
    "points": np.array([[0, 0], [1, 0], [1, 1], [0, 1]], "<f8"),
    "vertex_origins": np.array([0, 1, 2**32 - 1, 2**32 - 3], "<u4"),
    "vertex_tags": np.array([1, 1, 3, 0], "<i4"),
    "simplices": np.array([[0, 1, 2], [0, 2, 3]], "<u4"),
    "input_vertices": np.array([0, 1, 2**32 - 1], "<u4"),
    "facets": np.array([[0, 1], [1, 2], [2, 3]], "<u4"),
}


def metadata(**changes):
    message = _api.message("MeshMetadata")(
        dimension=2, vertex_count=4, simplex_count=2, input_point_count=3, chunk_count=6, facet_count=3,
        has_vertex_marks=True, moved_vertex_count=1,
    )
    message.domain.low.extend([0, 0])
    message.domain.high.extend([1, 1])
    message.boundary.add(tag=1, name="xmin", facet_count=2)
    message.boundary.add(tag=3, name="marker_3", facet_count=1)
    message.regions.add(id=1, name="domain")
    for name, value in changes.items():
        setattr(message, name, value)
    return message


def chunk(index, name, values=None, **others):
    values = ARRAYS[name] if values is None else np.asarray(values, ARRAYS[name].dtype)
    fields = {"index": index, name: values.ravel().tolist(), "crc32c": crc32c(values), **others}
    if name == "points":
        fields.setdefault("moved_vertices", [2])
    return _api.message("MeshChunk")(**fields)


def bytes_of(message):
    return memoryview(message.SerializeToString())


class MeshReceiverTest(Case):
    def receiver(self, chunks=0, **changes):
        receiver = MeshReceiver(2, 3)
        receiver.set_metadata(bytes_of(metadata(**changes)))
        for index, name in enumerate(list(ARRAYS)[:chunks]):
            receiver.add_chunk(bytes_of(chunk(index, name)))
        return receiver

    def test_takes_a_mesh(self):
        receiver = self.receiver(6)
        receiver.finish()
        mesh = _mesh.mesh_of(receiver)
        np.testing.assert_array_equal(mesh.points, ARRAYS["points"])
        np.testing.assert_array_equal(mesh.simplices, ARRAYS["simplices"])
        np.testing.assert_array_equal(mesh.input_vertices, [0, 1, -1])
        np.testing.assert_array_equal(mesh.vertex_origins, [0, 1, -1, -3])
        np.testing.assert_array_equal(mesh.facet_tags, [1, 1, 3])
        np.testing.assert_array_equal(mesh.regions, [1, 1])
        np.testing.assert_array_equal(mesh.moved_vertices, [2])
        np.testing.assert_array_equal(mesh.boundary("marker_3"), [[2, 3]])
        for array in (mesh.points, mesh.simplices, mesh.facets, mesh.vertex_origins):
            self.assertTrue(array.flags.c_contiguous and array.flags.aligned and array.flags.writeable)

    def test_damaged_chunks(self):
        for done, message, expected in (
            (0, chunk(1, "points"), "chunk 1 where chunk 0 of 6"),
            (0, chunk(0, "points", crc32c=1), "has the CRC32C"),
            (0, chunk(0, "points", simplices=[0, 1, 2]), "2 arrays; expected one"),
            (0, _api.message("MeshChunk")(index=0), "0 arrays; expected one"),
            (0, chunk(0, "points", np.zeros(7)), "no multiple of 2"),
            (0, chunk(0, "points", np.zeros((5, 2))), "more than the announced 8 numbers of points"),
            (0, chunk(0, "simplices"), "simplices after 0 of 8 numbers of points"),
            (1, chunk(1, "points"), "more than the announced"),
            (2, chunk(2, "vertex_origins"), "more than the announced"),
            (2, chunk(2, "points"), "points after vertex_origins"),
            (1, chunk(1, "vertex_origins", [0, 3, 0, 0]), "name input point 3 of 3"),
            (2, chunk(2, "vertex_tags", [0, 1, 3, 2]), "name the tag 2"),
            (3, chunk(3, "simplices", [[0, 1, 2], [0, 1, 4]]), "name vertex 4 of 4"),
            (4, chunk(4, "input_vertices", [0, 4, 1]), "name vertex 4 of 4"),
            (5, chunk(5, "facets", [[0, 1], [1, 2], [2, 9]]), "name vertex 9 of 4"),
            (0, chunk(0, "points", [[0, 0], [0, np.nan], [0, 0], [0, 0]]), "points have the number nan"),
            (0, chunk(0, "points", [[0, 0], [0, -np.inf], [0, 0], [0, 0]]), "points have the number -inf"),
            (0, chunk(0, "points", moved_vertices=[2, 1]), "not ascending"),
            (0, chunk(0, "points", moved_vertices=[4]), "not from 0 up to 4"),
            (0, chunk(0, "points", moved_vertices=[1, 2]), "more than the announced 1 moved"),
        ):
            with self.subTest(expected), self.fails(DamagedAnswerError, expected, code="DATA_LOSS"):
                self.receiver(done).add_chunk(bytes_of(message))

    def test_each_flipped_bit_of_an_array_is_found(self):
        serialized = bytearray(chunk(0, "points").SerializeToString())
        begin = serialized.index(ARRAYS["points"].tobytes())
        for bit in range(8 * begin, 8 * (begin + ARRAYS["points"].nbytes), 5):
            serialized[bit // 8] ^= 1 << bit % 8
            with self.fails(DamagedAnswerError, "CRC32C"):
                self.receiver().add_chunk(memoryview(bytes(serialized)))
            serialized[bit // 8] ^= 1 << bit % 8

    def test_damaged_metadata(self):
        for changes, expected in (
            ({"dimension": 3}, "a mesh of dimension 3"),
            ({"dimension": 0}, "a mesh of dimension 0"),
            ({"vertex_count": 2**33}, "more than can be"),
            ({"simplex_count": 2**60}, "more than can be"),
            ({"facet_count": 2**60}, "more than can be"),
            ({"input_point_count": 4}, "a mesh of 4 points; 3 were sent"),
            ({"facet_count": 4}, "other facets than 4"),
        ):
            with self.subTest(expected), self.fails(DamagedAnswerError, expected):
                self.receiver(**changes)

    def test_damaged_parts(self):
        for change, expected in (
            (lambda m: m.boundary.add(tag=1, name="again"), "with that of another"),
            (lambda m: m.boundary.add(tag=0, name="none"), "not above 0"),
            (lambda m: m.regions.add(id=-1, name="none"), "not above 0"),
            (lambda m: m.regions.add(id=2, name="two\nlines"), "'two\\nlines'"),
            (lambda m: m.regions.add(id=2, name=""), "with the name ''"),
        ):
            message = metadata()
            change(message)
            with self.subTest(expected), self.fails(DamagedAnswerError, expected):
                MeshReceiver().set_metadata(bytes_of(message))

    def test_what_is_missing(self):
        with self.fails(DamagedAnswerError, "no mesh"):
            MeshReceiver().finish()
        with self.fails(DamagedAnswerError, "5 of 6 chunks"):
            self.receiver(5).finish()
        with self.fails(DamagedAnswerError, "numbers of facets"):
            self.receiver(5, chunk_count=5).finish()
        with self.fails(DamagedAnswerError, "0 of 1 moved"):
            receiver = self.receiver()
            receiver.add_chunk(bytes_of(chunk(0, "points", moved_vertices=[])))
            for index, name in list(enumerate(ARRAYS))[1:]:
                receiver.add_chunk(bytes_of(chunk(index, name)))
            receiver.finish()

    def test_goes_on_with_the_same_mesh_only(self):
        receiver = self.receiver(2)
        with self.fails(DamagedAnswerError, "a second metadata"):
            receiver.set_metadata(bytes_of(metadata()))
        receiver.resume()
        with self.fails(DamagedAnswerError, "a chunk before the metadata"):
            receiver.add_chunk(bytes_of(chunk(2, "vertex_tags")))
        again = metadata()
        again.statistics.peak_memory_bytes = 17  # of the server, now
        receiver.set_metadata(bytes_of(again))
        receiver.add_chunk(bytes_of(chunk(2, "vertex_tags")))
        receiver.resume()
        with self.fails(DamagedAnswerError, "another mesh"):
            receiver.set_metadata(bytes_of(metadata(revision=5)))

    def test_bytes_of_every_kind(self):
        """Any bytes give an error of the package, or none."""
        random = np.random.default_rng(5)
        outcomes = []
        for good, take in (
            (metadata().SerializeToString(), lambda data: MeshReceiver(2, 3).set_metadata(data)),
            (chunk(0, "points").SerializeToString(), lambda data: self.receiver().add_chunk(data)),
            (chunk(3, "simplices").SerializeToString(), lambda data: self.receiver(3).add_chunk(data)),
        ):
            for _ in range(1000):
                data = bytearray(good)
                for _ in range(random.integers(1, 4)):
                    data[random.integers(len(data))] = random.integers(256)
                end = random.integers(len(data)) if random.integers(4) == 0 else len(data)
                try:
                    take(memoryview(bytes(data[:end])))
                    outcomes.append("taken")
                except (DamagedAnswerError, LimitError):
                    outcomes.append("refused")
        self.assertGreater(outcomes.count("refused"), 1500)
        self.assertGreater(outcomes.count("taken"), 10, "counts that nothing contradicts yet")

    def test_numbers_of_more_than_31_bits(self):
        numbers = np.array([0, 5, 2**32 - 3, 2**32 - 1], np.uint32)
        small = _mesh.signed(numbers, 2**31)
        self.assertEqual((small.dtype, small.base is numbers, list(small)), (np.int32, True, [0, 5, -3, -1]))
        large = _mesh.signed(np.array([2**31, 2**32 - 4, 2**32 - 1], np.uint32), 2**32 - 4)
        self.assertEqual((large.dtype, list(large)), (np.int64, [2**31, 2**32 - 4, -1]))

    def test_more_than_the_memory_holds(self):
        with self.fails(LimitError, "no memory for 3298534883328 numbers of simplices", code="RESOURCE_EXHAUSTED"):
            self.receiver(simplex_count=2**40)


if __name__ == "__main__":
    unittest.main()
