"""Files exported by test machines and data loggers: cells, blocks of numbers, quantities, a proposal.

`source` gives rows of cells in one of `formats`, `blocks` finds the tables in them, `cells` reads columns as
numbers, `columns` knows titles and units. A `proposal` is one immutable table of the columns that are read;
`steps` names in order the functions that make an experiment of it, each of which decides one thing and says
why. `decisions` lists which function decides what.
"""
