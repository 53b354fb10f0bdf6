"""Tests of decoding without protobuf: all encodings that protobuf may write are decoded, all others are refused."""
import random
import unittest

import grpc
from locus import LocusError, QueryResult, schema, wire
from support import listed

SEED = 7


class WireTest(unittest.TestCase):
    def assertUnreadable(self, data, pattern):
        with self.assertRaisesRegex(LocusError, pattern) as raised:
            wire.fields(memoryview(data))
        self.assertEqual(raised.exception.code, grpc.StatusCode.DATA_LOSS)

    def test_decoded_fields_equal_those_that_protobuf_wrote(self):
        message = schema.message("BlockResult")(t=b"1234", ids=b"x" * 1000, counts=b"")
        message.work.tests = 2**63
        found = wire.fields(memoryview(message.SerializeToString()))
        numbers = {name: field.number for name, field in message.DESCRIPTOR.fields_by_name.items()}
        self.assertEqual(set(found), {numbers["t"], numbers["ids"], numbers["work"]})
        self.assertEqual(bytes(wire.column(found, numbers["ids"])), b"x" * 1000)
        self.assertEqual(wire.column(found, numbers["counts"]), b"")
        self.assertEqual(wire.fixed64(wire.fields(found[numbers["work"]][0]), 3), 2**63)

    def test_varints_and_fields_of_high_number_are_read(self):
        message = schema.message("QueryBlock")(max_results=300)
        message.rays.mode = 2
        found = wire.fields(memoryview(message.SerializeToString()))
        self.assertEqual(found[8], [300])
        self.assertEqual(wire.fields(found[16][0])[4], [2])

    def test_columns_are_views_and_not_copies(self):
        raw = memoryview(schema.message("BlockResult")(t=b"12345678").SerializeToString())
        self.assertIs(wire.column(wire.fields(raw), 4).obj, raw.obj)

    def test_a_column_in_chunks_is_joined_as_by_protobuf(self):
        one, two = (schema.message("BlockResult")(ids=number.to_bytes(8, "little")).SerializeToString() for number in (5, 6))
        result = wire.head(4, len(one + two)) + one + two
        response = wire.head(1, len(result)) + result
        (block,) = QueryResult.from_bytes(response).blocks
        self.assertEqual(listed(block.ids), [5, 6])

    def test_an_encoded_field_equals_what_protobuf_writes(self):
        for size in (0, 1, 127, 128, 16383, 16384, 3_000_000):
            content = bytes(size)
            block = schema.message("QueryBlock").FromString(wire.head(5, size) + content)
            self.assertEqual(block.masks, content)
            in_high_number = wire.head(3000, size) + content
            self.assertEqual(wire.fields(memoryview(in_high_number)), {3000: [content]})

    def test_truncated_bytes_are_refused(self):
        whole = schema.message("BlockResult")(t=b"12345678").SerializeToString()
        for cut in range(1, len(whole)):
            self.assertUnreadable(whole[:cut], "cannot be read")

    def test_groups_and_overlong_varints_are_refused(self):
        self.assertUnreadable(b"\x0b", "wire type 3")
        self.assertUnreadable(b"\x08" + b"\xff" * 11, "too many bytes")
        self.assertUnreadable(b"\x22\xff\xff\xff\xff\x0f", "has more bytes than the message")

    def test_a_number_where_a_column_should_be_is_refused(self):
        for data in (b"\x08\x01", b"\x0a\x02\x20\x01", b"\x0a\x04\x22\x02\x28\x01"):
            with self.assertRaisesRegex(LocusError, "is a number"):
                (block,) = QueryResult.from_bytes(data).blocks
                block.ids

    def test_random_bytes_are_decoded_or_refused_with_locus_error(self):
        random_numbers = random.Random(SEED)
        refused = 0
        for _ in range(3000):
            data = random_numbers.randbytes(random_numbers.randrange(60))
            try:
                QueryResult.from_bytes(data)
            except LocusError:
                refused += 1
            except Exception as error:  # noqa: BLE001  the failure names the bytes and the seed
                self.fail(f"{data!r} of seed {SEED}: {error!r}")
        self.assertGreater(refused, 1000)
