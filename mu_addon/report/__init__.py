"""Parts of reports: HTML, charts, pictures of meshes, VTK and point-cache files."""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .calibration_charts import curve_chart as curve_chart
    from .coupon_charts import mode_chart as mode_chart
    from .coupon_charts import residual_chart as residual_chart
    from .html_parts import page as page
    from .html_parts import table as table
    from .lattice_charts import cell_picture as cell_picture
    from .lattice_charts import compression_chart as compression_chart
    from .lattice_charts import lines_of as lines_of
    from .lattice_charts import modulus_surface as modulus_surface
    from .lattice_charts import stretch_chart as stretch_chart
    from .lattice_charts import test_pictures as test_pictures
    from .pc2 import read_pc2 as read_pc2
    from .pc2 import write_pc2 as write_pc2
    from .print_check_pictures import layer_pictures as layer_pictures
    from .print_check_pictures import places_picture as places_picture
    from .print_check_pictures import trade_off as trade_off
    from .render import Camera as Camera
    from .render import Part as Part
    from .render import png as png
    from .unit_pictures import skin as skin
    from .vtk import write_mesh as write_mesh
    from .vtk import write_trajectory as write_trajectory
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
