"""The protocol as pages: one for each .proto file, made from the descriptor set with its comments."""
import os
import re
import subprocess
import tempfile

from google.protobuf import descriptor_pb2

import markdown

PACKAGE = "locus.v1"
FIELD = descriptor_pb2.FieldDescriptorProto
SCALARS = {number: name[len("TYPE_"):].lower() for name, number in FIELD.Type.items()}


def read_descriptors(source):
    """Returns the descriptors of the files of the protocol, with comments, made by protoc."""
    folder = os.path.join(source, "proto")
    files = sorted(name for name in os.listdir(os.path.join(folder, "locus/v1")) if name.endswith(".proto"))
    with tempfile.NamedTemporaryFile() as output:
        subprocess.run(["protoc", "-I", folder, "--include_source_info", "--include_imports",
                        "--descriptor_set_out=" + output.name, *(f"locus/v1/{name}" for name in files)], check=True)
        found = descriptor_pb2.FileDescriptorSet.FromString(output.read())
    return [file for file in found.file if file.package == PACKAGE]


class Element:
    """One documented element: its kind, its name without the package, its descriptor and comment, and its parent."""

    def __init__(self, kind, name, descriptor, comment, file, parent=None):
        self.kind, self.name, self.descriptor, self.comment = kind, name, descriptor, comment
        self.file, self.parent, self.parts = file, parent, []


def unindented(comment):
    return "\n".join(line.removeprefix(" ") for line in comment.split("\n"))


def comments_of(file):
    """Returns the comment of each element by its path in the descriptor."""
    return {tuple(location.path): unindented(location.leading_comments or location.trailing_comments)
            for location in file.source_code_info.location if location.leading_comments or location.trailing_comments}


# The numbers of the fields of descriptors, of which the paths of comments are made.
FILE_PARTS = (("message", 4, "message_type"), ("enum", 5, "enum_type"), ("service", 6, "service"))
INNER_PARTS = {"message": (("field", 2, "field"), ("oneof", 8, "oneof_decl"), ("message", 3, "nested_type"),
                           ("enum", 4, "enum_type")),
               "enum": (("value", 2, "value"),), "service": (("rpc", 2, "method"),)}


def is_synthetic(descriptor, kind, owner):
    """Returns whether protoc made the oneof for an `optional` field."""
    return kind == "oneof" and any(field.proto3_optional and owner.oneof_decl[field.oneof_index].name == descriptor.name
                                   for field in owner.field if field.HasField("oneof_index"))


def elements_of(file):
    """Returns all elements of a file, each after its parent; an element lists the elements inside it in `parts`."""
    comments, found = comments_of(file), []

    def add(owner, parts, path, prefix, parent):
        for kind, number, attribute in parts:
            for index, descriptor in enumerate(getattr(owner, attribute)):
                if is_synthetic(descriptor, kind, owner) or (kind == "message" and descriptor.options.map_entry):
                    continue
                below = (*path, number, index)
                element = Element(kind, prefix + descriptor.name, descriptor, comments.get(below, ""), file.name, parent)
                found.append(element)
                if parent:
                    parent.parts.append(element)
                add(descriptor, INNER_PARTS.get(kind, ()), below, element.name + ".", element)

    add(file, FILE_PARTS, (), "", None)
    return found


def page_of(file_name):
    return os.path.basename(file_name).replace(".proto", ".md")


