"""Parts of reports: HTML, charts, pictures of meshes, VTK and point-cache files."""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .calibration_charts import curve_chart
    from .coupon_charts import mode_chart, residual_chart
    from .html_parts import page, table
    from .lattice_charts import (
        cell_picture,
        compression_chart,
        lines_of,
        modulus_surface,
        stretch_chart,
        test_pictures,
    )
    from .pc2 import read_pc2, write_pc2
    from .print_check_pictures import layer_pictures, places_picture, trade_off
    from .render import Camera, Part, png
    from .unit_pictures import skin
    from .vtk import write_mesh, write_trajectory
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
