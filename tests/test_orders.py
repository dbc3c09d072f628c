"""The error falls with the size of the elements as theory says, where bodies are bonded, pressed or rub."""

import pytest

from validation.orders import error, rows


@pytest.mark.parametrize("meshes", ["crack", "matching", "non-matching"])
@pytest.mark.parametrize("joint", ["bond", "friction"])
def test_the_order_is_that_of_the_elements(joint, meshes):
    for row in rows((4, 8), (joint,), (meshes,)):
        assert row.orders[-1] > row.least, row


def test_pairs_that_match_are_as_good_as_a_crack():
    assert error("matching", "bond", 1, 4) == pytest.approx(error("crack", "bond", 1, 4), rel=1e-4)
