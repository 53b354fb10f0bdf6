"""Tests of columns: conversion of arguments and results, and errors that name the column."""
import array
import math
import struct
import unittest

from locus import columns
from locus.columns import FLOAT32, FLOAT64, UINT8, UINT32, UINT64
from support import without_numpy

numpy = columns.numpy
ONE_TO_SIX = struct.pack("<6f", 1, 2, 3, 4, 5, 6)


class EncodeTest(unittest.TestCase):
    def assertRefused(self, kind, pattern, value, *settings):
        with self.assertRaisesRegex(kind, pattern):
            columns.encode("a.column", value, *settings)

    def test_lists_tuples_and_nested_lists_are_the_same_column(self):
        for value in ([1, 2, 3, 4, 5, 6], (1.0, 2.0, 3.0, 4.0, 5.0, 6.0), [(1, 2, 3), (4, 5, 6)], [[1, 2, 3], [4, 5, 6]],
                      (number for number in range(1, 7)), range(1, 7)):
            self.assertEqual(columns.encode("c", value, FLOAT32, 3), ONE_TO_SIX)

    def test_buffers_of_the_right_type_are_not_converted(self):
        numbers = array.array("f", range(1, 7))
        table = memoryview(numbers).cast("B").cast("f", [2, 3])
        for value in (numbers, memoryview(numbers), ONE_TO_SIX, bytearray(ONE_TO_SIX), table):
            self.assertEqual(columns.encode("c", value, FLOAT32, 3), ONE_TO_SIX)

    def test_one_number_is_a_column_of_one(self):
        self.assertEqual(columns.encode("c", 0.5, FLOAT32), struct.pack("<f", 0.5))
        self.assertEqual(columns.encode("c", 2**64 - 1, UINT64), b"\xff" * 8)

    def test_none_is_an_empty_column(self):
        self.assertEqual(columns.encode("c", None, FLOAT32, 3), b"")

    def test_a_memory_view_with_gaps_is_copied_in_its_order(self):
        numbers = array.array("f", range(12))
        self.assertEqual(columns.encode("c", memoryview(numbers)[::2], FLOAT32), struct.pack("<6f", 0, 2, 4, 6, 8, 10))

    def test_unsigned_longs_are_accepted_for_the_type_of_their_width(self):
        kind = UINT64 if array.array("L").itemsize == 8 else UINT32
        self.assertEqual(columns.encode("c", array.array("L", [7]), kind), (7).to_bytes(kind.size, "little"))

    def test_numbers_of_another_type_are_refused_with_both_names(self):
        for code, found in (("d", "float64"), ("i", "int32"), ("q", "int64"), ("B", "uint8")):
            self.assertRefused(TypeError, f"^a.column: holds {found}, but float32 is wanted.*astype\\('float32'\\)",
                               array.array(code, [1, 2, 3]), FLOAT32, 3)
        self.assertRefused(TypeError, "holds int32, but uint64 is wanted", array.array("i", [1]), UINT64)

    def test_float64_positions_are_told_to_use_a_frame_or_float64(self):
        positions = array.array("d", [1, 2, 3])
        for path, remedy in (("blocks[0].rays.origins", "with frame=frame"), ("moves[0].positions", "as positions_f64"),
                             ("blocks[0].rays.directions", "^((?!frame).)*astype")):
            with self.assertRaisesRegex(TypeError, remedy):
                columns.encode(path, positions, FLOAT32, 3)

    def test_int64_is_accepted_for_ids_unless_one_is_negative(self):
        self.assertEqual(columns.encode("c", array.array("q", [1, 2**63 - 1]), UINT64), struct.pack("<2Q", 1, 2**63 - 1))
        self.assertEqual(columns.encode("c", array.array("q"), UINT64), b"")
        self.assertRefused(ValueError, r"^a.column\[1\]: is -7: give numbers from 0", array.array("q", [0, -7, -8]), UINT64)

    def test_an_inner_list_has_the_numbers_of_one_entry(self):
        for value in ([[1, 2], [3, 4], [5, 6]], [[1, 2, 3, 4, 5, 6]], [[1, 2, 3], [4, 5, 6, 7, 8, 9]], [[1], [2], [3]]):
            self.assertRefused(ValueError, "^a.column: has an entry of [1-9] numbers: give 3 numbers", value, FLOAT32, 3)
        rows = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        self.assertEqual(len(columns.encode("c", rows, FLOAT32, 16, 4)), 64)

    def test_values_without_numbers_are_refused(self):
        for value in ("abc", ["a"], [None], object(), [[1, 2], 3]):
            self.assertRefused(TypeError, "^a.column: .*give float32 numbers", value, FLOAT32)
        self.assertRefused(TypeError, "^a.column: .*give uint64 numbers", [1.5], UINT64)

    def test_ids_that_do_not_fit_are_refused(self):
        for value in (-1, 2**64):
            self.assertRefused(TypeError, "^a.column: .*give uint64 numbers", [value], UINT64)

    def test_a_column_of_incomplete_vectors_is_refused(self):
        self.assertRefused(ValueError, "^a.column: has 4 numbers: give 3 float32 for each entry", [1, 2, 3, 4], FLOAT32, 3)
        self.assertRefused(ValueError, "^a.column: has 7 bytes: give 1 uint64 for each entry", b"1234567", UINT64)

    def test_a_column_has_one_entry_for_each_query_or_one_or_none(self):
        for count in (0, 1, 3):
            raw = columns.encode_for("c", [5] * count, UINT32, 3)
            self.assertEqual(columns.entries(raw, UINT32), count)
        with self.assertRaisesRegex(ValueError, "^a.column: has 2 entries: give 3, one for all, or none"):
            columns.encode_for("a.column", [5, 5], UINT32, 3)


