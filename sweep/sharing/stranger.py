"""The texts of a packed study for who has no boidsweep: a README, and RO-Crate metadata
(https://w3id.org/ro/crate/1.2).
"""

import json
from typing import Any

from sweep.sharing.citing import Citation, Work, stored_at
from sweep.sharing.packed_file import CRATE, SUMS
from sweep.tables.stored_study import StoredStudy

CONFORMS = "https://w3id.org/ro/crate/1.2"
NO_LICENCE = "not stated: ask whoever gave you this file how it may be used"
PARQUET = "application/vnd.apache.parquet"
MEMBERS = {
    "README.md": ("text/markdown", "what this file is"),
    SUMS: ("text/plain", "the sha256 of every other file, for sha256sum -c"),
    "CITATION.bib": ("text/x-bibtex", "what to cite"),
    "provenance.json": (
        "application/json",
        "where the results come from: the spec, the code, versions and machines",
    ),
    "tables/trials.csv": ("text/csv", "a row a trial: its settings and its metrics"),
    "tables/columns.csv": ("text/csv", "a row a column of a table: type, unit, text"),
    "study/spec.yaml": ("application/yaml", "the spec of the study, as last launched"),
    "study/plan.parquet": (PARQUET, "the trials of the spec"),
    "study/parts/": ("", "all tables in parts, as they are stored, in parquet files"),
}
"""What a packed study has in any case, and what it is."""


def readme(study: StoredStudy, citation: Citation) -> str:
    """What the file is, and how its tables are read with other programs."""
    about = "\n".join(f"| `{name}` | {text} |" for name, (_, text) in MEMBERS.items())
    cited = "\n".join(f"- {work.as_text()}" for work in citation.works)
    return f"""# The study {study.name}

{_described(study)} It is a file of boidsweep, a program for Monte Carlo experiments
and parameter sweeps over boid swarms. You need not have that program to read it.

| file | what it is |
|---|---|
| `{CRATE}` | this description for machines (RO-Crate 1.2) |
{about}
| `code/` | the models, metrics, maps and starts that the study brings, if it does |

## Read it

`tables/trials.csv` opens in any program, and `tables/columns.csv` says what each column
is, with its unit. A text that begins with = + - @ or an apostrophe has one apostrophe
more before it. A trial whose `status` is not `done` has no metrics.

Series, heatmaps and trajectories are in `study/parts/*/`, in parquet files that DuckDB,
pandas, polars or R read. Trials of an earlier spec may be among them: those of this
spec have their `trial_id` in `study/plan.parquet`. A trial may be in several parts: the
last part by name counts.

```sql
-- DuckDB, in the folder of this file: the trials of the spec
FROM read_parquet('study/parts/*/trials.parquet', filename = true, union_by_name = true)
WHERE trial_id IN (SELECT trial_id FROM 'study/plan.parquet')
QUALIFY row_number() OVER (PARTITION BY trial_id ORDER BY filename DESC) = 1;
```

`sha256sum -c {SUMS}` says whether every file is as it was packed.

With boidsweep, `sweep load FILE` makes a study of it again, in every bit, which is
plotted, verified and launched on. Its code runs only if you say so.

## Cite it

{cited}

The licence of these data is {NO_LICENCE}.
"""


def crate(study: StoredStudy, citation: Citation, others: list[str]) -> str:
    """The metadata of the file as RO-Crate 1.2, ready for writing; `others` are files
    besides those of MEMBERS.
    """
    files = [_entity(name, *about) for name, about in MEMBERS.items()]
    files += [_entity(name, "text/x-python", "code of the study") for name in others]
    works = [_work(work) for work in citation.works if work.kind != "study"]
    (itself,) = (work for work in citation.works if work.kind == "study")
    root = {
        "@id": "./",
        "@type": "Dataset",
        "name": study.name,
        "description": _described(study),
        "identifier": itself.note,
        "datePublished": stored_at(study).date().isoformat(),
        "license": NO_LICENCE,
        "hasPart": [{"@id": one["@id"]} for one in files],
        "citation": [{"@id": one["@id"]} for one in works],
        "mentions": [{"@id": "#launch"}],
    }
    launch = {
        "@id": "#launch",
        "@type": "CreateAction",
        "name": f"the trials of {study.name} were run",
        "instrument": {"@id": works[0]["@id"]},
        "object": [{"@id": "study/spec.yaml"}],
        "result": [{"@id": "./"}],
    }
    descriptor = {
        "@id": CRATE,
        "@type": "CreativeWork",
        "conformsTo": {"@id": CONFORMS},
        "about": {"@id": "./"},
    }
    graph = [descriptor, root, *files, *works, launch]
    context = f"{CONFORMS}/context"
    return json.dumps({"@context": context, "@graph": graph}, indent=1)


def _described(study: StoredStudy) -> str:
    statuses = study.statuses()
    counts = ", ".join(f"{count:,} {name}" for name, count in sorted(statuses.items()))
    return (
        f"{study.plan.num_rows:,} trials ({counts}) of the model"
        f" {study.trials['model'].iloc[0]}, at {len(study.points):,} points."
    )


def _entity(name: str, encoding: str, text: str) -> dict[str, Any]:
    """A file, or a folder, whose name ends in a slash."""
    kind = "Dataset" if name.endswith("/") else "File"
    said = {"@id": name, "@type": kind, "name": name, "description": text}
    return said | ({"encodingFormat": encoding} if encoding else {})


def _work(work: Work) -> dict[str, Any]:
    kinds = {"software": "SoftwareApplication", "model": "CreativeWork"}
    said = {
        "@id": f"#{work.key}",
        "@type": kinds[work.kind],
        "name": work.title,
        "author": ", ".join(one.name for one in work.authors),
        "datePublished": "" if work.year is None else str(work.year),
        "version": work.version,
        "description": work.note,
    }
    return {name: text for name, text in said.items() if text}
