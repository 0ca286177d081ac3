"""Which points of a study have all trials that its rule asks for."""

from collections import Counter

from sweep.tables.stored_study import NOT_YET, WHYS, StoredStudy


def settled_points(study: StoredStudy) -> str:
    """Return how many points need no more trials, by the reason, in words.

    Raises ChoiceError for a study with a fixed number of trials.
    """
    why = study.stopping.groupby("point")["why"].agg(lambda of: min(of, key=WHYS.index))
    counts = Counter(why[why != NOT_YET])
    reasons = "".join(f", {count:,} by {one}" for one, count in sorted(counts.items()))
    return f"{counts.total():,} of {len(why):,} points{reasons}"


def why_unfinished(study: StoredStudy) -> str:
    """Return why more trials follow, in words, or "" where none do."""
    if study.about.until and (study.stopping["why"] == NOT_YET).any():
        return f"more trials of {study.name} follow by its rule"
    return ""
