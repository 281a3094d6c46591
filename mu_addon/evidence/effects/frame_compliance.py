"""Frame compliance."""

from .declaration import ALL, Declaration

EFFECT = Declaration(
    mechanism="the testing machine deforms",
    reveals="specimens of two sections, which load it by as much more",
    remedy="subtract the machine's compliance, found with a rigid block, or use an extensometer",
    shown_by={
        "beam_deadweight": "one load on beams of two lengths",
        "blocked_force": "a dead weight hung from the load cell, the deflection of its stand measured",
    },
    of=ALL,
    grips=True,
)
