"""Text of a file, in any encoding that a laboratory's computer writes."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable

from ..errors import InputError

_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
# Encodings other than UTF-8, the most usual first: computers of western and central Europe, Cyrillic,
# Turkish, DOS and Macintosh ones, Chinese, Japanese, Korean and Taiwan's.
_OTHERS = (
    *("cp1252", "cp1250", "cp1251", "cp1254", "cp850", "mac_roman"),
    *("gb18030", "cp932", "cp949", "cp866", "cp950"),
)
# First bytes of files that are not text or table, and the remedy.
_BINARY = (
    (b"%PDF", "a PDF", "export the data as CSV"),
    (b"\x1f\x8b", "compressed with gzip", "unpack it"),
    (b"Rar!", "an archive", "unpack it"),
    (b"7z\xbc\xaf", "an archive", "unpack it"),
    (
        b"TDSm",
        "a TDMS file of LabVIEW",
        "save it as CSV or a workbook with LabVIEW, DIAdem or Excel's TDM add-in",
    ),
    (b"MATLAB 5.0 MAT-file", "a MAT-file", "write it as CSV with MATLAB's writetable"),
    (b"\x89HDF", "an HDF5 file", "write its table as CSV"),
    (b"MDF  ", "an MDF file", "export the channels as CSV"),
    (b"\x93NUMPY", "a NumPy array", "write it with numpy.savetxt and a header of names and units"),
    (b"PAR1", "a Parquet file", "write it as CSV"),
    (b"SQLite format 3", "a SQLite database", "export the table as CSV"),
    (b"\x89PNG", "a picture", "export the numbers as CSV"),
    (b"\xff\xd8\xff", "a picture", "export the numbers as CSV"),
)
# A text cut off by a logger's loss of power ends in zero bytes; more of them are not text.
_MOST_NUL = 0.5
_CONTROL = re.compile(rb"[\x01-\x08\x0e-\x19]")


def decoded(data: bytes, where: str, known: Callable[[str], int] = lambda text: 0) -> str:
    """Text of bytes: by its byte order mark, as UTF-8 or UTF-16, else where `known` counts most.

    known: counts the known words of a text. Zero bytes in a text are kept as U+FFFD. Raises InputError for a
    file that is not text, naming its kind.
    """
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return _of(data, encoding, where)
    for begin, what, remedy in _BINARY:
        if data.startswith(begin):
            raise InputError(f"the file is {what}, not a table", where, remedy)
    head = data[:2000]
    if b"\0" in head:
        # UTF-16 without a mark has a zero in every other byte of its ASCII letters.
        for encoding, zeros in (("utf-16-le", head[1::2]), ("utf-16-be", head[::2])):
            if zeros.count(0) > 0.4 * len(zeros) and len(head) >= 8:
                return _of(data[: len(data) // 2 * 2], encoding, where)
    if b"\0" in data:
        if data.count(0) > _MOST_NUL * len(data) or _CONTROL.search(head):
            raise InputError(
                "the file holds NUL bytes: it is not text",
                where,
                "export it as CSV or text, or as a workbook (.xlsx, .xls, .ods)",
            )
        data = data.replace(b"\0", "\ufffd".encode())
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return _guessed(data, known)


def _of(data: bytes, encoding: str, where: str) -> str:
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        raise InputError(
            f"the file begins like {encoding} but continues otherwise", where, "export it again"
        ) from error


def _guessed(data: bytes, known: Callable[[str], int]) -> str:
    """Text in the encoding with most known words at its beginning; Windows-1252 if none is decisive."""
    head = data[:8000]
    best = max(_OTHERS, key=lambda encoding: known(head.decode(encoding, errors="replace")))
    return data.decode(best, errors="replace")
