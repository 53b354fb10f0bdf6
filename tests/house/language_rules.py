"""Rules about the language of comments and names: how a comment begins, which words are banned, and where a page is
required.
"""
import posixpath
import re

# Beginnings of comments without a verb. Such a comment leaves the reader to guess its subject.
FRAGMENT = re.compile(r"(Of|What|Whether|The same|As|Nothing|Who|Whose|Whoever|Where|Nobody|None)\b")
COMMENT = re.compile(r"[ \t]*// ?(.*)")


def first_lines_of_comments(text):
    """Returns (line number, text) of the first line of each run of lines that contain only comments."""
    found, inside = [], False
    for number, line in enumerate(text.split("\n"), 1):
        comment = COMMENT.fullmatch(line)
        if comment and not inside:
            found.append((number, comment.group(1)))
        inside = comment is not None
    return found


def comments_begin_with_a_verb_or_a_noun(tree):
    return [f"{path}:{number}: begins with a fragment, not with a verb or a noun: {text}"
            for path in tree.code() for number, text in first_lines_of_comments(tree.files[path]) if FRAGMENT.match(text)]


OLD_LIMIT = re.compile(r"\bk(Most|Least)(?![a-z])\w*")


def limits_are_named_max_and_min(tree):
    return [f"{path}:{number}: {match.group()}: kMax and kMin name limits" for path in tree.code()
            for number, line in enumerate(tree.files[path].split("\n"), 1) for match in OLD_LIMIT.finditer(line)]


# The words are written in pieces, so that this file does not contain the words that it bans.
BANNED = re.compile(r"\b(who" + r"ever|tells " + r"who|the ho" + r"use)\b", re.IGNORECASE)


def words_are_plain(tree):
    return [f"{path}:{number}: not a plain word: {match.group()}" for path, text in sorted(tree.files.items())
            if path.endswith((".h", ".cc", ".proto", ".md")) and not path.startswith("tests/house/")
            for number, line in enumerate(text.split("\n"), 1) for match in BANNED.finditer(line)]


# Pages that explain properties that are hard to see from the code. Each page has at most one screen.
PAGES = ("core/README.md", "core/GLOSSARY.md", "core/index/README.md", "core/index/bvh/README.md",
         "core/index/hash_grid/README.md", "core/scene/README.md", "core/scene/log/FORMAT.md", "core/query/README.md",
         "server/README.md", "server/ARCHITECTURE.md", "server/DECISIONS.md", "server/storage/README.md",
         "server/storage/rocksdb/FORMAT.md", "client/lib/README.md", "tests/house/README.md")
MAX_PAGE_LINES = 60
# Pages for users. Some are as long as a tutorial, and they link to pages that only the build of the site makes; it checks
# their links.
SITE = "deploy/docs/pages/"


def hard_rooms_have_pages(tree):
    problems = [f"{page}: is missing" for page in PAGES if page not in tree.files]
    for path, text in sorted(tree.files.items()):
        own = path.endswith(".md") and posixpath.basename(path) != "README.md" and not path.startswith(SITE)
        if own and text.count("\n") > MAX_PAGE_LINES:
            problems.append(f"{path}: {text.count(chr(10))} lines, at most {MAX_PAGE_LINES} are allowed")
    return problems


LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


def links_lead_somewhere(tree):
    """Checks that links in pages to files of the project lead to existing files."""
    folders = {posixpath.dirname(path) for path in tree.files}
    problems = []
    for path, text in sorted(tree.files.items()):
        for target in LINK.findall(text) if path.endswith(".md") and not path.startswith(SITE) else []:
            if "://" in target or target.startswith("mailto:"):
                continue
            full = posixpath.normpath(posixpath.join(posixpath.dirname(path), target))
            if full not in tree.files and full not in folders:
                problems.append(f"{path}: the link to {target} leads nowhere")
    return problems


RULES = {
    "CommentsBeginWithAVerbOrANoun": comments_begin_with_a_verb_or_a_noun,
    "LimitsAreNamedMaxAndMin": limits_are_named_max_and_min,
    "WordsArePlain": words_are_plain,
    "HardRoomsHavePages": hard_rooms_have_pages,
    "LinksLeadSomewhere": links_lead_somewhere,
}