class Pages:
    """Writes the pages; knows every element, so that comments link to the elements that they name."""

    def __init__(self, files):
        self.files = files
        self.elements = {file.name: elements_of(file) for file in files}
        self.by_name = {element.name: element for elements in self.elements.values() for element in elements}

    def link(self, name, text=None):
        element = self.by_name[name]
        return f"[{text or name}]({page_of(element.file)}#{element.name})"

    def linked(self, line):
        """Puts links into a line of a comment: reasons lead to the page of errors, names of elements to their place."""
        parts = markdown.CODE.split(line)
        for at in range(0, len(parts), 2):
            parts[at] = re.sub(r"REASON\\_((?:[A-Z]|\\_)+)", lambda found: self.reason_link(found.group(1)), parts[at])
            parts[at] = re.sub(r"(?<![\w.#/])[A-Z]\w+\.(?:\w|\\_)+", lambda found: self.name_link(found.group()), parts[at])
        return "".join(parts)

    def name_link(self, text):
        name = text.replace("\\_", "_")
        return self.link(name, text) if name in self.by_name else text

    def reason_link(self, text):
        name = text.replace("\\_", "_")
        known = "Reason.REASON_" + name in self.by_name
        return f"[REASON\\_{text}](../errors.md#{name.lower()})" if known else f"REASON\\_{text}"

    def map_type(self, element):
        """Returns the type of a map field, whose entries are a message that protoc made; None for other fields."""
        owner = element.parent.descriptor if element.parent else None
        for entry in owner.nested_type if owner else ():
            if entry.options.map_entry and element.descriptor.type_name.endswith(f".{owner.name}.{entry.name}"):
                return f"map of {self.type_of(entry.field[0])} to {self.type_of(entry.field[1])}"
        return None

    def type_of(self, field):
        if field.type in (FIELD.TYPE_MESSAGE, FIELD.TYPE_ENUM):
            name = field.type_name.removeprefix(f".{PACKAGE}.")
            return self.link(name) if name in self.by_name else name.lstrip(".")
        return SCALARS[field.type]

    def text(self, element):
        return markdown.markdown_of(element.comment, self.linked)

    def field(self, element):
        field = element.descriptor
        word = "repeated " if field.label == FIELD.LABEL_REPEATED else "optional " if field.proto3_optional else ""
        facts = [self.map_type(element) or word + self.type_of(field), f"number {field.number}"]
        if field.HasField("oneof_index") and not field.proto3_optional:
            facts.append(f"one of `{element.parent.descriptor.oneof_decl[field.oneof_index].name}`")
        return self.definition(element, ", ".join(facts))

    def definition(self, element, facts):
        short = element.name.rsplit(".", 1)[-1]
        term = f"[`{short}`](#{element.name}){{#{element.name}}} {facts}".rstrip()
        return markdown.definition(term, self.text(element))

    def part(self, element):
        """Returns one element inside a message, enum or service."""
        if element.kind == "field":
            return self.field(element)
        if element.kind == "value":
            return self.definition(element, f"= {element.descriptor.number}")
        if element.kind == "oneof":
            return self.definition(element, "(at most one of its fields)")
        return ""

    def rpc(self, element):
        method = element.descriptor
        types = ((method.client_streaming, method.input_type), (method.server_streaming, method.output_type))
        sides = [("stream " if streamed else "") + self.link(name.removeprefix(f".{PACKAGE}.")) for streamed, name in types]
        return f"\n### {element.name} {{#{element.name}}}\n\nTakes {sides[0]}, returns {sides[1]}.\n\n{self.text(element)}"

    def whole(self, element):
        """Returns a message, an enum or a service with its parts."""
        title = {"message": "Message", "enum": "Enum", "service": "Service"}[element.kind]
        text = f"\n## {title} {element.name} {{#{element.name}}}\n\n{self.text(element)}"
        if element.kind == "service":
            return text + "".join(self.rpc(part) for part in element.parts)
        oneofs = [part for part in element.parts if part.kind == "oneof"]
        return text + "".join(self.part(part) for part in oneofs + [part for part in element.parts if part not in oneofs])

    def file_comment(self, file):
        return markdown.markdown_of(comments_of(file).get((12,), ""), self.linked)

    def page(self, file):
        elements = self.elements[file.name]
        services = [element for element in elements if element.kind == "service"]
        others = [element for element in elements if element.kind in ("message", "enum")]
        return f"# {os.path.basename(file.name)}\n\n{self.file_comment(file)}" + "".join(map(self.whole, services + others))

    def index(self):
        """Returns the page that lists the calls and the files."""
        calls = [[self.link(element.name), self.summary(element)] for elements in self.elements.values()
                 for element in elements if element.kind == "rpc"]
        files = [[f"[{os.path.basename(file.name)}]({page_of(file.name)})", self.first_sentence(self.file_comment(file))]
                 for file in self.files]
        return (f"# Protocol\n\nThe package `{PACKAGE}`: gRPC services that every client of locus calls. These pages are made "
                f"from the files in `proto/` and have all {len(self.by_name)} elements.\n\n"
                + markdown.table(["call", "what it does"], calls) + "\n" + markdown.table(["file", "content"], files))

    def summary(self, element):
        return self.first_sentence(self.text(element))

    @staticmethod
    def first_sentence(text):
        paragraph = text.strip().split("\n\n")[0].replace("\n", " ")
        return re.split(r"(?<=[.:]) (?=[A-Z])", paragraph)[0]


def write_pages(source, folder):
    """Writes the pages and returns the descriptors."""
    files = read_descriptors(source)
    pages = Pages(files)
    os.makedirs(folder, exist_ok=True)
    for file in files:
        with open(os.path.join(folder, page_of(file.name)), "w", encoding="utf-8") as page:
            page.write(pages.page(file))
    with open(os.path.join(folder, "index.md"), "w", encoding="utf-8") as page:
        page.write(pages.index())
    return pages
