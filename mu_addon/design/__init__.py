"""The rules of a Monolithic Unit: parameters to exact geometry, anchors, the printable solid and files."""
