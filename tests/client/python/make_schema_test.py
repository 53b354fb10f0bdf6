"""Tests that the mirrored schema encodes every message and field to the same bytes as the real schema."""
import array
import os
import random
import subprocess
import tempfile
import unittest

import make_schema
from google.protobuf import descriptor_pb2
from locus import schema
from support import PROTO, generated_protocol

SEED = 20240611
ROUNDS = 20
Field = descriptor_pb2.FieldDescriptorProto
CODES = {Field.TYPE_FLOAT: "f", Field.TYPE_DOUBLE: "d", Field.TYPE_FIXED32: "I", Field.TYPE_FIXED64: "Q"}
LIMITS = {Field.TYPE_INT32: 2**31 - 1, Field.TYPE_UINT32: 2**32 - 1, Field.TYPE_FIXED32: 2**32 - 1,
          Field.TYPE_FIXED64: 2**64 - 1}


def scalar(field, random_numbers):
    if field.type in (Field.TYPE_FLOAT, Field.TYPE_DOUBLE):
        return array.array("f", [random_numbers.uniform(-1e6, 1e6)])[0]
    if field.type == Field.TYPE_BOOL:
        return True
    if field.type == Field.TYPE_STRING:
        return "name-%d" % random_numbers.randrange(1000)
    if field.type == Field.TYPE_BYTES:
        return random_numbers.randbytes(random_numbers.randrange(1, 40))
    if field.type == Field.TYPE_ENUM:
        return random_numbers.choice([value.number for value in field.enum_type.values])
    return random_numbers.randint(1, LIMITS[field.type])


def fill(real, mirror, random_numbers, depth=0):
    """Sets random fields of both messages to equal values; columns are lists in `real` and bytes in `mirror`."""
    chosen_of_oneof = {oneof.name: random_numbers.choice(oneof.fields) for oneof in real.DESCRIPTOR.oneofs}
    for field in real.DESCRIPTOR.fields:
        oneof = field.containing_oneof
        if (oneof is not None and chosen_of_oneof[oneof.name] is not field) or random_numbers.random() < 0.2:
            continue
        if field.message_type is not None and field.message_type.GetOptions().map_entry:
            getattr(real, field.name)["key"] = getattr(mirror, field.name)["key"] = "value"
        elif field.message_type is not None and depth < 6:
            repeated = field.label == field.LABEL_REPEATED
            for _ in range(random_numbers.randrange(1, 4) if repeated else 1):
                pair = [getattr(message, field.name) for message in (real, mirror)]
                left, right = [part.add() for part in pair] if repeated else pair
                left.SetInParent()
                right.SetInParent()
                fill(left, right, random_numbers, depth + 1)
        elif field.label == field.LABEL_REPEATED:
            numbers = [scalar(field, random_numbers) for _ in range(random_numbers.randrange(1, 50))]
            getattr(real, field.name).extend(numbers)
            if field.type in CODES:
                setattr(mirror, field.name, array.array(CODES[field.type], numbers).tobytes())
            else:
                getattr(mirror, field.name).extend(numbers)
        elif field.message_type is None:
            value = scalar(field, random_numbers)
            setattr(real, field.name, value)
            setattr(mirror, field.name, value)


class MirrorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.real = {}
        for module in generated_protocol(cls).values():
            cls.real.update({name: getattr(module, name) for name in module.DESCRIPTOR.message_types_by_name})

    def pairs(self):
        """Yields random messages of every type, each in the real and in the mirrored schema."""
        random_numbers = random.Random(SEED)
        for name, real_class in sorted(self.real.items()):
            for number in range(ROUNDS):
                real, mirror = real_class(), schema.message(name)()
                fill(real, mirror, random_numbers)
                yield f"{name} {number} of seed {SEED}", real, mirror

    def test_every_message_has_equal_bytes_in_both_schemas(self):
        bytes_seen = 0
        for what, real, mirror in self.pairs():
            wire = real.SerializeToString(deterministic=True)
            self.assertEqual(wire, mirror.SerializeToString(deterministic=True), what)
            bytes_seen += len(wire)
        self.assertGreater(bytes_seen, 500_000)

    def test_each_schema_reads_what_the_other_wrote(self):
        for what, real, mirror in self.pairs():
            self.assertEqual(type(real).FromString(mirror.SerializeToString()), real, what)
            self.assertEqual(type(mirror).FromString(real.SerializeToString()), mirror, what)

    def test_columns_are_bytes_and_nothing_else_changed(self):
        columns = 0
        for name, real_class in self.real.items():
            mirrored = schema.message(name).DESCRIPTOR.fields_by_name
            self.assertEqual(set(mirrored), {field.name for field in real_class.DESCRIPTOR.fields}, name)
            for field in real_class.DESCRIPTOR.fields:
                is_column = field.label == field.LABEL_REPEATED and field.type in CODES
                expected = (field.number, Field.TYPE_BYTES, Field.LABEL_OPTIONAL) if is_column else \
                    (field.number, field.type, field.label)
                found = mirrored[field.name]
                self.assertEqual((found.number, found.type, found.label), expected, f"{name}.{field.name}")
                columns += is_column
        self.assertGreater(columns, 60)

    def test_an_empty_column_equals_an_absent_one(self):
        rays = schema.message("Rays")(origins=b"")
        self.assertEqual(rays.SerializeToString(), self.real["Rays"](origins=[]).SerializeToString())


class MakeSchemaTest(unittest.TestCase):
    def mirrored(self, body):
        """Returns the fields of message M of an invented file, by name."""
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "made_up.proto")
            with open(path, "w", encoding="utf-8") as file:
                file.write(f'syntax = "proto3"; package locus.v1; message M {{ {body} }}')
            descriptors = os.path.join(folder, "descriptors")
            subprocess.run([os.environ["LOCUS_PROTOC"], "-I", folder, "--descriptor_set_out=" + descriptors, path], check=True)
            with open(descriptors, "rb") as file:
                files = make_schema.mirror(descriptor_pb2.FileDescriptorSet.FromString(file.read()))
        return {field.name: field for field in files.file[0].message_type[0].field}

    def test_varints_are_not_columns(self):
        fields = self.mirrored("repeated uint32 a = 1; repeated sint64 b = 2; repeated bool c = 3; repeated fixed32 d = 4;")
        self.assertEqual([name for name, field in fields.items() if field.type == Field.TYPE_BYTES], ["d"])

    def test_unpacked_numbers_are_not_columns(self):
        fields = self.mirrored("repeated float a = 1 [packed = false]; repeated float b = 2 [packed = true];")
        self.assertEqual([name for name, field in fields.items() if field.type == Field.TYPE_BYTES], ["b"])

    def test_nested_messages_have_columns_too(self):
        files = descriptor_pb2.FileDescriptorSet()
        file = files.file.add(name="nested.proto", package="locus.v1", syntax="proto3")
        nested = file.message_type.add(name="Outer").nested_type.add(name="Inner")
        nested.field.add(name="column", number=1, type=Field.TYPE_DOUBLE, label=Field.LABEL_REPEATED)
        (field,) = make_schema.mirror(files).file[0].message_type[0].nested_type[0].field
        self.assertEqual((field.type, field.label), (Field.TYPE_BYTES, Field.LABEL_OPTIONAL))

    def test_a_file_whose_numbers_are_not_packed_by_default_is_refused(self):
        files = descriptor_pb2.FileDescriptorSet()
        files.file.add(name="old.proto", package="locus.v1", syntax="proto2")
        with self.assertRaisesRegex(SystemExit, "old.proto is not proto3"):
            make_schema.mirror(files)

    def test_enums_keep_numbers_and_lose_prefixes(self):
        from locus import Column, RayMode, Reason, StaticDetail
        self.assertEqual((RayMode.ANY, Column.T, Reason.BATCH_GAP, StaticDetail.TRIANGLES_SORTED), (2, 1, 13, 3))

    def test_protocol_files_of_this_tree_are_all_mirrored(self):
        for name in os.listdir(os.path.join(PROTO, "locus/v1")):
            self.assertIsNotNone(schema.POOL.FindFileByName("locus/v1/" + name))
