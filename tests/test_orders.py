"""The error falls with the size of the elements as theory says, where bodies are bonded, pressed or rub."""

import pytest

from validation.orders import JOINTS, MESHES, error, rows


@pytest.mark.parametrize("meshes", MESHES)
@pytest.mark.parametrize("joint", JOINTS)
def test_the_order_is_that_of_the_elements(joint, meshes):
    for row in rows((4, 8), (joint,), (meshes,)):
        assert row.orders[-1] > row.least, row


def test_pairs_that_match_are_as_good_as_a_crack():
    assert error("matching", "bond", 1, 4) == pytest.approx(error("crack", "bond", 1, 4), rel=1e-4)


@pytest.mark.parametrize("joint", JOINTS)
def test_meshes_that_do_not_match_are_as_good_as_those_that_do(joint):
    """The bodies are meshed 3 : 2, so that one of them has smaller elements and a smaller error."""
    for degree in (1, 2):
        assert error("non-matching", joint, degree, 8) < 1.01 * error("matching", joint, degree, 8)
