"""Numbers at the ends of what numbers can be, under every key of a spec and in every
setting: a spec is planned, or refused in one line, and one that is planned runs.

A spec follows from its number alone: `python -m tests.spec.test_hostile_numbers 17`
prints it, and what is said of it. What is put where comes from the descriptions of the
keys, the settings of the models and the registries, so that a new one is tried too.
"""

import random
import re
import resource
import signal
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from copy import deepcopy
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

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
from sweep.spec.key_table import described
from sweep.spec.keys import Key
from sweep.spec.samplers import SAMPLERS
from sweep.spec.settings import settings_of
from sweep.spec.strict_yaml import dump, parse_document
from sweep.spec.study import SPEC, Study
from sweep.trial.simulation import run
from tests.specs import EVERYTHING, GAINS, SEPARATION, SHORT

MANY = 100_000
FEW = 150
MOST_POINTS = 300
"""Of a spec that is varied: what is read and planned should take milliseconds."""
RUN_SECONDS = 0.002
"""Trials of an estimate up to it are run."""
MOST_BYTES = 4 * 2**30
MOST_SECONDS = 120

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
WORDS = ("1e400", "-1e400", "1e-400", "0x10", "0o17", "1_000", "+.5", ".5e1", "1e5_0")
"""Numbers as YAML may have them, of which Python's may be others."""
IN_TEXTS = ("0", "1e308", "1e-308", "1e400", "9" * 20, "9" * 400, "0.0", "-1", "1e16")
NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])")
KEYS = dict(described(*SPEC))
PARTS = re.compile(r"\[\]|[^.\[\]]+")
PLAIN = [SHORT, SEPARATION, GAINS, EVERYTHING]


class Spec:
    """A spec on the way: mappings and lists as YAML has them, and its folder."""

    def __init__(self, number: int) -> None:
        self.draw = random.Random(number)
        content, self.path = self.draw.choice(bases())
        self.content = deepcopy(content)
        if self.draw.random() < 0.3:
            self.content["model"] = self.draw.choice([*MODELS])
            self.content.pop("preset", None)
        changes = (
            self.leaf,
            self.text,
            self.setting,
            self.setting,
            self.key,
            self.axis,
        )
        for _ in range(self.draw.choice((1, 1, 1, 2, 3))):
            self.draw.choice(changes)()

    @property
    def as_yaml(self) -> str:
        """The text, in which some numbers are written as YAML may have them."""
        return re.sub(
            r"WORD(\d)", lambda found: WORDS[int(found[1])], dump(self.content)
        )

    def hostile(self) -> Any:
        if self.draw.random() < 0.05:
            return f"WORD{self.draw.randrange(len(WORDS))}"
        return deepcopy(self.draw.choice(HOSTILE))

    def leaf(self) -> None:
        """Another value in the place of a number."""
        places = [
            (holder, at)
            for holder, at in leaves(self.content)
            if isinstance(holder[at], int | float)
        ]
        if places:
            holder, at = self.draw.choice(places)
            holder[at] = self.hostile()

    def text(self) -> None:
        """Another number in a text, as expressions and sizes have them."""
        places = [
            (holder, at)
            for holder, at in leaves(self.content)
            if isinstance(holder[at], str) and NUMBER.search(holder[at])
        ]
        if places:
            holder, at = self.draw.choice(places)
            number = self.draw.choice(IN_TEXTS)
            holder[at] = NUMBER.sub(number, holder[at], count=1)

    def setting(self) -> None:
        """A fixed setting of the model."""
        name = self.draw.choice([*settings(self.content["model"])])
        fixed = self.content.setdefault("fixed", {})
        if isinstance(fixed, dict):
            fixed[name] = self.hostile()

    def key(self) -> None:
        """A key with what its description shows, where one value is another."""
        path = self.draw.choice([*KEYS])
        shown = {"value": example(KEYS[path])}
        holder, at = self.draw.choice([(shown, "value"), *leaves(shown)])
        holder[at] = self.hostile()
        put(self.content, path, shown["value"])

    def axis(self) -> None:
        """An axis of numbers, drawn, listed, on a grid or in a chain."""
        known = settings(self.content["model"])
        names = [name for name, one in known.items() if one.kind in ("float", "int")]
        name = self.draw.choice(names)
        sweep = self.content.setdefault("sweep", {})
        if not isinstance(sweep, dict):
            return
        numbers = [self.hostile(), self.hostile(), self.draw.choice((1, 2, 5))]
        forms = ("values", "linspace", "logspace", *DISTRIBUTIONS)
        form = self.draw.choice(forms)
        if form not in forms[:3]:
            numbers = numbers[:2]
        one = {form: numbers if form != "values" else numbers[:2]}
        how = self.draw.random()
        if how < 0.2:
            points = self.draw.choice((4, 8, self.hostile()))
            sampler = self.draw.choice([*SAMPLERS])
            other = self.draw.choice(names)
            drawn = {"sample": sampler, "points": points, other: {"uniform": [0, 1]}}
            sweep["drawn"] = drawn | {name: one}
        elif how < 0.3:
            sweep[name] = one | {"continue": "up", "hold": self.hostile()}
        else:
            drawn = {} if form in forms[:3] else {"points": self.draw.choice((1, 3))}
            sweep[name] = one | drawn


