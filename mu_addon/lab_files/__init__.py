"""Files exported by test machines and data loggers: cells, blocks of numbers, quantities, a proposal.

`source` gives rows of cells in one of `formats`, `blocks` finds the tables in them, `columns` the quantity of
a title, `proposal` the experiments in steps (`quantities`, `kind`, `times`, `signs`, `facts`); `decisions`
lists what the data decide.
"""
