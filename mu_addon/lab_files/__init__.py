"""Files as test machines and data loggers export them: cells, blocks of numbers, quantities, a proposal.

`text` and `spreadsheet` give rows of cells, `blocks` finds the tables in them, `quantities` what a column
holds, and `proposal` which experiments they are, with the questions that a file cannot answer.
"""
