"""Tables of tracked markers as other trackers export them: read, or refused with line and remedy."""

import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.lab_files.tracked_table import read_pixels
from mu_addon.studies.track import tracks_in

DEEPLABCUT = """scorer,net,net,net,net,net,net
bodyparts,cl,cl,cl,cr,cr,cr
coords,x,y,likelihood,x,y,likelihood
0,400.5,100,0.99,600,100.25,0.99
1,7,7,0.2,600,100.25,0.99
3,401,100,0.99,600,100.25,0.99
"""
TRACKMATE = """LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME
Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame
,,,(quality),(pixel),(pixel),(pixel),(sec),
ID7,7,0,3,400.5,100,0,0,0
ID8,8,1,3,600,100.25,0,0,0
ID9,9,0,3,401,100,0,0.1,1
ID10,10,,3,5,5,0,0.1,1
"""


def table(tmp_path, text, name="a.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def test_deeplabcut_with_its_three_rows_of_titles(tmp_path):
    read = read_pixels(table(tmp_path, DEEPLABCUT))
    assert read.names == ("cl", "cr")
    assert read.time_s is None
    nan = np.nan
    np.testing.assert_array_equal(read.of("cl"), [[400.5, 100], [nan, nan], [nan, nan], [401, 100]])
    np.testing.assert_array_equal(read.of("cr")[[0, 1, 3]], [[600, 100.25]] * 3)
    assert np.isnan(read.of("cr")[2]).all(), "frame 2 is not in the table"
    assert any("1 positions of cl with a likelihood below 0.6" in remark.what for remark in read.remarks)
    several = DEEPLABCUT.replace("bodyparts", "individuals,a,a,a,b,b,b\nbodyparts").replace("cr", "cl")
    assert read_pixels(table(tmp_path, several)).names == ("a cl", "b cl")


def test_a_row_for_each_marker_and_frame(tmp_path):
    read = read_pixels(table(tmp_path, TRACKMATE))
    assert read.names == ("0", "1")
    assert read.time_s.tolist() == [0.0, 0.1]
    np.testing.assert_array_equal(read.of("0"), [[400.5, 100], [401, 100]])
    np.testing.assert_array_equal(read.of("1"), [[600, 100.25], [np.nan, np.nan]])
    assert next(remark.what for remark in read.remarks) == "1 rows without TRACK_ID were left out"
    trackpy = ",y,x,mass,frame,particle\n0,2,1,9,5,0\n1,4,3,9,5,1\n2,2,1.5,9,7,0.0\n"
    read = read_pixels(table(tmp_path, trackpy))
    np.testing.assert_array_equal(read.of("0"), [[1, 2], [np.nan, np.nan], [1.5, 2]])
    assert any("begins at frame 5" in remark.what for remark in read.remarks)


@pytest.mark.parametrize(
    ("text", "names", "time_s"),
    [
        (
            "Time (ms);M1 - X (px);M1 - Y (px);M2 - X (px);M2 - Y (px)\n0,00;1,5;2;3;4\n50;1,5;2;3;4\n",
            ("M1", "M2"),
            [0.0, 0.05],
        ),
        (
            "\tmass_A\t\tmass_B\t\nt\tx\ty\tx\ty\n0\t1.5\t2\t3\t4\n0.1\t1.5\t2\t3\t4\n",
            ("mass_A", "mass_B"),
            [0.0, 0.1],
        ),
        (
            "frame_idx,A.x,A.y,A.score,B_x,B_y,v_x (px/s),v_y (px/s)\n0,1.5,2,1,3,4,1,1\n1,1.5,2,1,3,4,1,1\n",
            ("A", "B"),
            None,
        ),
        (
            "#Kinovea Trajectory data export\n#T X Y\n\n# A\n0 1.5 2 \n0.04 1.5 2 \n\n# B\n0 3 4\n0.04 3 4\n",
            ("A", "B"),
            [0.0, 0.04],
        ),
        (
            "#Kinovea Trajectory data export\n#T X Y\n0:00:00:00 1,50 2,00\n0:00:01:03 1,50 2,00\n\n\n"
            "0:00:00:00 3,00 4,00\n0:00:01:03 3,00 4,00\n",
            ("path 1", "path 2"),
            [0.0, 1.03],
        ),
    ],
    ids=["kinovea", "tracker", "sleap", "kinovea text", "kinovea text with a clock"],
)
def test_columns_for_each_marker(tmp_path, text, names, time_s):
    read = read_pixels(table(tmp_path, text))
    assert read.names == names
    np.testing.assert_array_equal(read.pixels, [[[1.5, 2]] * 2, [[3, 4]] * 2])
    assert (read.time_s is None) if time_s is None else read.time_s.tolist() == pytest.approx(time_s)
    assert any("downward from the upper left corner" in remark.what for remark in read.remarks)


@pytest.mark.parametrize(
    ("text", "what", "where", "remedy"),
    [
        (TRACKMATE.replace("(pixel)", "(micron)"), "'POSITION_X' is in micron", "line 1", "in pixels"),
        ("t,A x (mm),A y (mm)\n0,1,2\n1,1,2\n", "'A x (mm)' is in mm", "line 1", "in pixels"),
        ("t,A x,A y\n0,1,-20\n1,1,-30\n", "positions are negative", "a.csv", "upper left corner"),
        ("t,A X,A Y,A Z\n0,10,20,1\n1,10,30,2\n", "'A Z' varies", "a.csv", "bending plane"),
        ("Frame,Time,X,Y,Z,X,Y,Z\n0,0,1,2,3,4,5,6\n1,1,1,2,3,4,5,6\n", "three axes", "line 1", "plane"),
        (
            f"type,net\n{',,a,a,a,b,b,b'}\nFrame,Time,X,Y,Z,X,Y,Z\n0,0,1,2,3,4,5,6\n1,1,1,2,3.5,4,5,6\n",
            "'Z' varies",
            "a.csv",
            "bending plane",
        ),
        (",,A,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,9,2,3\n2,0,8,2,3\n", "in mm", "line 2", "plane"),
        ("t,A x,A y\n0,0.1,0.2\n1,0.1,0.25\n", "within 0.05: they are not in pixels", "a.csv", "pixels"),
        ("#Kinovea Trajectory\n0 1 2\n1 1 2 3 4\n", "not `T X Y`", "line 3", "each path"),
        ("frame,A x,A y\n0,1,2\n1,1,lost\n", "not a number", "row 3", "correct"),
        ("frame,A x,A y\n0,1,2\n0,1,2\n", "does not increase", "row 3", "one animal or track"),
        ("frame,id,x,y\n0,1,1,2\n0,1,1,2\n", "two rows for one frame", "row 3", "keep the row"),
        ("id,x,y\n1,1,2\n1,1,2\n", "no column of frames", "a.csv", "frame, id, x and y"),
        ("A x,A y,A x,A y\n1,2,3,4\n1,2,3,4\n", "two columns hold the x of A", "line 1", "a different name"),
        ("a,b\n1,2\n3,4\n", "no tracked markers", "a.csv", "NAME right_px"),
        (DEEPLABCUT.replace("3,401", "2.5,401"), "not a whole number", "row 6", "correct"),
    ],
)
def test_what_cannot_be_used_is_refused(tmp_path, text, what, where, remedy):
    with pytest.raises(InputError) as caught:
        read_pixels(table(tmp_path, text))
    assert what in caught.value.what
    assert where in caught.value.where
    assert remedy in caught.value.remedy


def test_a_tracker_s_own_file_is_told_what_to_export(tmp_path):
    with pytest.raises(InputError, match="not a text table") as caught:
        tracks_in(table(tmp_path, "x", "net.h5"), None)
    assert "as CSV" in caught.value.remedy
