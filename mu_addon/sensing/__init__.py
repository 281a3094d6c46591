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
    from .calibration import Calibration as Calibration
    from .calibration import CalibrationSweep as CalibrationSweep
    from .calibration import calibrate as calibrate
    from .calibration import light_of as light_of
    from .calibration import read_calibration as read_calibration
    from .calibration import write_calibration as write_calibration
    from .decoder import Decoder as Decoder
    from .embedded_waveguide import EmbeddedWaveguide as EmbeddedWaveguide
    from .embedded_waveguide import Joints as Joints
    from .embedded_waveguide import WaveguideShape as WaveguideShape
    from .embedded_waveguide import embed_waveguide as embed_waveguide
    from .framing import cobs_decoded as cobs_decoded
    from .framing import cobs_encoded as cobs_encoded
    from .framing import crc16 as crc16
    from .guide import Centreline as Centreline
    from .guide import Guide as Guide
    from .light_law import Law as Law
    from .light_law import fit_law as fit_law
    from .light_signal import Response as Response
    from .light_signal import Signal as Signal
    from .light_signal import signal_of_nodes as signal_of_nodes
    from .light_signal import signal_of_states as signal_of_states
    from .optics import Optics as Optics
    from .reconnecting import Control as Control
    from .recording import Recorder as Recorder
    from .recording import Recording as Recording
    from .recording import read_recording as read_recording
    from .samples import Layout as Layout
    from .samples import Samples as Samples
    from .session import run_session as run_session
    from .sources import Replay as Replay
    from .sources import SerialLine as SerialLine
    from .sources import Simulated as Simulated
    from .sources import ports as ports
    from .sweeps import Check as Check
    from .sweeps import Sweeps as Sweeps
    from .sweeps import read_sweeps as read_sweeps
    from .tracing import Light as Light
    from .tracing import trace as trace
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
