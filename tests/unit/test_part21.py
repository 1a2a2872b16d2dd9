"""The text of STEP files: what stands in it, and what hostile ones may not do."""

import time

import pytest

from scenes.parts.part21 import Enumeration, Part21, Reference, Typed

FILE = """ISO-10303-21;
HEADER; /* a comment; with a ' in it */ FILE_NAME('a''b; #9=NOT_ONE();');
ENDSEC;
DATA;
#10 = FLAT('it''s; so', #2, .T., $, *, -1.5E-2, 7, (1.,(#3,$)), LENGTH_MEASURE(35.), ());
/* #11=COMMENTED(1); */
#12=(B()
A(.WORD.,'x')
C(#10));
#13=FLAT('\\X2\\00D8\\X0\\ 5 \\X\\B0');
#14=BROKEN(1;
ENDSEC;
END-ISO-10303-21;
"""


@pytest.fixture(scope="module")
def file():
    return Part21.of(FILE.encode())


def test_parameters_of_every_kind(file):
    assert file[10].entities == {
        "FLAT": ("it's; so", 2, "T", None, None, -0.015, 7, (1.0, (3, None)), Typed("LENGTH_MEASURE", 35.0), ()),
    }
    assert isinstance(file[10].entities["FLAT"][1], Reference)
    assert isinstance(file[10].entities["FLAT"][2], Enumeration)
    assert isinstance(file[10].entities["FLAT"][6], int)


def test_instances_of_several_entities_are_found_by_each(file):
    assert file[12].entities == {"B": (), "A": ("WORD", "x"), "C": (10,)}
    assert file[12].of("NONE", "A", "B") == ("WORD", "x")
    assert file[12].of("NONE") is None
    assert [file.numbers(kind) for kind in ("A", "C", "FLAT", "X")] == [[12], [12], [10, 13], []]
    assert file.numbers("FLAT", "B") == [10, 12, 13]


def test_comments_and_texts_are_no_instances(file):
    assert file.order == (10, 12, 13, 14)


def test_characters_beyond_ascii(file):
    assert file[13].of("FLAT") == ("\u00d8 5 \u00b0",)


def test_what_is_broken_or_missing_has_no_entities(file):
    assert file[14].entities == file[99].entities == {}


@pytest.mark.parametrize(
    "data",
    [
        b"#1=A('" + b"''" * 300_000, b"/*" * 300_000, b"/* '" * 300_000, b"'/*" * 300_000, b"#1=A(" * 300_000,
        b"#1=A(" + b"(" * 300_000 + b");", b"#1=(A('" + b"''" * 300_000 + b"')B());", b"/* */" + b"''" * 300_000 + b"'",
    ],
)  # fmt: skip
def test_hostile_texts_take_no_more_time_than_long_ones(data):
    start = time.process_time()
    file = Part21.of(data)
    file[1]
    file.numbers("A")
    assert time.process_time() - start < 10.0  # margin: a file that is read twice a character takes minutes; 0.1 s
