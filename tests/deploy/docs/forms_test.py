"""Checks the issue forms in .github against the rules of GitHub for such forms: python3 forms_test.py GITHUB_FOLDER

Source of the rules: GitHub's documentation, "Syntax for issue forms" and "Syntax for GitHub's form schema".
"""
import glob
import os
import sys
import unittest

import yaml

FOLDER = sys.argv[1]
# Attributes that an element may have, by type; the first is required.
ATTRIBUTES = {
    "markdown": ["value"],
    "textarea": ["label", "description", "placeholder", "value", "render"],
    "input": ["label", "description", "placeholder", "value"],
    "dropdown": ["options", "label", "description", "multiple", "default"],
    "checkboxes": ["options", "label", "description"],
}


def faults_of(form):
    """Returns what is wrong with a form."""
    faults = [f"has no {key}" for key in ("name", "description", "body") if not form.get(key)]
    faults += [f"has the unknown key {key}" for key in form.keys() - {"name", "description", "title", "labels", "body"}]
    elements = form.get("body") or []
    ids = [element["id"] for element in elements if "id" in element]
    labels = [element["attributes"].get("label") for element in elements if element["type"] != "markdown"]
    faults += ["repeats an id"] * (len(set(ids)) != len(ids)) + ["repeats a label"] * (len(set(labels)) != len(labels))
    faults += ["has no element to fill in"] * (not labels)
    for element in elements:
        known = ATTRIBUTES.get(element["type"])
        if known is None:
            faults.append(f"has an element of the unknown type {element['type']}")
            continue
        attributes = element["attributes"]
        faults += [f"{element.get('id')}: has no {key}" for key in {known[0], *known[:2]} & {"value", "label", "options"}
                   if not attributes.get(key)]
        faults += [f"{element.get('id')}: has the unknown attribute {key}" for key in attributes.keys() - set(known)]
        faults += [f"{element.get('id')}: has the unknown key {key}"
                   for key in element.keys() - {"type", "id", "attributes", "validations"}]
        faults += [f"{element.get('id')}: has the unknown validation {key}"
                   for key in element.get("validations", {}).keys() - {"required"}]
    return faults


class FormsTest(unittest.TestCase):
    def forms(self):
        for path in sorted(glob.glob(os.path.join(FOLDER, "ISSUE_TEMPLATE/*.yml"))):
            with open(path, encoding="utf-8") as file:
                yield os.path.basename(path), yaml.safe_load(file)

    def test_there_is_a_form_for_faults_wishes_and_questions(self):
        self.assertEqual({name for name, _ in self.forms()}, {"bug.yml", "feature.yml", "question.yml", "config.yml"})

    def test_forms_keep_the_rules(self):
        for name, form in self.forms():
            if name != "config.yml":
                self.assertEqual(faults_of(form), [], name)

    def test_broken_forms_are_detected(self):
        good = {"name": "a", "description": "b", "body": [{"type": "input", "id": "c", "attributes": {"label": "d"}}]}
        self.assertEqual(faults_of(good), [])
        element = good["body"][0]
        for change in ({"name": ""}, {"heading": "x"}, {"body": []}, {"body": [element, element]},
                       {"body": [{**element, "type": "number"}]}, {"body": [{**element, "attributes": {}}]},
                       {"body": [{**element, "attributes": {"label": "d", "render": "sh"}}]},
                       {"body": [{**element, "required": True}]},
                       {"body": [{"type": "dropdown", "attributes": {"label": "d"}}]}):
            self.assertNotEqual(faults_of({**good, **change}), [], change)

    def test_nobody_is_led_to_an_invented_address(self):
        for place, _, names in os.walk(FOLDER):
            for name in names:
                with open(os.path.join(place, name), encoding="utf-8") as file:
                    self.assertNotRegex(file.read(), r"https?://|mailto:|@\w+\.", name)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
