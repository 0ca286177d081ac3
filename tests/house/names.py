"""Entries are known by name where they are entered, and nowhere else."""

import re
from collections.abc import Collection, Iterator, Mapping

from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.starts import STARTS
from sweep.figures.kinds import KINDS
from sweep.method import own_methods
from sweep.methods.search.known_samplers import SEARCH_SAMPLERS
from sweep.methods.search.statistics import STATISTICS
from sweep.spec.distributions import DISTRIBUTIONS
from sweep.spec.samplers import SAMPLERS
from sweep.spec.study import sections
from tests.house.sources import Checkout, Finding, Module

OWN_PLACES = (
    "kernels/metrics/__init__.py",
    "kernels/models/",
    "kernels/playback.py",
    "sweep/published/definitions.py",
)
"""The registries, presets and each model's own file; and what defines metrics in
another way.
"""
WORDS = {
    "coverage": {
        "sweep/figures/kinds.py",  # a kind of figure
        "sweep/figures/coverage.py",  # and the figure itself, in an error
        "sweep/web/protocol.py",  # an overlay of the page
        "sweep/web/live_show.py",
        "sweep/web/session.py",
        "sweep/web/demo.py",
    },
    "speed": {  # the steps a second of a run
        "sweep/web/live_show.py",
        "sweep/web/messages.py",
        "sweep/web/demo.py",
    },
}
"""Names that are words too, and where they mean something else."""
EXAMPLES = {
    "sweep/cli/app.py": "nguyen2024",  # in help: the name of a study
    "sweep/cli/starting.py": "nguyen2024",  # in help too
    "sweep/cli/reading.py": "coverage_cv",  # in help: how a direction is written
}
PLACES_OF_ENTRIES: dict[str, Collection[str]] = {
    "kernels/settings.py": STARTS,  # values for most presets
    "kernels/models/aziel_chen2025.py": STARTS,  # a preset
    "kernels/models/couzin2002.py": STARTS,  # its presets
    "kernels/models/strombom2014.py": STARTS,  # its presets
    "kernels/models/vicsek1995.py": STARTS,  # its presets
    "kernels/starts.py": STARTS,
    "sweep/spec/samplers.py": SAMPLERS,
    "sweep/spec/whole_samples.py": SAMPLERS,
    "sweep/spec/distributions.py": DISTRIBUTIONS,
    "sweep/methods/search/known_samplers.py": SEARCH_SAMPLERS,
    "sweep/methods/search/statistics.py": STATISTICS,
    "sweep/figures/kinds.py": KINDS,
} | {f"sweep/figures/{name}.py": {name} for name in KINDS}
PLACES_OF_ENTRIES |= {
    f"sweep/methods/{name}/{file}.py": method.figures()
    for name, method in own_methods().items()
    for file in ("analysis", "collapse", "figure", "method")
}
PLACES_OF_ENTRIES |= {
    "sweep/methods/search/figure.py": {"history", "front"},
    "sweep/methods/search/figure_repetitions.py": {"comparison", "hypervolume"},
}
"""The registries, and what they gather."""
WORDS_OF_ENTRIES = {
    "numpy": {  # the package
        "kernels/device/wasm.py",
        "kernels/jit.py",
        "kernels/lanes/vectors.py",
        "sweep/store/origin.py",
        "sweep/store/provenance.py",
        "sweep/workers/fingerprint.py",
    },
    "random": {  # the runs that a search is compared with
        "kernels/generator.py",  # a method of NumPy's generator
        "sweep/methods/search/repetitions.py",
        "sweep/methods/search/report.py",
        "sweep/methods/search/figure_repetitions.py",
        "sweep/own_code/description.py",  # a field of a start
    },
    "uniform": {"kernels/generator.py"},  # a method of NumPy's generator
    "worst": {  # the trial of a point
        "sweep/cli/supplementing.py",
        "sweep/explorer/supplement_trials.py",
        "sweep/explorer/trials.py",
    },
    "sobol": {
        "sweep/spec/axis_keys.py",  # an example for the guide
        "sweep/methods/search/known_samplers.py",  # an option of optuna
        "sweep/spec/sampling.py",
        "sweep/methods/sensitivity/analysis.py",  # an analysis
    },
    "nsga3": {"sweep/methods/search/section_keys.py"},  # an example for the guide
    "morris": {"sweep/spec/sampling.py", "sweep/methods/sensitivity/analysis.py"},
    "sensitivity": {
        "sweep/spec/whole_samples.py",  # an extra
        "sweep/methods/sensitivity/sampled.py",  # in an error
    },
    "mean": {
        "sweep/methods/profiles/report.py",  # of columns, claims, intervals and weights
        "sweep/methods/calibration/analysis.py",
        "sweep/methods/calibration/report.py",
        "sweep/methods/calibration/rule.py",
        "kernels/models/cucker_smale2007.py",
        "sweep/analysis/intervals.py",
        "sweep/analysis/steady.py",
        "sweep/methods/power/report.py",
        "sweep/figures/curves.py",
        "sweep/methods/ablation/figure.py",
        "sweep/methods/refinement/figure.py",
        "sweep/published/measures.py",
        "sweep/methods/refinement/analysis.py",
        "sweep/methods/power/analysis.py",
        "sweep/web/claimed.py",
    },
    "normal": {  # how values of a metric are distributed
        "kernels/metrics/__init__.py",
        "kernels/metrics/ground.py",
        "sweep/analysis/contrasting.py",
        "sweep/analysis/estimate.py",
        "sweep/analysis/futures.py",
        "sweep/analysis/intervals.py",
        "sweep/analysis/mean_bounds.py",
        "sweep/analysis/replication.py",
        "sweep/analysis/sequential.py",
        "sweep/methods/search/repetitions.py",
        "sweep/methods/search/report.py",
        "sweep/methods/ablation/analysis.py",
        "sweep/methods/adaptive/rule.py",
        "sweep/methods/realities/analysis.py",
        "sweep/methods/search/objectives.py",
        "sweep/spec/recorded.py",
        "sweep/tables/means_text.py",
    },
    "curves": {"sweep/analysis/__init__.py"},  # a name of its face
    "posterior": {  # a heading, beside the prior
        "sweep/methods/calibration/analysis.py",
        "sweep/methods/calibration/report.py",
    },
    "collapse": {"sweep/methods/scaling/report.py"},  # a key of its JSON
    "front": {
        "sweep/methods/search/report.py",  # a part of the report
        "sweep/methods/search/figure_layout.py",  # in a legend
        "sweep/explorer/supplement.py",  # what stands about a figure
        "sweep/web/recording.py",
    },
    "hypervolume": {"sweep/methods/search/repetitions.py"},  # a quantity
    "phase": {  # of a search: who is judged
        "sweep/methods/search/asked_trials.py",
        "sweep/methods/search/exporting.py",
        "sweep/methods/search/findings.py",
        "sweep/methods/search/outcome.py",
        "sweep/methods/search/points_behind.py",
        "sweep/methods/search/repetitions.py",
        "sweep/spec/derived_metrics.py",
        "sweep/methods/search/separate_phases.py",
    },
    "choice": {  # settings and expressions of this kind
        "sweep/spec/expressions.py",
        "sweep/spec/schema_settings.py",
        "sweep/spec/settings.py",
        "sweep/store/rows.py",
        "sweep/tables/choosing.py",
    },
}
"""Names that are words too, and where they mean something else."""
KINDS_ARE = {
    "profiles": "a table of a study, and what is recorded in it",
    "trajectories": "a table of a study, what is recorded in it, and blocks of morris",
    "coverage": "a metric, and an overlay of the page",
}
"""Kinds of figures whose names mean something else in most places."""
REGISTRIES = (STARTS, SAMPLERS, DISTRIBUTIONS, SEARCH_SAMPLERS, STATISTICS, KINDS)


