"""Builds the site of the documentation and checks it:

    python3 site_test.py --source TOP --build DIR [--site FOLDER]

mkdocs is strict, no link is broken, nothing is loaded from elsewhere, no word is misspelt, and the reference lacks no element
of the protocol, no command, option, metric or Reason. Every check is also run on a fault that is planted, which it must find.
Without mkdocs, linkchecker or codespell (deploy/packages.sh docs) the test is skipped.
"""
import argparse
import copy
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import yaml
from prometheus_client.parser import text_string_to_metric_families

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "../../../deploy/docs")]
sys.dont_write_bytecode = True
import coverage  # noqa: E402
import daemon  # noqa: E402
import operation_pages  # noqa: E402
import protocol  # noqa: E402
import site_pages  # noqa: E402

SKIPPED = 77
TOOLS = ("mkdocs", "linkchecker", "codespell", "protoc")
OPTIONS = None


def run(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, timeout=300, **options)


def link_check(folder):
    """Runs linkchecker on a site; returns its exit code and what it found. As root it would change to a user who may not
    read the folder, so it gets a copy that everybody may read.
    """
    with tempfile.TemporaryDirectory() as top:
        os.chmod(top, 0o755)
        copied = os.path.join(top, "site")
        shutil.copytree(folder, copied)
        subprocess.run(["chmod", "-R", "a+rX", copied], check=True)
        done = run("linkchecker", "--no-status", "--no-robots", "--threads", "2", f"file://{copied}/index.html",
                   env=dict(os.environ, HOME=top), cwd=top)
    return done.returncode, done.stdout + done.stderr


def spelling(*folders):
    done = run("codespell", "--ignore-words", os.path.join(HERE, "words.txt"), "--skip", "*.svg,*.png,*.csv", *folders)
    return [line for line in done.stdout.splitlines() if "==>" in line]


def planted(pages, path, change):
    """Returns the pages with a change of one page."""
    changed = dict(pages)
    changed[path] = copy.deepcopy(pages[path])
    change(changed[path])
    return changed


