"""Numbers at the ends of what numbers can be, under every key of a spec and in every
setting: a spec is planned, or refused in one line, and what is planned runs.

A spec follows from its number alone: `Spec(17).text` is its text. What is put where
comes from the descriptions of the keys, the settings of the models and the registries:
what is new is tried too.
"""

import random
import re
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from copy import deepcopy
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.campaigns.plan import plan_of
from sweep.design.cost import job_seconds
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import SpecError
from sweep.own_code.reading import study_of, with_variants
from sweep.spec.built_in import EXPERIMENTS
from sweep.spec.distributions import DISTRIBUTIONS
from sweep.spec.document import Document, Entry
from sweep.spec.key_table import described
from sweep.spec.samplers import SAMPLERS
from sweep.spec.settings import Setting, settings_of
from sweep.spec.strict_yaml import dump, parse_document
from sweep.spec.study import Study, read_study, spec_parts
from sweep.trial.simulation import run
from tests.cases import slow_but
from tests.specs import EVERYTHING, GAINS, SEPARATION, SHORT

MANY, FEW = 100_000, 62
"""Spec(61) is the first of which a trial is run."""
RUN_SECONDS = 0.002
"""Trials of an estimate up to it are run."""
MOST_BYTES = 4 * 2**30
HANGS_SECONDS = 300
"""Far more than a thousand specs take."""

HOSTILE: tuple[Any, ...] = (
    *(0, -0.0, 1, -1, 2, 3, 0.5, 1.5, -0.5, 1 + 2**-52, 1 - 2**-53, 1e-9, 360),
    *(5e-324, -5e-324, 2.2e-308, 1e-308, 1e-300, 1e-160, 1e-30, 1e-12),
    *(1e9, 1e15, 1e16, 1e18, 1e30, 1e100, 1e154, 1e155, 1e300, 1e308, -1e308),
    *(1.7976931348623157e308, -1.7976931348623157e308),
    *(float("inf"), -float("inf"), float("nan")),
    *(255, 256, 2**31 - 1, 2**31, 2**32, 2**53, 2**53 + 1, 2**62),
    *(2**63 - 1, 2**63, 2**63 + 1, -(2**63), -(2**63) - 1, 2**64, 10**30, -(10**30)),
    *(10**400, True, False, None, "1e308", "-1", "0", "nan", "", [], {}, [1], [0.5, 2]),
)
IN_YAML = ("1e400", "-1e400", "1e-400", "0x10", "0o17", "1_000", "+.5", ".5e1", "1e5_0")
"""Numbers as YAML may write them, some of which are others in Python."""
IN_TEXTS = ("0", "1e308", "1e-308", "1e400", "9" * 20, "9" * 400, "0.0", "-1", "1e16")
NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])")
SENTENCE = re.compile(r"[^:]+:\d+: .{1,1500}")
FILES = (
    *("aziel_chen2025/search_cafeteria.yaml", "nguyen2024/ablation.yaml"),
    *("robots/drones.yaml", "strombom2014/map.yaml", "vasarhelyi2018/obstacles.yaml"),
    *("vicsek1995/figure2a.yaml", "vicsek1995/hysteresis.yaml"),
    "vicsek1995/scaling_scalar.yaml",
)
"""Built-in specs which have together all sections, and few points."""
KEYS = dict(described(*spec_parts()))
PARTS = re.compile(r"\[\]|[^.\[\]]+")


