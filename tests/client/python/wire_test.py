"""Messages read and written without protobuf's objects, against protobuf."""

import unittest

import numpy as np

from wellspace import DamagedAnswerError, _api, _wire


def read(serialized):
    return list(_wire.fields(memoryview(serialized)))


class WireTest(unittest.TestCase):
    def test_fields_are_those_of_protobuf(self):
        values = [0.5, -0.0, 5e-324]
        chunk = _api.message("MeshChunk")(index=300, crc32c=7, points=values, moved_vertices=[1, 2**32 - 2])
        index, crc, points, moved = read(chunk.SerializeToString())
        self.assertEqual((index.number, index.value, crc.number, crc.value), (1, 300, 2, 7))
        np.testing.assert_array_equal(_wire.packed(points, "<f8").view("<u8"), np.array(values).view("<u8"))
        np.testing.assert_array_equal(_wire.packed(moved, "<u4"), [1, 2**32 - 2])

    def test_arrays_are_views(self):
        serialized = _api.message("MeshChunk")(points=[1, 2, 3]).SerializeToString()
        values = _wire.packed(read(serialized)[0], "<f8")
        self.assertFalse(values.flags.owndata)
        self.assertEqual(values.ctypes.data, np.frombuffer(serialized, np.uint8).ctypes.data + len(serialized) - 24)

    def test_varints_of_every_length(self):
        counts = [0, 1, 127, 128, 16383, 16384, 2**21 - 1, 2**21, 2**28 - 1, 2**28, 2**32 - 1]
        for wanted in (counts, counts[:3], counts[::-1], []):
            batch = _api.message("VoronoiCellBatch")(node_counts=wanted)
            found = [_wire.packed_varints(field) for field in read(batch.SerializeToString())]
            self.assertEqual([int(value) for part in found for value in part], wanted)

    def test_written_fields_are_read_by_protobuf(self):
        points = np.random.default_rng(1).uniform(size=(50, 3))
        request = _api.message("UploadPointsRequest")(name="sessions/a", point_offset=1 << 40)
        serialized = request.SerializeToString() + _wire.message_field(3, _wire.packed_field(1, points))
        parsed = _api.message("UploadPointsRequest").FromString(serialized)
        self.assertEqual((parsed.name, parsed.point_offset), ("sessions/a", 1 << 40))
        np.testing.assert_array_equal(np.reshape(parsed.points.coordinates, (50, 3)), points)
        self.assertEqual(_wire.packed_field(1, np.empty((0, 3))), b"")
        for number in (0, 1, 127, 128, 2**32, 2**64 - 1):
            self.assertEqual(_wire.read_varint(memoryview(_wire.varint(number)), 0)[0], number)

    def test_single_numbers_may_come_alone(self):
        point, crc = read(b"\x19" + np.array([0.25]).tobytes() + b"\x25\x07\0\0\0")
        np.testing.assert_array_equal(_wire.packed(point, "<f8"), [0.25])
        np.testing.assert_array_equal(_wire.packed(crc, "<u4"), [7])
        np.testing.assert_array_equal(_wire.packed_varints(read(b"\x20\x81\x01")[0]), [129])

    def test_what_is_no_message(self):
        for serialized, message in (
            (b"\x80", "without an end"),
            (b"\xff" * 11, "without an end"),
            (b"\x1a\x08\0\0", "8 bytes where 2 are left"),
            (b"\x19\0\0", "8 bytes where 2 are left"),
            (b"\x00\x00", "without a number"),
            (b"\x1b", "unknown type 3"),
        ):
            with self.subTest(serialized), self.assertRaisesRegex(DamagedAnswerError, message):
                read(serialized)

    def test_what_is_no_array(self):
        with self.assertRaisesRegex(DamagedAnswerError, "a multiple of 8"):
            _wire.packed(read(b"\x1a\x04\0\0\0\0")[0], "<f8")
        with self.assertRaisesRegex(DamagedAnswerError, "has the type 0"):
            _wire.packed(read(b"\x18\x01")[0], "<f8")
        with self.assertRaisesRegex(DamagedAnswerError, "ends within"):
            _wire.packed_varints(read(b"\x22\x01\x80")[0])
        with self.assertRaisesRegex(DamagedAnswerError, "above 2\\^32"):
            _wire.packed_varints(read(b"\x22\x06\x80\x80\x80\x80\x80\x01")[0])
        with self.assertRaisesRegex(DamagedAnswerError, "above 2\\^32"):
            _wire.packed_varints(read(b"\x20" + b"\xff" * 9 + b"\x01")[0])


if __name__ == "__main__":
    unittest.main()
