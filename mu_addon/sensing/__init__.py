"""Sensing: the optical waveguide, its calibration, and the serial line.

`Decoder` turns bytes of a serial line into samples, `run_session` records them, `calibrate` maps voltage to
bending angle with a 95 % band. `fit_law` and `signal_of_nodes` predict the light of a waveguide in a unit
that bends.

    >>> from mu_addon.sensing import cobs_encoded
    >>> cobs_encoded(bytes([1, 0, 2])).hex()
    '02010202'
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .calibration import (
        Calibration,
        CalibrationSweep,
        calibrate,
        light_of,
        read_calibration,
        write_calibration,
    )
    from .decoder import Decoder
    from .embedded_waveguide import EmbeddedWaveguide, Joints, WaveguideShape, embed_waveguide
    from .framing import cobs_decoded, cobs_encoded, crc16
    from .guide import Centreline, Guide
    from .light_law import Law, fit_law
    from .light_signal import Response, Signal, signal_of_nodes, signal_of_states
    from .optics import Optics
    from .reconnecting import Control
    from .recording import Recorder, Recording, read_recording
    from .samples import Layout, Samples
    from .session import run_session
    from .sources import Replay, SerialLine, Simulated, ports
    from .sweeps import Check, Sweeps, read_sweeps
    from .tracing import Light, trace
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
