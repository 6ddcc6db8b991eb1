"""The checksum of chunks, by numpy and by ISA-L, against RFC 3720's definition byte by byte."""

import unittest
from unittest import mock

import numpy as np

from wellspace import _checksum


def reference(data, crc=0):
    crc ^= 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


class ByNumpy(unittest.TestCase):
    def setUp(self):
        patch = mock.patch.object(_checksum, "_compiled", None)
        patch.start()
        self.addCleanup(patch.stop)

    def test_examples_of_the_rfc(self):
        # RFC 3720, appendix B.4.
        for data, crc in ((bytes(32), 0x8A9136AA), (b"\xff" * 32, 0x62A8AB43), (bytes(range(32)), 0x46DD794E),
                          (bytes(range(31, -1, -1)), 0x113FDB5C)):
            self.assertEqual(_checksum.crc32c(data), crc)
        self.assertEqual(_checksum.crc32c(b"123456789"), 0xE3069283)
        self.assertEqual(_checksum.crc32c(b""), 0)

    def test_lengths_around_every_fold(self):
        data = np.random.default_rng(1).bytes(100_000)
        lengths = [*range(20), *(5685 * scale + more for scale in (1, 2, 4, 8, 16) for more in (-1, 0, 1, 3, 4, 5, 8))]
        for length in [*lengths, 4323, 10008, 10009, 10012, 100_000]:
            part = memoryview(data)[:length]
            self.assertEqual(_checksum.crc32c(part), reference(part), length)

    def test_goes_on_from_any_place(self):
        data = np.random.default_rng(2).bytes(20_000)
        whole = reference(data)
        for place in (0, 1, 2, 3, 4, 5, 5684, 5685, 5686, 9999, 19_997, 20_000):
            self.assertEqual(_checksum.crc32c(data[place:], _checksum.crc32c(data[:place])), whole, place)

    def test_finds_each_flipped_bit(self):
        data = bytearray(12_000)
        crc = _checksum.crc32c(data)
        for bit in range(0, 8 * len(data), 97):
            data[bit // 8] ^= 1 << bit % 8
            self.assertNotEqual(_checksum.crc32c(data), crc, bit)
            data[bit // 8] ^= 1 << bit % 8

    def test_arrays_of_several_pieces(self):
        values = np.random.default_rng(3).uniform(size=(1 << 18) + 3)  # 2 MiB and 24 bytes
        with mock.patch.object(_checksum, "_PIECE", 1 << 20):
            self.assertEqual(_checksum.crc32c(values), self.in_parts(values))
        self.assertEqual(_checksum.crc32c(values.reshape(-1, 1)), _checksum.crc32c(values.tobytes()))

    def in_parts(self, values):
        crc = 0
        for part in np.array_split(values, 7):
            crc = _checksum.crc32c(part, crc)
        return crc


class ByIsal(unittest.TestCase):
    def test_says_what_numpy_says(self):
        compiled = _checksum._load()
        self.assertIsNotNone(compiled, "not installed: apt install libisal2")
        data = np.random.default_rng(4).integers(0, 256, 70_000, np.uint8)
        for length in (0, 1, 3, 4, 7, 64, 5685, 5689, 70_000):
            self.assertEqual(compiled(5, data[:length]), _checksum._extend(5, data[:length]), length)

    def test_is_not_taken_where_it_is_not(self):
        self.assertIsNone(_checksum._load("libno-such-library.so.2"))
        self.assertIsNone(_checksum._load("libc.so.6"), "a library without the function")


if __name__ == "__main__":
    unittest.main()