@unittest.skipIf(without_numpy(), "what numpy arrays do is seen with numpy")
class NumpyTest(unittest.TestCase):
    def test_arrays_of_any_shape_and_order_are_encoded_row_by_row(self):
        table = numpy.arange(1, 7, dtype="float32").reshape(2, 3)
        for value in (table, numpy.asfortranarray(table), numpy.repeat(table, 2, axis=1)[:, ::2], table.ravel()):
            self.assertEqual(columns.encode("c", value, FLOAT32, 3), ONE_TO_SIX)

    def test_the_last_axes_have_the_numbers_of_one_entry(self):
        for shape in ((3, 5), (6, 2), (2, 3, 2), (1, 9), (3, 1, 4), (3, 1)):
            with self.assertRaisesRegex(ValueError, r"^a.column: has the shape .*along the last axis, as in \(N, 3\)"):
                columns.encode("a.column", numpy.zeros(shape, "float32"), FLOAT32, 3)
        with self.assertRaisesRegex(ValueError, "has the shape"):
            columns.encode("points.T", numpy.zeros((3, 4), "float32"), FLOAT32, 12, 3)
        for shape, width, part in (((5, 3), 3, 0), ((2, 4, 3), 3, 0), ((0, 5), 3, 0), ((4, 4), 16, 4), ((5, 4, 4), 16, 4),
                                   ((7, 16), 16, 4), ((5, 6, 4), 24, 4), ((30, 4), 24, 4), ((2, 3), 1, 0)):
            raw = columns.encode("a.column", numpy.zeros(shape, "float32"), FLOAT32, width, part)
            self.assertEqual(len(raw), 4 * math.prod(shape))

    def test_int64_is_accepted_for_ids_unless_one_is_negative(self):
        self.assertEqual(columns.encode("c", numpy.array([[1, 2], [3, 4]])[:, ::-1], UINT64), struct.pack("<4Q", 2, 1, 4, 3))
        with self.assertRaisesRegex(ValueError, r"^a.column\[2\]: is -1"):
            columns.encode("a.column", numpy.array([1, 2, -1]), UINT64)

    def test_received_columns_are_aligned_to_their_type(self):
        for offset in range(9):
            column = columns.decode(memoryview(b"x" * offset + struct.pack("<3Q", 1, 2, 3))[offset:], UINT64)
            self.assertEqual(column.tolist(), [1, 2, 3])
            self.assertTrue(column.flags.aligned and not column.flags.writeable)

    def test_read_only_arrays_and_scalars_are_accepted(self):
        frozen = numpy.arange(1, 7, dtype="float32")
        frozen.setflags(write=False)
        self.assertEqual(columns.encode("c", frozen, FLOAT32, 3), ONE_TO_SIX)
        self.assertEqual(columns.encode("c", numpy.float32(0.5), FLOAT32), struct.pack("<f", 0.5))
        self.assertEqual(columns.encode("c", [numpy.arange(1, 4), numpy.arange(4, 7)], FLOAT32, 3), ONE_TO_SIX)

    def test_other_types_are_refused_with_both_names(self):
        for kind, found in (("float64", "float64"), ("float16", "float16"), ("int32", "int32"), (">f4", "big-endian"),
                            ("bool", "bool"), ("uint8", "uint8")):
            with self.assertRaisesRegex(TypeError, f"^a.column: holds {found}.*but float32 is wanted"):
                columns.encode("a.column", numpy.ones(3, dtype=kind), FLOAT32, 3)

    def test_received_columns_are_views_of_the_bytes(self):
        flat = columns.decode(ONE_TO_SIX, FLOAT32)
        table = columns.decode(ONE_TO_SIX, FLOAT32, 3)
        self.assertEqual((flat.shape, table.shape, flat.dtype), ((6,), (2, 3), numpy.float32))
        self.assertFalse(flat.flags.owndata or flat.flags.writeable)
        self.assertEqual(flat.__array_interface__["data"], table.__array_interface__["data"])

    def test_an_empty_column_has_no_rows_of_its_width(self):
        self.assertEqual(columns.decode(b"", FLOAT32, 3).shape, (0, 3))


class DecodeTest(unittest.TestCase):
    def test_every_number_type_survives_encoding_and_decoding(self):
        for kind, numbers in ((FLOAT32, [0.5, -1.0]), (FLOAT64, [0.1, 1e300]), (UINT32, [0, 2**32 - 1]),
                              (UINT64, [1, 2**64 - 1]), (UINT8, [0, 255])):
            self.assertEqual(columns.decode(columns.encode("c", numbers, kind), kind).tolist(), numbers)

    @unittest.skipUnless(without_numpy(), "array.array comes out only without numpy")
    def test_without_numpy_columns_are_flat_arrays(self):
        column = columns.decode(memoryview(ONE_TO_SIX), FLOAT32, 3)
        self.assertEqual(column, array.array("f", [1, 2, 3, 4, 5, 6]))


class VectorTest(unittest.TestCase):
    def test_three_numbers_make_a_vector(self):
        self.assertEqual(columns.vector("frame", array.array("f", [1, 2, 3])), [1.0, 2.0, 3.0])

    def test_any_other_count_of_numbers_is_refused(self):
        with self.assertRaisesRegex(ValueError, "^frame: has 2 numbers: give x, y and z"):
            columns.vector("frame", [1, 2])
