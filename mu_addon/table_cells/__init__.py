"""Cells of tables in any notation: encodings, separators, and the signs in numbers, judged by column.

`encoding` decodes a file's bytes, `dialect` splits the text into rows of cells, `notation` reads numbers in a
column's cells, `clock` times of day, and `own_tables` reads tables in this program's own formats.
"""
