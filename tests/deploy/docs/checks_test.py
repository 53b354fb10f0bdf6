"""Tests of the checks of pages: faults that are planted in a page are found. python3 checks_test.py"""
import os
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "../../../deploy/docs")]
sys.dont_write_bytecode = True
import blocks  # noqa: E402
import check_pages  # noqa: E402
import markdown  # noqa: E402
import navigation  # noqa: E402
import page_shell  # noqa: E402
import pages_test  # noqa: E402

FENCE = "`" * 3


def block(language, text, mark=""):
    return (f"<!-- {mark} -->\n" if mark else "") + f"{FENCE}{language}\n{text}\n{FENCE}\n"


class BlocksTest(unittest.TestCase):
    def test_marks_directly_above_a_block_belong_to_it(self):
        text = "<!-- not run: It takes an hour. -->\n\n" + block("sh", "true", "file: a.sh")
        (found,) = blocks.blocks_of(text)
        self.assertEqual(found.marks, {"file": "a.sh"})

    def test_a_text_block_belongs_to_the_script_directly_before_it(self):
        found = blocks.blocks_of(block("sh", "echo a") + "\n" + block("text", "a") + "Words.\n" + block("text", "b"))
        self.assertEqual([one.follows for one in found], [False, True, False])

    def test_an_indented_block_is_found(self):
        (found,) = blocks.blocks_of("- A step:\n\n    " + block("sh", "true").replace("\n", "\n    "))
        self.assertEqual((found.language, found.text), ("sh", "true\n"))

    def test_commands_go_on_after_a_backslash_and_to_the_end_of_a_document(self):
        (found,) = blocks.blocks_of(block("console", "$ echo \\\n  a\na\n$ cat <<END\nb $ c\nEND\nb $ c"))
        self.assertEqual(blocks.commands_of(found), [("echo \\\n  a", "a"), ("cat <<END\nb $ c\nEND", "b $ c\n")])

    def test_faults_of_blocks_are_found(self):
        for text, fault in ((block("", "x"), "without a language"), (block("perl", "x"), "unknown language"),
                            (block("sh", "x", "not run: slow"), "no whole sentence"),
                            (block("console", "x"), "without a command")):
            (found,) = blocks.faults_of(text)
            self.assertIn(fault, found[1])
        self.assertEqual(blocks.faults_of(block("sh", "x", "not run: It deletes the data directory.")), [])

    def test_the_daemon_of_a_page(self):
        self.assertEqual(blocks.daemon_options("# Page\n"), [])
        self.assertEqual(blocks.daemon_options("<!-- daemon: --threads 1 -->\n"), ["--threads", "1"])
        self.assertIsNone(blocks.daemon_options("<!-- daemon: none -->\n"))


class CheckPagesTest(unittest.TestCase):
    def setUp(self):
        self.pages = {"index.md": "", "cookbook/index.md": "[a](a.md)",
                      "cookbook/a.md": block("sh", "echo a") + block("text", "a")}

    def test_good_pages_have_no_faults(self):
        self.assertEqual(check_pages.faults_of(self.pages), [])

    def test_a_recipe_without_a_test_is_found(self):
        for recipe in ("Words.\n", block("sh", "echo a"),
                       block("sh", "echo a", "not run: It takes an hour.") + block("text", "a"),
                       block("console", "$ true"), block("sh", "echo a") + "Words.\n" + block("text", "a")):
            self.assertEqual(len(check_pages.recipes_without_a_test({**self.pages, "cookbook/a.md": recipe})), 1, recipe)

    def test_a_page_without_a_link_is_found(self):
        found = check_pages.faults_of({**self.pages, "cookbook/b.md": self.pages["cookbook/a.md"]})
        self.assertEqual(found, ["cookbook/b.md: cookbook/index.md has no link to it"])

    def test_a_bad_block_is_found(self):
        self.assertEqual(len(check_pages.faults_of({**self.pages, "index.md": block("perl", "x")})), 1)

    def test_the_build_fails_on_a_fault(self):
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "index.md"), "w", encoding="utf-8") as file:
                file.write(block("perl", "x"))
            self.assertEqual(check_pages.check(folder), 1)


