"""Strut thickness."""

from .declaration import Declaration

EFFECT = Declaration(
    mechanism="the struts of a specimen are not as thick as drawn, or not those that were drawn",
    reveals="struts of each specimen measured under a microscope, each specimen weighed",
    remedy="measure the struts of each specimen, and write one unit file for each design",
)
