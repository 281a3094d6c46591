"""Cells of tables as people write them: encodings, separators, and the signs in numbers, judged by column.

`encoding` makes text of a file's bytes, `dialect` rows of cells of the text, `notation` numbers of a column's
cells, `clock` seconds of times of day, and `own` reads the tables that this program asks for.
"""