class Spec:
    """A spec that follows from its number: mappings and lists as YAML has them, and its
    file. Each twentieth is read from a text.
    """

    def __init__(self, number: int) -> None:
        self.draw = random.Random(number)
        self.in_yaml = number % 20 == 0
        if self.draw.random() < 0.3:
            self.path = Path("spec.yaml")
            self.content = bases()[0][0] | {"model": self.draw.choice([*MODELS])}
            del self.content["preset"]
        else:
            content, self.path = self.draw.choice(bases())
            self.content = deepcopy(content)
        changes = self.leaf, self.words, self.setting, self.setting, self.key, self.axis
        for _ in range(self.draw.choice((1, 1, 1, 2, 3))):
            self.draw.choice(changes)()

    @property
    def text(self) -> str:
        """The text, in which some numbers are written as YAML may write them."""
        return re.sub(
            r"NUMBER(\d)", lambda found: IN_YAML[int(found[1])], dump(self.content)
        )

    def study(self) -> Study:
        """What it describes. Raises SpecError."""
        # Variants of a study are made of its text.
        if self.in_yaml or "validate" in self.content:
            return study_of(self.text, self.path, code=False)
        return read_study(Entry(Document(self.path, ""), (), self.content), BUILT_IN)

    def hostile(self) -> Any:
        if self.in_yaml and self.draw.random() < 0.5:
            return f"NUMBER{self.draw.randrange(len(IN_YAML))}"
        return deepcopy(self.draw.choice(HOSTILE))

    def leaf(self) -> None:
        """Another value in the place of a number."""
        numbers = [
            (holder, at)
            for holder, at in leaves(self.content)
            if isinstance(holder[at], int | float)
        ]
        if numbers:
            holder, at = self.draw.choice(numbers)
            holder[at] = self.hostile()

    def words(self) -> None:
        """Another number in a text, as expressions and sizes have them."""
        texts = [
            (holder, at)
            for holder, at in leaves(self.content)
            if isinstance(holder[at], str) and NUMBER.search(holder[at])
        ]
        if texts:
            holder, at = self.draw.choice(texts)
            number = self.draw.choice(IN_TEXTS)
            holder[at] = NUMBER.sub(number, holder[at], count=1)

    def setting(self) -> None:
        """A fixed setting of the model."""
        name = self.draw.choice([*self.settings()])
        fixed = self.content.setdefault("fixed", {})
        if isinstance(fixed, dict):
            fixed[name] = self.hostile()

    def key(self) -> None:
        """A key with what its description shows, where one value is another."""
        path = self.draw.choice([*KEYS])
        shown = {"value": deepcopy(example(path))}
        holder, at = self.draw.choice([(shown, "value"), *leaves(shown)])
        holder[at] = self.hostile()
        put(self.content, path, shown["value"])

    def axis(self) -> None:
        """An axis of numbers: listed, on a grid, drawn alone or in a sample, or of
        chains.
        """
        sweep = self.content.setdefault("sweep", {})
        known = self.settings()
        name, other = self.draw.sample(
            [name for name, one in known.items() if one.kind in ("float", "int")], 2
        )
        grid = {
            "values": [self.hostile(), self.hostile()],
            "linspace": [self.hostile(), self.hostile(), self.draw.choice((1, 2, 5))],
            "logspace": [self.hostile(), self.hostile(), self.draw.choice((1, 2, 5))],
        }
        drawn = {form: [self.hostile(), self.hostile()] for form in DISTRIBUTIONS}
        form, numbers = self.draw.choice([*(grid | drawn).items()])
        axis = {form: numbers}
        points = {"points": self.draw.choice((1, 4, 8, self.hostile()))}
        if not isinstance(sweep, dict):
            return
        if form in grid:
            chained = {"continue": "up", "hold": self.hostile()}
            sweep[name] = axis | self.draw.choice((chained, {}, {}))
        elif self.draw.random() < 0.5:
            sweep[name] = axis | points
        else:
            sample = {"sample": self.draw.choice([*SAMPLERS])} | points
            sweep["drawn"] = sample | {name: axis, other: {"uniform": [0, 1]}}

    def settings(self) -> dict[str, Setting]:
        model = self.content["model"]
        is_known = isinstance(model, str) and model in MODELS
        return settings_of(model if is_known else next(iter(MODELS)), BUILT_IN)


@cache
def bases() -> list[tuple[dict[str, Any], Path]]:
    """Specs that are varied, with their files: those that are planned fast."""
    few = GAINS.replace("2000", "20")
    texts = [(text, Path("spec.yaml")) for text in (SHORT, SEPARATION, few, EVERYTHING)]
    texts += [(file.read_text(), file) for file in map(EXPERIMENTS.joinpath, FILES)]
    return [(parse_document(text, path).value, path) for text, path in texts]


