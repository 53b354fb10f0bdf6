"""Tests of results: the rows of each query, and inconsistent answers."""
import struct
import unittest

import grpc
from locus import LocusError, QueryResult, schema
from support import listed


def answer(**columns):
    """Returns a result of one block with these columns."""
    response = schema.message("QueryResponse")()
    response.result.epoch, response.result.revision, response.result.tick = 7, 8, 9
    response.result.blocks.add(**columns)
    return QueryResult.from_bytes(response.SerializeToString())


class ResultsTest(unittest.TestCase):
    def test_counts_determine_the_rows_of_each_query(self):
        (block,) = answer(counts=struct.pack("<3I", 2, 0, 1), ids=struct.pack("<3Q", 5, 6, 7)).blocks
        self.assertEqual([block.ids[block.rows_of(query)].tolist() for query in range(3)], [[5, 6], [], [7]])
        self.assertEqual(block.rows, 3)

    def test_without_counts_every_query_has_one_row(self):
        (block,) = answer(ids=struct.pack("<2Q", 5, 0), normals=struct.pack("<6f", *range(6))).blocks
        self.assertEqual((block.rows, block.rows_of(1)), (2, slice(1, 2)))
        self.assertEqual(listed(block.normals), list(range(6)))

    def test_any_column_determines_the_number_of_rows(self):
        for name, size in (("t", 4), ("triangles", 4), ("uvs", 8), ("normals", 12), ("points", 12), ("groups", 8), ("tags", 8),
                           ("layers", 4), ("positions", 24)):
            (block,) = answer(**{name: bytes(3 * size)}).blocks
            self.assertEqual(block.rows, 3, name)

    def test_every_column_of_the_protocol_is_an_attribute(self):
        (block,) = answer(ids=bytes(8)).blocks
        missing = [name for name in schema.numbers("BlockResult") if not hasattr(block, name)]
        self.assertEqual(missing, [])

    def test_columns_not_requested_are_empty(self):
        (block,) = answer(ids=bytes(8)).blocks
        for name in ("t", "triangles", "uvs", "normals", "points", "groups", "tags", "layers", "positions", "rotations",
                     "counts", "truncated", "hits"):
            self.assertEqual(len(getattr(block, name)), 0, name)
        self.assertIsNone(block.work)

    def test_the_answer_to_an_empty_batch_has_a_revision(self):
        result = QueryResult.from_bytes(b"")
        self.assertEqual((result.epoch, result.revision, result.tick, result.blocks, result.work), (0, 0, 0, (), None))
        self.assertEqual((answer().epoch, answer().revision, answer().tick), (7, 8, 9))

    def test_columns_of_unequal_length_are_a_contradiction(self):
        for columns in (dict(ids=bytes(16), t=bytes(4)), dict(counts=struct.pack("<I", 3), t=bytes(8)),
                        dict(t=bytes(5))):
            (block,) = answer(**columns).blocks
            with self.assertRaisesRegex(LocusError, "contradicts itself: t has") as raised:
                block.t
            self.assertEqual(raised.exception.code, grpc.StatusCode.DATA_LOSS)

    def test_counts_that_are_no_numbers_are_a_contradiction(self):
        (block,) = answer(counts=b"12345").blocks
        with self.assertRaisesRegex(LocusError, "contradicts itself: counts has 5 bytes"):
            block.counts

    def test_columns_outlive_the_result(self):
        ids = answer(ids=struct.pack("<2Q", 5, 6)).blocks[0].ids
        self.assertEqual(listed(ids), [5, 6])
