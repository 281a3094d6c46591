"""Fatigue drift."""

from .declaration import Declaration

EFFECT = Declaration(
    mechanism="the modulus falls with the number of cycles",
    reveals="the first protocol again at the end",
    remedy="replace the specimen, or recalibrate after that many cycles",
    memory=True,
)
