import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.campaign import legal_name, name_problem
from tdacoustic.toml_models import MAX_NAME_LENGTH, unique_name


@pytest.mark.parametrize("name", ["a", "1", "Motor Z (left) #1", "电机_1", "Мотор/3", "Ölwanne-2.b", "हिन्दी", "a" * 64])
def test_names_of_any_script(name):
    assert name_problem(name) is None


@pytest.mark.parametrize(
    "name", ["", " a", "#1", "a" * 65, "a:b", "a\nb", "a\0", "a=b", "a,b", "a;b", '"', "a\\b", "\u0301a"]
)
def test_what_no_name_has(name):
    assert name_problem(name) is not None


@given(st.text(st.characters(), max_size=100))
def test_a_text_made_legal_is_legal_and_stays(text):
    name = legal_name(text, "ch1")
    assert name_problem(name) is None
    assert legal_name(name, "x") == name


@given(st.lists(st.text("ab", min_size=1, max_size=70), max_size=8))
def test_names_made_unique_are_unique_and_short_enough(texts):
    taken = []
    for text in texts:
        taken.append(unique_name(legal_name(text, "x"), taken))
    assert len(set(taken)) == len(texts)
    assert all(len(name) <= MAX_NAME_LENGTH for name in taken)
