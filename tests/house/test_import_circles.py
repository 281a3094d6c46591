"""No module of the package imports itself through others, not even inside a function."""

import grimp


def circles():
    """Sets of modules that import each other, imports for type checkers alone left aside."""
    graph = grimp.build_graph("mu_addon", exclude_type_checking_imports=True)
    assert graph.count_imports() > 1000
    after = {module: sorted(graph.find_modules_directly_imported_by(module)) for module in graph.modules}
    number, low, stack, found = {}, {}, [], []

    def visit(module):
        number[module] = low[module] = len(number)
        stack.append(module)
        for other in after[module]:
            if other not in number:
                visit(other)
            if other in stack:
                low[module] = min(low[module], low[other])
        if low[module] == number[module]:
            at = stack.index(module)
            circle, stack[at:] = set(stack[at:]), []
            if len(circle) > 1:
                found.append(circle)

    for module in after:
        if module not in number:
            visit(module)
    return found


def test_no_imports_go_in_circles():
    assert circles() == []
