"""The built site as the tests read it: text, ids and links of each page."""
import html.parser
import os
import re
import urllib.parse

# Elements without an end tag.
VOID = {"area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "track", "wbr"}
RESOURCES = {("script", "src"), ("link", "href"), ("img", "src"), ("source", "src"), ("iframe", "src"), ("object", "data")}


class PageReader(html.parser.HTMLParser):
    """Reads one page: `ids`, `links` (of anchors), `resources` (what a browser loads), and the text of the article. Text is
    also kept by the id of the definition or heading that it belongs to.
    """

    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.ids, self.links, self.resources, self.text = set(), [], [], ""
        self.by_id = {}
        self.current = None
        self.article = 0

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        if tag in ("article",) and not self.article:
            self.article = 1
        if "id" in values:
            self.ids.add(values["id"])
            if self.article:
                self.current = values["id"]
                self.by_id.setdefault(self.current, "")
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        for name, value in attrs:
            if (tag, name) in RESOURCES and value and values.get("rel") != "canonical":
                self.resources.append(value)

    def handle_endtag(self, tag):
        if tag == "article":
            self.article = 0

    def handle_data(self, data):
        if self.article:
            self.text += data
            if self.current:
                self.by_id[self.current] += data


def read_site(folder):
    """Returns a reader for each page, by its path from `folder`."""
    pages = {}
    for place, _, names in os.walk(folder):
        for name in names:
            if name.endswith(".html") and name != "404.html":
                path = os.path.join(place, name)
                reader = PageReader()
                with open(path, encoding="utf-8") as file:
                    reader.feed(file.read())
                pages[os.path.relpath(path, folder)] = reader
    return pages


def letters(text):
    """Returns letters and digits only, so that texts can be compared whatever their markup."""
    return re.sub(r"[^A-Za-z0-9]", "", text)


def broken_anchors(pages):
    """Returns links to a place that its page does not have."""
    faults = []
    for path, page in sorted(pages.items()):
        for link in page.links:
            target, _, anchor = link.partition("#")
            if "://" in link or link.startswith("mailto:") or not anchor or target.startswith("/"):
                continue
            full = os.path.normpath(os.path.join(os.path.dirname(path), urllib.parse.unquote(target))) if target else path
            if full in pages and urllib.parse.unquote(anchor) not in pages[full].ids:
                faults.append(f"{path}: {link} leads to no place of {full}")
    return faults


def foreign_resources(pages):
    """Returns what a page loads from elsewhere."""
    return [f"{path}: loads {value}" for path, page in sorted(pages.items()) for value in page.resources
            if re.match(r"(?:[a-z]+:)?//", value)]