@cache
def bases() -> list[tuple[dict[str, Any], Path]]:
    """Specs that are varied, with their files: those that are planned fast."""
    texts = [(text, Path("spec.yaml")) for text in PLAIN]
    files = sorted(EXPERIMENTS.glob("*/*.yaml"))
    texts += [(file.read_text(), file) for file in files]
    found = []
    for text, path in texts:
        try:
            study = study_of(text, path, code=False)
        except SpecError:  # another kind of file, or one of several studies
            continue
        if study.search or expand(study).n_points <= MOST_POINTS:
            found.append((parse_document(text, path).value, path))
    return found


@cache
def settings(model: str) -> dict[str, Any]:
    if model not in MODELS:
        model = next(iter(MODELS))
    return dict(settings_of(model, BUILT_IN))


def leaves(value: Any) -> Iterator[tuple[Any, Any]]:
    """Each plain value below a mapping or a list: what holds it, and its key there."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value)
    for key, one in pairs:
        if isinstance(one, dict | list):
            yield from leaves(one)
        else:
            yield value, key


def example(key: Key) -> Any:
    """A value that may stand under a key, as its description shows it."""
    if key.example:
        return parse_document(f"{key.name}: {key.example}", Path("key")).value[key.name]
    if key.content.sections:
        return {}
    return 1


def put(content: dict[str, Any], path: str, value: Any) -> None:
    """Enter a value under a key, and what its description asks for beside it."""
    here: Any = content
    done = ""
    for part, after in pairwise(PARTS.findall(path)):
        done += part if part == "[]" else f".{part}" if done else part
        slot = 0 if part == "[]" else next(iter(here), "a") if part == "NAME" else part
        missing = part != "[]" and slot not in here
        if missing or not isinstance(here[slot], dict | list) or not here[slot]:
            here[slot] = [{}] if after == "[]" else {}
        if isinstance(here[slot], list) != (after == "[]"):
            here[slot] = [{}] if after == "[]" else {}
        here = here[slot]
        if isinstance(here, dict) and after != "NAME":
            beside(here, done)
    last = PARTS.findall(path)[-1]
    here[0 if last == "[]" else last] = value


def beside(section: dict[str, Any], path: str) -> None:
    """Enter what must be given in a section."""
    for whole, key in KEYS.items():
        if key.required and whole == f"{path}.{key.name}":
            section.setdefault(key.name, example(key))


def planned(text: str, path: Path) -> list[Study]:
    """The studies of a spec that is planned as by `sweep plan`; none where it is
    refused, in one line a mistake.
    """
    try:
        studies = with_variants(study_of(text, path, code=False))
        for study in studies:
            made = plan_of(study, 2)
            assert made.as_text()
            assert made.as_json()
    except SpecError as error:
        for line in str(error).splitlines():
            assert re.match(r"[\w.-]+:\d+: .", line), str(error)
            assert len(line) < 1500, str(error)
        return []
    return studies


def run_one(study: Study) -> str:
    """How a short trial of a study ended; nothing where all take long."""
    if study.search:
        return ""
    jobs = Jobs(study, expand(study))
    first = [jobs[at] for at in range(min(len(jobs), 3))]
    seconds = job_seconds(first)
    if not np.any(seconds < RUN_SECONDS):
        return ""
    ended = run(first[int(np.argmin(seconds))])
    return f"{ended.status} {ended.error}"


@contextmanager
def bounded() -> Iterator[None]:
    """Work that ends after MOST_SECONDS of a processor, and holds few bytes more."""
    limits = resource.getrlimit(resource.RLIMIT_AS)
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (held + MOST_BYTES, limits[1]))
    before = signal.signal(signal.SIGPROF, _end)
    signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
        resource.setrlimit(resource.RLIMIT_AS, limits)


def _end(*_: object) -> None:
    raise AssertionError(f"takes more than {MOST_SECONDS} s")


def tried(number: int, *, runs: bool = False) -> str:
    """What came of a spec: refused, planned, or how its trial ended."""
    spec = Spec(number)
    text = spec.as_yaml
    with bounded(), warnings.catch_warnings():
        warnings.simplefilter("error")
        studies = planned(text, spec.path)
        if not studies:
            return "refused"
        return (runs and run_one(studies[0])) or "planned"
