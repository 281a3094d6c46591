"""Valid units of every kind, for properties that must hold for all of them."""

from hypothesis import strategies as st

from mu_addon.design.parameters import Chambers, Envelope, Material, Unit, Waveguide


@st.composite
def units(draw):
    def real(low, high):
        return draw(st.floats(low, high))

    scale, cell, share = real(0.3, 4.0), real(6.0, 30.0), real(0.15, 0.85)
    neck = real(0.3, 1.6) * cell
    a = share * cell / 2.0
    curvature = a * (cell / 2.0) / (2.0 * (cell - neck / 2.0))
    wall = max(0.1, real(0.1, 0.95) * min(curvature, 0.6 * neck / 2.0, 6.0))
    bore = neck - 2.0 * wall
    inlet = max(0.5, real(0.1, 0.95) * min(bore, neck - 0.4, 40.0))
    cells_minus = draw(st.integers(1, 3))
    cells_plus = cells_minus + draw(st.integers(0, 3))
    junction = real(0.2, 0.3 * cell)
    rows = [j for j in range(-cells_minus, cells_plus + 1) if j]
    return Unit(
        name=draw(st.text(st.characters(codec="utf-8"), min_size=1, max_size=20).filter(str.isprintable)),
        scale=scale,
        chambers=Chambers(
            count=draw(st.integers(3, 8)),
            cell_mm=cell,
            bladder_diameter_mm=2.0 * cell,
            neck_diameter_mm=neck,
            bladder_share=share,
            wall_mm=wall,
            base_cap_mm=max(0.2, real(0.02, 0.45) * cell),
            tip_cap_mm=max(0.2, real(0.02, 0.45) * cell),
            inlet_diameter_mm=inlet,
            inlet_length_mm=real(0.5, 20.0),
            inlet_wall_mm=max(0.2, real(0.1, 0.99) * min((neck - inlet) / 2.0, 20.0)),
        ),
        lattice=Envelope(
            cells_x=draw(st.sampled_from([3, 5, 7])),
            cells_y_minus=cells_minus,
            cells_y_plus=cells_plus,
            allow_symmetric=cells_minus == cells_plus,
            kind=draw(st.sampled_from(["body-centred", "body-centred-straight"])),
            junction_diameter_mm=junction,
            midspan_diameter_mm=real(junction, min(0.7 * cell, 20.0)),
        ),
        waveguide=Waveguide(
            row=draw(st.sampled_from(rows)),
            seats=False,
            section_mm=real(0.8, 1.7),
            well_depth_mm=real(0.05, 0.4),
            well_width_mm=real(0.1, 0.9),
            well_pitch_mm=real(1.0, 5.0),
            end_mm=min(20.0, real(0.0, 0.4) * scale * cell),
            inclusion_radius_mm=min(6.0, max(0.1, real(0.0, 0.4) * scale * cell)),
        ),
        material=Material(lattice_modulus_kPa=real(1.0, 100.0)),
    )
