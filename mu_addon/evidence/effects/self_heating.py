"""Self-heating."""

from .declaration import Declaration

EFFECT = Declaration(
    mechanism="fast tests are scaled: the specimen warms itself and softens, or its rate stiffens it",
    reveals="the fast test after a pause, and with the rate of the slow one",
    remedy="test slowly or with pauses, or measure the specimen's temperature",
    modulus=True,
)