class NavigationTest(unittest.TestCase):
    def test_pages_have_the_order_of_the_links_in_the_index(self):
        with tempfile.TemporaryDirectory() as folder:
            os.makedirs(os.path.join(folder, "start/inner"))
            for name, text in (("index.md", ""), ("start/index.md", "[b](b.md) [a](a.md)"), ("start/a.md", ""),
                               ("start/b.md", ""),
                               ("start/inner/z.md", ""), ("start/inner/index.md", "")):
                with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                    file.write(text)
            self.assertEqual(navigation.navigation(folder), ["index.md", {"Start": [
                "start/index.md", "start/b.md", "start/a.md", {"Inner": ["start/inner/index.md", "start/inner/z.md"]}]}])


class MarkdownTest(unittest.TestCase):
    def test_nothing_in_a_text_is_markup_but_code(self):
        self.assertEqual(markdown.escaped("a_b *c* <d> `e_f` [g]"), "a\\_b \\*c\\* &lt;d&gt; `e_f` \\[g\\]")
        self.assertEqual(markdown.escaped("1. a"), "1\\. a")

    def test_a_list_is_apart_from_the_paragraph_before_it(self):
        text = "Errors:\n- one\n  more\n  - inner\nEnd."
        self.assertEqual(markdown.markdown_of(text), "Errors:\n\n- one\n  more\n    - inner\n\nEnd.\n")


class RunnerTest(unittest.TestCase):
    def faults(self, text):
        """Runs a page without a locusd and returns its faults."""
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "page.md")
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
            with page_shell.PageShell(folder, folder, None) as shell:
                page = pages_test.Page(path, shell)
                page.run()
            return page.faults

    def test_a_page_that_shows_what_is_printed_passes(self):
        text = block("console", "$ mkdir in; cd in\n$ X=5\n$ pwd | tail -c4; echo $X\n/in\n5\n$ echo epoch 12345\nepoch EPOCH")
        text += block("python", "print('a')\nprint('b 1.5 s')") + block("text", "a\nb ... s")
        text += block("sh", "echo x > f", "file: f.sh") + block("console", "$ sh ../f.sh; cat f\nx")
        self.assertEqual(self.faults(text), [])

    def test_other_output_is_found(self):
        for text in (block("console", "$ echo a\nb"), block("console", "$ echo a"), block("console", "$ true\na"),
                     block("python", "print(1)") + block("text", "2"), block("sh", "echo a") + block("text", "a\nb")):
            self.assertEqual(len(self.faults(text)), 1, text)

    def test_a_wrong_exit_code_is_found(self):
        for text in (block("console", "$ false"), block("python", "raise SystemExit(3)"), block("sh", "true", "fails: 1"),
                     block("console", "$ false\n$ true", "fails: 1")):
            self.assertGreater(len(self.faults(text)), 0, text)
        self.assertEqual(self.faults(block("console", "$ echo a >&2; (exit 3)\na", "fails: 3")), [])

    def test_data_that_is_malformed_is_found(self):
        for text in (block("json", "{"), block("yaml", "a: [")):
            self.assertEqual(len(self.faults(text)), 1, text)

    def test_jobs_of_a_page_end_with_it(self):
        with page_shell.PageShell("/nowhere", "/nowhere", None) as shell:
            self.assertEqual(shell.run("sleep 1000 & echo $!")[0], 0)
            (process,) = [one for one in shell.members() if one != shell.shell.pid]
        self.assertFalse(os.path.exists(f"/proc/{process}"))


class AgreesTest(unittest.TestCase):
    def test_dots_stand_for_any_lines_and_any_text(self):
        self.assertTrue(pages_test.agrees("a\n...\nz", "a\nb\nc\nz"))
        self.assertTrue(pages_test.agrees("a\n...\nz", "a\nz"))
        self.assertTrue(pages_test.agrees("took ... ms", "took 3.5 ms"))
        self.assertFalse(pages_test.agrees("took ... ms", "took\n3 ms"))
        self.assertFalse(pages_test.agrees("a\n...\nz", "a\nb"))
        self.assertFalse(pages_test.agrees("a.c", "abc"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
