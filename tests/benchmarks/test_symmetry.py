"""The ground truth of the symmetry benchmark, and what it counts."""

import numpy as np

from benchmarks import symmetry


def test_sets_are_lines_of_numbers_and_remarks_are_passed_over(tmp_path):
    file = tmp_path / "1.sym.info"
    file.write_text("0 3 \n1\n\n0: one end\n1: the other end\n")
    sets = symmetry.exchanged_landmarks(file)
    assert sorted(sets) == [0, 1, 3]
    assert sets[0] == sets[3] != sets[1]


def test_pairs_of_one_landmark_and_unknown_parts_are_not_counted():
    """Parts 0 and 1 stand for one landmark, 2 for its counterpart, 3 for another, and 4 for none."""
    truth = symmetry.Truth(np.array([7, 7, 8, 9, 0]), np.array([1, 1, 1, 2, -1]))
    counts = symmetry.compared([(0, 3), (1, 2), (4,)], truth)
    assert counts == (5, 2, 2, 1)
    row = symmetry.row([counts, counts])
    assert (row["pairs"], row["precision"], row["recall"]) == (10, 0.5, 0.5)


def test_nothing_found_has_no_precision():
    assert symmetry.row([symmetry.Counts(3, 0, 0, 0)])["precision"] is None