def leaves(value: Any) -> Iterator[tuple[Any, Any]]:
    """Each plain value below a mapping or a list: what holds it, and its key there."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value)
    for key, one in pairs:
        if isinstance(one, dict | list):
            yield from leaves(one)
        else:
            yield value, key


@cache
def example(path: str) -> Any:
    """A value that may stand under a key, as its description shows it."""
    key = KEYS[path]
    if key.example:
        return parse_document(f"{key.name}: {key.example}", Path("key")).value[key.name]
    return {} if key.content.sections else 1


def put(content: dict[str, Any], path: str, value: Any) -> None:
    """Enter a value under a key, and what its description asks for beside it."""
    here: Any = content
    above = ""
    parts = PARTS.findall(path)
    for part, after in pairwise(parts):
        above += part if part == "[]" else f".{part}" if above else part
        slot = 0 if part == "[]" else next(iter(here), "a") if part == "NAME" else part
        there = here[slot] if part == "[]" else here.get(slot)
        if not there or isinstance(there, list) != (after == "[]"):
            there = [{}] if after == "[]" else {}
        here[slot] = there if isinstance(there, dict | list) else {}
        here = here[slot]
        if isinstance(here, dict) and after != "NAME":
            for one, key in KEYS.items():
                if key.required and one == f"{above}.{key.name}":
                    here.setdefault(key.name, deepcopy(example(one)))
    here[parts[-1]] = value


def planned(spec: Spec) -> list[Study]:
    """The studies of a spec that is planned as by `sweep plan`; none where it is
    refused, in one line a mistake.
    """
    try:
        studies = with_variants(spec.study())
        plans = [plan_of(study, 2) for study in studies]
    except SpecError as error:
        said = str(error).splitlines()
        if not all(SENTENCE.fullmatch(line) for line in said):
            raise AssertionError(said) from error
        return []
    assert all(made.as_text() and made.as_json() for made in plans)
    return studies


def ran(study: Study) -> str:
    """How the shortest of a few trials of a study ended; nothing where all are long."""
    jobs = Jobs(study, expand(study))
    few = [jobs[at] for at in range(min(len(jobs), 3))]
    seconds = job_seconds(few)
    if seconds.min() > RUN_SECONDS:
        return ""
    ended = run(few[int(np.argmin(seconds))])
    return f"{ended.status} {ended.error}"


def _hangs(*_: object) -> None:
    raise AssertionError(f"no end in {HANGS_SECONDS} seconds of a processor")


@contextmanager
def bounded() -> Iterator[None]:
    """Work that holds MOST_BYTES more than this process does now. A timer that is set
    inside ends what hangs.
    """
    before = signal.signal(signal.SIGPROF, _hangs)
    limits = resource.getrlimit(resource.RLIMIT_AS)
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (held + MOST_BYTES, limits[1]))
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
        resource.setrlimit(resource.RLIMIT_AS, limits)


def tried(number: int) -> str:
    """What came of a spec: refused, planned, or how its trial ended. Of each twentieth
    a trial is run.
    """
    studies = planned(Spec(number))
    if not studies:
        return "refused"
    if number % 20 == 1 and not studies[0].strategy_section:
        return ran(studies[0]) or "planned"
    return "planned"


def test_each_key_can_be_reached() -> None:
    for path in KEYS:
        content: dict[str, Any] = {}
        put(content, path, 1e308)
        assert 1e308 in [holder[at] for holder, at in leaves(content)], path


@pytest.mark.parametrize("many", slow_but([FEW], [FEW, MANY]))
def test_a_spec_is_planned_or_refused_in_one_line(many: int) -> None:
    with bounded():
        for number in range(many):
            if number % 1000 == 0:
                signal.setitimer(signal.ITIMER_PROF, HANGS_SECONDS)
            try:
                came = tried(number)
            except Exception as error:
                error.add_note(f"Spec({number})")
                raise
            assert came in ("refused", "planned", "done "), f"Spec({number}): {came}"
