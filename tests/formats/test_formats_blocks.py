"""What every reader does alike: grouping by origin, blocks of one length, the order asked for."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.errors import FormatError
from tdacoustic.formats.blocks import by_origin, check_request, in_asked_order, rebuffered

N = 23
cuts = st.lists(st.integers(0, N), max_size=6)


def pieces_of(values, at):
    """An array of shape (channels, n) in pieces that end anywhere."""
    return np.split(values, sorted(at), axis=1)


@given(cuts, st.integers(1, 30))
def test_pieces_of_any_length_become_blocks_of_one(at, size):
    values = np.arange(2.0 * N).reshape(2, N)
    blocks = list(rebuffered(pieces_of(values, at), size))
    assert [block.shape[1] for block in blocks] == [size] * (N // size) + [N % size] * (N % size > 0)
    np.testing.assert_array_equal(np.concatenate(blocks, axis=1), values)


@given(st.lists(st.sampled_from("abc"), min_size=1, max_size=7), st.data(), st.integers(1, 30))
def test_channels_of_several_places_come_in_the_order_asked_for(places, data, size):
    """Channel k holds the numbers 100 k, 100 k + 1, ..., wherever it lies."""
    rows = {place: data.draw(st.permutations(members)) for place, members in by_origin(places).items()}
    assert sorted(row for members in rows.values() for row in members) == list(range(len(places)))
    assert all(places[row] == place for place, members in rows.items() for row in members)
    stored = [
        pieces_of(100.0 * np.array(members)[:, None] + np.arange(N), data.draw(cuts)) for members in rows.values()
    ]
    blocks = list(in_asked_order(stored, rows.values(), size))
    assert all(block.shape == (len(places), size) for block in blocks[:-1])
    np.testing.assert_array_equal(
        np.concatenate(blocks, axis=1), 100.0 * np.arange(len(places))[:, None] + np.arange(N)
    )


def test_places_of_unequal_length_are_no_blocks():
    with pytest.raises(ValueError, match="zip"):
        list(in_asked_order([[np.zeros((1, 4))], [np.zeros((1, 9))]], [[0], [1]], 4))


@pytest.mark.parametrize(
    ("start", "stop", "size", "says"),
    [(0, 5, 0, "block_size must be > 0"), (3, 2, 1, "start = 3"), (-1, 2, 1, "start = -1"), (0, 11, 1, "holds 10")],
)
def test_requests_that_cannot_be_met(tmp_path, start, stop, size, says):
    with pytest.raises(FormatError, match=says):
        check_request(tmp_path / "log.x", 10, start, stop, size)
