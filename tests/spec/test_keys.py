"""One description of a key makes its reader, its schema, its writer and its table."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import pytest
from jsonschema import Draft7Validator

from sweep.errors import SpecError
from sweep.methods.search.section_keys import LEVEL, Racing
from sweep.spec import key_table, schema, study
from sweep.spec.axes import forms
from sweep.spec.axis_keys import axis_keys
from sweep.spec.contents import Number, OneOf, OrFalse, ReadLater, Text, Whole
from sweep.spec.document import Document, Entry
from sweep.spec.failure_policy import FailureBudget
from sweep.spec.key_table import described
from sweep.spec.keys import Key, differing, keys_of, read_section, written
from sweep.spec.samplers import SAMPLERS
from sweep.spec.strict_yaml import parse_document
from sweep.spec.study import RecordSpec, Streams, Study, parse_spec, spec_parts
from tests.specs import short

ROOT = Path(__file__).parents[2]
KEYS = dict(described(*spec_parts()))
ALONE = {
    path: key
    for path, key in KEYS.items()
    if key.example and not isinstance(key.content, ReadLater)
}


def entry(value: Any, name: str = "key") -> Entry:
    return Entry(Document(Path("spec.yaml"), ""), (name,), value)


def example(key: Key) -> Entry:
    return parse_document(f"{key.name}: {key.example}", Path("spec.yaml")).child(
        key.name
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class LongerStudy(Study):
    """A study with a key that this test alone knows."""

    patience: Annotated[
        int, Key(Whole(2, 9), "hours that somebody waits", example="4")
    ] = 3


@dataclass(frozen=True, eq=False, kw_only=True)
class EasierStudy(Study):
    """A study some of whose keys have got other defaults."""

    model: Annotated[str, Key(Text(), "a model")] = "nguyen2024"
    seed: Annotated[int, Key(Whole(0), "a seed")] = 7


def entered(monkeypatch: pytest.MonkeyPatch, kind: type[Study]) -> None:
    """The class of a study is another one; nothing else is told of its keys."""
    monkeypatch.setattr(study, "Study", kind)


@pytest.fixture
def longer(monkeypatch: pytest.MonkeyPatch) -> None:
    """There is one key more."""
    entered(monkeypatch, LongerStudy)


@pytest.mark.usefixtures("longer")
def test_a_key_that_is_entered_once_is_read() -> None:
    assert parse_spec(short()).patience == 3
    assert parse_spec(short("patience: 5")).patience == 5
    wanted = '"patience" must be an integer from 2 to 9, not 1'
    with pytest.raises(SpecError, match=rf"^spec.yaml:6: {wanted}$"):
        parse_spec(short("patience: 1"))
    with pytest.raises(SpecError, match=r'^spec.yaml:6: .*; did you mean "patience"\?'):
        parse_spec(short("pateince: 5"))


@pytest.mark.usefixtures("longer")
def test_a_key_that_is_entered_once_is_in_the_schema() -> None:
    validator = Draft7Validator(schema.json_schema())
    head = parse_document(short(), Path("spec.yaml")).value
    assert validator.is_valid(head | {"patience": 5})
    assert not validator.is_valid(head | {"patience": 1})
    text = "hours that somebody waits; by default 3; for example 4"
    assert schema.json_schema()["properties"]["patience"]["description"] == text


@pytest.mark.usefixtures("longer")
def test_a_key_that_is_entered_once_is_written_and_in_the_table() -> None:
    assert written({"patience": 5, "seed": 1}, *spec_parts()) == {
        "seed": 1,
        "patience": 5,
    }
    row = (
        "| `patience` | hours that somebody waits | an integer from 2 to 9 | 3 |"
        " `patience: 4` |\n"
    )
    assert row in key_table.key_table()


def test_a_default_is_entered_once_too(monkeypatch: pytest.MonkeyPatch) -> None:
    bare = {"study": "short", "replicates": 2}
    with pytest.raises(SpecError, match='missing key "model"'):
        parse_spec(bare)
    assert not Draft7Validator(schema.json_schema()).is_valid(bare)
    entered(monkeypatch, EasierStudy)
    assert (parse_spec(bare).model, parse_spec(bare).seed) == ("nguyen2024", 7)
    assert Draft7Validator(schema.json_schema()).is_valid(bare)
    assert "| `seed` | a seed | an integer from 0 | 7 |" in key_table.key_table()


def test_without_the_key_it_is_unknown() -> None:
    with pytest.raises(SpecError, match='unknown key "patience"'):
        parse_spec(short("patience: 5"))


def test_the_page_of_all_keys_is_up_to_date() -> None:
    """`make documents` renews it."""
    page = ROOT / "docs" / "keys.md"
    assert page.read_text(encoding="utf-8") == key_table.key_table()


@pytest.mark.parametrize("path", KEYS)
def test_a_key_has_a_text_and_what_is_allowed_in_words(path: str) -> None:
    assert KEYS[path].text
    assert KEYS[path].content.words
    assert "|" not in KEYS[path].text + KEYS[path].content.words


def test_the_table_of_axes_has_every_fixed_key() -> None:
    rules = [about.blocks for about in SAMPLERS.values() if about.blocks]
    own = [key.name for one in rules for key in one.options]
    assert own == ["second_order", "levels"]
    assert {key.name for key in axis_keys()} >= {*forms(), *own}
    names = [key.name for key in axis_keys()]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("key", axis_keys(), ids=lambda key: key.name)
def test_an_example_of_an_axis_is_allowed_by_its_own_content(key: Key) -> None:
    assert key.text
    if key.example:
        key.content.read(example(key))


@cache
def definitions() -> dict[str, Any]:
    """What a schema of a key may refer to."""
    return {"definitions": schema.json_schema()["definitions"]}


@pytest.mark.parametrize("path", ALONE)
def test_an_example_is_read_and_valid_and_is_written_as_it_is_read(path: str) -> None:
    key, given = ALONE[path], example(ALONE[path])
    validator = Draft7Validator(key.content.schema() | definitions())
    validator.validate(given.value)
    value = key.content.read(given)
    if not isinstance(value, Entry):
        again = key.content.write(value)
        validator.validate(again)
        assert key.content.read(entry(again, key.name)) == value


DEFAULTS = [
    path for path, key in KEYS.items() if not key.required and key.otherwise is None
]


@pytest.mark.parametrize("path", DEFAULTS)
def test_a_default_that_a_spec_can_say_is_allowed(path: str) -> None:
    key = KEYS[path]
    assert key.content.read(entry(key.content.write(key.default))) == key.default


def test_a_section_is_written_without_what_is_so_by_default() -> None:
    assert differing(Streams(noise="common")) == {"noise": "common"}
    record = RecordSpec(("speed",), every=5)
    assert differing(record) == {"metrics": ["speed"], "every": 5}
    read = read_section(RecordSpec, entry(differing(record)))
    assert read == record


def test_what_is_no_key_is_not_written() -> None:
    with pytest.raises(AssertionError, match="serie"):
        written({"serie": ("speed",)}, RecordSpec)


@pytest.mark.parametrize(
    ("value", "text"), [(LEVEL, True), (None, False), (0.05, {"level": 0.05})]
)
def test_racing_is_written_as_it_is_read(value: float | None, text: Any) -> None:
    assert Racing().write(value) == text
    assert Racing().read(entry(text)) == value


@pytest.mark.parametrize("text", [0, 7, "0%", "100%", "12.3456789%", "0.000000001%"])
def test_a_budget_is_written_as_it_is_read(text: Any) -> None:
    assert FailureBudget().write(FailureBudget().read(entry(text))) == text


@pytest.mark.parametrize("value", [None, 0.5])
def test_false_stands_for_none(value: float | None) -> None:
    content = OrFalse(Number(above=0))
    assert content.read(entry(content.write(value))) == value


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (Number(), "a number"),
        (Number(least=0.5, most=0.999), "a number from 0.5 to 0.999"),
        (Number(above=0, below=0.5), "a number above 0 and below 0.5"),
        (Number(above=0, most=9), "a number above 0, at most 9"),
        (OrFalse(Number(above=0, unit="s")), "a number of s above 0, or false"),
        (Number(above=0, note="in m"), "a number above 0, in m"),
        (Whole(1, 20_000), "an integer from 1 to 20,000"),
        (OneOf("fruit", ["apple", "pear", "fig"]), "apple, pear or fig"),
    ],
)
def test_what_is_allowed_in_words(content: Any, words: str) -> None:
    assert content.words == words


@pytest.mark.parametrize("number", [0, 0.5, -1, 1.0, 0.499, float("inf"), "1", True])
def test_a_number_is_in_its_range_for_the_reader_and_the_schema(number: Any) -> None:
    for content in (
        Number(least=0.5, most=0.999),
        Number(above=0, below=0.5),
        Number(),
    ):
        valid = Draft7Validator(content.schema()).is_valid(number)
        if number == float("inf"):  # which JSON cannot say
            valid = False
        try:
            content.read(entry(number))
        except SpecError:
            assert not valid
        else:
            assert valid


def test_a_key_without_default_is_required_unless_something_else_holds() -> None:
    @dataclass
    class Part:
        first: Annotated[str, Key(Text(), "must be there")]
        second: Annotated[str, Key(Text(), "what first says", otherwise="as first")]
        third: Annotated[str, Key(Text(), "", name="3rd")] = "three"

    assert [(key.name, key.required) for key in keys_of(Part)] == [
        ("first", True),
        ("second", False),
        ("3rd", False),
    ]
    with pytest.raises(SpecError, match='missing key "first" in "key"'):
        read_section(Part, entry({"3rd": "x"}))
    assert read_section(Part, entry({"first": "x"}), second="y") == Part("x", "y")
