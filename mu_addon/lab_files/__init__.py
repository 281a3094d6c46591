"""Files exported by test machines and data loggers: cells, blocks of numbers, quantities, a proposal.

`text` and `spreadsheet` give rows of cells, `blocks` finds the tables in them, `columns` the quantity of a
column, and `proposal` the experiments, with the questions that a file leaves open.
"""
