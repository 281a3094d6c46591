"""Optical nonlinearity."""

from .declaration import Declaration

EFFECT = Declaration(
    mechanism="the light loss is not proportional to curvature",
    reveals="an amplitude ladder",
    remedy="calibrate the sensor over the whole range of bending",
)
