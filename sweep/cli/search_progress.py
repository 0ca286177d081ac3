"""The progress of a search: that of a launch, with the findings so far."""

from sweep.campaigns.progress import Progress, SearchProgress
from sweep.cli.progress import ProgressBar


class SearchBar(ProgressBar):
    """A ProgressBar that also shows the findings of the search so far."""

    findings = ""
    begun = False

    def show(self, progress: Progress) -> None:
        """Show `progress`, as ProgressBar does."""
        if isinstance(progress, SearchProgress):
            self.findings = progress.best_so_far
        super().show(progress)

    def _pace(self, new: int) -> str:
        return ", ".join(filter(None, [super()._pace(new), self.findings]))

    def _first(self, progress: Progress) -> None:
        if not self.begun:
            self._line(
                f"at most {progress.trials:,} trials;"
                " what is stored already does not run again"
            )
        self.begun = True
