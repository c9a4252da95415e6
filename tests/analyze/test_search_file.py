"""The search of a calibration as a file: what goes on, and what is refused."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from analyze.workbench.search_file import going_on, read_journal
from twin.calibrate.search import Journal, SearchError

FloatArray = npt.NDArray[np.float64]


def bowl(points: FloatArray) -> FloatArray:
    return np.asarray(np.sum((points - 0.3) ** 2, axis=1))


def searched(journal: Journal, *, evaluations: int, begin: float = 0.5, seed: int = 3) -> float:
    """The best of a search from a point whose coordinates are all `begin`."""
    start = np.full(3, begin)
    *_, best = going_on(journal)(bowl, 3, seed=seed, evaluations=evaluations, start=start)
    return best.cost


def test_a_search_from_a_file_is_the_search_that_never_stopped(tmp_path: Path) -> None:
    whole, first = Journal(), Journal()
    cost = searched(whole, evaluations=300)
    searched(first, evaluations=120)
    (tmp_path / "j.json").write_text(first.to_json())
    later = read_journal(tmp_path / "j.json")
    assert searched(later, evaluations=300, begin=0.4) == cost  # the fit has moved meanwhile
    assert np.array_equal(later.points, whole.points)
    assert np.array_equal(later.costs, whole.costs)


def test_no_file_is_no_search_yet_and_another_file_is_refused(tmp_path: Path) -> None:
    assert len(read_journal(tmp_path / "none.json")) == 0
    (tmp_path / "j.json").write_text("{}")
    with pytest.raises(SearchError, match="no journal"):
        read_journal(tmp_path / "j.json")
    (tmp_path / "j.json").write_bytes(b"\xff\xfe")
    with pytest.raises(SearchError, match="cannot be read"):
        read_journal(tmp_path / "j.json")


def test_a_search_of_another_problem_or_seed_is_refused() -> None:
    journal = Journal()
    searched(journal, evaluations=60)
    with pytest.raises(SearchError, match="another seed"):
        searched(journal, evaluations=90, seed=4)
    options = {"seed": 3, "evaluations": 90}
    with pytest.raises(SearchError, match="other tests"):
        list(going_on(journal)(lambda x: 1.01 * bowl(x), 3, start=np.full(3, 0.5), **options))
    with pytest.raises(SearchError, match="other tests"):
        list(going_on(journal)(bowl, 4, start=np.full(4, 0.5), **options))
    assert len(journal) == 60
