"""Forms of issues follow the schema of GitHub, and the steps of a release exist."""

import re
from typing import Any

import jsonschema
import pytest
from ruamel.yaml import YAML

from tests import ROOT

FORMS = sorted(
    path
    for path in ROOT.glob(".github/ISSUE_TEMPLATE/*.yml")
    if path.name != "config.yml"
)
TEXT = {"type": "string", "minLength": 1}
REQUIRED = {"required": {"type": "boolean"}}
LABELLED = {"label": TEXT, "description": {"type": "string"}}
WRITTEN = LABELLED | {"placeholder": TEXT, "value": TEXT}


def element(kind: str, attributes: dict[str, Any], needed: list[str]) -> dict[str, Any]:
    """The schema of a type of element. GitHub allows no further keys."""
    return {
        "type": "object",
        "properties": {
            "type": {"const": kind},
            "id": {"type": "string", "pattern": "^[A-Za-z0-9_-]+$"},
            "attributes": {
                "type": "object",
                "properties": attributes,
                "required": needed,
                "additionalProperties": False,
            },
            "validations": {
                "type": "object",
                "properties": REQUIRED,
                "additionalProperties": False,
            },
        },
        "required": ["type", "attributes"],
        "additionalProperties": False,
    }


def listed(items: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "minItems": 1, "uniqueItems": True, "items": items}


CHECKBOX = {
    "type": "object",
    "properties": {"label": TEXT} | REQUIRED,
    "required": ["label"],
    "additionalProperties": False,
}
ELEMENTS = [
    element("markdown", {"value": TEXT}, ["value"]),
    element("textarea", WRITTEN | {"render": TEXT}, ["label"]),
    element("input", WRITTEN, ["label"]),
    element(
        "dropdown",
        LABELLED
        | {
            "options": listed(TEXT),
            "multiple": {"type": "boolean"},
            "default": {"type": "integer"},
        },
        ["label", "options"],
    ),
    element(
        "checkboxes", LABELLED | {"options": listed(CHECKBOX)}, ["label", "options"]
    ),
]
FORM = {
    "type": "object",
    "properties": {
        **dict.fromkeys(("name", "description", "title", "type"), TEXT),
        **dict.fromkeys(("labels", "assignees", "projects"), listed(TEXT)),
        "body": {"type": "array", "minItems": 1, "items": {"anyOf": ELEMENTS}},
    },
    "required": ["name", "description", "body"],
    "additionalProperties": False,
}
"""Syntax of issue forms, as the documentation of GitHub states it."""


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.stem)
def test_a_form_follows_the_schema_of_github(path: Any) -> None:
    form = YAML(typ="safe").load(path)
    jsonschema.validate(form, FORM)
    ids = [field["id"] for field in form["body"] if "id" in field]
    labels = [
        field["attributes"]["label"]
        for field in form["body"]
        if field["type"] != "markdown"
    ]
    assert len(ids) == len(set(ids)) == len(labels) == len(set(labels))
    assert any(field["type"] != "markdown" for field in form["body"])


def test_names_of_forms_differ_and_an_empty_issue_is_not_offered() -> None:
    names = [YAML(typ="safe").load(path)["name"] for path in FORMS]
    assert len(names) == len(set(names)) > 1
    config = ROOT / ".github" / "ISSUE_TEMPLATE" / "config.yml"
    assert YAML(typ="safe").load(config) == {"blank_issues_enabled": False}


@pytest.mark.parametrize(
    "broken",
    [
        {"name": "a", "description": "b", "body": []},
        {"name": "a", "description": "b", "body": [{"type": "text"}]},
        {
            "name": "a",
            "description": "b",
            "body": [{"type": "input", "id": "a b", "attributes": {"label": "c"}}],
        },
    ],
)
def test_the_schema_refuses_broken_forms(broken: dict[str, Any]) -> None:
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(broken, FORM)


def test_files_and_pages_that_forms_name_exist() -> None:
    for path in FORMS:
        text = path.read_text(encoding="utf-8")
        for name in re.findall(r"\b(?:docs/)?[\w-]+\.md\b", text):
            assert (ROOT / name).is_file(), name


def test_the_commands_of_a_release_exist() -> None:
    steps = (ROOT / "RELEASING.md").read_text(encoding="utf-8")
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = re.findall(r"`make ([a-z-]+)`", steps)
    assert len(targets) > 3
    for target in targets:
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