class SiteTest(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        top = os.path.abspath(os.path.join(OPTIONS.build, "deploy/docs"))
        cls.site, cls.markdown = OPTIONS.site or os.path.join(top, "site"), os.path.join(top, "pages")
        cls.binaries = os.path.abspath(os.path.join(OPTIONS.build, "bin"))
        done = run(os.path.join(OPTIONS.source, "deploy/docs/build.sh"), "--build", OPTIONS.build, "--site", cls.site,
                   "--pages", cls.markdown)
        if done.returncode:
            raise RuntimeError(f"build.sh exited with {done.returncode}:\n{done.stdout}{done.stderr}")
        cls.pages = site_pages.read_site(cls.site)
        cls.elements = list(protocol.Pages(protocol.read_descriptors(OPTIONS.source)).by_name.values())

    def helps(self):
        """Returns the help of each command, found by following the lists of commands in the help of the programs."""
        helps, left = {}, ["locus", "locusd"]
        while left:
            command = left.pop()
            program, *words = command.split()
            text = run(os.path.join(self.binaries, program), *words, "--help").stdout
            helps[command] = text
            for _, lines in coverage.HELP_SECTION.findall(text):
                left += [f"{command} {word}" for word in re.findall(r"^  ([a-z][a-z-]*) ", lines, re.MULTILINE)]
        return helps

    def families(self):
        """Returns the metrics of a daemon that has a scene and has answered calls, with the labels of their samples."""
        with daemon.Daemon(self.binaries) as running:
            for line in ("scene create arena --history-ticks 5", "insert arena ball --id 7 --at 0,0,30 --radius 0.5",
                         "query ray arena --from 0,0,100 --dir 0,0,-1", "query ball nowhere --at 0,0,0 --radius 5"):
                running.locus(*line.split())
            families = list(text_string_to_metric_families(running.metrics()))
        return [(operation_pages.family_name(family), family.type, family.documentation,
                 {label for sample in family.samples for label in sample.labels}) for family in families]

    def reasons(self):
        return {part.descriptor.name: part.comment for element in self.elements if element.name == "Reason"
                for part in element.parts}

    def test_every_element_of_the_protocol_is_in_the_reference(self):
        self.assertGreater(len(self.elements), 450)
        self.assertEqual(coverage.missing_elements(self.pages, self.elements), [])
        path = "reference/protocol/query_service.html"
        gone = planted(self.pages, path, lambda page: page.by_id.pop("QueryRequest.scene"))
        self.assertEqual(len(coverage.missing_elements(gone, self.elements)), 1)
        cut = planted(self.pages, path, lambda page: page.by_id.update({"QueryRequest.scene": "Required."}))
        self.assertEqual(len(coverage.missing_elements(cut, self.elements)), 1)

    def test_every_command_and_option_is_in_the_reference(self):
        helps = self.helps()
        self.assertGreater(len(helps), 60)
        self.assertGreater(sum(len(coverage.options_of_help(text)) for text in helps.values()), 400)
        self.assertEqual(coverage.missing_options(self.pages, helps), [])
        self.assertEqual(len(coverage.missing_options(self.pages, {**helps, "locus fly": ""})), 1)
        more = {"locus health": helps["locus health"] + "  --planted X  An option that no page has\n"}
        self.assertEqual(len(coverage.missing_options(self.pages, more)), 1)
        other = {"locus health": helps["locus health"] + "  --serv X  The beginning of another option's name\n"}
        self.assertEqual(len(coverage.missing_options(self.pages, other)), 1)

    def test_every_setting_of_the_daemon_is_in_the_reference_with_its_default(self):
        defaults = {**operation_pages.effective_options(self.binaries), **operation_pages.OF_THE_MACHINE}
        self.assertGreater(len(defaults), 30)
        self.assertEqual(coverage.missing_settings(self.pages, defaults), [])
        self.assertEqual(len(coverage.missing_settings(self.pages, {**defaults, "planted": "1"})), 1)
        self.assertEqual(len(coverage.missing_settings(self.pages, {**defaults, "max-scenes": "1025"})), 1)

    def test_every_metric_of_a_running_daemon_is_in_the_reference(self):
        families = self.families()
        self.assertGreater(len(families), 50)
        self.assertEqual(coverage.missing_metrics(self.pages, families), [])
        planted_family = ("locus_planted_total", "counter", "Nothing.", set())
        self.assertEqual(len(coverage.missing_metrics(self.pages, [*families, planted_family])), 1)
        self.assertEqual(len(coverage.missing_metrics(self.pages, families[1:])), 1)
        (calls,) = [family for family in families if family[0] == "locus_calls_total"]
        others = [family for family in families if family is not calls]
        for changed in ((calls[0], "gauge", *calls[2:]), (*calls[:3], {"rpc", "planted"}), (*calls[:2], "Other help.", calls[3])):
            self.assertEqual(len(coverage.missing_metrics(self.pages, [*others, changed])), 1, changed)

    def test_every_reason_says_what_it_means_and_what_to_do(self):
        reasons = self.reasons()
        self.assertGreaterEqual(len(reasons), 18)
        self.assertEqual(coverage.missing_reasons(self.pages, reasons), [])
        self.assertEqual(len(coverage.missing_reasons(self.pages, {**reasons, "REASON_PLANTED": "x"})), 1)
        path = "reference/errors.html"
        for text in ("", letters_only(reasons["REASON_LIMIT"])):
            cut = planted(self.pages, path, lambda page, text=text: page.by_id.update({"limit": text}))
            self.assertEqual(len(coverage.missing_reasons(cut, reasons)), 1, text)

    def test_every_alert_links_to_its_section_of_the_runbook(self):
        with open(os.path.join(OPTIONS.source, "deploy/dashboards/alerts.yml"), encoding="utf-8") as file:
            groups = yaml.safe_load(file)["groups"]
        alerts = {rule["alert"]: rule["annotations"] for group in groups for rule in group["rules"]}
        self.assertGreater(len(alerts), 5)
        self.assertEqual(coverage.missing_runbooks(self.pages, alerts), [])
        for url in ("", "operations/gone.html#locusdown", "index.html#planted"):
            self.assertEqual(len(coverage.missing_runbooks(self.pages, {"Planted": {"runbook_url": url}})), 1, url)

    def outcome(self, command, folder):
        """Runs an example in an empty folder, where no server answers; locusd only shows its options. Returns the exit code
        and the output.
        """
        environment = {name: value for name, value in os.environ.items() if not name.startswith("LOCUS_")}
        environment.update(LOCUS_ADDRESS="127.0.0.1:1", PATH=self.binaries + ":" + os.environ["PATH"], HOME=folder)
        if command.startswith("locusd") and not re.match(r"locusd (check|repair|config)\b", command):
            command = command.replace("locusd", "locusd config", 1)
        done = run("bash", "-c", "set -o pipefail; " + command, env=environment, cwd=folder, stdin=subprocess.DEVNULL)
        return done.returncode, done.stdout + done.stderr

    def faults_of_example(self, command, folder):
        """Returns what is wrong with the options of an example. It may fail, for want of a server or a file."""
        code, output = self.outcome(command, folder)
        wanting = re.search(r"does not exist|not readable|cannot be opened|No such file", output)
        return [f"exits with {code}: {command}\n{output}"] if code in (2, 126, 127) and not wanting else []

    def test_examples_of_the_commands_are_right(self):
        folder, faults, count = os.path.join(self.markdown, "reference/commands"), [], 0
        with tempfile.TemporaryDirectory() as empty:
            for name in sorted(set(os.listdir(folder)) - {"index.md"}):
                for command in examples_of(operation_pages.read(folder, name)):
                    count += 1
                    faults += self.faults_of_example(command, empty)
            self.assertEqual(len(self.faults_of_example("locus query ray arena --planted", empty)), 1)
            self.assertEqual(len(self.faults_of_example("locusd --planted  # starts it", empty)), 1)
        self.assertGreater(count, 80)
        self.assertEqual(faults, [])

    def test_no_link_is_broken(self):
        code, found = link_check(self.site)
        self.assertEqual(code, 0, found)
        self.assertRegex(found, r"\d{3,} links in \d+ URLs checked")
        self.assertEqual(site_pages.broken_anchors(self.pages), [])

    def test_a_broken_link_is_found(self):
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "index.html"), "w", encoding="utf-8") as file:
                file.write('<html><body><article><a href="gone.html">a</a><a href="#gone">b</a>'
                           '<img src="https://example.com/a.png"></article></body></html>')
            self.assertNotEqual(link_check(folder)[0], 0)
            pages = site_pages.read_site(folder)
            self.assertEqual(len(site_pages.broken_anchors(pages)), 1)
            self.assertEqual(len(site_pages.foreign_resources(pages)), 1)

    def test_nothing_is_loaded_from_elsewhere(self):
        self.assertEqual(site_pages.foreign_resources(self.pages), [])
        with open(os.path.join(self.site, "index.html"), encoding="utf-8") as file:
            self.assertNotRegex(file.read(), r"fonts\.g|unpkg|jsdelivr|cdnjs")

    def test_no_word_is_misspelt(self):
        self.assertEqual(spelling(self.markdown, os.path.join(OPTIONS.source, "deploy/docs")), [])
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "page.md"), "w", encoding="utf-8") as file:
                file.write("Objects are " + "recie" + "ved.\n")
            self.assertEqual(len(spelling(folder)), 1)


def examples_of(text):
    """Returns the commands of the examples of a page. A command goes on after a backslash and inside of quotes."""
    (block,) = re.findall(r"^## Examples\n.*?^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    commands = [""]
    for line in block.splitlines(keepends=True):
        commands[-1] += line
        if not line.endswith("\\\n") and commands[-1].count("'") % 2 == 0:
            commands.append("")
    return commands[:-1]


def letters_only(text):
    return site_pages.letters(text)


def main():
    global OPTIONS
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--source", required=True)
    parser.add_argument("--build", required=True)
    parser.add_argument("--site", help="where to write the site; below the build folder by default")
    OPTIONS, rest = parser.parse_known_args()
    missing = [tool for tool in TOOLS if not shutil.which(tool)]
    if missing:
        print(f"SKIPPED: {', '.join(missing)} not found; run deploy/packages.sh docs")
        return SKIPPED
    return not unittest.main(argv=[sys.argv[0], *rest], verbosity=2, exit=False).result.wasSuccessful()


if __name__ == "__main__":
    sys.exit(main())