SPINE = tuple(
    f"sweep/{name}/"
    for name in (
        *("spec", "own_code", "design", "trial", "store", "workers", "testing"),
        *("tables", "campaigns", "figures", "replays", "sharing"),
    )
)
"""What every study passes: it loops over methods, and knows no section of one."""
WORDS_OF_SECTIONS = {
    "search": {"sweep/spec/seeds.py"},  # a purpose of random numbers, a part of ids
}


def known_by_name() -> set[str]:
    """Models, metrics, and settings that are the weight of a rule."""
    weights = {rule.weight for model in MODELS.values() for rule in model.rules}
    return {*MODELS, *METRICS} | weights


def _said(
    module: Module,
    known: set[str],
    words: Mapping[str, Collection[str]],
    own: Collection[str] = (),
) -> Iterator[Finding]:
    """Texts of a module that are names of entries, but for its own and those that are
    other words there; and such words that are no longer there.
    """
    allowed = {word for word, places in words.items() if module.name in places}
    said = module.texts.keys() & known
    for word in said - allowed.union(own):
        yield module.finding(module.texts[word], f"knows {word} by name")
    for word in allowed - said.union(own):
        yield module.finding(1, f"has no text {word}, which it is allowed")


def nobody_knows_a_model_a_metric_or_a_weight_by_name(
    checkout: Checkout,
) -> Iterator[Finding]:
    known = known_by_name()
    for module in checkout.modules.values():
        if not module.name.startswith(OWN_PLACES):
            yield from _said(module, known, WORDS)


def no_text_of_the_machine_has_such_a_name_in_it(
    checkout: Checkout,
) -> Iterator[Finding]:
    """One that is no plain word."""
    known = {name for name in known_by_name() if re.search("[_0-9]", name)}
    for module in checkout.part("sweep"):
        if module.name.startswith(OWN_PLACES):
            continue
        told = {
            word: line
            for text, line in module.texts.items()
            for word in known.intersection(re.findall(r"\w+", text))
        }
        example = EXAMPLES.get(module.name)
        for word in told.keys() - {example}:
            yield module.finding(told[word], f"has {word} in a text")
        if example and example not in told:
            yield module.finding(1, f"has no {example} in a text, which it is allowed")


def a_model_knows_no_other(checkout: Checkout) -> Iterator[Finding]:
    for name in MODELS:
        module = checkout.module(f"kernels/models/{name}.py")
        for other in module.texts.keys() & MODELS.keys() - {name}:
            yield module.finding(module.texts[other], f"knows the model {other}")
        if name not in module.texts:
            yield module.finding(1, "does not say its own name")


def nobody_knows_another_entry_by_name(checkout: Checkout) -> Iterator[Finding]:
    """A start, a sampler of points, a distribution, a sampler of a search, a statistic
    or a kind of figure.
    """
    known = {one for registry in REGISTRIES for one in registry} - KINDS_ARE.keys()
    for module in checkout.modules.values():
        own = PLACES_OF_ENTRIES.get(module.name, ())
        yield from _said(module, known, WORDS_OF_ENTRIES, own)


def the_spine_knows_no_section_of_a_method(checkout: Checkout) -> Iterator[Finding]:
    for module in checkout.modules.values():
        if module.name.startswith(SPINE):
            yield from _said(module, {*sections()}, WORDS_OF_SECTIONS)


RULES = (
    nobody_knows_a_model_a_metric_or_a_weight_by_name,
    no_text_of_the_machine_has_such_a_name_in_it,
    a_model_knows_no_other,
    nobody_knows_another_entry_by_name,
    the_spine_knows_no_section_of_a_method,
)
