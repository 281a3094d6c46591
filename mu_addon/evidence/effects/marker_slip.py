"""Marker slip."""

from .declaration import ALL, Declaration

EFFECT = Declaration(
    mechanism="a marker slips on the unit's surface at one moment and stays there",
    reveals=(
        "a mark drawn next to the marker; the marker glued again, and the records after that moment repeated"
    ),
    remedy="leave this marker out from that moment on, or glue it again and repeat the later records",
    of=ALL,
    instrument=True,
)
